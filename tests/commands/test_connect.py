"""`srt-jax connect`, what its judge notices, and pictures of mode shortest."""

import json

import numpy as np
import pytest

from srt_jax import connect, make_task, stack
from srt_jax.check import check_connection
from srt_jax.cli import run
from srt_jax.formats.batch import write_batch

ROOMS = """\
type octile
height 5
width 9
map
..@...@..
..@...@..
..@...@..
..@...@..
..@...@..
"""


@pytest.fixture
def rooms(tmp_path):
    path = tmp_path / "rooms.map"
    path.write_text(ROOMS, encoding="ascii")
    return str(path)


@pytest.fixture
def task():
    labels = np.full((5, 9), -1)
    labels[:, 2], labels[:, 6], labels[2, 3:6] = 0, 1, 2
    return make_task(labels, (0, 0), (0, 8), removal_cost=[1.0, 1.0, 5.0])


def test_walls_up_to_the_edge_are_noted_unless_it_is_said_what_can_go(rooms, tmp_path, capsys):
    walls = tmp_path / "walls.map"
    walls.write_text(ROOMS.replace("..@...@..", "..@@@@@..", 1), encoding="ascii")
    assert run(["connect", str(walls)]) == 0
    assert "perhaps its walls" in capsys.readouterr().out
    assert run(["connect", str(walls), "--json"]) == 0
    assert "perhaps its walls" in json.loads(capsys.readouterr().out)["notes"][0]["what"]
    assert run(["connect", rooms]) == 0  # either wall is no more than half of what is blocked
    assert "perhaps its walls" not in capsys.readouterr().out


def test_all_regions_or_those_named_are_joined_and_drawn(rooms, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "joined.png"
    assert run(["connect", rooms, "--out", str(picture)]) == 0
    printed = capsys.readouterr()
    out = " ".join(printed.out.split())
    assert "chosen" not in printed.err  # start and goal do not matter
    assert "destroy 2 obstacles (0, 1) at a cost of 2" in out and "45 cells" in out
    assert picture.stat().st_size > 3000
    named = ["--cell-side", "0.5", "--region", "0,0", "--region", "2.1m,1.2m"]
    assert run(["connect", rooms, *named, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["destroyed"] == [0] and record["regions"] == [[0, 0], [2, 4]]
    assert record["is_proven"] and record["joined_cells"] == 30


def test_what_cannot_be_joined_has_an_exit_code_and_bad_regions_a_sentence(rooms, capsys):
    assert run(["connect", rooms, "--destroyable", "none"]) == 1
    assert "nothing that can be destroyed joins all regions" in capsys.readouterr().out
    assert run(["connect", rooms, "--region", "0,0", "--region", "9,9"]) == 2
    assert "(9, 9)" in capsys.readouterr().err
    assert run(["connect", rooms, "--region", "somewhere"]) == 2
    assert "--region 'somewhere' is no cell" in capsys.readouterr().err


def test_the_judge_notices_what_is_wrong(task):
    found = connect(task)
    assert check_connection(task, found) == []
    some = [(0, 0), (0, 4)]
    assert check_connection(task, connect(task, some), some) == []
    for changes, cells, word in (
        ({"destroyed": (0,)}, None, "not joined"),
        ({"destroyed": (0, 1, 2), "removal_cost": 7.0}, None, "2 need not be destroyed"),
        ({"destroyed": (0, 7)}, None, "ids of obstacles"),
        ({"removal_cost": 3.0}, None, "what is destroyed costs 2.0"),
        ({"removal_bound": 2.5}, None, "above the cost"),
        ({"joined": ~found.joined}, None, "not the region"),
        ({"removal_cost": np.inf, "removal_bound": np.inf}, None, "without a way"),
        ({"removal_bound": 2.0}, some, "1 need not"),
    ):
        problems = check_connection(task, found._replace(**changes), cells)
        assert any(word in problem for problem in problems), (changes, problems)
    # Two walls between two rooms: a bound above the cheaper one.
    labels = np.full((5, 5), -1)
    labels[:3, 2], labels[3:, 2] = 0, 1
    task = make_task(labels, (0, 0), (0, 4), removal_cost=[1.0, 4.0])
    dear = connect(task.replace(removal_cost=np.array([9, 4], np.float32)))
    assert any("[0] join them for 1.0" in problem for problem in check_connection(task, dear))


def test_draw_takes_mode_shortest_with_its_toll(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    free = np.ones((12, 12), bool)
    free[:11, 6] = False
    path, picture = tmp_path / "wall.npz", tmp_path / "wall.svg"
    write_batch(path, stack([make_task(free, (0, 4), (0, 8))]), names=["wall"])
    line = ["draw", str(path), "--out", str(picture)]
    assert run([*line, "--toll", "3"]) == 2
    assert "--mode shortest" in capsys.readouterr().err
    assert run([*line, "--mode", "shortest", "--toll", "3"]) == 0
    assert picture.stat().st_size > 3000
