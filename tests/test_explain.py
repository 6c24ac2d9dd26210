import numpy as np
import pytest

from srt_jax import explain, make_task, solve, stack


def told(labels, start, goal, **options):
    task = make_task(np.array(labels, np.int32), start, goal, **options)
    return explain(task, solve(task))


def test_an_open_way_is_told_with_its_length():
    assert told([[-1, -1, -1]], (0, 0), (0, 2)) == (
        "The goal (0, 2) lies 2 away to the east of (0, 0). A path exists, 2.0 long; nothing has to be destroyed."
    )


def test_what_blocks_what_was_destroyed_and_how_good_that_is():
    text = told([[-1, -1, 0, -1], [-1, -1, 1, -1]], (0, 0), (1, 3), destroyable=[True, False])
    assert "0 (destroyable), 1 (firm)" in text
    assert "Destroyed obstacle 0 from (0, 1); removal cost 1, proven least." in text


@pytest.mark.parametrize(
    ("start", "goal", "destroyable", "expected"),
    [
        ((0, 2), (0, 0), True, "The start (0, 2) lies in 0 (destroyable), so the agent cannot move."),
        ((0, 0), (0, 3), False, "Unsolvable: even with 0 destroyable obstacles gone there is no path."),
        ((0, 0), (0, 2), False, "Unsolvable: the goal lies in 0 (firm)."),
        ((0, 0), (0, 0), True, "The goal (0, 0) is the start."),
    ],
)
def test_each_way_to_fail_has_its_sentence(start, goal, destroyable, expected):
    assert expected in told([[-1, -1, 0, -1]], start, goal, destroyable=destroyable)


def test_a_batch_is_told_line_by_line():
    tasks = stack([make_task(np.ones((1, n), bool), (0, 0), (0, n - 1)) for n in (2, 3)])
    lines = explain(tasks, solve(tasks)).splitlines()
    assert [line.split(":")[0] for line in lines] == ["task 0", "task 1"]
    with pytest.raises(ValueError, match="batch dimensions"):
        explain(tasks, solve(make_task(np.ones((1, 2), bool), (0, 0), (0, 1))))
