"""A* and Dijkstra, the slow twins: right on pictures, equal to each other and to SciPy, and at the
figures of the paper.
"""

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra as scipy_dijkstra

from srt_jax.reference.astar import astar, length_of
from srt_jax.reference.dijkstra import DIAGONAL, STRAIGHT, dijkstra
from tests.helpers.cut_off_maps import half, quarter, random_maps, ring, walks
from tests.helpers.pictures import drawn

ROOT = 2**0.5


def scipy_lengths(free, start):
    """Lengths to every cell from SciPy, on a graph built edge by edge."""
    height, width = free.shape
    edges = {}
    for row, col in np.argwhere(free).tolist():
        for other in ((row, col + 1), (row + 1, col), (row + 1, col + 1), (row + 1, col - 1)):
            if (
                0 <= other[0] < height
                and 0 <= other[1] < width
                and free[other]
                and free[row, other[1]]
                and free[other[0], col]
            ):
                length = np.hypot(other[0] - row, other[1] - col)
                edges[row * width + col, other[0] * width + other[1]] = length
    rows, cols = np.array(list(edges), int).reshape(-1, 2).T
    graph = coo_matrix(
        (np.array(list(edges.values()), float), (rows, cols)), shape=(free.size, free.size)
    ).tocsr()
    return scipy_dijkstra(graph, directed=False, indices=start[0] * width + start[1]).reshape(
        free.shape
    )


def test_a_diagonal_past_a_corner_is_not_taken():
    free, at = drawn("""
        S.@
        @..
        ..G""")
    found = astar(free, at["S"], at["G"])
    assert found.path == [(0, 0), (0, 1), (1, 1), (2, 2)]
    assert found.cost == 2 + ROOT


def test_the_start_may_be_the_goal():
    found = astar(np.ones((1, 1), bool), (0, 0), (0, 0))
    assert (found.cost, found.path, found.num_expansions) == (0.0, [(0, 0)], 1)


@pytest.mark.parametrize("start", [(0, 0), (-1, 1), (1, 3)])
def test_a_blocked_or_outside_start_reaches_nothing(start):
    free, _ = drawn("""
        @..
        ...""")
    found = astar(free, start, (1, 1))
    assert found.cost == np.inf and found.num_expansions == 0 and not found.closed.any()
    assert np.isinf(dijkstra(free, start)).all()


@pytest.mark.parametrize("goal", [(0, 0), (-1, 2), (1, 9)])
def test_towards_a_blocked_or_outside_goal_all_is_explored(goal):
    free, _ = drawn("""
        @..
        ...""")
    found = astar(free, (1, 1), goal)
    assert found.cost == np.inf and (found.closed == free).all() and found.num_expansions == 5


def test_lengths_are_equal_to_scipys():
    for free, start, _ in random_maps(150, seed=1):
        np.testing.assert_allclose(dijkstra(free, start), scipy_lengths(free, start), rtol=1e-12)


def test_astar_equals_dijkstra_and_explores_all_on_failure():
    for free, start, goal in random_maps(800, seed=2):
        field, found = dijkstra(free, start), astar(free, start, goal)
        np.testing.assert_allclose(found.cost, field[goal], rtol=1e-12)
        assert found.num_expansions == found.closed.sum()
        if found.cost < np.inf:
            walks(free, found.path, start, goal)
            assert length_of(found.path) == found.cost
        else:
            assert (found.closed == np.isfinite(field)).all()


def test_eight_moves_reach_what_is_connected_by_sides():
    for free, start, _ in random_maps(300, seed=3):
        reached = np.zeros_like(free)
        reached[start] = True
        for _ in range(free.size):
            wide = np.pad(reached, 1)
            reached = (
                wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:] | reached
            ) & free
        assert (reached == np.isfinite(dijkstra(free, start))).all()


def test_the_integer_pair_is_one_of_pells():
    assert abs(DIAGONAL**2 - 2 * STRAIGHT**2) == 1


@pytest.mark.parametrize(
    ("map_of", "expected"),
    [
        (lambda: ring(10), 249_900),
        (lambda: ring(100), 240_000),
        (quarter, 187_500),
        (half, 125_000),
    ],
)
def test_expansions_on_cut_off_empty_maps_are_those_of_other_planners(map_of, expected):
    found = astar(*map_of())
    assert found.num_expansions == expected and found.cost == np.inf
