"""The octile length of a shortest path from the start to every cell, in exact integers (PY16 §3.2:
g).

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
import numpy as np
from jax import Array, lax

from sign_model.ground.marks import compiled_whole, runs_in_place
from srt_jax import types as records
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.kernel import batch_kernel, each, write
from srt_jax.fields import cell_queue, fixed_point, frontier, row_sweeps
from srt_jax.fields.goal_bound import Target, target_of
from srt_jax.gradients import least_costs

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


def cost_to_come(
    free: records.Array, start: records.Array, traversal_cost: records.Array | None = None
) -> Array:
    """Returns the length of a shortest path from `start` to each cell; inf where none leads
    (everywhere if `start` is blocked).

    Octile: 1 a straight move, sqrt 2 a diagonal one, which needs both cells beside it free (PY16
      §3.2). Exact up to the
    rounding to float32 (1.8e-7 at most) and the fixed point's 8e-9 on maps up to 700x700, 3e-7 up
    to 1700x1700, 1.5e-6 up to
    2600x2600: what diagonals may be too long or too short by (`fixed_point`).

    With `traversal_cost`, a move costs its length times the mean of the costs of its two cells
    (`cell_costs`), and the result is differentiable with respect to the costs, forwards and
    backwards (`least_costs`): blocked and unreached cells have gradient 0.

    Memory besides arguments and result: 20 bytes a cell of the one map in work, whatever the batch
    (without `traversal_cost`).

    Args:
      free: bool [..., H, W], True where the agent fits.
      start: int32 [..., 2], (row, col); may lie outside the map.
      traversal_cost: float32 [..., H, W], positive on free cells, 1 where a move costs its length;
        inf blocks the cell. Where all free cells of a map cost the same, the lengths are computed
        and multiplied.

    Returns:
      float32 [..., H, W], in cell sides (times the cost).

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit; outside jit, for a cost that
        is not positive.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> print(srt_jax.cost_to_come(free, (2, 0))[2])
      [ 0.  1.  2. inf inf inf inf]
      >>> swamp = np.full((5, 7), 3, np.float32)  # three times as dear as open ground
      >>> print(srt_jax.cost_to_come(free, (2, 0), swamp)[2, :3])
      [0. 3. 6.]
    """
    free, start = arguments.as_mask("free", free), arguments.as_cells("start", start)
    if traversal_cost is not None:
        return least_costs.least_costs(
            free, start, arguments.as_floats("traversal_cost", traversal_cost), _length_map
        )
    batch = arguments.common_batch(free=(free, 2), start=(start, 1))
    return eager.call(_length_maps, batch, free, start)


def path_cost(
    free: records.Array,
    start: records.Array,
    goal: records.Array,
    traversal_cost: records.Array | None = None,
) -> Array:
    """Returns `cost_to_come` at `goal` alone; inf where no path leads there or it lies outside the
    map.

    Its derivative with respect to `traversal_cost` is that of the path to `goal`: cheaper than the
    one of the whole field, and the path itself, each cell with the length it answers for.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start, goal: int32 [..., 2], (row, col); may lie outside the map.
      traversal_cost: float32 [..., H, W], as in `cost_to_come`.

    Returns:
      float32 [...].

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> round(srt_jax.path_cost(free, (2, 0), (0, 2)).item(), 4)  # two diagonal moves
      2.8284
    """
    free, start, goal = (
        arguments.as_mask("free", free),
        arguments.as_cells("start", start),
        arguments.as_cells("goal", goal),
    )
    if traversal_cost is None:
        traversal_cost = np.ones(free.shape, np.float32)
    return least_costs.least_cost(
        free, start, goal, arguments.as_floats("traversal_cost", traversal_cost), _length_map
    )


def cost_field(free: Array, start: Array, goal: Array | None = None) -> Field:
    """Returns `cost_to_come` of a batch in exact integers: free bool [B, H, W], start int32 [B, 2].

    With a `goal`, int32 [B, 2], only its cost and those on the shortest paths to it are sure to be
    exact, no other is too low, and it takes about half the time: `path.trace_field` reads the same
    path off either.
    """
    return Field(*(_cost_maps(free, start) if goal is None else _costs_towards(free, start, goal)))


def cheapest(field: Field, among: Array) -> Array:
    """Returns the cheapest cell of each mask, uint32 [B, H, words], the first in row order, int32
    [B, 2]; (-1, -1) of none.
    """
    return compiled_whole(functools.partial(each, _cheapest))(field.cost, among)


def _cheapest(cost: Array, among: Array) -> Array:
    """The first of the cells that are the first least of their column (argmin over a map would be a
    scalar loop on CPU).
    """
    height, width = cost.shape

    def row_step(best: tuple[Array, Array], row: Array) -> tuple:
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
def _length_maps(free: Array, start: Array) -> Array:
    return compiled_whole(functools.partial(each, _length_map))(free, start)


def _length_map(free: Array, start: Array) -> Array:
    return _lengths(solve_map(free, start)[0], fixed_point.finest_scale(free))


@batch_kernel
def _cost_maps(free: Array, start: Array) -> tuple[Array, Array]:
    return compiled_whole(functools.partial(each, solve_map))(free, start)


@batch_kernel
def _costs_towards(free: Array, start: Array, goal: Array) -> tuple[Array, Array]:
    return compiled_whole(functools.partial(each, solve_map))(free, start, goal)


def solve_map(free: Array, start: Array, goal: Array | None = None) -> tuple[Array, Array]:
    """Returns the cost, int32 [H, W], and scale of one map, as in `cost_field`; for use inside a
    marked call.

    Set up and trimmed map by map: a batch of temporaries is fresh memory.
    """
    scale = jnp.asarray(fixed_point.finest_scale(free), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    towards = None if goal is None else target_of(goal, *free.shape)
    field = _solved(
        free, row_sweeps.new_field(free, start, diagonal), start, straight, diagonal, towards
    )[1:-1, 1:-1]
    return jnp.where(
        field < row_sweeps.unreached(diagonal), field.astype(jnp.int32), UNREACHED
    ), scale


def _solved(
    free: Array,
    field: Array,
    start: Array,
    straight: Array,
    diagonal: Array,
    towards: Target | None,
) -> Array:
    """Sweeps where that pays, then follows the frontier until there is none."""
    rows, stride = field.shape
    room = min(_ROOM, 1 << (rows * stride).bit_length())
    free_beside = cell_queue.neighbours(free)

    def sweep(field: Array) -> Array:
        return row_sweeps.four_sweeps(field, straight, diagonal)

    def listed(field: Array) -> tuple[Array, Array]:
        return frontier.listed(frontier.frontier(field, straight, diagonal, towards), stride, room)

    def by_sweeps(field: Array) -> tuple[Array, Array, Array]:
        field = sweep(field)
        if towards is not None:
            return *listed(field), field
        num_reached = jnp.sum(field < row_sweeps.unreached(diagonal), dtype=jnp.int32)
        field = lax.cond(num_reached * 8 > field.size, sweep, lambda field: field, field)
        return *listed(field), field

    def from_start(field: Array) -> tuple[Array, Array, Array]:
        cell = ((start[0] + 1) * stride + start[1] + 1).astype(jnp.uint32)
        cell = jnp.where(row_sweeps.is_reached(field, start), cell, jnp.uint32(0))
        return (
            write(jnp.zeros(room, jnp.uint32), cell, jnp.uint32(0)),
            (cell != 0).astype(jnp.uint32),
            field,
        )

    def spread(state: tuple) -> tuple:
        cells, num, field = state
        cost = field.reshape(-1)
        sources = frontier.cheapest_first(cells, num, cost)
        cost, is_short = cell_queue.spread(
            cost, free_beside, sources, straight, diagonal, stride, towards
        )
        field = cost.reshape(rows, stride)
        return *lax.cond(
            is_short | (num == room - 1), listed, lambda _: (cells, jnp.uint32(0)), field
        ), field

    if not runs_in_place():
        return _swept_to_the_end(field, sweep)
    state = lax.cond(_is_rough(free), from_start, by_sweeps, field)
    return lax.while_loop(lambda state: state[1] != 0, spread, state)[2]


def _swept_to_the_end(field: Array, sweep: Callable[[Array], Array]) -> Array:
    """Sweeps until nothing changes: then no move can improve any cell."""

    def once_more(state: tuple[Array, Array]) -> tuple[Array, Array]:
        field, _ = state
        swept = sweep(field)
        return swept, jnp.any(swept != field)

    return lax.while_loop(lambda state: state[1], once_more, (field, jnp.bool_(True)))[0]


def _is_rough(free: Array) -> Array:
    """Whether paths are likely to turn often: whether walls lie closer than a dozen cells, in a
    sample of rows.
    """
    sample = free[::4]
    num_edges = jnp.sum(sample[:, 1:] != sample[:, :-1], dtype=jnp.int32)
    return num_edges * 12 > sample.size
