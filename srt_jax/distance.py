"""The octile length of a shortest path from the start to every cell: cone sweeps in exact integers (PY16 §3.2: g).

A sweep down the rows lets each row take what it can from the row above, straight and over both diagonals: a cone of
directions, all columns at once as one vector. The sweep back up does the same from below. Then the map is transposed, and
the same two sweeps serve the columns, until neither orientation changes anything: then no move can improve any cell, which
is what a shortest distance is. Sums of integers (`fixed_point`) do not depend on their order, hence neither on the batch
nor on the machine.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from srt_jax import bucketed, fixed_point, shapes
from srt_jax import types as records
from srt_jax.kernel import batch_kernel, compiled_whole

UNREACHED = 2**31 - 1
"""The cost, in a `Field`, of a cell that is blocked or that no path leads to."""

_BLOCKED = 1 << 31  # one bit of uint32: `value & _BLOCKED` asks, max(value, other & _BLOCKED) forbids a move without a branch


class Field(NamedTuple):
    """Exact costs of a batch of maps.

    cost: int32 [B, H, W], in units of 1 / straight cell sides; UNREACHED where no path leads.
    scale: int32 [B], index into `moves.FIXED_POINTS` of the map's (straight, diagonal).
    """

    cost: Array
    scale: Array


def cost_to_come(free: records.Array, start: records.Array) -> Array:
    """Returns the length of a shortest path from `start` to each cell; inf where none leads (everywhere if `start` is blocked).

    Octile: 1 a straight move, sqrt 2 a diagonal one, which needs both cells beside it free (PY16 §3.2). Exact up to the
    rounding to float32 and the fixed point's 8e-9 (maps up to 700x700; 3e-7 at most up to 2048x2048).

    Args:
      free: bool [..., H, W], True where the agent fits.
      start: int32 [..., 2], (row, col); may lie outside the map.

    Returns:
      float32 [..., H, W], in cell sides.

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.
    """
    free, start = shapes.as_mask("free", free), shapes.as_cells("start", start)
    batch = shapes.common_batch(free=(free, 2), start=(start, 1))
    return bucketed.call(_length_maps, batch, free, start)


def cost_field(free: Array, start: Array) -> Field:
    """Returns `cost_to_come` of a batch in exact integers: free bool [B, H, W], start int32 [B, 2]."""
    return Field(*_cost_maps(free, start))


def field_length(field: Field) -> Array:
    """Returns the costs in cell sides: float32 [B, H, W], inf where not reached."""
    return _lengths(field.cost, fixed_point.pairs(field.scale)[0][:, None, None])


def _lengths(cost: Array, straight: Array) -> Array:
    reached = cost != UNREACHED
    return jnp.where(reached, fixed_point.to_length(jnp.where(reached, cost, 0), straight), jnp.inf)


@batch_kernel
def _length_maps(free: Array, start: Array) -> Array:
    def one_map(args: tuple[Array, Array]) -> Array:
        cost, scale = _solve_map(*args)
        return _lengths(cost, fixed_point.pairs(scale)[0])

    return compiled_whole(lambda free, start: lax.map(one_map, (free, start)))(free, start)


@batch_kernel
def _cost_maps(free: Array, start: Array) -> tuple[Array, Array]:
    return compiled_whole(lambda free, start: lax.map(lambda args: _solve_map(*args), (free, start)))(free, start)


def _solve_map(free: Array, start: Array) -> tuple[Array, Array]:
    """Cost, int32 [H, W], and scale of one map. Set up and trimmed map by map: a batch of temporaries is fresh memory."""
    height, width = free.shape
    scale = jnp.asarray(fixed_point.finest_scale(free), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    field = _solve(_bordered_square(free, start, diagonal), straight, diagonal)[1 : 1 + height, 1 : 1 + width]
    return jnp.where(field < _unreached(diagonal), field.astype(jnp.int32), UNREACHED), scale


def _unreached(diagonal: Array) -> Array:
    return jnp.uint32(_BLOCKED - 1) - diagonal  # a move added to it does not set the bit


def _bordered_square(free: Array, start: Array, diagonal: Array) -> Array:
    """The field before any sweep, uint32 [N, N]: square, so that its transpose fits the same buffer; bordered."""
    height, width = free.shape
    side = max(height, width)
    free = jnp.pad(free, ((1, 1 + side - height), (1, 1 + side - width)))
    row, col = start[0] + 1, start[1] + 1
    inside = (row > 0) & (row <= height) & (col > 0) & (col <= width)
    row, col = jnp.where(inside, row, 0), jnp.where(inside, col, 0)  # a blocked cell of the border
    field = jnp.where(free, _unreached(diagonal), jnp.uint32(_BLOCKED))
    at_start = jnp.where(lax.dynamic_slice(free, (row, col), (1, 1)), jnp.uint32(0), jnp.uint32(_BLOCKED))
    return lax.dynamic_update_slice(field, at_start, (row, col))


def _solve(field: Array, straight: Array, diagonal: Array) -> Array:
    """Sweeps one bordered square map [N, N] until nothing changes; it ends, because costs only fall.

    Every half-round ends with a transpose, so "row" means a column of the map in every other one. `first`..`last`: the rows
    that the half-round before changed; `raised`: the highest row that the last upward sweep in this orientation changed, from
    which the rows below can take.
    """
    bottom = jnp.int32(field.shape[0] - 2)  # last row inside the border; the first is 1

    def half_round(state: tuple) -> tuple:
        field, num_quiet, num_halves, first, last, raised, raised_other = state
        is_first = num_halves < 2  # each orientation sweeps all rows once: at first only the start could "have changed"
        first = jnp.where(is_first, 1, jnp.minimum(first, raised))
        field, steps, down = _sweep(field, first, bottom, straight, diagonal, upwards=False)
        last = jnp.where(is_first, bottom, jnp.maximum(last, jnp.where(steps > 0, first + steps - 1, 1)))
        field, steps, up = _sweep(field, jnp.int32(1), last, straight, diagonal, upwards=True)
        raised = jnp.where(steps > 0, last - (steps - 1), bottom)
        changed = down | up
        is_quiet = ~jnp.any(changed)
        first = jnp.where(is_quiet, bottom, jnp.argmax(changed).astype(jnp.int32))
        last = jnp.where(is_quiet, 1, bottom + 1 - jnp.argmax(changed[::-1]).astype(jnp.int32))
        return field.T, jnp.where(is_quiet, num_quiet + 1, 0), num_halves + 1, first, last, raised_other, raised

    state = (field, jnp.int32(0), jnp.int32(0), bottom, bottom, bottom, bottom)
    field, _, num_halves, *_ = lax.while_loop(lambda state: state[1] < 2, half_round, state)
    return jnp.where(num_halves % 2 == 1, field.T, field)


def _sweep(
    field: Array, first: Array, last: Array, straight: Array, diagonal: Array, *, upwards: bool
) -> tuple[Array, Array, Array]:
    """Relaxes rows first..last in order, or last..first if `upwards`.

    Rows are read from `field` and written to `out`: reading an array that the loop carries anywhere but in the slice then
    overwritten would copy it at every step.

    Returns the map, the number of steps up to the last one that changed a row, and bool [N], the columns that changed.
    """
    side = field.shape[0]

    def row_of(y: Array) -> Array:
        return lax.dynamic_slice(field, (y, 0), (1, side))[0]

    def row_step(step: Array, carry: tuple) -> tuple:
        line, bare, out, changed_at = carry  # the row before, with its border and without: to cut it out again costs 50 %
        y = last - step if upwards else first + step
        row = row_of(y)
        new = _relaxed(line, bare, row, straight, diagonal)
        changed_at = jnp.where(new != row[1:-1], step + 1, changed_at)  # per column: a vector, no reduction in the loop
        line = jnp.pad(new, 1, constant_values=jnp.uint32(_BLOCKED))
        return line, new, lax.dynamic_update_slice(out, line[None], (y, 0)), changed_at

    line = row_of(last + 1 if upwards else first - 1)
    carry = (line, line[1:-1], field, jnp.zeros(side - 2, jnp.int32))
    _, _, out, changed_at = lax.fori_loop(0, last - first + 1, row_step, carry)
    return out, jnp.max(changed_at), jnp.pad(changed_at > 0, 1)


def _relaxed(line: Array, bare: Array, row: Array, straight: Array, diagonal: Array) -> Array:
    """The costs of `row` (bordered) after the moves from the row before (`line` bordered, `bare` not)."""
    blocked = jnp.uint32(_BLOCKED)
    here = row[1:-1]
    left = jnp.maximum(line[:-2], row[:-2] & blocked)  # a diagonal needs the cell beside the target in this row,
    right = jnp.maximum(line[2:], row[2:] & blocked)
    best = jnp.minimum(jnp.minimum(left, right) + diagonal, bare + straight)
    best = jnp.maximum(best, bare & blocked)  # and the one in the row before
    return jnp.maximum(jnp.minimum(here, best), here & blocked)
