"""Where obstacles matter, and which of them no least way enters twice: rectangles that nothing else
covers.

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
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, runs_in_place
from sign_model.foundation.words import num_words
from srt_jax.engine import packing
from srt_jax.obstacles import Labels
from srt_jax.tolls import entry
from srt_jax.tolls.paid_sets import Metric, octile, to_boxes
from srt_jax.tolls.stops import Changes
from srt_jax.types import FREE, Array

_ONE, _TOP = np.uint32(1), np.uint32(31)
_FAR = np.int32(2**30)


class Places(NamedTuple):
    """Where a way within a limit may need each obstacle gone.

    matters: bool [M], whether one may at all.
    boxes: int32 [M, 4], the bounding box of the cells that such a way comes to: the least and
      greatest rows, the least and greatest columns; all 0 where it does not matter.
    near: uint32 [H, words], packed, the cells that such a way comes to.
    """

    matters: Array
    boxes: Array
    near: Array


def places_of(
    labels: Labels, changes: Changes, tolls: Array, metric: Metric, limit: Array
) -> Places:
    """Returns where each obstacle matters, if it does.

    A way through a cell is no shorter than the octile distances from the start to it and from there
    to the goal, but that a way that cuts a corner of a cell passes it at a straight move's
    distance, before and behind, instead of one diagonal: that much less. The cells for which that
    and the least toll are within the limit are an interval of each row. There the first and the
    last cell of each piece that an obstacle has of the row are looked at.

    Args:
      tolls: uint32 [M], `entry.CLOSED` of what must stay.
      limit: uint32 [], at most `entry.CLOSED`; a way is within it whose sum is less.
    """
    num_obstacles, (height, width) = len(tolls), labels.all.shape[2:]
    inside = _intervals(metric, limit - jnp.minimum(limit, jnp.min(tolls)), height, width)
    along, _, owned = changes
    ends = along | _following(along) | (inside & ~(_following(inside) & _before(inside)))
    first = jnp.array(np.arange(along.shape[1]) == 0).astype(jnp.uint32)
    asked = inside & owned & (ends | first[None])

    least = jnp.full((num_obstacles + 1, 4), _FAR, jnp.int32)
    if runs_in_place():

        def visit(least: Array, row: Array, col: Array) -> Array:
            row, col = row.astype(jnp.int32), col.astype(jnp.int32)
            new = jnp.stack([row, -row, col, -col])[None]
            for layer in range(labels.all.shape[1]):
                owner = labels.at(layer, row, col)
                at = jnp.where(owner >= 0, owner, num_obstacles).astype(jnp.uint32)
                old = apart(_row_of)(least, at)
                least = lax.dynamic_update_slice(least, jnp.minimum(old, new), (at, jnp.uint32(0)))
            return least

        least = packing.for_each_cell(asked, visit, least)
    else:
        owner = labels.all[labels.which]
        is_one = packing.unpack(asked[None], width) & (owner >= 0)
        rows, cols = (
            jnp.broadcast_to(x, owner.shape) for x in jnp.indices((height, width), jnp.int32)
        )
        new = jnp.stack([rows, -rows, cols, -cols], axis=-1).astype(jnp.int32)
        least = least.at[jnp.where(is_one, owner, num_obstacles)].min(new)
    least = least[:num_obstacles]
    is_there = (least[:, 0] < _FAR) & (tolls < entry.CLOSED)
    signs = jnp.array(np.array([[1, -1, 1, -1]], np.int32))
    boxes = jnp.where(is_there[:, None], least * signs, 0)
    # One whose toll is not the least may be too dear all the same.
    over = sum(to_boxes(cell[0], cell[1], boxes, metric) for cell in (metric.start, metric.goal))
    matters = is_there & (over + tolls < limit)
    return Places(matters, jnp.where(matters[:, None], boxes, 0), inside)


def _before(mask: Array) -> Array:
    """The mask moved by a column to the left: whether the next cell is in it."""
    return (mask >> _ONE) | jnp.pad(mask[:, 1:] << _TOP, ((0, 0), (0, 1)))


def _following(mask: Array) -> Array:
    """The mask moved by a column to the right: whether the cell before is in it."""
    return (mask << _ONE) | jnp.pad(mask[:, :-1] >> _TOP, ((0, 0), (1, 0)))


def _intervals(metric: Metric, most: Array, height: int, width: int) -> Array:
    """The cells through which a way may be less than `most` long, uint32 [H, words]: an interval of
    each row, since the length is convex.
    """
    rows = jnp.arange(height, dtype=jnp.int32)[None]
    ends = (metric.start, metric.goal)
    less = 2 * metric.straight - metric.diagonal

    def is_near(cols: Array) -> tuple[Array, Array]:
        over = sum(
            octile(jnp.abs(rows - cell[0]), jnp.abs(cols - cell[1]), metric) for cell in ends
        )
        return over, over - jnp.minimum(over, less) < most

    # Between its bends it is straight, so that it is least at one of these.
    bends = jnp.concatenate(
        [cell[1] + sign * jnp.abs(rows - cell[0]) for cell in ends for sign in (-1, 0, 1)]
    ).clip(0, width - 1)
    over, are_near = is_near(bends)
    is_least = over == jnp.min(over, axis=0, keepdims=True)
    middle = jnp.min(jnp.where(is_least, bends, jnp.int32(width)), axis=0, keepdims=True)
    is_any = are_near.any(axis=0)

    # How far it reaches to either side: bisection.
    steps = max(width - 1, 1).bit_length()
    sides = jnp.array(np.array([[-1], [1]], np.int32))

    def halve(i: Array, reach: Array) -> Array:
        farther = reach + (sides << (steps - 1 - i))
        is_on_row = (farther >= 0) & (farther < width)
        return jnp.where(is_on_row & is_near(farther)[1], farther, reach)

    left, right = repeat(steps, halve, jnp.broadcast_to(middle, (2, height)))
    words = num_words(width)
    cells = packing.bits_inside(right + 1, words) & ~packing.bits_inside(left, words)
    return jnp.where(is_any[:, None], cells, jnp.uint32(0))


def rectangles_of(labels: Labels, changes: Changes, boxes: Array, among: Array) -> Array:
    """Returns which of the obstacles `among`, bool [M], are rectangles that nothing else covers,
    as far as they matter: no labels change within the box, int32 [M, 4], of `Places`.
    """
    words = changes.along.shape[1]

    def one(args: tuple[Array, Array]) -> Array:
        (top, bottom, left, right), is_asked = args
        within, inner = (
            packing.bits_inside(right + 1 - i, words) & ~packing.bits_inside(left, words)
            for i in (0, 1)
        )
        num_owners = sum(
            (labels.at(layer, top, left) != FREE).astype(jnp.int32)
            for layer in range(labels.all.shape[1])
        )

        def next_row(state: tuple[Array, Array]) -> tuple[Array, Array]:
            row, _ = state
            along = lax.dynamic_index_in_dim(changes.along, row, keepdims=False) & inner
            down = lax.dynamic_index_in_dim(changes.down, row, keepdims=False) & within
            differs = along | jnp.where(row < bottom, down, jnp.uint32(0))
            return row + 1, (differs == 0).all()

        is_sole = (num_owners == 1) & is_asked
        # Ends: row by row, at the latest after the last one.
        _, is_even = lax.while_loop(
            lambda state: state[1] & (state[0] <= bottom), next_row, (top, is_sole)
        )
        return is_even

    return lax.map(one, (boxes, among)) & among


def _row_of(table: Array, row: Array) -> Array:
    return lax.dynamic_slice(table, (row, jnp.uint32(0)), (1, table.shape[1]))
