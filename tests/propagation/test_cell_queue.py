"""The queue of cells of cost_to_come, and the sweeps that take its place on a GPU."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax.engine import packing
from srt_jax.propagation import cell_queue, row_sweeps
from tests.helpers.fields import bordered, flat_cell, new_cost
from tests.helpers.maps import any_start, noise, random_maps
from tests.helpers.slow_kernels import costs_by_scipy

STRAIGHT, DIAGONAL = np.uint32(5741), np.uint32(8119)


@functools.cache
def _program(stride, room):
    """One program for all maps of a shape: the map and the start are arguments."""

    @jax.jit
    def run(cost, free, cell):
        beside = cell_queue.neighbours(packing.pack(free[None])[0], free.shape[1])
        return cell_queue.spread(cost, beside, cell, STRAIGHT, DIAGONAL, stride, room)

    return run


def _spread(free, start, room):
    """The field that the queue leaves, and whether it was too short."""
    stride = free.shape[1] + 2
    cell = np.uint32(flat_cell(free, start))
    cost, is_short = _program(stride, room)(new_cost(free, start), free, cell)
    return np.asarray(cost).reshape(-1, stride), bool(is_short)


@pytest.mark.parametrize("width", [1, 27, 28, 29, 32, 61, 64])
def test_the_neighbours_are_those_of_a_padded_map(width):
    free = noise(np.random.default_rng(width), 7, width, 0.3)
    padded = np.pad(free, 2)
    words = jax.jit(packing.pack)(free[None])[0]
    beside = jax.jit(cell_queue.neighbours, static_argnums=1)(words, width)
    expected = sum(
        padded[1 + down : 10 + down, 1 + right : 3 + right + width].astype(np.uint8) << i
        for i, (down, right) in enumerate(cell_queue.CLOCKWISE)
    )
    assert np.array_equal(np.asarray(beside).reshape(9, -1), expected)


def test_the_queue_finds_the_costs_of_scipy():
    for free, start in zip(*random_maps(71, 12, 20, 40)[:2]):
        field, is_short = _spread(free, start, 1024)
        assert not is_short
        assert np.array_equal(field, bordered(costs_by_scipy(free, start, 5741, 8119), free))


def test_a_queue_that_is_too_short_reports_it_and_no_cost_is_too_low():
    free = noise(np.random.default_rng(3), 60, 60, 0.1)
    start = any_start(np.random.default_rng(4), free)
    expected = bordered(costs_by_scipy(free, start, 5741, 8119), free)
    field, is_short = _spread(free, start, 16)
    assert is_short
    assert (field >= expected).all() and (field > expected).any()


def test_sweeps_alone_settle_an_empty_map():
    free = np.ones((40, 70), bool)
    field = row_sweeps.new_field(jnp.asarray(free), jnp.array([13, 50]), jnp.uint32(8119))
    field = jax.jit(row_sweeps.four_sweeps)(field, jnp.uint32(5741), jnp.uint32(8119))
    assert np.array_equal(field, bordered(costs_by_scipy(free, (13, 50), 5741, 8119), free))
