"""The hand on the wall: the trace, as a set, is the definition of the contour; in order, a walk."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

from srt_jax.reference.astar import astar
from srt_jax.reference.wall_following import follow_wall
from tests.helpers.cut_off_maps import half, quarter, random_maps, ring, seed_of
from tests.helpers.pictures import drawn

CORNERS_TOO = np.ones((3, 3), bool)


def contour_by_definition(free, reached, seed, goal):
    """Reached cells that touch, by side or corner, the piece of blocked cells on the greedy
    step.
    """
    labels, _ = ndimage.label(~free, structure=CORNERS_TOO)
    row, col = np.sign(np.subtract(goal, seed))
    label = labels[seed[0] + row, seed[1] + col] or labels[seed[0] + row, seed[1]]
    return reached & ndimage.binary_dilation(labels == label, structure=CORNERS_TOO)


def as_mask(cells, shape):
    mask = np.zeros(shape, bool)
    mask[tuple(np.array(cells).T)] = True
    return mask


def test_the_trace_goes_round_once():
    free, at = drawn("""
        .....
        S@@@.
        .@G@.
        .@@@.
        .....""")
    trace = follow_wall(free, (2, 0), at["G"])
    round_it = [
        (3, 0),
        (4, 0),
        (4, 1),
        (4, 2),
        (4, 3),
        (4, 4),
        (3, 4),
        (2, 4),
        (1, 4),
        *[(0, c) for c in (4, 3, 2, 1, 0)],
    ]
    assert trace[0] == trace[-1] == (2, 0)
    assert set(trace) == {*round_it, (1, 0), (2, 0)} and len(trace) == 17
    assert trace[1] == (3, 0)  # facing up, the wall would be on the right


def test_at_the_edge_of_the_map_the_walker_turns_back():
    free, at = drawn("""
        ..@...
        S.@.G.
        ...@..
        ..@...""")
    trace = follow_wall(free, (1, 1), at["G"])
    assert trace in (
        [(0, 1), (1, 1), (2, 1), (2, 2), (2, 1), (3, 1)],
        [(3, 1), (2, 1), (2, 2), (2, 1), (1, 1), (0, 1)],
    )


def test_nothing_ahead_gives_an_empty_trace():
    assert follow_wall(np.ones((3, 3), bool), (0, 0), (2, 2)) == []


def test_the_trace_is_a_walk_whose_cells_are_the_contour():
    num_cut_off = 0
    for free, start, goal in random_maps(3000, seed=7):
        found = astar(free, start, goal)
        if found.cost < np.inf:
            continue
        num_cut_off += 1
        seed = seed_of(found.closed, goal)
        trace = follow_wall(free, seed, goal)
        assert seed in trace
        assert (
            as_mask(trace, free.shape) == contour_by_definition(free, found.closed, seed, goal)
        ).all()
        assert all(abs(a - c) + abs(b - d) == 1 for (a, b), (c, d) in pairwise(trace))
    assert num_cut_off > 1000


@pytest.mark.parametrize(
    ("map_of", "expected"),
    [
        (lambda: ring(10), 44),
        (lambda: ring(50), 204),
        (lambda: ring(100), 404),
        (half, 500),
        (quarter, 501),
    ],
)
def test_contours_on_the_empty_map_have_the_known_sizes(map_of, expected):
    free, _, goal = map_of()
    seed = {"half": (250, 249), "quarter": (249, 450)}.get(getattr(map_of, "__name__", ""))
    seed = seed or (goal[0], int(np.flatnonzero(~free[goal[0]])[-1]) + 1)
    assert len(set(follow_wall(free, seed, goal))) == expected
