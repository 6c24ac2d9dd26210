"""The twin against Dijkstra's search with lengths, and the rule that picks one of several paths."""

import numpy as np
import pytest

from srt_jax.moves import FIXED_POINTS
from srt_jax.reference.dijkstra import dijkstra
from srt_jax.reference.first_path import first_path
from tests.helpers.maps import any_start, random_maps

STRAIGHT, DIAGONAL = FIXED_POINTS[0]


def test_going_back_straight_moves_come_before_diagonal_ones():
    free = np.ones((3, 4), bool)
    length, path = first_path(free, (2, 0), (0, 3), STRAIGHT, DIAGONAL)
    assert length == 2 * DIAGONAL + STRAIGHT
    assert path == [(2, 0), (1, 1), (0, 2), (0, 3)]
    assert first_path(free, (0, 3), (2, 0), STRAIGHT, DIAGONAL)[1] == [
        (0, 3),
        (1, 2),
        (2, 1),
        (2, 0),
    ]


def test_of_two_straight_moves_the_one_from_the_first_row_comes_first():
    free = np.ones((3, 3), bool)
    free[1, 1] = False
    assert first_path(free, (2, 0), (0, 2), 1, 2)[1] == [(2, 0), (1, 0), (0, 0), (0, 1), (0, 2)]
    assert first_path(free, (0, 0), (2, 2), 1, 2)[1] == [(0, 0), (0, 1), (0, 2), (1, 2), (2, 2)]


@pytest.mark.parametrize("ends", [((0, 0), (0, 2)), ((0, 2), (0, 0)), ((-1, 0), (0, 0))])
def test_there_is_no_path_to_or_from_a_blocked_cell_or_one_outside(ends):
    assert first_path(np.array([[True, True, False]]), *ends, 1, 2) == (-1, [])


def test_no_path_leads_through_a_wall():
    assert first_path(np.array([[True, False, True]]), (0, 0), (0, 2), 1, 2) == (-1, [])


def test_lengths_are_those_of_dijkstra():
    free, starts, _ = random_maps(8, 64, 20, 24)
    rng = np.random.default_rng(2)
    for one, start in zip(free, starts):
        goal = tuple(any_start(rng, one).tolist())
        cost = dijkstra(one, tuple(start.tolist()))[goal]
        length, path = first_path(one, tuple(start.tolist()), goal, STRAIGHT, DIAGONAL)
        assert (length < 0) == np.isinf(cost) == (not path)
        if path:
            np.testing.assert_allclose(length / STRAIGHT, cost, rtol=1e-7)
