"""The search from corner to corner behind cost_to_come, against SciPy on every kind of map."""

import functools

import jax
import numpy as np
import pytest

from srt_jax.bench.measured_maps import KINDS, maps_of
from srt_jax.engine import packing
from srt_jax.moves import FIXED_POINTS
from srt_jax.propagation import cell_queue, corner_queue
from tests.helpers.fields import bordered, flat_cell, new_cost
from tests.helpers.maps import any_start, noise, random_maps
from tests.helpers.slow_kernels import costs_by_scipy


@functools.cache
def _program(shape, is_cut, room):
    """One program for all maps of a shape: the map, the start and the fixed point are arguments."""

    @jax.jit
    def run(cost, free, cell, straight, diagonal):
        beside = cell_queue.neighbours(packing.pack(free[None])[0], shape[1])
        return corner_queue.spread(cost, beside, cell, is_cut, straight, diagonal, shape, room)

    return run


def _spread(free, start, cost=None, is_cut=False, room=None, pair=(5741, 8119)):
    """The field that the search leaves; from the given costs, where there are any."""
    cell = np.uint32(0 if start is None else flat_cell(free, start))
    cost = new_cost(free, start) if cost is None else cost
    units = (np.uint32(units) for units in pair)
    field = _program(free.shape, is_cut, room)(cost, free, cell, *units)
    return np.asarray(field).reshape(free.shape[0] + 2, -1)


@pytest.mark.parametrize("kind", KINDS)
def test_the_costs_are_those_of_scipy_on_every_kind_of_map(kind):
    for free, start in zip(*maps_of(kind, 48, 3)):
        expected = bordered(costs_by_scipy(free, start, 5741, 8119), free)
        assert np.array_equal(_spread(free, start), expected)


def test_the_costs_are_those_of_scipy_on_maps_of_any_shape():
    for free, start in zip(*random_maps(72, 12, 20, 70)[:2]):
        expected = bordered(costs_by_scipy(free, start, 5741, 8119), free)
        assert np.array_equal(_spread(free, start), expected)


@pytest.mark.parametrize("room", [2, 4, 16])
def test_a_queue_that_is_too_short_still_ends_at_the_exact_costs(room):
    rng = np.random.default_rng(room)
    for share in (0.1, 0.35):
        free = noise(rng, 50, 40, share)
        start = any_start(rng, free)
        expected = bordered(costs_by_scipy(free, start, 5741, 8119), free)
        assert np.array_equal(_spread(free, start, room=room), expected)


def test_costs_that_are_not_exact_yet_are_finished():
    rng = np.random.default_rng(5)
    free = noise(rng, 50, 60, 0.2)
    start = any_start(rng, free)
    expected = bordered(costs_by_scipy(free, start, 5741, 8119), free)
    # too high in places, as another queue may leave them
    raised = np.where(
        (expected > 0) & (expected < 2**30) & (rng.random(expected.shape) < 0.3),
        np.uint32(2**31 - 1 - 8119),
        expected,
    )
    field = _spread(free, None, cost=raised.reshape(-1), is_cut=True)
    assert np.array_equal(field, expected)
    unfinished = _spread(free, None, cost=raised.reshape(-1), is_cut=False)
    assert np.array_equal(unfinished, raised)


def test_walks_longer_than_any_bucket_are_found_again():
    """Long narrow maps, whose walks are as long as the ring of buckets allows, in every fixed
    point.
    """
    free = np.ones((3, 900), bool)
    free[1, 5:890:7] = False
    for straight, diagonal in FIXED_POINTS:
        expected = costs_by_scipy(free, (0, 0), straight, diagonal)
        field = _spread(free, (0, 0), cost=_cost(free, diagonal), pair=(straight, diagonal))
        assert np.array_equal(field[1:-1, 1:-1][free], expected[free].astype(np.uint32))


def _cost(free, diagonal):
    cost = np.where(free, 2**31 - 1 - diagonal, 2**31).astype(np.uint32)
    cost[0, 0] = 0
    return np.pad(cost, 1, constant_values=2**31).reshape(-1)
