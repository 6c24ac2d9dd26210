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

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, runs_in_place
from sign_model.foundation.words import num_words
from srt_jax.engine import packing
from srt_jax.engine.in_place import read
from srt_jax.obstacles import Labels
from srt_jax.tolls import entry
from srt_jax.tolls.memory import Metric, octile
from srt_jax.tolls.stops import Changes
from srt_jax.types import FREE, Array

_ONE, _TOP, _ALL = np.uint32(1), np.uint32(31), np.uint32(2**32 - 1)
_FAR = np.int32(2**31 - 1)


class Places(NamedTuple):
    """Where a way within a limit may need each obstacle gone.

    nearest: uint32 [M], the length that a way through it has at least; `entry.CLOSED` where there
      is none within the limit.
    boxes: int32 [M, 4], the bounding box of the cells that such a way comes to: the least and
      greatest rows, the least and greatest columns; all 0 where there is none.
    """

    nearest: Array
    boxes: Array


def places_of(
    labels: Labels, changes: Changes, tolls: Array, metric: Metric, limit: Array
) -> Places:
    """Returns where each obstacle matters, if it does.

    A way through a cell is no shorter than the octile distances from the start to it and from there
    to the goal, but that a way that cuts a corner of a cell passes it at a straight move's
    distance, before and behind, instead of one diagonal: that much less. The cells for which that
    and the least toll are within the limit are an interval of each row. Of an obstacle's cells
    there only those of the rim are looked at, beside which labels differ: there lies the least, and
    there the box ends, or at the end of an interval.

    Without a way round there is no limit but `entry.CLOSED`. Then upper left and lower right corners
    are enough: the first cells of the uppermost row and of the leftmost column are of the one kind,
    the last ones of the other.

    Args:
      tolls: uint32 [M], `entry.CLOSED` of what must stay.
      limit: uint32 [], at most `entry.CLOSED`; a way is within it whose sum is less.
    """
    num_obstacles, (height, width) = len(tolls), labels.all.shape[2:]
    is_limited = limit < entry.CLOSED
    less = 2 * metric.straight - metric.diagonal
    sure = jnp.abs(metric.start - metric.goal)
    sure = octile(sure[0], sure[1], metric)

    def through(row: Array, col: Array) -> Array:
        """The octile distance from the start over a cell to the goal, less that, at least."""
        over = sum(
            octile(jnp.abs(row - cell[0]), jnp.abs(col - cell[1]), metric)
            for cell in (metric.start, metric.goal)
        )
        return jnp.where(is_limited, over - jnp.minimum(over, less), sure)

    inside = _intervals(through, metric, limit - jnp.minimum(limit, jnp.min(tolls)), height, width)
    along, down, owned = changes
    before = (along << _ONE) | jnp.pad(along[:, :-1] >> _TOP, ((0, 0), (1, 0)))
    before = before | jnp.array(np.arange(along.shape[1]) == 0).astype(jnp.uint32)[None]
    above = jnp.concatenate([jnp.full_like(down[:1], _ALL), down[:-1]])
    corners = (above & before) | (down & along)
    # The first and the last of each interval stand for the cells between changes beside its ends.
    asked = jnp.where(is_limited, inside & (along | down | before | above | _ends(inside)), corners)
    asked = asked & owned

    def columns(row: Array, col: Array, owner: Array, is_one: Array) -> tuple[Array, Array]:
        own = through(row, col)
        toll = jnp.take(tolls, owner, mode="clip")
        is_within = is_one & (toll < entry.CLOSED) & (own + toll < limit)
        at = jnp.where(is_within, owner, num_obstacles).astype(jnp.uint32)
        return at, jnp.stack([row, -row, col, -col, own.astype(jnp.int32), row, row, row], axis=-1)

    least = jnp.full((num_obstacles + 1, 8), _FAR, jnp.int32)
    if runs_in_place():

        def visit(least: Array, row: Array, col: Array, is_set: Array) -> Array:
            row, col = row.astype(jnp.int32), col.astype(jnp.int32)
            for layer in range(labels.all.shape[1]):
                owner = labels.at(layer, row, col)
                at, new = columns(row, col, owner, is_set & (owner >= 0))
                old = apart(_row_of)(least, at)
                new = jnp.minimum(old, new[None])
                least = lax.dynamic_update_slice(least, new, (at, jnp.uint32(0)))
            return least

        least = _for_each_set(asked, visit, least)
    else:
        owner = labels.all[labels.which]
        is_one = packing.unpack(asked[None], width) & (owner >= 0)
        rows, cols = (jnp.broadcast_to(x, owner.shape) for x in jnp.indices((height, width)))
        at, new = columns(rows.astype(jnp.int32), cols.astype(jnp.int32), owner, is_one)
        least = least.at[at].min(new)
    least = least[:num_obstacles]
    is_there = least[:, 4] < _FAR
    nearest = jnp.where(is_there, least[:, 4].astype(jnp.uint32), jnp.uint32(entry.CLOSED))
    signs = jnp.array(np.array([[1, -1, 1, -1]], np.int32))
    boxes = jnp.where(is_there[:, None], least[:, :4] * signs, 0)
    return Places(nearest, boxes)


