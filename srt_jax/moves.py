"""The eight moves, what they cost, the diagonal rule, and octile distance (PY16 §3.2).

A move goes from a free cell to a free neighbour: 1 cell side straight, sqrt 2 diagonally. A
diagonal needs both cells beside it free as well, so that the agent's disc hits no corner. Hence
whatever eight moves reach, the four straight ones reach too.

Costs are added up in fixed point: diagonal : straight is a convergent of sqrt 2, so int32 sums are
exact, independent of their order, and equal bit for bit on every machine.
"""

import jax.numpy as jnp

from srt_jax.types import Array

STRAIGHT_MOVES = ((-1, 0), (0, -1), (0, 1), (1, 0))
DIAGONAL_MOVES = ((-1, -1), (-1, 1), (1, -1), (1, 1))
MOVES = tuple(sorted(STRAIGHT_MOVES + DIAGONAL_MOVES))
"""The eight moves in row order: the order in which ties are broken."""

FIXED_POINTS = (
    (5741, 8119),
    (2378, 3363),
    (985, 1393),
    (408, 577),
    (169, 239),
    (70, 99),
    (29, 41),
    (12, 17),
)
"""Pell's pairs (straight, diagonal), finest first: relative errors 8e-9, 4e-8, 3e-7, 2e-6, 9e-6,
5e-5, 3e-4, 2e-3.
"""


def is_on_map(row: Array, col: Array, height: Array | int, width: Array | int) -> Array:
    """Returns whether cells lie on a map of this size: bool, of the shapes broadcast."""
    return (row >= 0) & (row < height) & (col >= 0) & (col < width)


def max_path_cells(height: int, width: int) -> int:
    """Returns a number of cells that no shortest path on a map of this size exceeds.

    Of four cells that form a square a shortest path holds at most three: were all four free, one
    move would lead from the first of them on the path to the last. The squares that tile the map
    give the bound.
    """
    return min(height * width, 3 * (-(-height // 2)) * (-(-width // 2)))


def octile_distance(cell: Array, goal: Array) -> Array:
    """Returns the length of a shortest path from `cell` to `goal` on an empty map, in cell sides:
    the heuristic h.

    Args:
      cell, goal: int32 [..., 2], (row, col); batch dimensions broadcast.

    Returns:
      float32 [...].
    """
    apart = jnp.abs(jnp.asarray(cell, jnp.int32) - jnp.asarray(goal, jnp.int32))
    long, short = apart.max(axis=-1), apart.min(axis=-1)
    return (long - short).astype(jnp.float32) + short.astype(jnp.float32) * jnp.float32(2**0.5)


def octile_order(down: Array, across: Array) -> Array:
    """Returns an int32 by which cells are ordered as by their octile distance, from rows and
    columns apart: int32 each.

    In the finest fixed point, whose order is that of sqrt 2 on maps of up to 5741 cells a side,
    since no fraction with a smaller denominator is nearer. At most 2 ** 26 on maps of 8192.
    """
    straight, diagonal = FIXED_POINTS[0]
    down, across = jnp.abs(down), jnp.abs(across)
    return jnp.maximum(down, across) * straight + jnp.minimum(down, across) * (diagonal - straight)
