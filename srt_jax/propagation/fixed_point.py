"""Lengths as integers: which fixed point a map takes, and how its sums become float32.

A straight move costs s and a diagonal d, (s, d) a pair of `moves.FIXED_POINTS`. The finest pair is
taken with which no shortest path of the map can pass `MAX_COST`. How long can one be? Tile the map
by squares of 2x2 cells from (0, 0).
- A square of four free cells holds at most two cells of a shortest path: from the first to the
  third of them one move leads, not two. Other squares hold no more than their free cells. Let T be
  the sum: the path has at most T cells.
- A diagonal move has two free cells beside it, and the path visits neither (by the argument above).
  No free cell stands beside two diagonals of the path: two that share an end (N-E, E-S) cost 2 d,
  while N-cell-S costs 2 s < 2 d; two that do not (N-E, S-W, in whatever order and direction) have N
  and S, or E and W, further apart on the path than 2 s, in the same way. So with F free cells there
  are at most (F - T) / 2 diagonals on a path of T cells, and the length is at most s T + (d - s) (F
  - T) / 2 < s (T + (F - T) / 4), since d < 3 s / 2. Fewer cells, with more diagonals, are shorter
  still.
Both counts, hence the fixed point, depend on the free cells alone: padding with blocked cells
changes no bit.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from srt_jax import moves
from srt_jax.types import Array

MAX_COST = 2**31 - 1 - 2 * moves.FIXED_POINTS[0][1]
"""The longest cost that can be held, a move and the marks above it taken off."""


def pairs(scale: Array) -> tuple[Array, Array]:
    """Returns the costs (straight, diagonal), int32 like `scale`, of the fixed points with these
    indices.
    """
    straight, diagonal = np.array(moves.FIXED_POINTS, np.int32).T
    return jnp.asarray(straight)[scale], jnp.asarray(diagonal)[scale]


def scale_by_shape(height: int, width: int) -> int | None:
    """Returns the index of the fixed point that all maps of a shape take; None where the map
    decides.
    """
    return 0 if _is_finest_always(height, width) else None


def finest_scale(free: Array) -> Array | int:
    """Returns the index of the finest fixed point that cannot overflow on a map; an int where its
    shape alone decides.

    Args:
      free: bool [H, W].

    Returns:
      int32 [], an index into `moves.FIXED_POINTS`.
    """
    height, width = free.shape
    rows, cols = -(-height // 2), -(-width // 2)
    if _is_finest_always(height, width):
        return 0
    count = jnp.pad(free, ((0, height % 2), (0, width % 2))).astype(jnp.int32)
    count = count.reshape(rows, 2, cols, 2).sum((1, 3), dtype=jnp.int32)
    num_free, num_path = (
        count.sum(dtype=jnp.int32),
        jnp.where(count == 4, 2, count).sum(dtype=jnp.int32),
    )
    return _finest_of(num_free, num_path)


def finest_scale_of_words(free: Array, width: int) -> Array | int:
    """Returns `finest_scale` of a packed map: uint32 [H, words], of W columns."""
    if _is_finest_always(free.shape[0], width):
        return 0
    num_free, num_squares = _counts(free)
    return _finest_of(num_free, num_free - 2 * num_squares)


def finest_scale_within(free: Array, width: int) -> Array | int:
    """Returns the finest fixed point that cannot overflow on any map whose free cells are among
    these, as `finest_scale_of_words`: a square of four may lose one, which makes three of two.
    """
    if _is_finest_always(free.shape[0], width):
        return 0
    num_free, num_squares = _counts(free)
    return _finest_of(num_free - num_squares, num_free - num_squares)


def _counts(free: Array) -> tuple[Array, Array]:
    """The free cells of a packed map, and its squares of four that are free: int32 [] each."""
    squares = jnp.pad(free, ((0, free.shape[0] % 2), (0, 0)))
    squares = squares[::2] & squares[1::2]
    # the even bits: columns 2 i and 2 i + 1, both rows
    squares = squares & (squares >> jnp.uint32(1)) & jnp.uint32(0x55555555)
    num_free, num_squares = (
        lax.population_count(words).astype(jnp.int32).sum(dtype=jnp.int32)
        for words in (free, squares)
    )
    return num_free, num_squares


def _is_finest_always(height: int, width: int) -> bool:
    """Whether the shape alone decides, since three free cells in every square make T = F largest.

    ValueError where not even the coarsest fixed point is sure to hold.
    """
    longest = 3 * (-(-height // 2)) * (-(-width // 2)) + 1
    if longest > _LONGEST[-1]:
        most = _LONGEST[-1] // 3 * 4
        raise ValueError(
            f"a map of {height}x{width} cells is too large for exact lengths: split it, at most"
            f" {most} cells"
        )
    return longest <= _LONGEST[0]


def _finest_of(num_free: Array, num_path: Array) -> Array:
    """F and T, int32 [] each."""
    longest = num_path + (num_free - num_path) // 4 + 1
    return sum((longest > bound).astype(jnp.int32) for bound in _LONGEST[:-1])


_LONGEST = tuple(MAX_COST // straight for straight, _ in moves.FIXED_POINTS)


def length_where(is_there: Array, cost: Array, scale: Array) -> Array:
    """Returns `to_length`, inf where `is_there` is False and `cost` has no meaning."""
    return jnp.where(is_there, to_length(jnp.where(is_there, cost, 0), scale), jnp.inf)


def to_length(cost: Array, scale: Array | int) -> Array:
    """Returns a cost as float32, in cell sides: exact where that is whole, else within 1.5 units in
    the last place.

    For lengths below 2^24; past that float32 has no fraction to hold. A float division, or a
    product added to a sum, may be rounded otherwise on a GPU or where the compiler fuses the two.
    So the whole part comes from integers, and the fraction passes through an integer: no bit
    depends on the machine.

    Args:
      cost: int32, not negative.
      scale: index into `moves.FIXED_POINTS`, int32 that broadcasts with `cost`, or an int.

    Returns:
      float32, of the shape of `cost`.
    """
    is_known = isinstance(scale, int)
    # of many cells found once, not for each again
    find = apart(_reciprocals) if not is_known and cost.ndim > scale.ndim else _reciprocals
    straight, reciprocal, parts = find(scale)
    # an estimate, off by a few dozen at most
    whole = (cost.astype(jnp.float32) * reciprocal).astype(jnp.int32)
    if not is_known:  # the finest scale, the one known beforehand, has small quotients: off by one
        whole = whole + ((cost - whole * straight).astype(jnp.float32) * reciprocal).astype(
            jnp.int32
        )
    rest = cost - whole * straight
    whole = whole + (rest >= straight).astype(jnp.int32) - (rest < 0).astype(jnp.int32)
    rest = cost - whole * straight
    fraction = (rest.astype(jnp.float32) * parts).astype(jnp.int32)  # in units of 2^-24
    return whole.astype(jnp.float32) + fraction.astype(jnp.float32) * jnp.float32(2.0**-24)


def _reciprocals(scale: Array | int) -> tuple[Array | int, Array, Array]:
    """A straight move's cost, and by what to multiply for cell sides, and for 2^-24 of them."""
    tables = (
        np.array([straight for straight, _ in moves.FIXED_POINTS]) / np.array([[1], [2.0**24]])
    ) ** -1
    whole_by, parts_by = tables.astype(np.float32)
    if isinstance(scale, int):
        return moves.FIXED_POINTS[scale][0], whole_by[scale], parts_by[scale]
    return pairs(scale)[0], jnp.asarray(whole_by)[scale], jnp.asarray(parts_by)[scale]
