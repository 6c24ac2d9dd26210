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

import jax.numpy as jnp
from jax import lax

from sign_model.ground.marks import runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.tolls import around
from srt_jax.tolls.spread import UNREACHED as FAR
from srt_jax.tolls.spread import Ground, Size, octile
from srt_jax.types import Array


def nearest_sums(ground: Ground, size: Size, num_obstacles: int) -> Array:
    """Returns the length that a way through each obstacle has at least: the least octile distance
    from the start over one of its cells to the goal, uint32 [M]; a great number where it covers no
    cell.

    A way that cuts a corner of a cell passes it at a straight move's distance, before and behind,
    instead of one diagonal: that much less. Cells deep inside are left out: the octile path from
    the start to the one of the least sum enters the obstacle at a cell of its rim, whose sum is no
    greater.
    """
    row, col = (ground.start // size.stride, ground.start % size.stride)
    start = jnp.stack([row, col]).astype(jnp.int32) - 1
    sums = ground.left + octile(start, ground.straight, ground.diagonal, size)
    less = 2 * ground.straight - ground.diagonal
    sums = sums - jnp.minimum(sums, less)
    far = jnp.full(num_obstacles + 1, FAR, jnp.uint32)
    if not runs_in_place():
        at = jnp.where(ground.labels >= 0, ground.labels, num_obstacles)
        return far.at[at].min(jnp.broadcast_to(sums[:, None], at.shape))[:num_obstacles]

    def visit(least: Array, row: Array, col: Array, is_set: Array) -> Array:
        place = jnp.where(is_set, row * jnp.uint32(size.stride) + col, jnp.uint32(0))
        own = read(sums, place)
        for layer in range(ground.labels.shape[1]):
            owner = lax.dynamic_slice(ground.labels, (place, jnp.uint32(layer)), (1, 1))[0, 0]
            at = jnp.where(owner >= 0, owner, num_obstacles).astype(jnp.uint32)
            least = write(least, jnp.minimum(read_apart(least, at), own), at)
        return least

    is_rim = (ground.seen & jnp.uint8(around.EVEN) == 0) & (ground.labels >= 0).any(axis=1)
    cells = packing.pack(is_rim.reshape(1, -1, size.stride))[0]
    return packing.for_each_cell(cells, visit, far)[:num_obstacles]


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
