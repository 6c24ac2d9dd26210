"""Jump point search: as long paths as A*'s, far fewer expansions, and a CLOSED set that may miss
the seed.
"""

import numpy as np
import pytest

from srt_jax.reference.astar import astar
from srt_jax.reference.jump_point_search import jps
from tests.helpers.cut_off_maps import half, quarter, random_maps, ring, seed_of, walks
from tests.helpers.pictures import drawn


def test_a_wall_is_rounded_without_cutting_its_corner():
    free, at = drawn("""
        .....
        .@@@.
        S..@G
        .....""")
    found = jps(free, at["S"], at["G"])
    assert found.path == [(2, 0), (3, 1), (3, 2), (3, 3), (3, 4), (2, 4)]
    assert found.cost == astar(free, at["S"], at["G"]).cost


def test_paths_are_legal_and_as_long_as_those_of_astar():
    for free, start, goal in random_maps(3000, seed=4):
        slow, fast = astar(free, start, goal), jps(free, start, goal)
        assert fast.cost == slow.cost
        assert fast.num_expansions == fast.closed.sum()
        if fast.cost < np.inf:
            walks(free, fast.path, start, goal)
        else:
            assert not (fast.closed & ~slow.closed).any()


def test_paths_are_as_long_on_maps_of_rooms_and_mazes():
    rng = np.random.default_rng(5)
    for _ in range(150):
        free = np.ones((41, 37), bool)
        free[::4], free[:, ::6] = False, False
        free[1::4, ::6] |= rng.random((10, 7)) < 0.7
        free[::4, 3::6] |= rng.random((11, 6)) < 0.7
        start, goal = (
            (int(rng.integers(10)) * 4 + 2, int(rng.integers(6)) * 6 + 2) for _ in range(2)
        )
        assert jps(free, start, goal).cost == astar(free, start, goal).cost


@pytest.mark.parametrize("start", [(0, 0), (-1, 1), (1, 3)])
def test_a_blocked_or_outside_start_reaches_nothing(start):
    free, _ = drawn("""
        @..
        ...""")
    found = jps(free, start, (1, 1))
    assert found.cost == np.inf and found.path == [] and not found.closed.any()


@pytest.mark.parametrize(
    ("map_of", "expected"), [(lambda: ring(10), 5), (lambda: ring(100), 5), (quarter, 1), (half, 1)]
)
def test_expansions_on_cut_off_empty_maps_are_those_of_other_planners(map_of, expected):
    found = jps(*map_of())
    assert found.num_expansions == expected and found.cost == np.inf


def test_closed_of_jps_may_miss_the_seed_but_that_of_astar_never_does():
    """PY16 §3.2. The true seed comes from the reached cells, found by a search towards nowhere."""
    missed = num_cut_off = 0
    for free, start, goal in random_maps(1500, seed=6):
        slow = astar(free, start, goal)
        if slow.cost < np.inf:
            continue
        num_cut_off += 1
        seed = seed_of(astar(free, start, (-1, -1)).closed, goal)
        assert slow.closed[seed] and seed_of(slow.closed, goal) == seed
        missed += not jps(free, start, goal).closed[seed]
    assert num_cut_off > 300
    assert missed > num_cut_off / 10


def test_on_a_halved_empty_map_jps_closes_the_start_alone():
    free, start, goal = half()
    assert np.argwhere(jps(free, start, goal).closed).tolist() == [list(start)]
    assert seed_of(astar(free, start, goal).closed, goal) == (250, 249)
