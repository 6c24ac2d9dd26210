import jax
import numpy as np
import pytest

import srt_jax
from tests.helpers.maps import random_maps
from tests.helpers.slow_kernels import seed_by_sorting


def test_it_equals_the_twin_that_compares_distances_without_rounding():
    reached, _, _ = random_maps(5, 150, 30, 40)
    rng = np.random.default_rng(0)
    goals = rng.integers(-10, 50, (150, 2)).astype(np.int32)
    for one, goal, got in zip(reached, goals, np.asarray(srt_jax.seed_cell(reached, goals))):
        assert tuple(got) == seed_by_sorting(one, goal)


def test_near_ties_on_a_large_map_are_distinguished():
    reached = np.zeros((2, 1500, 1500), bool)
    reached[0, 985, 0] = reached[0, 577, 577 - 170] = True
    reached[0, 0, 1393] = True
    reached[1] = np.random.default_rng(0).random((1500, 1500)) < 1e-5
    goals = np.array([[0, 0], [700, 700]], np.int32)
    for one, goal, got in zip(reached, goals, np.asarray(srt_jax.seed_cell(reached, goals))):
        assert tuple(got) == seed_by_sorting(one, goal)


def test_where_nothing_is_reached_there_is_no_seed():
    assert srt_jax.seed_cell(np.zeros((4, 5), bool), (1, 1)).tolist() == [-1, -1]


def test_ties_go_to_the_lowest_row_then_the_lowest_column():
    assert srt_jax.seed_cell(~np.eye(5, dtype=bool), (2, 2)).tolist() == [1, 2]
    reached = np.ones((5, 5), bool)
    reached[1:4, 1:4] = False
    assert srt_jax.seed_cell(reached, (2, 2)).tolist() == [0, 2]


def test_jit_vmap_and_padding_give_the_same_cell():
    reached, _, _ = random_maps(6, 16, 30, 40)
    goals = np.random.default_rng(1).integers(0, 30, (16, 2)).astype(np.int32)
    expected = np.asarray(srt_jax.seed_cell(reached, goals))
    assert np.array_equal(jax.jit(jax.vmap(srt_jax.seed_cell))(reached, goals), expected)
    padded = np.pad(reached, ((0, 0), (5, 60), (7, 1)))
    moved = np.asarray(srt_jax.seed_cell(padded, goals + np.array([5, 7], np.int32)))
    assert np.array_equal(moved - (expected >= 0) * [5, 7], expected)


def test_wrong_input_is_named_with_its_remedy():
    with pytest.raises(TypeError, match="reached must be bool"):
        srt_jax.seed_cell(np.ones((3, 3), np.uint8), (0, 0))
