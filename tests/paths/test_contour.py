import jax
import numpy as np
import pytest

import srt_jax
from srt_jax.paths.contour import obstacle_ahead
from tests.helpers.maps import any_start, noise, random_maps
from tests.helpers.pictures import drawn
from tests.helpers.slow_kernels import contour_by_label
from tests.helpers.slowly import slow


def _blocked_by(free, start, goal):
    reached = srt_jax.reach(free, start)
    seed = np.asarray(srt_jax.seed_cell(reached, goal))
    return seed, np.asarray(srt_jax.contour(free, seed, goal))


def test_the_contour_is_the_seeds_side_of_the_wall_ahead_and_no_other_obstacle():
    free, places = drawn("""
        S..@..
        .@.@.G
        ...@..
    """)
    seed, contour = _blocked_by(free, places["S"], places["G"])
    assert tuple(seed) == (1, 2)
    assert np.array_equal(contour, [[0, 0, 1, 0, 0, 0]] * 3)


@pytest.mark.parametrize("side, cells", [(10, 44), (50, 204), (100, 404)])
def test_a_bagel_on_the_empty_map_has_a_contour_all_round(side, cells):
    free = np.ones((500, 500), bool)
    free[200 : 200 + side, 300 : 300 + side] = False
    free[201 : 199 + side, 301 : 299 + side] = True
    _, contour = _blocked_by(free, (3, 3), (200 + side // 2, 300 + side // 2))
    assert contour.sum() == cells


def test_half_and_quarter_of_the_empty_map_have_contours_of_500_and_501_cells():
    half = np.ones((500, 500), bool)
    half[:, 250] = False
    assert _blocked_by(half, (10, 10), (490, 490))[1].sum() == 500
    quarter = np.ones((500, 500), bool)
    quarter[250, 250:] = quarter[250:, 250] = False
    assert _blocked_by(quarter, (10, 10), (490, 490))[1].sum() == 501


def test_it_equals_the_twin_on_random_maps():
    free, starts, sizes = random_maps(60, 300, 40, 50)
    rng = np.random.default_rng(2)
    goals = np.stack([rng.integers(0, size) for size in sizes]).astype(np.int32)
    seeds = np.array(srt_jax.seed_cell(srt_jax.reach(free, starts), goals))
    seeds[::5] = starts[::5]
    num_found = 0
    for one, seed, goal, got in zip(
        free, seeds, goals, np.asarray(srt_jax.contour(free, seeds, goals))
    ):
        expected = contour_by_label(one, seed, goal)
        num_found += expected.any()
        assert np.array_equal(got, expected)
    assert num_found > 50


@pytest.mark.parametrize("shape", [(1, 9), (31, 33), *slow((1, 1), (9, 1), (37, 64))])
def test_the_padding_of_an_eager_call_is_no_obstacle(shape):
    height, width = shape
    rng = np.random.default_rng(height)
    for _ in range(8):
        free = noise(rng, height, width, 0.4)
        seed, goal = (
            any_start(rng, free),
            rng.integers(-3, [height + 3, width + 3]).astype(np.int32),
        )
        assert np.array_equal(srt_jax.contour(free, seed, goal), contour_by_label(free, seed, goal))
        assert np.array_equal(
            jax.jit(srt_jax.contour)(free, seed, goal), contour_by_label(free, seed, goal)
        )


def test_nothing_ahead_means_no_contour():
    free = np.ones((5, 5), bool)
    free[2, 2] = False
    for seed, goal in (
        ((-1, -1), (3, 3)),
        ((1, 1), (1, 1)),
        ((0, 0), (4, 4)),
        ((2, 2), (4, 4)),
        ((9, 9), (0, 0)),
    ):
        assert not srt_jax.contour(free, seed, goal).any()
    assert srt_jax.contour(free, (1, 1), (4, 4)).sum() == 8


def test_the_cell_ahead_is_the_diagonal_one_or_a_blocked_side():
    free, places = drawn("""
        S@..
        .@@.
        ...G
    """)
    opened = free.copy()
    opened[1, 1] = True
    seeds = np.array([[0, 0], [1, 0], [2, 0], [2, 2], [0, 0]], np.int32)
    goals = np.array([[2, 3]] * 5, np.int32)
    ahead = jax.jit(obstacle_ahead)(np.stack([free] * 4 + [opened]), seeds, goals)
    assert ahead.tolist() == [[1, 1], [1, 1], [-1, -1], [-1, -1], [0, 1]]
    assert places["G"] == (2, 3)


def test_jit_and_vmap_give_the_same_bits():
    free, starts, _ = random_maps(61, 12, 40, 50)
    goals = np.random.default_rng(3).integers(0, 40, (12, 2)).astype(np.int32)
    expected = np.asarray(srt_jax.contour(free, starts, goals))
    assert np.array_equal(jax.jit(jax.vmap(srt_jax.contour))(free, starts, goals), expected)
    assert np.array_equal(jax.jit(srt_jax.contour)(free, starts, goals), expected)
