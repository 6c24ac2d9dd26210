"""Obstacles and the cells they cover: which cells open when obstacles go, which obstacles a set of cells meets.

All functions take one leading batch axis B; H x W cells, L layers of labels, M obstacles.
"""

import jax.numpy as jnp
from jax import lax

from srt_jax.kernel import compiled_whole, each
from srt_jax.types import FREE, OUTSIDE, Array


def free_cells(labels: Array) -> Array:
    """Returns the cells no obstacle covers: int32 [B, L, H, W] -> bool [B, H, W]."""
    return (labels == FREE).all(axis=1)


def inside_cells(labels: Array) -> Array:
    """Returns the cells that belong to the map, not to its padding: int32 [B, L, H, W] -> bool [B, H, W]."""
    return (labels != OUTSIDE).all(axis=1)


def open_cells(labels: Array, gone: Array) -> Array:
    """Returns the cells that are free once the obstacles `gone` (bool [B, M]) are: bool [B, H, W].

    A cell that several obstacles cover opens when all of them are gone.
    """
    return ((labels == FREE) | _of_obstacle(labels, gone)).all(axis=1)


def cells_of(labels: Array, which: Array) -> Array:
    """Returns the cells that at least one of the obstacles `which` (bool [B, M]) covers: bool [B, H, W]."""
    return _of_obstacle(labels, which).any(axis=1)


def met_by(labels: Array, cells: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover at least one of `cells` (bool [B, H, W]): bool [B, M]."""
    if num_obstacles > _MOST_IN_WORDS:
        ids = jnp.where(cells[:, None] & (labels >= 0), labels, num_obstacles)  # past the end: dropped
        batch = jnp.arange(len(labels), dtype=jnp.int32)[:, None]
        return jnp.zeros((len(labels), num_obstacles), bool).at[batch, ids.reshape(len(labels), -1)].set(True, mode="drop")
    words = _met_words(labels, cells, -(-num_obstacles // _WORD))
    ids = jnp.arange(num_obstacles, dtype=jnp.uint32)
    return (words[:, ids // _WORD] >> (ids % _WORD)[None]) & jnp.uint32(1) != 0


_WORD = 32
_MOST_IN_WORDS = 512
"""Obstacles up to which sets of them as bits of words, per column of the map, are faster than a scatter (25 times for 32)."""


def _met_words(labels: Array, cells: Array, num_words: int) -> Array:
    """Returns the obstacles met as bits, uint32 [B, words]: row after row, words for every column, ORed at the end."""
    B, L, H, W = labels.shape

    def all_maps(labels: Array, cells: Array) -> Array:
        def row_step(row: Array, met: tuple) -> tuple:
            batch, *words = met
            ids = lax.dynamic_slice(labels, (batch, row // H, row % H, 0), (1, 1, 1, W)).reshape(W)
            asked = lax.dynamic_slice(cells, (batch, row % H, 0), (1, 1, W)).reshape(W)
            bit = jnp.where(asked & (ids >= 0), jnp.uint32(1) << (ids % _WORD).astype(jnp.uint32), jnp.uint32(0))
            return batch, *(word | jnp.where(ids // _WORD == k, bit, jnp.uint32(0)) for k, word in enumerate(words))

        def one_map(batch: Array) -> Array:
            none = [jnp.zeros(W, jnp.uint32)] * num_words
            _, *words = lax.fori_loop(0, L * H, row_step, (batch, *none))
            return jnp.stack([lax.reduce(word, jnp.uint32(0), lax.bitwise_or, (0,)) for word in words])

        return each(one_map, jnp.arange(B, dtype=jnp.int32))

    return compiled_whole(all_maps)(labels, cells)


def owners_at(labels: Array, cell: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover `cell` (int32 [B, 2]): bool [B, M]; none where it lies outside the array."""
    _, _, H, W = labels.shape
    row, col = cell[:, 0], cell[:, 1]
    is_inside = (row >= 0) & (row < H) & (col >= 0) & (col < W)
    batch = jnp.arange(labels.shape[0], dtype=jnp.int32)
    owners = labels[batch, :, row.clip(0, H - 1), col.clip(0, W - 1)]  # [B, L]
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)
    return (owners[:, :, None] == ids[None, None, :]).any(axis=1) & is_inside[:, None]


def opens_at(labels: Array, cell: Array, gone: Array) -> Array:
    """Returns whether `cell` (int32 [B, 2]) is on the map and free once the obstacles `gone` (bool [B, M]) are: bool [B]."""
    _, _, H, W = labels.shape
    row, col = cell[:, 0], cell[:, 1]
    is_inside = (row >= 0) & (row < H) & (col >= 0) & (col < W)
    owners = labels[jnp.arange(len(labels), dtype=jnp.int32), :, row.clip(0, H - 1), col.clip(0, W - 1)]  # [B, L]
    is_open = (owners == FREE) | (jnp.take_along_axis(gone, owners.clip(0), axis=1) & (owners >= 0))
    return is_open.all(axis=1) & is_inside


def value_at(mask: Array, cell: Array) -> Array:
    """Returns the entry of `mask` [B, H, W] at `cell` (int32 [B, 2]): [B]; False where the cell lies outside the array."""
    _, H, W = mask.shape
    row, col = cell[:, 0], cell[:, 1]
    is_inside = (row >= 0) & (row < H) & (col >= 0) & (col < W)
    return mask[jnp.arange(mask.shape[0], dtype=jnp.int32), row.clip(0, H - 1), col.clip(0, W - 1)] & is_inside


def only_cell(cell: Array, height: int, width: int) -> Array:
    """Returns the mask of `cell` (int32 [B, 2]) alone: bool [B, H, W], empty where it lies outside."""
    rows = jnp.arange(height, dtype=jnp.int32)[None, :, None] == cell[:, 0, None, None]
    cols = jnp.arange(width, dtype=jnp.int32)[None, None, :] == cell[:, 1, None, None]
    return rows & cols


def beside(cells: Array) -> Array:
    """Returns `cells` (bool [B, H, W]) and their neighbours by a side."""
    return _spread(cells, 1) | _spread(cells, 2)


def around(cells: Array) -> Array:
    """Returns `cells` (bool [B, H, W]) and their neighbours by a side or a corner."""
    return _spread(_spread(cells, 1), 2)


def _spread(cells: Array, axis: int) -> Array:
    padding = [(0, 0)] * 3
    padding[axis] = (1, 1)
    wide = jnp.pad(cells, padding)
    length = cells.shape[axis]
    return cells | lax.slice_in_dim(wide, 0, length, axis=axis) | lax.slice_in_dim(wide, 2, length + 2, axis=axis)


def _of_obstacle(labels: Array, which: Array) -> Array:
    """Returns `which` (bool [B, M]) looked up by label: bool [B, L, H, W], False where no obstacle is."""
    B = labels.shape[0]
    ids = labels.clip(0).reshape(B, -1)
    return jnp.take_along_axis(which, ids, axis=1).reshape(labels.shape) & (labels >= 0)
