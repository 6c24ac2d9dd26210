"""The octile lengths of shortest paths from a start to every cell of a map, in exact integers
(PY16 §3.2: g).

Three ways. On a CPU walks from corner to corner (`corner_queue`) settle most cells without a queue;
on small maps full of scattered obstacles, where every other cell is a corner, a plain queue of
cells (`cell_queue`) is up to one and a half times as fast. Elsewhere, where queues would be copied
at every step, whole rows are swept until nothing changes (`row_sweeps`). Sums of integers
(`fixed_point`) do not depend on their order, hence neither on the way taken, nor on the batch, nor
on the machine.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, compiled_whole, runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.propagation import cell_queue, corner_queue, fixed_point, row_sweeps
from srt_jax.types import Array

UNREACHED = 2**31 - 1
"""The cost, in a `Field`, of a cell that is blocked or that no path leads to."""

# the most cells, with the border, of a map that the queue of cells may take: on larger ones costs
# fall again too often in it, and the search is up to three times as slow
_SMALL = 1 << 19
# of that queue, in cells
_ROOM = 1 << 14

_SAMPLED = 4  # of so many rows one is looked at


class Field(NamedTuple):
    """Exact costs of a batch of maps.

    cost: int32 [B, H, W], in units of 1 / straight cell sides; UNREACHED where no path leads.
    scale: int32 [B], index into `moves.FIXED_POINTS` of the map's (straight, diagonal).
    """

    cost: Array
    scale: Array


def cost_field(free: Array, start: Array) -> Field:
    """Returns the costs of a batch in exact integers: free bool [B, H, W], start int32 [B, 2]."""
    return Field(*_cost_maps(free, start))


def cheapest(field: Field, among: Array) -> Array:
    """Returns the cheapest cell of each mask, uint32 [B, H, words], the first in row order, int32
    [B, 2]; (-1, -1) of none.
    """
    return compiled_whole(functools.partial(each, _cheapest))(field.cost, among)


def _cheapest(cost: Array, among: Array) -> Array:
    """The first of the cells that are the first cheapest of their column (argmin over a map would
    be a scalar loop on CPU).
    """
    height, width = cost.shape

    def row_step(best: tuple[Array, Array], row: Array) -> tuple[tuple[Array, Array], None]:
        own = packing.unpack(lax.dynamic_index_in_dim(among, row)[None], width)[0, 0]
        own = jnp.where(own, lax.dynamic_index_in_dim(cost, row, keepdims=False), UNREACHED)
        least, rows = best
        return (jnp.minimum(least, own), jnp.where(own < least, row, rows)), None

    start = (jnp.full(width, UNREACHED, jnp.int32), jnp.zeros(width, jnp.int32))
    (least, rows), _ = lax.scan(row_step, start, jnp.arange(height, dtype=jnp.int32))
    place = jnp.where(
        least == jnp.min(least), rows * width + jnp.arange(width, dtype=jnp.int32), height * width
    )
    first = jnp.min(place)
    return jnp.where(jnp.min(least) < UNREACHED, jnp.stack([first // width, first % width]), -1)


def field_length(field: Field) -> Array:
    """Returns the costs in cell sides: float32 [B, H, W], inf where not reached."""
    return _lengths(field.cost, field.scale[:, None, None])


def _lengths(cost: Array, scale: Array | int) -> Array:
    return jnp.where(cost == UNREACHED, jnp.inf, fixed_point.to_length(cost, scale))


@batch_kernel
def length_maps(free: Array, start: Array) -> Array:
    """Returns the lengths of a batch in cell sides: free bool [B, H, W], start int32 [B, 2] ->
    float32 [B, H, W], inf where no path leads.
    """
    return compiled_whole(functools.partial(each, length_map))(free, start)


def length_map(free: Array, start: Array) -> Array:
    """Returns `length_maps` of one map; for use inside a marked call."""
    cost, scale = solve_map(free, start)
    known = fixed_point.scale_by_shape(*free.shape)
    return _lengths(cost, scale if known is None else known)


@batch_kernel
def _cost_maps(free: Array, start: Array) -> tuple[Array, Array]:
    return compiled_whole(functools.partial(each, solve_map))(free, start)


def solve_map(free: Array, start: Array) -> tuple[Array, Array]:
    """Returns the cost, int32 [H, W], and scale of one map, as in `cost_field`; for use inside a
    marked call.

    Set up and trimmed map by map, since the temporaries of a whole batch would be memory fresh from
    the system.
    """
    words = packing.pack(free[None])[0]
    scale = jnp.asarray(fixed_point.finest_scale_of_words(words, free.shape[1]), jnp.int32)
    straight, diagonal = apart(_units)(scale)
    if runs_in_place():
        field = _by_queues(words, free.shape[1], start, straight, diagonal)
    else:
        field = _sweep_to_the_end(
            row_sweeps.new_field(free, start, diagonal),
            lambda field: row_sweeps.four_sweeps(field, straight, diagonal),
        )
    field = field[1:-1, 1:-1]
    return jnp.where(
        field < row_sweeps.unreached(diagonal), field.astype(jnp.int32), UNREACHED
    ), scale


def _units(scale: Array) -> tuple[Array, Array]:
    straight, diagonal = fixed_point.pairs(scale)
    return straight.astype(jnp.uint32), diagonal.astype(jnp.uint32)


def _by_queues(free: Array, width: int, start: Array, straight: Array, diagonal: Array) -> Array:
    """The exact costs of a packed map as a bordered field, in which blocked cells are not reached;
    for use inside a marked call.
    """
    shape, stride = (free.shape[0], width), width + 2
    free_beside = cell_queue.neighbours(free, width)
    cost, cell = corner_queue.begin(free, width, start, diagonal)
    is_cut = False
    if cost.size <= _SMALL:
        # either queue starts, the other one has nothing to do
        is_rough = _is_rough(free, width)
        first, cell = jnp.where(is_rough, cell, jnp.uint32(0)), jnp.where(is_rough, 0, cell)
        room = min(_ROOM, 1 << cost.size.bit_length())
        cost, is_cut = cell_queue.spread(cost, free_beside, first, straight, diagonal, stride, room)
    cost = corner_queue.spread(cost, free_beside, cell, is_cut, straight, diagonal, shape)
    return cost.reshape(-1, stride)


class _Round(NamedTuple):
    """field: uint32 [H + 2, W + 2]; is_changing: bool [], whether the last round changed it."""

    field: Array
    is_changing: Array


def _sweep_to_the_end(field: Array, sweep: Callable[[Array], Array]) -> Array:
    """Sweeps until nothing changes: then no move can improve any cell."""

    def once_more(state: _Round) -> _Round:
        swept = sweep(state.field)
        return _Round(swept, jnp.any(swept != state.field))

    return lax.while_loop(
        lambda state: state.is_changing, once_more, _Round(field, jnp.bool_(True))
    ).field


def _is_rough(free: Array, width: int) -> Array:
    """Whether paths are likely to turn at every other cell: whether walls begin or end at every
    fifth cell, in a sample of rows.
    """
    height, words = free.shape

    def row(i: Array, total: Array) -> Array:
        """From bit to bit of a word; the steps between words are left out."""
        line = lax.dynamic_slice(free, (i * _SAMPLED, np.int32(0)), (1, words))[0]
        edges = (line ^ (line >> jnp.uint32(1))) & jnp.uint32(2**31 - 1)
        return total + lax.population_count(edges)

    # row by row: as one sum it would take the compiler a quarter of a second
    num_rows = -(-height // _SAMPLED)
    edges = repeat(num_rows, row, jnp.zeros(words, jnp.uint32))
    return jnp.sum(edges, dtype=jnp.uint32) * 5 > num_rows * width
