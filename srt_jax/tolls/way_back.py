"""Back from the goal along least sums: which obstacles a least way needs gone, and its length.

Of the cells before, it is the first of MOVES in row order from which a least way comes, so the way
is one and the same wherever it is looked for.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import read, write
from srt_jax.moves import MOVES
from srt_jax.tolls import entry
from srt_jax.tolls.spread import UNREACHED, Ground, Size, square, tolls_at
from srt_jax.types import Array


class WayBack(NamedTuple):
    """needed: bool [M]. length: uint32 [], in units."""

    needed: Array
    length: Array


class _Walk(NamedTuple):
    """cell: uint32 []; needed: uint32 [M + 1], the last of no obstacle; length: uint32 []."""

    cell: Array
    needed: Array
    length: Array


def way_back(
    ground: Ground, tolls: Array, sums: Array, goal: Array, size: Size, num_obstacles: int
) -> WayBack:
    """Returns what a least way to `goal` needs; nothing where it is not reached.

    Args:
      tolls, sums: as in `spread`. goal: uint32 [], a place, 0 for none.
    """
    lengths = entry.lengths_of_moves(ground.straight, ground.diagonal)
    offsets = np.array([down * size.stride + right for down, right in MOVES], np.int64) % 2**32
    offset = jnp.array(offsets.astype(np.uint32))
    order = jnp.arange(8, dtype=jnp.uint32)

    def move_before(cell: Array) -> Array:
        """The direction, among MOVES, of the cell before."""
        nine = square(ground.labels, cell, size)
        paid = tolls_at(nine, tolls)
        doors = jnp.stack([entry.of_move(nine, paid, 4, i, is_back=True) for i in range(8)])
        there = square(sums, cell, size)
        there = jnp.concatenate([there[:4], there[5:]])
        fits = (there < UNREACHED) & (there + lengths + doors == read(sums, cell))
        return jnp.min(jnp.where(fits, order, jnp.uint32(8)))

    # Beside a diagonal move back: the cell in its row, and that in its column.
    beside = np.array([[b, a * size.stride] if a and b else [0, 0] for a, b in MOVES], np.int64)
    in_row, in_col = (jnp.array((part % 2**32).astype(np.uint32)) for part in beside.T)

    def step(walk: _Walk) -> _Walk:
        move = move_before(walk.cell)
        move = jnp.minimum(move, jnp.uint32(7))
        needed = walk.needed
        for step_to in (jnp.uint32(0), read(in_row, move), read(in_col, move)):
            cell = walk.cell + step_to
            for layer in range(ground.labels.shape[1]):
                at = (cell, jnp.uint32(layer))
                owner = lax.dynamic_slice(ground.labels, at, (1, 1))[0, 0]
                owner = jnp.where(owner < 0, num_obstacles, owner).astype(jnp.uint32)
                needed = write(needed, jnp.uint32(1), owner)
        length = walk.length + read(lengths, move)
        return _Walk(walk.cell + read(offset, move), needed, length)

    is_there = (goal != 0) & (read(sums, goal) < UNREACHED)
    nothing = jnp.zeros(num_obstacles + 1, jnp.uint32)
    begin = _Walk(jnp.where(is_there, goal, ground.start), nothing, jnp.uint32(0))
    # Ends: the sums fall from cell to cell, down to the start.
    end = lax.while_loop(lambda walk: walk.cell != ground.start, step, begin)
    return WayBack(end.needed[:num_obstacles] != 0, end.length)
