"""Which obstacles no least way enters twice: rectangles that nothing else covers.

Take a way that needs such an obstacle gone at several moves, the first from u, the last to v. With
the obstacle gone a straight line of the octile metric leads through the rectangle from where the
way first meets it to where it last does, and none is shorter: where it enters, the cell entered;
where it only cuts a corner, the cell of that corner, reached by one straight move, which is less
than the diagonal. So what lies between u and v can be replaced by a way that is no longer, stays in
the rectangle, needs nothing else gone, and pays once. One obstacle after the other: what replaces
the way at one meets no other obstacle, so it pays no other a second time.

Of any other shape the way through the inside may be longer than leaving it and coming back.
"""

import jax.numpy as jnp
from jax import lax

from sign_model.ground.marks import runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.tolls import around
from srt_jax.types import Array


def rectangles(labels: Array, seen: Array, stride: int, num_obstacles: int) -> Array:
    """Returns which obstacles are rectangles of cells that no other obstacle covers: bool [M]; also
    those that cover no cell.

    Args:
      labels: int32 [N, L]. seen: uint8 [N], from `around.seen_around`. stride: columns of the map
        with its border.
    """
    # One upper left corner, no square that is bent, no cell of another.
    corner, other = jnp.uint8(around.CORNER), jnp.uint8(around.BENT | around.SHARED)
    faults = (seen & corner != 0).astype(jnp.uint32)
    faults = faults + jnp.where(seen & other != 0, jnp.uint32(2), jnp.uint32(0))
    nothing = jnp.zeros(num_obstacles + 1, jnp.uint32)
    if not runs_in_place():
        at = jnp.where(labels >= 0, labels, num_obstacles)
        more = jnp.broadcast_to(faults[:, None], labels.shape)
        return nothing.at[at].add(more)[:num_obstacles] <= 1

    def visit(num: Array, row: Array, col: Array, is_set: Array) -> Array:
        place = jnp.where(is_set, row * jnp.uint32(stride) + col, jnp.uint32(0))
        more = read(faults, place)
        for layer in range(labels.shape[1]):
            owner = lax.dynamic_slice(labels, (place, jnp.uint32(layer)), (1, 1))[0, 0]
            at = jnp.where(owner >= 0, owner, num_obstacles).astype(jnp.uint32)
            num = write(num, read_apart(num, at) + more, at)
        return num

    cells = packing.pack((faults > 0).reshape(1, -1, stride))[0]
    return packing.for_each_cell(cells, visit, nothing)[:num_obstacles] <= 1
