"""The contour of the obstacle that stops the search, seen from the seed (PY16 §3.2)."""

import jax.numpy as jnp
import numpy as np
from jax import Array

from srt_jax import bucketed, packing, shapes
from srt_jax import types as records
from srt_jax.kernel import batch_kernel
from srt_jax.reach import flood_words, reach_words


def contour(free: records.Array, seed: records.Array, goal: records.Array) -> Array:
    """Returns the cells around the obstacle ahead of `seed`; all False where nothing is ahead.

    The obstacle is the 8-connected piece of blocked cells that owns the blocked cell on the greedy octile step from `seed`
    towards `goal`: this piece alone cuts the goal off. Its contour is the free cells that touch it by side or corner and
    that can be reached from `seed` (PY16 §3.2). All False where `seed` is (-1, -1), blocked, or equal to `goal`, or where the
    step is open.

    Args:
      free: bool [..., H, W], True where the agent fits.
      seed: int32 [..., 2], (row, col), from `seed_cell`.
      goal: int32 [..., 2], (row, col).

    Returns:
      bool [..., H, W].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.
    """
    free = shapes.as_mask("free", free)
    seed, goal = shapes.as_cells("seed", seed), shapes.as_cells("goal", goal)
    batch = shapes.common_batch(free=(free, 2), seed=(seed, 1), goal=(goal, 1))
    size = np.broadcast_to(np.array(free.shape[-2:], np.int32), (*batch, 2))  # padding is no obstacle
    return bucketed.call(_contour_maps, batch, free, seed, goal, size)


@batch_kernel
def _contour_maps(free: Array, seed: Array, goal: Array, size: Array) -> Array:
    _, height, width = free.shape
    free_words = packing.pack(free)
    blocked = packing.words_inside(size, height, width) & ~free_words
    ahead = packing.words_of_cell(obstacle_ahead(free, seed, goal, size=size), height, width)
    near = around(flood_words(blocked, ahead, through_corners=True))
    return packing.unpack(near & reach_words(free_words, seed, width=width), width)


def around(words: Array) -> Array:
    """The cells of each mask, uint32 [B, H, words], and all that touch them by side or corner."""
    one, top = jnp.uint32(1), jnp.uint32(31)
    guarded = jnp.pad(words, ((0, 0), (0, 0), (1, 1)))
    wide = words | (words << one) | (words >> one) | (guarded[:, :, :-2] >> top) | (guarded[:, :, 2:] << top)
    wide = jnp.pad(wide, ((0, 0), (1, 1), (0, 0)))
    return wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]


def obstacle_ahead(free: Array, seed: Array, goal: Array, *, size: Array | None = None) -> Array:
    """Returns the blocked cell on the greedy octile step from `seed` towards `goal`; (-1, -1) where the step is open.

    The step is diagonal while the goal lies off both axes. The diagonal cell if that is blocked, else the cell beside it in the
    goal's row direction, else the other: blocked cells among them belong to one 8-connected piece if the diagonal one does.

    Args:
      free: bool [B, H, W].
      seed, goal: int32 [B, 2], (row, col).
      size: int32 [B, 2], height and width before padding; beyond lies no obstacle. Default: the maps are not padded.

    Returns:
      int32 [B, 2]; (-1, -1) also where `seed` is no free cell of the map.
    """
    if size is None:
        size = jnp.broadcast_to(jnp.array(free.shape[1:], jnp.int32)[None], seed.shape)
    towards = jnp.sign(goal - seed)
    beside = [jnp.stack([seed[:, 0] + towards[:, 0], seed[:, 1]], 1), jnp.stack([seed[:, 0], seed[:, 1] + towards[:, 1]], 1)]
    answer = jnp.full_like(seed, -1)
    for cell in (beside[1], beside[0], seed + towards):  # the first choice is written last
        answer = jnp.where((_value(free, cell, size) == 0)[:, None], cell, answer)
    return jnp.where((_value(free, seed, size) == 1)[:, None], answer, -1)


def _value(free: Array, cell: Array, size: Array) -> Array:
    """int32 [B]: 1 where the cell is free, 0 where it is blocked, -1 outside the map."""
    batch, height, width = free.shape
    inside = jnp.all((cell >= 0) & (cell < size), axis=1)
    value = free[jnp.arange(batch), jnp.clip(cell[:, 0], 0, height - 1), jnp.clip(cell[:, 1], 0, width - 1)]
    return jnp.where(inside, value.astype(jnp.int32), -1)
