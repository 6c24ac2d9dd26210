"""The reached cell nearest the goal: where the search was stopped (PY16 §3.2, the cell of least h
in CLOSED).
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.moves import octile_order
from srt_jax.types import Array

_FAR = 2**31 - 1


def seed_cell(reached: Array, goal: Array) -> Array:
    """Returns the reached cell nearest `goal`; (-1, -1) where nothing is reached.

    It borders the obstacle that closes off the goal (PY16 §3.2). Nearness is octile distance,
    compared without rounding; ties go to the lowest row, then the lowest column.

    Memory besides argument and result: a few rows of the one map in work.

    Args:
      reached: bool [..., H, W], from `reach`.
      goal: int32 [..., 2], (row, col).

    Returns:
      int32 [..., 2], (row, col).

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> srt_jax.seed_cell(srt_jax.reach(free, (2, 0)), (2, 6)).tolist()
      [2, 2]
    """
    (reached, goal), batch = arguments.mask_and_cells(reached=reached, goal=goal)
    return eager.call(seed_cells, batch, reached, goal, is_light=True)


@batch_kernel
def seed_cells(reached: Array, goal: Array) -> Array:
    """Returns `seed_cell` of a batch: reached bool [B, H, W], goal int32 [B, 2] -> int32 [B, 2]."""
    return compiled_whole(functools.partial(each, nearest))(reached, goal)


class _Best(NamedTuple):
    """For each column the last reached row down to the goal's, -1 where there is none, and the
    first below it, H where there is none: int16 or int32 [W] each.
    """

    above: Array
    below: Array


class _Nearest(NamedTuple):
    """apart: int32 [], how many rows the next ones lie from the goal's. The nearest cell so far: h,
    its distance in `octile_order`; row, col; int32 [] each.
    """

    apart: Array
    h: Array
    row: Array
    col: Array


def nearest_in_words(reached: Array, goal: Array, width: int) -> Array:
    """Returns `seed_cell` of one map from packed rows, uint32 [H, words], of W columns: row by row
    away from the goal, as long as a row may hold a nearer cell.
    """
    height, words = reached.shape
    row, col = goal[0], goal[1]
    first = packing.WORD * jnp.arange(words, dtype=jnp.int32)
    until, before = (packing.bits_inside(end, words) for end in (col + 1, col))
    one, nowhere = jnp.uint32(1), np.int32(2**29)

    def look_at(state: _Nearest, at: Array) -> _Nearest:
        """Takes the nearest cell of a row if it is nearer, or as near and in an earlier row."""
        is_there = (at >= 0) & (at < height)
        line = lax.dynamic_index_in_dim(reached, at.clip(0, height - 1), keepdims=False)
        left, right = line & until, line & ~before
        highest = np.int32(packing.WORD - 1) - lax.clz(left).astype(jnp.int32)
        lowest = lax.population_count((right & -right) - one).astype(jnp.int32)
        last = jnp.max(jnp.where(left != 0, first + highest, -nowhere))
        following = jnp.min(jnp.where(right != 0, first + lowest, nowhere))
        cell = jnp.where(col - last <= following - col, last, following)
        is_there &= (cell != nowhere) & (cell != -nowhere)
        h = octile_order(at - row, cell - col)
        is_nearer = is_there & ((h < state.h) | ((h == state.h) & (at < state.row)))
        new = _Nearest(state.apart, h, at, cell)
        return jax.tree.map(lambda new, old: jnp.where(is_nearer, new, old), new, state)

    def two_rows(state: _Nearest) -> _Nearest:
        state = look_at(look_at(state, row - state.apart), row + state.apart)
        return state._replace(apart=state.apart + 1)

    def may_be_nearer(state: _Nearest) -> Array:
        return (state.apart <= last) & (octile_order(state.apart, jnp.int32(0)) <= state.h)

    begin = jnp.maximum(jnp.maximum(-row, row - (height - 1)), 0)
    last = jnp.maximum(row, height - 1 - row)
    none = jnp.int32(-1)
    # Ends: after the row farthest from the goal.
    found = lax.while_loop(may_be_nearer, two_rows, _Nearest(begin, jnp.int32(_FAR), none, none))
    return jnp.stack([found.row, found.col])


def nearest(reached: Array, goal: Array) -> Array:
    """Returns `seed_cell` of one map: reached bool [H, W], goal int32 [2] -> int32 [2].

    The nearest of the cells that are nearest within their column: of those above the goal's row
    the last, else the first.

    jnp.argmin over the whole map would be a scalar loop on CPU, for its reduction carries a pair;
    here a scan over rows keeps two rows a column.
    """
    height, num_columns = reached.shape
    # the narrower, the more columns in one step
    dtype = jnp.int16 if height < 2**15 - 1 else jnp.int32
    none = np.array(height, dtype)

    def row_step(best: _Best, row_and_mask: tuple[Array, Array]) -> tuple[_Best, None]:
        row, mask = row_and_mask
        is_above = row <= goal[0]
        last = jnp.where(is_above, row, -1).astype(dtype)
        first = jnp.where(is_above, height, row).astype(dtype)
        return _Best(
            jnp.where(mask, jnp.maximum(best.above, last), best.above),
            jnp.where(mask, jnp.minimum(best.below, first), best.below),
        ), None

    # two candidates a column
    start = _Best(jnp.full(num_columns, -1, dtype), jnp.full(num_columns, none, dtype))
    (above, below), _ = lax.scan(row_step, start, (jnp.arange(height, dtype=jnp.int32), reached))
    # the nearest of them; among equals the first in row order
    rows = jnp.concatenate([above, below]).astype(jnp.int32)
    cols = jnp.tile(jnp.arange(num_columns, dtype=jnp.int32), 2)
    h = jnp.where((rows >= 0) & (rows < height), octile_order(rows - goal[0], cols - goal[1]), _FAR)
    least = jnp.min(h)
    place = jnp.min(jnp.where(h == least, rows * num_columns + cols, _FAR))
    return jnp.where(least < _FAR, jnp.stack([place // num_columns, place % num_columns]), -1)
