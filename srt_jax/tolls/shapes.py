"""Which obstacles no least way enters twice: rectangles that nothing else covers; and how long a
way through each obstacle is at least.

Take a way that needs such an obstacle gone at several moves, the first from u, the last to v. With
the obstacle gone a straight line of the octile metric leads through the rectangle from where the
way first meets it to where it last does, and none is shorter: where it enters, the cell entered;
where it only cuts a corner, the cell of that corner, reached by one straight move, which is less
than the diagonal. So what lies between u and v can be replaced by a way that is no longer, stays in
the rectangle, needs nothing else gone, and pays once. One obstacle after the other: what replaces
the way at one meets no other obstacle, so it pays no other a second time.

Of any other shape the way through the inside may be longer than leaving it and coming back.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import apart, runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.tolls import around
from srt_jax.tolls.spread import UNREACHED as FAR
from srt_jax.tolls.spread import Ground, Size, octile_of
from srt_jax.types import Array


class Shapes(NamedTuple):
    """What is asked of each obstacle, of one that covers no cell too.

    is_rectangle: bool [M], of cells that no other obstacle covers; True without a cell.
    nearest: uint32 [M], the length that a way through it has at least; a great number without a
      cell.
    boxes: uint32 [M, 4], its bounding box, the least and greatest rows, the least and greatest
      columns, of the map with its border; empty without a cell.
    """

    is_rectangle: Array
    nearest: Array
    boxes: Array


def shapes_of(ground: Ground, size: Size, num_obstacles: int) -> Shapes:
    """Returns the shape of each obstacle, and how far off the way it lies.

    A way through an obstacle is no shorter than the least octile distance from the start over one
    of its cells to the goal, but that a way that cuts a corner of a cell passes it at a straight
    move's distance, before and behind, instead of one diagonal: that much less.

    Only cells of the rim are looked at, beside which labels differ. The octile path from the start
    to the cell of the least sum enters the obstacle there, where the sum is no greater; a rectangle
    is spoilt there; and cells that several obstacles cover have a rim of their own.
    """
    row, col = (ground.start // size.stride, ground.start % size.stride)
    start = jnp.stack([row, col]).astype(jnp.int32)
    less = 2 * ground.straight - ground.diagonal
    # One upper left corner, no square that is bent, no cell of another.
    corner, other = jnp.uint8(around.CORNER), jnp.uint8(around.BENT | around.SHARED)

    def faults_at(seen: Array) -> Array:
        faults = (seen & corner != 0).astype(jnp.uint32)
        return faults + jnp.where(seen & other != 0, jnp.uint32(2), jnp.uint32(0))

    def columns(left: Array, row: Array, col: Array) -> Array:
        # The least of what is left to FAR gives the greatest.
        rows, cols = row.astype(jnp.int32) - start[0], col.astype(jnp.int32) - start[1]
        own = left + octile_of(rows, cols, ground.straight, ground.diagonal)
        own = own - jnp.minimum(own, less)
        return jnp.stack([own, row, FAR - row, col, FAR - col, own, own, own], axis=-1)

    begin = (
        jnp.full((num_obstacles + 1, 8), FAR, jnp.uint32),
        jnp.zeros(num_obstacles + 1, jnp.uint32),
    )

    def shapes(least: Array, faults: Array) -> Shapes:
        least = least[:num_obstacles]
        ends = [least[:, 1], FAR - least[:, 2], least[:, 3], FAR - least[:, 4]]
        return Shapes(faults[:num_obstacles] <= 1, least[:, 0], jnp.stack(ends, axis=1))

    is_rim = (ground.seen & jnp.uint8(around.EVEN) == 0) & (ground.labels >= 0).any(axis=1)
    if not runs_in_place():
        is_owned = is_rim[:, None] & (ground.labels >= 0)
        at = jnp.where(is_owned, ground.labels, num_obstacles)
        cells = jnp.arange(size.num_cells, dtype=jnp.uint32)
        new = columns(ground.left, cells // size.stride, cells % size.stride)[:, None]
        more = jnp.broadcast_to(faults_at(ground.seen)[:, None], at.shape)
        return shapes(
            begin[0].at[at].min(jnp.broadcast_to(new, (*at.shape, 8))), begin[1].at[at].add(more)
        )

    def visit(state: tuple[Array, Array], row: Array, col: Array, is_set: Array) -> tuple:
        least, faults = state
        place = jnp.where(is_set, row * jnp.uint32(size.stride) + col, jnp.uint32(0))
        new = columns(read(ground.left, place), row, col)[None]
        more = faults_at(read(ground.seen, place))
        for layer in range(ground.labels.shape[1]):
            owner = lax.dynamic_slice(ground.labels, (place, jnp.uint32(layer)), (1, 1))[0, 0]
            at = jnp.where(owner >= 0, owner, num_obstacles).astype(jnp.uint32)
            old = apart(_row_of)(least, at)
            least = lax.dynamic_update_slice(least, jnp.minimum(old, new), (at, jnp.uint32(0)))
            faults = write(faults, read_apart(faults, at) + more, at)
        return least, faults

    cells = packing.pack(is_rim.reshape(1, -1, size.stride))[0]
    return shapes(*packing.for_each_cell(cells, visit, begin))


def _row_of(table: Array, row: Array) -> Array:
    return lax.dynamic_slice(table, (row, jnp.uint32(0)), (1, table.shape[1]))
