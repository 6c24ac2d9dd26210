import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax.engine import packing
from srt_jax.moves import FIXED_POINTS
from srt_jax.propagation import fixed_point
from srt_jax.propagation.fixed_point import MAX_COST, pairs, to_length
from tests.helpers.jitted import Jitted
from tests.helpers.maps import noise, random_maps, snake
from tests.helpers.slow_kernels import costs_by_scipy

jitted = Jitted(fixed_point, finest_scale_of_words=(1,))


@pytest.mark.parametrize("scale", range(len(FIXED_POINTS)))
def test_lengths_are_the_nearest_float32_or_its_neighbour_and_whole_ones_are_exact(scale):
    rng = np.random.default_rng(scale)
    straight, diagonal = FIXED_POINTS[scale]
    counts = rng.integers(0, 2 ** rng.integers(1, 31 - straight.bit_length() - 1, 5000), (2, 5000))
    cost = (counts[0] * straight + counts[1] * diagonal).astype(np.int64)
    cost = np.concatenate(
        [
            cost[cost < min(2**31 - 1, straight << 24)],
            [0, straight, diagonal, 2 * diagonal],
            np.arange(1, 3000) * straight,
        ]
    )
    length = np.asarray(jax.jit(to_length)(jnp.asarray(cost, jnp.int32), jnp.int32(scale)))
    exact = cost / straight
    assert (
        np.abs(length - exact) <= 1.5 * np.spacing(np.maximum(exact, 1).astype(np.float32))
    ).all()
    if scale == 0:
        assert np.array_equal(
            jax.jit(lambda cost: to_length(cost, 0))(jnp.asarray(cost, jnp.int32)), length
        )
    whole = cost % straight == 0
    assert np.array_equal(length[whole], (cost[whole] // straight).astype(np.float32))


def test_the_scale_is_the_finest_that_no_shortest_path_can_overflow():
    free, starts, _ = random_maps(0, 40, 40, 40)
    for one, start in zip(free, starts):
        squares = np.pad(one, 8)[8:, 8:][:40, :40].reshape(20, 2, 20, 2).sum((1, 3))
        bound = np.where(squares == 4, 2, squares).sum()
        bound += (one.sum() - bound) // 4 + 1
        cost = costs_by_scipy(one, start, 5741, 8119)
        assert cost[np.isfinite(cost)].max(initial=0) <= 5741 * bound


def test_padding_and_place_do_not_change_the_scale():
    free = np.zeros((2048, 2048), bool)
    free[:1100, :1101] = snake(1100, 1101)
    small = jitted.finest_scale(jnp.asarray(free[:1100, :1101]))
    assert int(small) == int(jitted.finest_scale(jnp.asarray(free))) > 0
    assert (
        int(jitted.finest_scale(jnp.asarray(noise(np.random.default_rng(0), 100, 100, 0.1)))) == 0
    )


@pytest.mark.parametrize("shape", [(900, 901), (1101, 1300), (2, 2_000_001), (30, 31)])
def test_a_packed_map_has_the_scale_of_the_map(shape):
    rng = np.random.default_rng(0)
    scales = set()
    for density in (0.0, 0.02, 0.1, 0.3, 0.6, 0.95):
        free = jnp.asarray(noise(rng, *shape, density))
        words = jax.jit(packing.pack)(free[None])[0]
        scale = jitted.finest_scale_of_words(words, shape[1])
        assert int(scale) == int(jitted.finest_scale(free))
        scales.add(int(scale))
    assert len(scales) > 1 or shape == (30, 31)


@pytest.mark.parametrize("side, error", [(700, 8e-9), (1700, 3e-7), (2600, 1.54e-6)])
def test_the_error_documented_for_a_size_holds_whatever_is_on_the_map(side, error):
    worst = np.ones((side, side), bool)
    worst[1::2, 1::2] = False  # three free cells in every square: no map needs a coarser scale
    straight, diagonal = FIXED_POINTS[int(jitted.finest_scale(jnp.asarray(worst)))]
    assert abs(diagonal / straight / 2**0.5 - 1) < error
    assert int(worst.sum()) * straight < MAX_COST


def test_a_map_too_large_for_exact_lengths_is_refused():
    with pytest.raises(ValueError, match="too large for exact lengths"):
        jax.eval_shape(fixed_point.finest_scale, jax.ShapeDtypeStruct((20_000, 20_000), bool))


def test_pairs_are_looked_up_by_scale():
    straight, diagonal = pairs(jnp.array([0, 2]))
    assert straight.tolist() == [5741, 985] and diagonal.tolist() == [8119, 1393]
