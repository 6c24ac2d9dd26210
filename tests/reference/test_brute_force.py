"""Brute force over sets of obstacles: right on pictures where greedy choices fail, and equal to a
search over (cell, set).
"""

from heapq import heappop, heappush

import numpy as np
import pytest

from srt_jax.reference.brute_force import MAX_DESTROYABLE, brute_force_removal


def task(picture: str, *, fixed: str = "@", **costs):
    """Labels, flags, costs, start and goal from a picture; letters are obstacles, an empty line
    parts the layers.
    """
    signs = np.array(
        [[list(line.strip()) for line in layer.split()] for layer in picture.strip().split("\n\n")]
    )
    names = sorted(set(signs.flat) - set(".SG"))
    labels = np.array(
        [[[names.index(s) if s in names else -1 for s in row] for row in layer] for layer in signs],
        np.int32,
    )
    start, goal = (tuple(np.argwhere((signs == sign).any(axis=0))[0].tolist()) for sign in "SG")
    flags = np.array([name not in fixed for name in names])
    return labels, flags, np.array([costs.get(name, 1) for name in names], np.float32), start, goal


def test_a_free_way_needs_nothing():
    found = brute_force_removal(*task("S.aG\n...."))
    assert (found.cost, found.obstacles, found.sets, found.is_solvable) == (0.0, (), [()], True)


def test_a_fixed_wall_cannot_be_opened():
    found = brute_force_removal(*task("Sa@G\n..@."))
    assert (found.cost, found.obstacles, found.sets, found.is_solvable, found.length) == (
        np.inf,
        (),
        [],
        False,
        np.inf,
    )


def test_the_cheaper_of_two_ways_is_taken():
    found = brute_force_removal(*task("SaG\n@@@\n...", a=5))
    assert (found.cost, found.obstacles) == (5.0, (1,))
    found = brute_force_removal(*task("Sa.G\n.@@.\n.bc.", a=5, b=2, c=2))
    assert (found.cost, found.obstacles, found.length) == (4.0, (2, 3), 7.0)


def test_of_equal_sets_the_one_with_the_shorter_route_is_taken():
    found = brute_force_removal(*task("S.a.\n..a.\n@.a.\n.b@G\n...."))
    assert found.sets == [(1,), (2,)]
    assert found.obstacles == (1,)


def test_a_cell_under_two_obstacles_needs_both_gone():
    found = brute_force_removal(*task("SaG\n\n.b."))
    assert (found.cost, found.obstacles) == (2.0, (0, 1))


def test_an_obstacle_in_parts_is_paid_once():
    found = brute_force_removal(*task("Sa.aG\n@@@@@"))
    assert found.cost == 1.0
    assert brute_force_removal(*task("Sab.aG", a=3)).cost == 4.0


def test_a_corner_contact_opens_nothing():
    assert brute_force_removal(*task("Sb.\nbab\n.bG")).obstacles == (1,)
    assert not brute_force_removal(*task("S@.\n@a@\n.@G")).is_solvable


def test_a_covered_start_or_a_fixed_goal_is_unsolvable():
    labels, flags, costs, start, goal = task("S.a.G")
    assert not brute_force_removal(labels, flags, costs, (0, 2), goal).is_solvable
    assert not brute_force_removal(labels, np.array([False]), costs, start, (0, 2)).is_solvable
    assert brute_force_removal(labels, flags, costs, start, (0, 2)).obstacles == (0,)


def test_padding_is_never_opened():
    assert not brute_force_removal(
        np.array([[-1, -2, -1]]), np.array([True]), np.ones(1), (0, 0), (0, 2)
    ).is_solvable


def test_too_many_obstacles_are_refused():
    many = MAX_DESTROYABLE + 1
    with pytest.raises(ValueError, match="at most 16"):
        brute_force_removal(np.full((2, 2), -1), np.ones(many, bool), np.ones(many), (0, 0), (1, 1))


def cheapest_walk(labels, flags, costs, start, goal) -> float:
    """The least cost by a search over (cell, obstacles gone): a slower twin that knows nothing of
    sets that open the way.
    """
    _, height, width = labels.shape
    if (labels[:, *start] >= 0).any():
        return np.inf
    waiting, settled = [(0.0, start, frozenset())], set()
    while waiting:
        cost, cell, gone = heappop(waiting)
        if cell == goal:
            return cost
        if (cell, gone) in settled:
            continue
        settled.add((cell, gone))
        for other in (
            (cell[0] + 1, cell[1]),
            (cell[0] - 1, cell[1]),
            (cell[0], cell[1] + 1),
            (cell[0], cell[1] - 1),
        ):
            if 0 <= other[0] < height and 0 <= other[1] < width:
                owners = frozenset(labels[:, *other].tolist()) - {-1} - gone
                if all(flags[i] for i in owners):
                    heappush(
                        waiting, (cost + sum(float(costs[i]) for i in owners), other, gone | owners)
                    )
    return np.inf


def test_equal_to_a_search_over_cells_and_sets():
    rng = np.random.default_rng(8)
    for _ in range(200):
        height, width, num_obstacles, layers = (
            *rng.integers(2, 8, 2),
            rng.integers(1, 7),
            rng.integers(1, 3),
        )
        labels = rng.integers(0, num_obstacles, (layers, height, width)).astype(np.int32)
        labels[rng.random(labels.shape) < 0.5] = -1
        flags, costs = (
            rng.random(num_obstacles) < 0.8,
            rng.integers(1, 4, num_obstacles).astype(np.float32),
        )
        start, goal = (tuple(rng.integers(0, (height, width)).tolist()) for _ in range(2))
        found = brute_force_removal(labels, flags, costs, start, goal)
        assert found.cost == cheapest_walk(labels, flags, costs, start, goal)
        assert found.is_solvable == (found.cost < np.inf)
        assert all(costs[list(chosen)].sum() == found.cost for chosen in found.sets)
