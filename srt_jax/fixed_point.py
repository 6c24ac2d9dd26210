"""Lengths as integers: which fixed point a map takes, and how its sums become float32.

A straight move costs s and a diagonal d, (s, d) a pair of `moves.FIXED_POINTS`. The finest pair is taken with which no shortest
path of the map can pass `MAX_COST`. How long can one be? Tile the map by squares of 2x2 cells from (0, 0).
- A square of four free cells holds at most two cells of a shortest path: from the first to the third of them one move leads,
  not two. Other squares hold no more than their free cells. Let T be the sum: the path has at most T cells.
- A diagonal move has two free cells beside it, and the path visits neither (by the argument above). No free cell stands beside
  two diagonals of the path: two that share an end (N-E, E-S) cost 2 d, while N-cell-S costs 2 s < 2 d; two that do not (N-E,
  S-W, in whatever order and direction) have N and S, or E and W, further apart on the path than 2 s, in the same way.
  So with F free cells there are at most (F - T) / 2 diagonals on a path of T cells, and the length is at most
  s T + (d - s) (F - T) / 2 < s (T + (F - T) / 4), since d < 3 s / 2. Fewer cells, with more diagonals, are shorter still.
Both counts, hence the fixed point, depend on the free cells alone: padding with blocked cells changes no bit.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from srt_jax import moves

MAX_COST = 2**31 - 1 - 2 * moves.FIXED_POINTS[0][1]
"""The longest cost that can be held, a move and the marks above it taken off."""


def pairs(scale: Array) -> tuple[Array, Array]:
    """Returns the costs (straight, diagonal), int32 like `scale`, of the fixed points with these indices."""
    straight, diagonal = np.array(moves.FIXED_POINTS, np.int32).T
    return jnp.asarray(straight)[scale], jnp.asarray(diagonal)[scale]


def finest_scale(free: Array) -> Array | int:
    """Returns the index of the finest fixed point that cannot overflow on a map; an int where its shape alone decides.

    Args:
      free: bool [H, W].

    Returns:
      int32 [], an index into `moves.FIXED_POINTS`.
    """
    height, width = free.shape
    rows, cols = -(-height // 2), -(-width // 2)
    if 3 * rows * cols + 1 <= _LONGEST[0]:  # three free cells in every square: T = F is largest
        return 0
    if 3 * rows * cols + 1 > _LONGEST[-1]:
        most = _LONGEST[-1] // 3 * 4
        raise ValueError(f"a map of {height}x{width} cells is too large for exact lengths: split it, at most {most} cells")
    count = jnp.pad(free, ((0, height % 2), (0, width % 2))).astype(jnp.int32)
    count = count.reshape(rows, 2, cols, 2).sum((1, 3))
    num_free, num_path = count.sum(), jnp.where(count == 4, 2, count).sum()
    longest = num_path + (num_free - num_path) // 4 + 1
    return sum((longest > bound).astype(jnp.int32) for bound in _LONGEST[:-1])


_LONGEST = tuple(MAX_COST // straight for straight, _ in moves.FIXED_POINTS)


def to_length(cost: Array, straight: Array) -> Array:
    """Returns cost / straight as float32: exact where it is whole, else within 0.75 units in the last place.

    For lengths below 2^24; past that float32 has no fraction to hold, and a unit is at stake.

    By long division in integers. A float division, or a product added to a sum, may be rounded otherwise on a GPU or where the
    compiler fuses the two; here every product and all sums but the last are exact, so that no bit depends on it.

    Args:
      cost: int32, 0 <= cost < 2^31, 0 or at least `straight`.
      straight: int32, of the same shape or scalar.

    Returns:
      float32, of the shape of `cost`.
    """
    reciprocal = jnp.float32(1) / straight.astype(jnp.float32)  # only an estimate: _divided puts it right
    whole, rest = _divided(cost, straight, reciprocal)
    high, rest = _divided(rest << 12, straight, reciprocal)  # rest < 5741 < 2^13
    low, rest = _divided(rest << 12, straight, reciprocal)
    low += (2 * rest >= straight).astype(jnp.int32)
    return whole.astype(jnp.float32) + ((high << 12) + low).astype(jnp.float32) * jnp.float32(2.0**-24)


def _divided(value: Array, by: Array, reciprocal: Array) -> tuple[Array, Array]:
    """Quotient and remainder of non-negative int32: an estimate, the estimate of what it left, and at most one unit more."""
    quotient = (value.astype(jnp.float32) * reciprocal).astype(jnp.int32)
    rest = value - quotient * by  # may wrap on the way, but not in the end
    more = (rest.astype(jnp.float32) * reciprocal).astype(jnp.int32)
    rest = rest - more * by
    more = more + (rest >= by).astype(jnp.int32) - (rest < 0).astype(jnp.int32)
    return quotient + more, value - (quotient + more) * by
