"""One row a task and mode, with the numbers of the solution."""

import numpy as np
import pytest

import srt_jax

pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def tasks():
    free = np.ones((12, 15), bool)
    free[:, 7] = False
    walled = srt_jax.make_task(free, (2, 0), (2, 14))
    firm = walled.replace(destroyable=np.zeros(1, bool))
    clear = srt_jax.make_task(np.ones((12, 15), bool), (2, 0), (2, 14))
    return [walled, firm, clear]


@pytest.fixture(scope="module")
def solutions(tasks):
    return srt_jax.solve_many(tasks)


def test_a_row_holds_the_numbers_of_its_task_and_solution(tasks, solutions):
    rows = srt_jax.table(
        tasks, solutions, names=["a", "b", "c"], cell_side=0.5, seconds=[1.0, 2.0, 3.0]
    ).to_pylist()
    assert [row["name"] for row in rows] == ["a", "b", "c"]
    walled, firm, clear = rows
    assert walled == {
        "name": "a",
        "map": None,
        "mode": None,
        "status": "SOLVED",
        "is_solved": True,
        "height": 12,
        "width": 15,
        "num_obstacles": 1,
        "length": 14.0,
        "length_m": 7.0,
        "num_cells": 15,
        "num_destroyed": 1,
        "removal_cost": 1.0,
        "removal_bound": 1.0,
        "is_proven_least": True,
        "total": None,
        "total_bound": None,
        "num_blocking": 1,
        "explored": 84,
        "seconds": 1.0,
    }
    assert firm["status"] == "UNSOLVABLE" and firm["length"] is None
    assert firm["is_proven_least"] is None and firm["removal_bound"] is None
    assert (clear["num_destroyed"], clear["explored"], clear["num_blocking"]) == (0, 180, 0)


def test_totals_are_those_of_mode_shortest(tasks, solutions):
    walled = solutions[0].replace(total=np.float32(34), total_bound=np.float32(33))
    shut = solutions[1].replace(total=np.float32(np.inf), total_bound=np.float32(np.inf))
    rows = srt_jax.table(tasks[:2], [walled, shut]).to_pylist()
    assert [(row["total"], row["total_bound"]) for row in rows] == [(34.0, 33.0), (None, None)]


def test_modes_stand_one_below_the_other(tasks, solutions):
    rows = srt_jax.table(tasks, {"least": solutions, "again": solutions}, seconds=0.5).to_pylist()
    assert [row["mode"] for row in rows] == ["least"] * 3 + ["again"] * 3
    assert {row["seconds"] for row in rows} == {0.5}
    assert [row["name"] for row in rows] == ["0", "1", "2"] * 2


def test_batches_make_the_table_of_their_lists(tasks, solutions):
    batch, listed = srt_jax.stack(tasks), srt_jax.table(tasks, {"least": solutions})
    found = srt_jax.solve(batch)
    for given in (batch, tasks):
        assert srt_jax.table(given, {"least": found}).equals(listed)
        assert srt_jax.table(given, found).equals(srt_jax.table(tasks, solutions))
    assert srt_jax.table(tasks[0], solutions[0]).num_rows == 1
    with pytest.raises(ValueError, match="solution 0 is a batch of 3"):
        srt_jax.table(tasks[:1], [found])


def test_what_does_not_fit_is_refused(tasks, solutions):
    with pytest.raises(ValueError, match="3 tasks and 2 names"):
        srt_jax.table(tasks, solutions, names=["a", "b"])
    with pytest.raises(ValueError, match="3 tasks and 1 solutions of mode paper"):
        srt_jax.table(tasks, {"least": solutions, "paper": solutions[:1]})
    with pytest.raises(ValueError, match="call unstack on a batch"):
        srt_jax.table([srt_jax.stack(tasks)], solutions[:1])
    assert srt_jax.table([], []).num_rows == 0


def test_data_frames_read_it(tasks, solutions):
    pandas = pytest.importorskip("pandas")
    frame = srt_jax.table(tasks, solutions).to_pandas()
    assert isinstance(frame, pandas.DataFrame) and frame["length"].isna().tolist() == [0, 1, 0]


def test_modes_stand_side_by_side(tasks, solutions):
    modes = {"least": solutions, "again": solutions}
    wide = srt_jax.table(tasks, modes, side_by_side=True, cell_side=0.5)
    assert wide.num_rows == 3 and "mode" not in wide.column_names
    assert wide["length_m_least"].to_pylist() == wide["length_m_again"].to_pylist() == [7, None, 7]
    assert wide.column_names[:6] == ["name", "map", "height", "width", "num_obstacles", "explored"]
    with pytest.raises(ValueError, match=r"give solutions as \{mode: solutions\}"):
        srt_jax.table(tasks, solutions, side_by_side=True)
