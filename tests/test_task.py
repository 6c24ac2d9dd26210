"""Tasks from masks and labels, padded batches and back."""

import chex
import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from srt_jax.formats.gridmap import GridMap
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import World
from srt_jax.solver import solve
from srt_jax.task import make_task, stack, unstack
from srt_jax.types import FREE, OUTSIDE, Task
from tests.helpers.pictures import drawn

EMPTY = np.ones((3, 4), bool)
LABELS = np.array([[-1, 0, -1], [2, -1, 1]])


def test_obstacles_of_a_mask_are_its_8_connected_pieces_in_row_order():
    free, _ = drawn("""
        ..@..@
        .@....
        @...@.
    """)
    task = make_task(free, (0, 0), (2, 5))
    expected = np.full((3, 6), FREE)
    expected[[0, 1, 2], [2, 1, 0]] = 0
    expected[0, 5], expected[2, 4] = 1, 2
    np.testing.assert_array_equal(task.labels, expected[None])
    assert task.labels.dtype == task.start.dtype == task.goal.dtype == task.size.dtype == np.int32
    assert task.removal_cost.dtype == np.float32 and task.destroyable.tolist() == [True] * 3
    assert task.size.tolist() == [3, 6]


def test_a_map_without_obstacles_has_one_that_covers_nothing_and_stays():
    for free in (EMPTY, np.full((3, 4), -1)):
        task = make_task(free, (0, 0), (2, 3))
        assert (
            (task.labels == FREE).all()
            and task.destroyable.tolist() == [False]
            and task.removal_cost.tolist() == [1.0]
        )


@pytest.mark.parametrize(
    ("destroyable", "expected"),
    [
        (True, [True, True, True]),
        (False, [False] * 3),
        ([True, False, True], [True, False, True]),
        (np.array([False, False, True]), [False, False, True]),
        ({2, 0}, [True, False, True]),
        ([1], [False, True, False]),
        (np.array([2, 1]), [False, True, True]),
        ([], [False] * 3),
        ((), [False] * 3),
    ],
)
def test_destroyable_is_one_flag_or_flags_or_ids(destroyable, expected):
    assert (
        make_task(LABELS, (0, 0), (0, 2), destroyable=destroyable).destroyable.tolist() == expected
    )


def test_lists_longer_than_the_labels_name_obstacles_that_cover_no_cell():
    task = make_task(LABELS, (0, 0), (0, 2), removal_cost=[1, 2, 3, 4.5], destroyable=True)
    assert task.removal_cost.tolist() == [1, 2, 3, 4.5] and task.destroyable.all()


def test_start_and_goal_may_lie_on_obstacles():
    task = make_task(LABELS, (0, 1), (1, 0))
    assert task.start.tolist() == [0, 1] and task.goal.tolist() == [1, 0]


@pytest.mark.parametrize(
    ("error", "message", "change"),
    [
        (TypeError, "signed integers", {"free_or_labels": EMPTY.astype(np.float32)}),
        (TypeError, "astype", {"free_or_labels": EMPTY.astype(np.uint8)}),
        (ValueError, r"shape \[H, W\]", {"free_or_labels": EMPTY[None]}),
        (ValueError, "no empty side", {"free_or_labels": np.ones((0, 3), bool)}),
        (
            ValueError,
            r"label -5 at \[0, 1\]",
            {"free_or_labels": np.where(LABELS == 0, -5, LABELS)},
        ),
        (
            ValueError,
            "number the obstacles",
            {"free_or_labels": np.where(LABELS == 0, 2**31, LABELS)},
        ),
        (ValueError, r"start \(-1, 0\) lies outside", {"start": (-1, 0)}),
        (ValueError, r"goal \(2, 0\) lies outside", {"goal": (2, 0)}),
        (ValueError, "lies outside", {"goal": (0, 2**32)}),
        (TypeError, "integers", {"start": (0.0, 0.0)}),
        (ValueError, r"\(row, col\)", {"start": (0, 0, 0)}),
        (ValueError, "one cell", {"start": [(0, 0)]}),
        (ValueError, "obstacle 7", {"destroyable": [7]}),
        (ValueError, "obstacle -1", {"destroyable": [-1]}),
        (ValueError, "destroyable has shape", {"destroyable": [True, False]}),
        (TypeError, "destroyable", {"destroyable": "all"}),
        (TypeError, "destroyable", {"destroyable": 1}),
        (ValueError, "removal_cost has shape", {"removal_cost": [1, 2]}),
        (ValueError, "removal_cost of obstacle 1 is nan", {"removal_cost": [1, np.nan, 1]}),
        (ValueError, "positive", {"removal_cost": 0}),
        (ValueError, "finite", {"removal_cost": 1e300}),
        (TypeError, "removal_cost", {"removal_cost": "1"}),
    ],
)
def test_bad_input_is_refused_in_one_sentence(error, message, change):
    arguments = {"free_or_labels": LABELS, "start": (0, 0), "goal": (0, 2)} | change
    map_, start, goal = (arguments.pop(name) for name in ("free_or_labels", "start", "goal"))
    with pytest.raises(error, match=message) as caught:
        make_task(map_, start, goal, **arguments)
    assert "\n" not in str(caught.value)


def test_a_mask_allows_no_more_flags_than_pieces():
    with pytest.raises(ValueError, match="there are 0 obstacles"):
        make_task(EMPTY, (0, 0), (0, 1), destroyable=[True])


