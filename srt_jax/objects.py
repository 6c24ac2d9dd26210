"""Single cells and the obstacles that cover them (`obstacles` does the same for masks of cells).

All functions take one leading batch axis B; H x W cells, L layers of labels, M obstacles.
"""

import jax.numpy as jnp

from srt_jax.types import FREE, Array


def owners_at(labels: Array, cell: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover `cell` (int32 [B, 2]): bool [B, M]; none where it lies
    outside the array.
    """
    owners, is_inside = _at(jnp.moveaxis(labels, 1, -1), cell)  # [B, L]
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)
    return (owners[:, :, None] == ids[None, None, :]).any(axis=1) & is_inside[:, None]


def opens_at(labels: Array, cell: Array, gone: Array) -> Array:
    """Returns whether `cell` (int32 [B, 2]) is on the map and free once the obstacles `gone`
    (bool [B, M]) are: bool [B].
    """
    owners, is_inside = _at(jnp.moveaxis(labels, 1, -1), cell)  # [B, L]
    is_open = (owners == FREE) | (jnp.take_along_axis(gone, owners.clip(0), axis=1) & (owners >= 0))
    return is_open.all(axis=1) & is_inside


def _at(array: Array, cell: Array) -> tuple[Array, Array]:
    """Returns the entry of `array` [B, H, W, ...] at `cell`, or the nearest it has, and whether
    it has `cell` (bool [B]).
    """
    _, H, W = array.shape[:3]
    row, col = cell[:, 0], cell[:, 1]
    is_inside = (row >= 0) & (row < H) & (col >= 0) & (col < W)
    return array[
        jnp.arange(array.shape[0], dtype=jnp.int32), row.clip(0, H - 1), col.clip(0, W - 1)
    ], is_inside
