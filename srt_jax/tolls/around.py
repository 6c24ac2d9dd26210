"""What each cell of a map sees around it, as bits: whether a move from it may pay, and what speaks
against its obstacle being a rectangle.

Row by row: there XLA:CPU reads neighbours as slices of rows, ten times as fast as over a whole map.
"""

import functools

import jax.numpy as jnp
from jax import lax

from srt_jax.types import OUTSIDE, Array

EVEN = 1
"""The cell and all round it have the same labels, so no move from it pays."""

SHARED = 2
"""Several obstacles cover the cell."""

CORNER = 4
"""The cell is an upper left corner of the obstacle that alone covers it."""

BENT = 8
"""The cell belongs to a square of four of which its obstacle has three, or two that touch by the
corner alone; without such squares every piece of an obstacle is a rectangle."""


def seen_around(layers: Array) -> Array:
    """Returns the bits of each cell: uint8 [rows, columns].

    Args:
      layers: int32 [L, rows, columns], no cell with one label in two layers, with a border
        that is OUTSIDE.
    """
    num_layers, height, width = layers.shape
    wide = jnp.pad(layers, ((0, 0), (1, 1), (1, 1)), constant_values=OUTSIDE)

    def bits_of_row(row: Array) -> Array:
        zero = jnp.int32(0)
        rows = lax.dynamic_slice(wide, (zero, row, zero), (num_layers, 3, width + 2))
        cells = {
            (down, right): rows[:, 1 + down, 1 + right : 1 + right + width]
            for down in (-1, 0, 1)
            for right in (-1, 0, 1)
        }
        here = cells[0, 0]
        same = [(other == here).all(axis=0) for step, other in cells.items() if step != (0, 0)]
        is_even = functools.reduce(jnp.logical_and, same)
        is_shared = (here != -1).sum(axis=0, dtype=jnp.int32) > 1
        sole = {step: _sole(own) for step, own in cells.items()}
        own = sole[0, 0]
        is_corner = (own >= 0) & (sole[-1, 0] != own) & (sole[0, -1] != own)
        # The squares of which the cell is the upper left and the upper right one.
        is_bent = functools.reduce(
            jnp.logical_or,
            [
                (sole[1, side] == own) & ((sole[0, side] != own) | (sole[1, 0] != own))
                for side in (1, -1)
            ],
        )
        is_bent = is_bent & (own >= 0)
        flags = ((is_even, EVEN), (is_shared, SHARED), (is_corner, CORNER), (is_bent, BENT))
        bits = [jnp.where(flag, jnp.uint8(bit), jnp.uint8(0)) for flag, bit in flags]
        return functools.reduce(jnp.bitwise_or, bits)

    return lax.map(bits_of_row, jnp.arange(height, dtype=jnp.int32))


def _sole(labels: Array) -> Array:
    """The obstacle that alone covers each cell, else -1: [L, W] -> [W]."""
    if labels.shape[0] == 1:
        return labels[0]
    num = (labels != -1).sum(axis=0, dtype=jnp.int32)
    return jnp.where(num == 1, labels.max(axis=0), -1)
