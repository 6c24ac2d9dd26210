import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from srt_jax.engine import packing
from srt_jax.paths.seed import nearest_in_words
from tests.helpers.maps import random_maps
from tests.helpers.slow_kernels import seed_by_sorting


def test_it_equals_the_twin_that_compares_distances_without_rounding():
    reached, _, _ = random_maps(5, 150, 30, 40)
    rng = np.random.default_rng(0)
    goals = rng.integers(-10, 50, (150, 2)).astype(np.int32)
    for one, goal, got in zip(reached, goals, np.asarray(srt_jax.seed_cell(reached, goals))):
        assert tuple(got) == seed_by_sorting(one, goal)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5])
def test_packed_rows_give_the_same_cell(share):
    rng = np.random.default_rng(7)
    for width in (1, 32, 45, 70):
        reached = rng.random((200, 12, width)) < share * rng.random((200, 1, 1))
        goals = rng.integers(-5, (17, width + 5), (200, 2)).astype(np.int32)
        words = packing.pack(jnp.asarray(reached))
        near = jax.jit(jax.vmap(lambda words, goal, w=width: nearest_in_words(words, goal, w)))
        for one, goal, got in zip(reached, goals, np.asarray(near(words, goals))):
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