def test_padding_is_outside_in_the_first_layer_and_free_in_the_others():
    two_layers = make_task(np.array([[[0, -1]], [[1, -1]]]), (0, 1), (0, 0), removal_cost=[2, 3])
    batch = stack([two_layers, make_task(EMPTY, (0, 0), (2, 3))])
    assert batch.labels.shape == (
        2,
        2,
        3,
        4,
    ) and batch.destroyable.shape == batch.removal_cost.shape == (2, 2)
    assert (batch.labels[0, 0, 1:] == OUTSIDE).all() and (
        batch.labels[0, 0, :, 2:] == OUTSIDE
    ).all()
    assert (batch.labels[0, 1, 1:] == FREE).all() and (batch.labels[1] == FREE).all()
    assert batch.destroyable.tolist() == [[True, True], [False, False]]
    assert batch.removal_cost.tolist() == [[2, 3], [1, 1]]
    assert batch.size.tolist() == [[1, 2], [3, 4]]


@st.composite
def tasks(draw) -> Task:
    layers, height, width = (
        draw(st.integers(1, 3)),
        draw(st.integers(1, 6)),
        draw(st.integers(1, 6)),
    )
    rng = np.random.default_rng(draw(st.integers(0, 2**20)))
    labels = rng.integers(-1, draw(st.integers(1, 5)), (layers, height, width))
    labels[-1, 0, 0] = 0  # so that no layer at the end is free everywhere
    count = int(labels.max()) + 1
    start, goal = ((int(rng.integers(height)), int(rng.integers(width))) for _ in range(2))
    return make_task(
        labels,
        start,
        goal,
        destroyable=rng.random(count) < 0.5,
        removal_cost=rng.integers(1, 5, count),
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(tasks(), min_size=1, max_size=5))
def test_unstack_undoes_stack(singles):
    for given_task, returned in zip(singles, unstack(stack(singles)), strict=True):
        chex.assert_trees_all_equal(given_task, returned)


def test_obstacles_that_cover_nothing_survive_a_batch_where_they_differ_from_padding():
    task = make_task(
        LABELS,
        (0, 0),
        (0, 2),
        destroyable=[False] * 4 + [True, False],
        removal_cost=[1, 1, 1, 1, 1, 2],
    )
    chex.assert_trees_all_equal(unstack(stack([task]))[0], task)


def test_stack_refuses_nothing_and_batches_and_unstack_refuses_single_tasks():
    task = make_task(EMPTY, (0, 0), (0, 1))
    with pytest.raises(ValueError, match="empty"):
        stack([])
    with pytest.raises(ValueError, match="task 1 has labels of shape"):
        stack([task, stack([task])])
    with pytest.raises(ValueError, match="one batch dimension"):
        unstack(task)


def test_integers_that_look_like_a_mask_are_warned_of():
    mask = np.ones((8, 8), int)
    mask[:, 3] = 0
    with pytest.warns(UserWarning, match=r"write map\.astype\(bool\)"):
        assert make_task(mask, (0, 0), (0, 2)).destroyable.shape == (2,)
    for grid in ([[-1, 0, 100]], [[0, 0, 100]]):
        with pytest.warns(UserWarning, match=r"occupancy grid of ROS.*write map == 0"):
            make_task(np.array(grid, np.int8), (0, 0), (0, 2))
    with pytest.warns(UserWarning, match="no cell of the map is free"):
        make_task(np.zeros((8, 8), int), (0, 0), (0, 2))


def test_what_readers_return_is_refused_with_the_way_to_make_a_task_of_it():
    found = GridMap(np.ones((3, 4), bool), np.zeros((3, 4), bool))
    world = World(
        bounds=(0, 0, 4, 4), obstacles=(), position=(1, 1), radius=0.4, goal=((3, 3), 1.0)
    )
    for record, remedy in (
        (found, r"got a GridMap: write srt_jax\.make_task\(map\.free, start, goal\)"),
        (world, r"got a World: srt_jax\.rasterize makes a task of a World"),
        (Place((0, 0, 4, 4), ()), r"got a Place: it has no start and no goal"),
        ("city.map", r"got a str: a file is read by srt_jax\.formats\.task_files\.read_tasks"),
    ):
        for refuse in (solve, lambda one: make_task(one, (0, 0), (1, 1))):
            with pytest.raises(TypeError, match=remedy):
                refuse(record)


def test_solutions_of_a_batch_come_apart_as_the_answers_to_its_tasks():
    free = np.ones((5, 7), bool)
    free[:, 3] = False
    tasks = [make_task(free, (2, 0), (2, 6)), make_task(EMPTY, (0, 0), (2, 3))]
    tasks.append(tasks[0].replace(destroyable=np.zeros(1, bool)))
    batch = stack(tasks)
    found = solve(batch, max_cells=16)
    for known, of in ((found, None), (jax.tree.map(np.asarray, found), batch)):
        for task, one in zip(tasks, unstack(known, of), strict=True):
            alone = solve(task, max_cells=16)
            jax.tree.map(np.testing.assert_array_equal, one, alone)
            np.testing.assert_array_equal(one.num_approach, alone.num_approach)
    uncut = unstack(jax.tree.map(np.asarray, found))
    assert [one.contour.shape for one in uncut] == [(5, 7)] * 3  # nobody knows their tasks
    with pytest.raises(ValueError, match="batch dimensions"):
        unstack(found, tasks[0])
    with pytest.raises(ValueError, match="one batch dimension"):
        unstack(uncut[0])
