"""Costs bounded by a goal: the same path as from the whole field, bit for bit, and no cell's cost
too low.
"""

import chex
import jax
import numpy as np
import pytest

from srt_jax.fields.lengths import UNREACHED, cost_field
from srt_jax.paths.path import trace_field
from tests.helpers.maps import any_start, city, maze, noise, random_maps, rooms, snake


@jax.jit
def both(free, start, goal):
    """Each field and its path: the whole one, and the one towards the goal."""
    fields = cost_field(free, start), cost_field(free, start, goal)
    return fields, [trace_field(field, goal, max_cells=2048) for field in fields]


def assert_same(free, start, goal):
    (whole, bounded), (expected, got) = both(free, start, goal)
    chex.assert_trees_all_equal(got, expected)
    assert (np.asarray(bounded.cost) >= np.asarray(whole.cost)).all()
    assert (np.asarray(bounded.cost)[~free] == UNREACHED).all()
    return got


def test_on_maps_of_all_sizes_from_one_cell_and_goals_anywhere():
    free, starts, sizes = random_maps(60, 256, 61, 67)
    rng = np.random.default_rng(1)
    goals = np.stack([any_start(rng, one) for one in free])
    goals[::5] = rng.integers(0, sizes[::5])  # blocked or walled off, some
    path = assert_same(free, starts, goals)
    assert 80 < (np.asarray(path.num_cells) > 0).sum() < 256


def test_a_goal_outside_the_map_or_walled_off_has_no_path():
    free = np.ones((6, 61, 67), bool)
    free[:, :, 40] = False
    goals = np.array(
        [[-1, 0], [61, 5], [3, 67], [-(2**31), 2**31 - 1], [10, 60], [10, 40]], np.int32
    )
    path = assert_same(free, np.full((6, 2), 3, np.int32), goals)
    assert not path.num_cells.any()


def test_start_and_goal_may_be_one_cell():
    path = assert_same(
        np.ones((6, 61, 67), bool), np.full((6, 2), 3, np.int32), np.full((6, 2), 3, np.int32)
    )
    assert (np.asarray(path.num_cells) == 1).all() and not path.cost.any()


@pytest.mark.parametrize("seed", range(2))
def test_on_rough_and_open_ground_and_in_mazes(seed):
    rng = np.random.default_rng(seed)
    free = [
        maze(rng, 127, 127),
        maze(rng, 127, 127, 5),
        snake(127, 127)[:, ::-1],
        rooms(rng, 127, 127),
        city(rng, 127, 127),
    ]
    free = np.stack(free + [noise(rng, 127, 127, density) for density in (0.02, 0.2, 0.35)])
    ends = np.stack([[any_start(rng, one) for _ in range(2)] for one in free])
    assert_same(free, ends[:, 0], ends[:, 1])