def _intervals(through: Callable, metric: Metric, most: Array, height: int, width: int) -> Array:
    """The cells through which a way may be no longer than `most`, uint32 [H, words]: an interval of
    each row, since the length is convex.
    """
    rows = jnp.arange(height, dtype=jnp.int32)
    aside = [jnp.abs(rows - cell[0]) for cell in (metric.start, metric.goal)]
    # Between its bends it is straight, so that it is least at one of these.
    bends = [
        (cell[1] + sign * by).clip(0, width - 1)
        for cell, by in zip((metric.start, metric.goal), aside)
        for sign in (-1, 0, 1)
    ]
    lengths = [through(rows, bend) for bend in bends]
    least, middle = lengths[0], bends[0]
    for length, bend in zip(lengths[1:], bends[1:]):
        middle = jnp.where(length < least, bend, middle)
        least = jnp.minimum(length, least)

    # How far it reaches to either side: bisection.
    steps = max(width - 1, 1).bit_length()

    def halve(i: Array, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        by = jnp.int32(1) << (steps - 1 - i)
        left, right = (jnp.where(j, end + by, end - by) for j, end in enumerate(ends))
        return (
            jnp.where((left >= 0) & (through(rows, left) <= most), left, ends[0]),
            jnp.where((right < width) & (through(rows, right) <= most), right, ends[1]),
        )

    left, right = repeat(steps, halve, (middle, middle))
    words = num_words(width)
    cells = packing.bits_inside(right + 1, words) & ~packing.bits_inside(left, words)
    return jnp.where((least <= most)[:, None], cells, jnp.uint32(0))


def _ends(inside: Array) -> Array:
    """The first and the last of each row, and those that have none above or below."""
    left = (inside << _ONE) | jnp.pad(inside[:, :-1] >> _TOP, ((0, 0), (1, 0)))
    right = (inside >> _ONE) | jnp.pad(inside[:, 1:] << _TOP, ((0, 0), (0, 1)))
    above, below = jnp.pad(inside[:-1], ((1, 0), (0, 0))), jnp.pad(inside[1:], ((0, 1), (0, 0)))
    return inside & ~(left & right & above & below)


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


def _for_each_set(mask: Array, visit: Callable, out: Array) -> Array:
    """`packing.for_each_cell` for masks of few cells: empty words are passed by."""
    per_row = jnp.uint32(mask.shape[1])
    words = jnp.pad(mask.reshape(-1), (0, 1), constant_values=1)
    num_all = np.uint32(words.size - 1)

    def step(state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        at, word, out = state
        at, word = lax.while_loop(
            lambda scan: scan[1] == 0,
            lambda scan: (scan[0] + _ONE, read(words, scan[0] + _ONE)),
            (at, word),
        )
        bit = lax.population_count((word & -word) - _ONE)
        row, col = at // per_row, at % per_row * np.uint32(32) + bit
        return at, word & (word - _ONE), visit(out, row, col, at < num_all)

    # Ends: at the word behind the last one, which is not empty.
    begin = (jnp.uint32(0), words[0], out)
    return lax.while_loop(lambda state: state[0] < num_all, step, begin)[2]


def _row_of(table: Array, row: Array) -> Array:
    return lax.dynamic_slice(table, (row, jnp.uint32(0)), (1, table.shape[1]))
