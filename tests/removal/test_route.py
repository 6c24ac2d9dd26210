"""The order in which a route needs obstacles gone, equal to NumPy's sort."""

import functools

import jax
import numpy as np
import pytest

from srt_jax.removal.route import NEVER, in_order


@pytest.mark.parametrize("num_obstacles", [1, 5, 300])
@pytest.mark.parametrize("max_destroyed", [1, 8, 70])
def test_obstacles_come_in_the_order_of_need_and_then_of_their_numbers(
    num_obstacles, max_destroyed
):
    rng = np.random.default_rng(num_obstacles)
    needed = rng.integers(0, 9, (4, num_obstacles)).astype(np.int32)  # ties
    share = np.array([0, 0.02, 0.3, 1])[:, None]
    needed[rng.random(needed.shape) >= share] = NEVER
    select = jax.jit(functools.partial(in_order, max_destroyed=max_destroyed))
    for one, ids, at, count in zip(needed, *(np.asarray(x) for x in select(needed))):
        order = np.lexsort((np.arange(num_obstacles), one))
        order = order[one[order] < NEVER]
        assert count == len(order)
        wanted = np.full((2, max_destroyed), -1)
        first = order[:max_destroyed]
        wanted[:, : len(first)] = first, one[first]
        assert np.array_equal([ids, at], wanted)
