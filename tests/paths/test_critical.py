"""Cells whose blocking cuts the way: those that floods without each cell find, in every form."""

import jax
import numpy as np
import pytest

from srt_jax import critical_cells
from tests.helpers.maps import maze
from tests.helpers.pictures import drawn
from tests.helpers.slow_kernels import reach_by_steps

COUNT, SHAPE = 64, (12, 12)


def by_blocking(free, start, goal):
    """One flood, by eight moves, for each cell blocked."""
    critical = np.zeros(free.shape, bool)
    if not reach_by_steps(free, start)[goal]:
        return critical
    for cell in map(tuple, np.argwhere(free)):
        without = free.copy()
        without[cell] = False
        critical[cell] = not reach_by_steps(without, start)[goal]
    return critical


@pytest.fixture(scope="module")
def maps():
    rng = np.random.default_rng(17)
    free = rng.random((COUNT, *SHAPE)) < rng.uniform(0.55, 0.95, (COUNT, 1, 1))
    ends = rng.integers(0, SHAPE[0], (2, COUNT, 2)).astype(np.int32)
    return free, *ends


def test_they_are_those_without_which_no_flood_arrives(maps):
    found = np.asarray(critical_cells(*maps))
    for free, start, goal, cells in zip(*maps, found):
        np.testing.assert_array_equal(cells, by_blocking(free, tuple(start), tuple(goal)))
    assert (found.sum(axis=(1, 2)) > 2).sum() > 5


def test_alone_under_vmap_and_with_all_cells_at_once_the_bits_are_the_same(maps, monkeypatch):
    found = np.asarray(critical_cells(*maps))
    np.testing.assert_array_equal(critical_cells(*(array[5] for array in maps)), found[5])
    np.testing.assert_array_equal(jax.jit(jax.vmap(critical_cells))(*maps), found)
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")  # as on a GPU: no loop over words
    np.testing.assert_array_equal(jax.jit(lambda *args: critical_cells(*args))(*maps), found)


def test_the_cells_before_and_behind_a_gap_count_too_and_two_gaps_do_not():
    free, at = drawn("""
        S.@....@....
        ..@....@....
        .......@....
        ..@.........
        ..@....@....
        ..@.........
        ..@....@....
        ..@....@....
        ..@....@....
        ..@....@....
        ..@....@....
        ..@....@..G.
    """)
    cells = critical_cells(free, at["S"], at["G"])
    assert np.argwhere(cells).tolist() == [[0, 0], [2, 1], [2, 2], [2, 3], [11, 10]]


def test_in_a_maze_all_cells_of_the_only_way_are_critical():
    free = maze(np.random.default_rng(2), 13, 13)[:12, :12]
    cells = np.argwhere(free).astype(np.int32)
    reached = np.argwhere(reach_by_steps(free, tuple(cells[0]))).astype(np.int32)
    found = critical_cells(free, cells[0], reached[-1])
    assert found.sum() > 15
    np.testing.assert_array_equal(found, by_blocking(free, tuple(cells[0]), tuple(reached[-1])))


@pytest.mark.parametrize("goal", [(0, 6), (3, 3), (-1, 2), (12, 0)])
def test_where_there_is_no_way_no_cell_cuts_it(goal):
    free = np.ones(SHAPE, bool)
    free[:, 3] = False
    assert not critical_cells(free, (2, 0), goal).any()
    assert np.argwhere(critical_cells(free, (2, 0), (2, 0))).tolist() == [[2, 0]]
