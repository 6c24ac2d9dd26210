"""The contour of the obstacle that stops the search, seen from the seed (PY16 §3.2)."""

import functools
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.moves import is_on_map
from srt_jax.paths.reach import cells_in_group, flood_group
from srt_jax.types import Array


def contour(free: Array, seed: Array, goal: Array) -> Array:
    """Returns the cells around the obstacle ahead of `seed`; all False where nothing is ahead.

    The obstacle is the 8-connected piece of blocked cells that owns the blocked cell on the greedy
    octile step from `seed` towards `goal`: this piece alone cuts the goal off. Its contour is the
    free cells that touch it by side or corner and that can be reached from `seed` (PY16 §3.2). All
    False where `seed` is (-1, -1), blocked, or equal to `goal`, or where the step is open.

    Memory besides argument and result: 0.3 bytes a cell of a batch of hundreds, up to 2.5 of a
    small one.

    Args:
      free: bool [..., H, W], True where the agent fits.
      seed: int32 [..., 2], (row, col), from `seed_cell`.
      goal: int32 [..., 2], (row, col).

    Returns:
      bool [..., H, W].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> seed = srt_jax.seed_cell(srt_jax.reach(free, (2, 0)), (2, 6))
      >>> np.argwhere(srt_jax.contour(free, seed, (2, 6))).tolist()
      [[0, 2], [1, 2], [2, 2], [3, 2], [4, 2]]
    """
    (free, seed, goal), batch = arguments.mask_and_cells(free=free, seed=seed, goal=goal)
    # given before padding, since padding is no obstacle
    size = np.broadcast_to(np.array(free.shape[-2:], np.int32), (*batch, 2))
    return eager.call(_contour_maps, batch, free, seed, goal, size, on_quads=_contour_quads)


@batch_kernel
def _contour_maps(free: Array, seed: Array, goal: Array, size: Array) -> Array:
    batch, height, width = free.shape
    group = packing.group_size(batch, height, width)
    cells = [obstacle_ahead(free, seed, goal, size=size), seed, size]
    cells = [jnp.pad(cell, ((0, -batch % group), (0, 0)), constant_values=-1) for cell in cells]
    lanes = _contour_lanes(packing.to_lanes(packing.pack(free), group), *cells, group=group)
    return packing.unpack(packing.from_lanes(lanes, group, batch), width)


def _contour_quads(free: Array, seed: Array, goal: Array, size: Array) -> Array:
    """`contour` of masks as quads (`packing`); B a power of two."""
    batch, height, count = free.shape
    group = packing.group_size(batch, height, 4 * count)

    def value(row: Array, col: Array) -> Array:
        quad = free[jnp.arange(batch, dtype=jnp.int32)[None], row, col // 4]
        return ((quad >> (8 * (col % 4)).astype(jnp.uint32)) & jnp.uint32(1)).astype(jnp.int32)

    ahead = _ahead(value, (height, 4 * count), seed, goal, size)
    lanes = _contour_lanes(packing.quads_to_lanes(free, group), ahead, seed, size, group=group)
    return packing.unpack(packing.from_lanes(lanes, group, batch), 4 * count)


def _contour_lanes(free: Array, ahead: Array, seed: Array, size: Array, *, group: int) -> Array:
    """The contours of masks in lanes, in lanes; the cells and sizes int32 [B, 2]."""
    cells = [cell.reshape(-1, group, 2) for cell in (ahead, seed, size)]
    return compiled_whole(functools.partial(each, _contour_group))(free, *cells)


def _contour_group(free: Array, ahead: Array, seed: Array, size: Array) -> Array:
    """The contours of one group in lanes, uint32 [H, lanes]; the cells and sizes int32 [group,
    2].
    """
    height, lanes = free.shape
    group = size.shape[0]
    # blocked cells inside each map: padding is no obstacle
    columns = packing.bits_inside(size[:, 1], lanes // group).T.reshape(1, -1)
    tall = jnp.tile(size[:, 0], lanes // group)[None]
    rows = jnp.arange(height, dtype=jnp.int32)[:, None]
    blocked = jnp.where(rows < tall, columns, jnp.uint32(0)) & ~free
    # the obstacle ahead, the region of the seed, and where the two touch
    obstacle = flood_group(
        blocked, cells_in_group(blocked, ahead), group=group, through_corners=True
    )
    side = flood_group(free, cells_in_group(free, seed), group=group, through_corners=False)
    return packing.dilate(obstacle, group) & side


def obstacle_ahead(free: Array, seed: Array, goal: Array, *, size: Array | None = None) -> Array:
    """Returns the blocked cell on the greedy octile step from `seed` towards `goal`; (-1, -1) where
    the step is open.

    The step is diagonal while the goal lies off both axes. The diagonal cell if that is blocked,
    else the cell beside it in the goal's row direction, else the other: blocked cells among them
    belong to one 8-connected piece if the diagonal one does.

    Args:
      free: bool [B, H, W].
      seed, goal: int32 [B, 2], (row, col).
      size: int32 [B, 2], height and width before padding; beyond lies no obstacle. Default: the
        maps are not padded.

    Returns:
      int32 [B, 2]; (-1, -1) also where `seed` is no free cell of the map.
    """
    batch, height, width = free.shape
    if size is None:
        size = jnp.broadcast_to(jnp.array((height, width), jnp.int32)[None], seed.shape)
    which = jnp.arange(batch, dtype=jnp.int32)[None]
    return _ahead(
        lambda row, col: free[which, row, col].astype(jnp.int32), (height, width), seed, goal, size
    )


def ahead_in_words(free: Array, seed: Array, goal: Array, size: Array, width: int) -> Array:
    """Returns `obstacle_ahead` of one map from packed rows, uint32 [H, words]; the cells and the
    size int32 [2].
    """

    def value(row: Array, col: Array) -> Array:
        word = free[row, col >> 5]
        return (word >> (col & 31).astype(jnp.uint32)).astype(jnp.int32) & 1

    ends = (seed[None], goal[None], size[None])
    return _ahead(value, (free.shape[0], width), *ends)[0]


def _ahead(value: Callable, sides: tuple[int, int], seed: Array, goal: Array, size: Array) -> Array:
    """`obstacle_ahead`, with value(row, col) -> int32 [4, B], 1 where these cells of each map are
    free, else 0.
    """

    # the cells of the greedy step: the seed; diagonal, in the goal's row direction, in its column's
    towards = jnp.sign(goal - seed)
    moves = np.array([[0, 0], [1, 1], [1, 0], [0, 1]], np.int32)
    cells = seed[None] + moves[:, None] * towards[None]  # [4, B, 2]

    # of each of them: 1 where it is free, 0 where it is blocked, -1 outside the map
    row, col = cells[..., 0], cells[..., 1]
    inside = is_on_map(row, col, size[None, :, 0], size[None, :, 1])
    free = value(jnp.clip(row, 0, sides[0] - 1), jnp.clip(col, 0, sides[1] - 1))
    content = jnp.where(inside, free, -1)

    answer = jnp.full_like(seed, -1)
    for i in (3, 2, 1):  # the first choice is written last
        answer = jnp.where((content[i] == 0)[:, None], cells[i], answer)
    return jnp.where((content[0] == 1)[:, None], answer, -1)
