"""Sweeps over a field of costs: each carries costs as far as a cone of directions reaches, all
columns at once as one vector.

A sweep down the rows lets each row take what it can from the row above, straight and over both
diagonals; the sweep back up does the same from below; on the transposed map the same two serve the
columns. Where shortest paths seldom double back, as on streets, a few sweeps leave most costs
exact. `frontier` finds what is left, and `cell_queue` does it.

A field is uint32 [rows, cols] with a border of blocked cells, so that the neighbours of a row are
plain slices. BLOCKED is one bit: `value & BLOCKED` tests for it, and max(value, other & BLOCKED)
forbids a move without a branch.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from srt_jax.moves import is_on_map
from srt_jax.types import Array

BLOCKED = np.uint32(1 << 31)

_STRIP = 16  # rows


def unreached(diagonal: Array) -> Array:
    """Returns the cost of a free cell that is not reached yet: adding a move to it does not set the
    bit of BLOCKED.
    """
    return jnp.uint32(int(BLOCKED) - 1) - diagonal


def new_field(free: Array, start: Array, diagonal: Array) -> Array:
    """Returns the field before any sweep, uint32 [H + 2, W + 2]: 0 at the start if that is a free
    cell of the map.
    """
    height, width = free.shape
    row, col = _bordered(start, height, width)
    field = jnp.pad(jnp.where(free, unreached(diagonal), BLOCKED), 1, constant_values=BLOCKED)
    at_start = lax.dynamic_slice(field, (row, col), (1, 1))
    return lax.dynamic_update_slice(
        field, jnp.where(at_start < BLOCKED, jnp.uint32(0), at_start), (row, col)
    )


def _bordered(cell: Array, height: int, width: int) -> tuple[Array, Array]:
    """Where a cell lies in the bordered field, int32 row and column; (0, 0), a blocked cell of the
    border, for one outside the map.
    """
    row, col = cell[0], cell[1]
    inside = is_on_map(row, col, height, width)
    return jnp.where(inside, row + 1, 0), jnp.where(inside, col + 1, 0)


def four_sweeps(field: Array, straight: Array, diagonal: Array) -> Array:
    """Returns the field after sweeps down, up, right and left."""
    for _ in range(2):
        for upwards in (False, True):
            field = _sweep(field, straight, diagonal, upwards=upwards)
        field = transposed(field)
    return field


def transposed(field: Array) -> Array:
    """Returns field.T, 16 rows at a time, so that their cells stay in the first-level cache while
    they are written to the columns.
    """
    rows, cols = field.shape
    if rows < _STRIP:
        return field.T

    zero = np.int32(0)

    def move(strip: Array, out: Array) -> Array:
        first = jnp.minimum(strip * _STRIP, rows - _STRIP)
        return lax.dynamic_update_slice(
            out, lax.dynamic_slice(field, (first, zero), (_STRIP, cols)).T, (zero, first)
        )

    return repeat(-(-rows // _STRIP), move, jnp.zeros((cols, rows), field.dtype))


class _Sweep(NamedTuple):
    """line, bare: uint32 [cols] and [cols - 2], the row before with its border and without (to cut
    it out again costs 50 %); field: uint32 [rows, cols].
    """

    line: Array
    bare: Array
    field: Array


def _sweep(field: Array, straight: Array, diagonal: Array, *, upwards: bool) -> Array:
    """Relaxes the rows inside the border, from the first to the last, or back if `upwards`; in
    place.

    Reading an array that the loop carries anywhere but in the slice then overwritten would copy it
    at every step.
    """
    rows, cols = field.shape
    zero = np.int32(0)

    def row_of(field: Array, y: Array) -> Array:
        return lax.dynamic_slice(field, (y, zero), (1, cols))[0]

    def row_step(step: Array, sweep: _Sweep) -> _Sweep:
        y = rows - 2 - step if upwards else 1 + step
        new = _relax_row(sweep.line, sweep.bare, row_of(sweep.field, y), straight, diagonal)
        # its ends, the border, stay: a pad is slower by 40 %
        line = lax.dynamic_update_slice(sweep.line, new, (np.int32(1),))
        return _Sweep(line, new, lax.dynamic_update_slice(sweep.field, line[None], (y, zero)))

    line = row_of(field, jnp.int32(rows - 1 if upwards else 0))
    return repeat(rows - 2, row_step, _Sweep(line, line[1:-1], field)).field


def _relax_row(line: Array, bare: Array, row: Array, straight: Array, diagonal: Array) -> Array:
    """The costs of `row` (bordered) after the moves from the row before (`line` bordered, `bare`
    not).
    """
    here = row[1:-1]
    # a diagonal needs the cell beside the target in this row,
    left = jnp.maximum(line[:-2], row[:-2] & BLOCKED)
    right = jnp.maximum(line[2:], row[2:] & BLOCKED)
    best = jnp.minimum(jnp.minimum(left, right) + diagonal, bare + straight)
    best = jnp.maximum(best, bare & BLOCKED)  # and the one in the row before
    return jnp.maximum(jnp.minimum(here, best), here & BLOCKED)
