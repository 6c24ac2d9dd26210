"""The octile lengths of shortest paths from a start to every cell of a map, in exact integers
(PY16 §3.2: g).

Two ways, joined. On open ground a few sweeps over whole rows (`row_sweeps`) bring costs across the
map at a fraction of a nanosecond a cell; where paths turn back and forth, as in mazes and among
scattered obstacles, each turn would cost a sweep, and a queue of cells (`cell_queue`) is faster, at
about 20 ns a cell. So sweep while that pays, then list the cells that can still improve a neighbour
(`frontier`) and spread from these. Sums of integers (`fixed_point`) do not depend on their order,
hence neither on the way taken, nor on the batch, nor on the machine.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import compiled_whole, runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.engine.in_place import write
from srt_jax.propagation import cell_queue, fixed_point, frontier, row_sweeps
from srt_jax.propagation.frontier import CellList
from srt_jax.types import Array

UNREACHED = 2**31 - 1
"""The cost, in a `Field`, of a cell that is blocked or that no path leads to."""

# of the queue, in cells: more than any front on a map of 2048x2048 with a few percent of noise
_ROOM = 1 << 15


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
    return _lengths(solve_map(free, start)[0], fixed_point.finest_scale(free))


@batch_kernel
def _cost_maps(free: Array, start: Array) -> tuple[Array, Array]:
    return compiled_whole(functools.partial(each, solve_map))(free, start)


def solve_map(free: Array, start: Array) -> tuple[Array, Array]:
    """Returns the cost, int32 [H, W], and scale of one map, as in `cost_field`; for use inside a
    marked call.

    Set up and trimmed map by map, since the temporaries of a whole batch would be memory fresh from
    the system.
    """
    scale = jnp.asarray(fixed_point.finest_scale(free), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    field = _solve_field(
        free, row_sweeps.new_field(free, start, diagonal), start, straight, diagonal
    )[1:-1, 1:-1]
    return jnp.where(
        field < row_sweeps.unreached(diagonal), field.astype(jnp.int32), UNREACHED
    ), scale


class _Rest(NamedTuple):
    """cells, num: uint32 [room] and [], what `spread` has to start from (`frontier.CellList`);
    field: uint32 [H + 2, W + 2].
    """

    cells: Array
    num: Array
    field: Array


def _solve_field(
    free: Array,
    field: Array,
    start: Array,
    straight: Array,
    diagonal: Array,
) -> Array:
    """Sweeps where that pays, then follows the frontier until there is none."""
    # the queue and its list of sources have the same room
    rows, stride = field.shape
    room = min(_ROOM, 1 << (rows * stride).bit_length())
    free_beside = cell_queue.neighbours(free)

    def sweep(field: Array) -> Array:
        return row_sweeps.four_sweeps(field, straight, diagonal)

    def find_frontier(field: Array) -> CellList:
        cells = frontier.frontier(field, straight, diagonal)
        return frontier.list_cells(cells, stride, room)

    def by_sweeps(field: Array) -> _Rest:
        field = sweep(field)
        # a second round, unless little was reached: then most of the map is closed off
        num_reached = jnp.sum(field < row_sweeps.unreached(diagonal), dtype=jnp.int32)
        field = lax.cond(num_reached * 8 > field.size, sweep, lambda field: field, field)
        return _Rest(*find_frontier(field), field)

    def from_start(field: Array) -> _Rest:
        cell = ((start[0] + 1) * stride + start[1] + 1).astype(jnp.uint32)
        cell = jnp.where(row_sweeps.is_reached(field, start), cell, jnp.uint32(0))
        cells = write(jnp.zeros(room, jnp.uint32), cell, jnp.uint32(0))
        return _Rest(cells, (cell != 0).astype(jnp.uint32), field)

    def spread(rest: _Rest) -> _Rest:
        cost = rest.field.reshape(-1)
        sources = frontier.cheapest_first(rest.cells, rest.num, cost)
        cost, is_short = cell_queue.spread(cost, free_beside, sources, straight, diagonal, stride)
        field = cost.reshape(rows, stride)
        # only where list or queue were too short can anything be left
        is_cut = is_short | (rest.num == room - 1)
        nothing = CellList(rest.cells, jnp.uint32(0))
        cells, num = lax.cond(is_cut, find_frontier, lambda _: nothing, field)
        return _Rest(cells, num, field)

    if not runs_in_place():
        return _sweep_to_the_end(field, sweep)
    rest = lax.cond(_is_rough(free), from_start, by_sweeps, field)
    # ends: costs only fall, and no frontier means that all are exact
    return lax.while_loop(lambda rest: rest.num != 0, spread, rest).field


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


def _is_rough(free: Array) -> Array:
    """Whether paths are likely to turn often: whether walls lie closer than a dozen cells, in a
    sample of rows.
    """
    sample = free[::4]
    num_edges = jnp.sum(sample[:, 1:] != sample[:, :-1], dtype=jnp.int32)
    return num_edges * 12 > sample.size
