"""What a move pays at the door: the tolls of the obstacles that it needs gone and that the cell
left does not lie in.

A move needs every owner of the cell entered gone, and on a diagonal the owners of both cells beside
it: that is the library's rule for an obstacle destroyed. So whoever walks inside an obstacle has
paid for it, whoever leaves it and comes back pays again, and whoever cuts its corner pays without
being in it. Numbers are whole: tolls in the units of the map's fixed point
(`propagation.fixed_point`).
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.moves import FIXED_POINTS, MOVES
from srt_jax.types import FREE, OUTSIDE, Array

CLOSED = 2**31 - 2**14
"""The toll of what may not be entered, and more than any sum that can be held: `CLOSED`, another
toll and a move still fit into 32 bits."""

BESIDE = tuple(
    tuple((down, right) for down, right in ((a, 0), (0, b)) if a and b) for a, b in MOVES
)
"""For each of MOVES the steps from its first cell to the two cells beside it; none of a straight
one."""


def around(down: int, right: int) -> int:
    """Returns the place of a neighbour among the nine cells of a square, in row order."""
    return 3 * (down + 1) + right + 1


def in_units(toll: Array, straight: Array) -> Array:
    """Returns tolls in cell sides, float32, as whole numbers of the fixed point, uint32: to the
    nearest, `CLOSED` where that is too dear to be held, or not a number.
    """
    units = jnp.round(jnp.maximum(toll, 0) * straight.astype(jnp.float32))
    is_held = units < CLOSED
    return jnp.where(is_held, jnp.where(is_held, units, 0).astype(jnp.uint32), jnp.uint32(CLOSED))


def with_ends(tolls: Array) -> Array:
    """Returns the tolls of M obstacles, uint32 [M], such that entry `label + 2` is that of a label:
    `CLOSED` of OUTSIDE, 0 of FREE.
    """
    assert (OUTSIDE, FREE) == (-2, -1)
    ends = jnp.array(np.array([CLOSED, 0], np.uint32))
    return jnp.concatenate([ends, tolls])


def of_move(labels: Array, tolls: Array, here: int, move: int, *, is_back: bool = False) -> Array:
    """Returns what `MOVES[move]` pays from the cell `here` of nine, or with `is_back` from the
    neighbour in that direction to it.

    Args:
      labels: int32 [9, L, ...], of a square of cells in row order. No cell has one label in two
        layers. tolls: uint32 [9, L, ...], of these.

    Returns:
      uint32 [...], no more than `CLOSED`.
    """
    down, right = MOVES[move]
    far = around(down, right)
    source, target = (far, here) if is_back else (here, far)
    entered = [target, *(around(*step) for step in BESIDE[move])]
    known, low, high = [source], jnp.uint32(0), jnp.uint32(0)
    for cell in entered:
        is_new = ~_is_among(labels[cell], [labels[other] for other in known])
        toll = jnp.where(is_new, tolls[cell], jnp.uint32(0))
        low = low + jnp.sum(toll & jnp.uint32(0xFFFF), axis=0, dtype=jnp.uint32)
        high = high + jnp.sum(toll >> jnp.uint32(16), axis=0, dtype=jnp.uint32)
        known.append(cell)
    return joined(low, high)


def sum_of_move(labels: Array, values: Array, move: int) -> Array:
    """Returns the sum of `values` over what `MOVES[move]` pays for from the middle one of nine
    cells, as in `of_move`: linear in them.

    Args:
      labels: int32 [9, L, ...]. values: float32 [9, L, ...], of these.

    Returns:
      float32 [...].
    """
    target = around(*MOVES[move])
    known, total = [labels[4]], jnp.float32(0)
    for cell in [target, *(around(*step) for step in BESIDE[move])]:
        is_new = ~_is_among(labels[cell], known)
        for layer in range(labels.shape[1]):
            total = total + jnp.where(is_new[layer], values[cell, layer], jnp.float32(0))
        known.append(labels[cell])
    return jnp.broadcast_to(total, labels.shape[2:])


def joined(low: Array, high: Array) -> Array:
    """Returns a sum whose lower 16 bits and upper ones were added up apart, at most `CLOSED`."""
    high = high + (low >> jnp.uint32(16))
    whole = (high << jnp.uint32(16)) | (low & jnp.uint32(0xFFFF))
    return jnp.where(high >> jnp.uint32(15) != 0, jnp.uint32(CLOSED), jnp.minimum(whole, CLOSED))


def total(tolls: Array, which: Array) -> Array:
    """Returns the sum of the tolls `which`, uint32 [M] and bool [M], at most `CLOSED`; M < 2^16."""
    toll = jnp.where(which, tolls, jnp.uint32(0))
    low = jnp.sum(toll & jnp.uint32(0xFFFF), dtype=jnp.uint32)
    return joined(low, jnp.sum(toll >> jnp.uint32(16), dtype=jnp.uint32))


def _is_among(labels: Array, others: list[Array]) -> Array:
    """Whether each label of a cell is one of other cells': [L, ...] each."""
    if labels.shape[0] == 1:
        found = [labels == other for other in others]
    else:
        found = [jnp.any(labels[:, None] == other[None], axis=1) for other in others]
    return sum(found[1:], found[0])


def lengths_of_moves(straight: Array, diagonal: Array) -> Array:
    """Returns the length of each of MOVES: uint32 [8]."""
    is_diagonal = jnp.array(np.array([bool(a and b) for a, b in MOVES]))
    return jnp.where(is_diagonal, diagonal, straight)


def bucket_bits(diagonal: Array) -> Array:
    """Returns the least number of bits, uint32, such that no move is longer than a bucket."""
    assert all(diagonal < 2**13 for _, diagonal in FIXED_POINTS)
    return (32 - lax.clz(diagonal.astype(jnp.int32))).astype(jnp.uint32)
