"""The reached cell nearest the goal: where the search was stopped (PY16 §3.2, the cell of least h
in CLOSED).
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

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


def nearest_in_words(reached: Array, goal: Array, width: int) -> Array:
    """Returns `nearest` of one map from packed rows, uint32 [H, words]: each is unpacked when its
    turn comes.
    """
    return nearest(
        reached, goal, lambda words: packing.unpack(words[None, None], width)[0, 0], width
    )


def nearest(
    reached: Array,
    goal: Array,
    row_of: Callable[[Array], Array] = lambda row: row,
    width: int | None = None,
) -> Array:
    """Returns `seed_cell` of one map: reached bool [H, W], goal int32 [2] -> int32 [2].

    The nearest of the cells that are nearest within their column: of those above the goal's row
    the last, else the first.

    jnp.argmin over the whole map would be a scalar loop on CPU, for its reduction carries a pair;
    here a scan over rows keeps two rows a column.
    """
    height = reached.shape[0]
    num_columns = width or reached.shape[1]
    # the narrower, the more columns in one step
    dtype = jnp.int16 if height < 2**15 - 1 else jnp.int32
    none = np.array(height, dtype)

    def row_step(best: _Best, row_and_mask: tuple[Array, Array]) -> tuple[_Best, None]:
        row, mask = row_and_mask[0], row_of(row_and_mask[1])
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
