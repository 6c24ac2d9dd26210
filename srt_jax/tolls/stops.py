"""Where straight runs over labelled cells have to stop, as bit maps: where labels change, and at
corners.

Bit maps lie as those of `paths.jump_tables`, by rows and by columns, and runs are numbered as
there. A run stops at the first cell that obstacles cover which do not all cover the cell before,
and may have to be paid for; at a corner, beside which, to one side, obstacles have just ended or
become others; at the goal; and outside the map.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.words import WORD
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, write
from srt_jax.obstacles import Labels
from srt_jax.paths.jump_tables import groups_of, place_in_parts, transposed
from srt_jax.types import FREE, Array

_ONE, _TOP, _ALL = np.uint32(1), np.uint32(WORD - 1), np.uint32(2**32 - 1)


class Changes(NamedTuple):
    """Of each cell, all uint32 [H, words], packed. along, down: whether its labels differ from
    those of the next cell of the row, and of the next row; outside the map there is another one.
    owned: whether an obstacle covers it.
    """

    along: Array
    down: Array
    owned: Array


class Stops(NamedTuple):
    """stop, before, behind: uint32 [4 * size], by run: where it stops, and the corners whose
    obstacle is in the line before and behind; the goal is both. square: uint32 [2 * size], of which
    the first half counts, of the layout by rows: the top left cells of four with the same labels.

    ahead: uint32 [8 * size]: the cells from which the next stop of a run *across* the lines is a
    corner, and the goal itself; in the second half also those from which it is a door. Parts of
    each half: 0 down, 1 right, 2 up, 3 left.
    """

    stop: Array
    before: Array
    behind: Array
    square: Array
    ahead: Array


def changes_of(labels: Labels, free: Array) -> Changes:
    """Returns where the labels of one map change; free: uint32 [H, words], its free cells, packed.

    Nearly everywhere that is where free cells and others meet; rows in which obstacles touch each
    other are compared label by label.
    """
    _, num_layers, height, width = labels.all.shape
    words = free.shape[1]
    inside = packing.bits_inside(jnp.int32(width), words)
    owned = ~free & inside[None]
    following = (owned >> _ONE) | jnp.pad(owned[:, 1:] << _TOP, ((0, 0), (0, 1)))
    # Outside the map there is another one.
    last = inside & ~packing.bits_inside(jnp.int32(width - 1), words)
    under = jnp.concatenate([owned[1:], ~owned[-1:]])
    along = ((owned ^ following) & inside[None]) | last[None]
    down = (owned ^ under) & inside[None]

    def layers_at(row: Array) -> Array:
        return jnp.stack([labels.row(layer, row) for layer in range(num_layers)])

    def one_row(row: Array) -> tuple[Array, Array]:
        own, below = layers_at(row), layers_at(jnp.minimum(row + 1, height - 1))
        aside = jnp.concatenate([own[:, 1:], own[:, -1:]], axis=1)
        differs = [(own != other).any(axis=0) for other in (aside, below)]
        is_free = [(ids == FREE).all(axis=0) for ids in (own, aside, below)]
        touch = [each & ~is_free[0] & ~other for each, other in zip(differs, is_free[1:])]

        def compared() -> Array:
            return packing.pack(jnp.stack(differs)[None])[0]

        simple = jnp.stack([along[row], down[row]])
        new = lax.cond((touch[0] | touch[1]).any(), compared, lambda: simple)
        return new[0] | last, new[1] | jnp.where(row == height - 1, inside, jnp.uint32(0))

    along, down = lax.map(one_row, jnp.arange(height, dtype=jnp.int32))
    return Changes(along, down, owned)


def stops_of(changes: Changes, near: Array, goal: Array, width: int) -> Stops:
    """Returns the bit maps of one map; for use inside a marked call.

    Args:
      near: uint32 [H, words], packed: the cells that `ahead` tells of; of each row and column a
        single piece.
      goal: int32 [2], a cell of the map. width: W.
    """
    height = changes.along.shape[0]
    tall, wide = groups_of(height, width)
    size, margin = WORD * tall * wide, max(tall, wide) + 1
    beyond = ~packing.bits_inside(jnp.int32(width), wide)

    def in_both(mask: Array, turned: Array) -> Array:
        """Both layouts, one behind the other, with a margin around them."""
        both = jnp.zeros(2 * size + 2 * margin, jnp.uint32)
        both = lax.dynamic_update_slice(both, mask.reshape(-1), (margin,))
        return lax.dynamic_update_slice(both, turned.reshape(-1), (margin + size,))

    def padded(mask: Array, fill: np.uint32) -> Array:
        new = jnp.full((WORD * tall, wide), fill, jnp.uint32)
        return lax.dynamic_update_slice(new, mask, (0, 0))

    along, down = padded(changes.along, np.uint32(0)), padded(changes.down, np.uint32(0))
    owned = padded(changes.owned, _ALL) | beyond[None]
    near = padded(near, np.uint32(0))
    by_cols = jnp.split(transposed(jnp.concatenate([along, down, owned, near], axis=1)), 4)
    # A line and the next one differ, so that no run goes on from one to the other.
    lines = in_both(_closed(along), _closed(by_cols[1]))
    across, owned, near = (
        in_both(mask, by_cols[i]) for mask, i in ((down, 0), (owned, 2), (near, 3))
    )

    parts = [(tall, wide), (wide, tall)] if tall != wide else [(2 * tall, wide)]
    new = jnp.zeros(4 * size, jnp.uint32)
    stops = Stops(new, new, new, jnp.zeros(2 * size, jnp.uint32), jnp.zeros(8 * size, jnp.uint32))
    first = 0
    for groups, words in parts:
        stops = _strips(stops, (lines, across, owned), margin, first, groups, words)
        first += groups * WORD * words
    mark_goal, first = _marker(goal, size, tall, wide), 0
    stops = mark_goal(stops)
    for groups, words in parts:
        stops = _look_ahead(stops, (across, owned, near), margin, first, groups * WORD, words)
        first += groups * WORD * words
    return stops._replace(ahead=mark_goal(stops).ahead)


def _closed(lines: Array) -> Array:
    last = np.zeros((1, lines.shape[1]), np.uint32)
    last[0, -1] = _ONE << _TOP
    return lines | jnp.array(last)


def _strips(
    stops: Stops, masks: tuple[Array, ...], margin: int, first: int, groups: int, words: int
) -> Stops:
    """Fills in the bit maps of one layout, or of both, 32 lines at a time."""
    length, half = WORD * words, np.uint32(stops.square.size)

    def strip(i: Array, stops: Stops) -> Stops:
        place = i.astype(jnp.uint32) * jnp.uint32(length) + jnp.uint32(first)

        def near(mask: Array, line: int, word: int = 0) -> Array:
            at = place + np.uint32(margin + line * words + word)
            return lax.dynamic_slice(mask, (at,), (length,))

        along, across, owned = masks
        here, above, below = (near(along, line) for line in (0, -1, 1))
        # Beside which cells there is an obstacle that they do not belong to, in the line before and
        # behind; of their words the one before, their own and the next.
        walls = [
            [
                near(across, line, word) & near(owned, line if line else 1, word)
                for word in (-1, 0, 1)
            ]
            for line in (-1, 0)
        ]
        ends = [near(along, line, -1) for line in (-1, 1)]
        forth = [
            ((own & side) << _ONE) | ((last & end) >> _TOP)
            for (last, own, _), side, end in zip(walls, (above, below), ends)
        ]
        back = [
            ((own >> _ONE) | (following << _TOP)) & side
            for (_, own, following), side in zip(walls, (above, below))
        ]
        # Who leaves an obstacle for a free cell pays nothing, and goes on.
        own = near(owned, 0)
        changed = ((here << _ONE) | (near(along, 0, -1) >> _TOP)) & own
        new = [
            (forth[0] | forth[1] | changed, *forth),
            (back[0] | back[1] | (here & own), *back),
        ]
        stop, before, behind = (
            _put(_put(table, own[0], place), own[1], place + half)
            for table, own in zip(stops, zip(*new))
        )
        down = near(across, 0)
        aside = (down >> _ONE) | (near(across, 0, 1) << _TOP)
        square = ~(here | below | down | aside)
        return Stops(stop, before, behind, _put(stops.square, square, place), stops.ahead)

    return repeat(groups, strip, stops)


def _look_ahead(
    stops: Stops, masks: tuple[Array, ...], margin: int, first: int, lines: int, words: int
) -> Stops:
    """Fills in `ahead` of one layout, or of both, line by line against the run: from the last line
    for runs down, from the first for runs up.

    A corner lies diagonally behind an obstacle's cell, so the corners of runs across the lines are
    those of runs along them with the obstacle in the line before, and behind.
    """
    half, base = np.uint32(stops.square.size), np.uint32(first)

    def line(i: Array, state: tuple) -> tuple:
        forth, back, ahead = state
        place = base + i.astype(jnp.uint32) * jnp.uint32(words)
        mirrored = base + np.uint32((lines - 1) * words) - (place - base)

        def passed(seen: tuple, corners: Array, at: Array, between: int) -> tuple:
            across, owned, near = (
                lax.dynamic_slice(mask, (at + np.uint32(margin + by),), (words,))
                for mask, by in zip(masks, (between, 0, 0))
            )
            corner = lax.dynamic_slice(corners, (at,), (words,))
            corner = corner | lax.dynamic_slice(corners, (at + half,), (words,))
            door = across & owned
            on, met = ~(door | corner) & near, corner & near
            return met | (on & seen[0]), met | (door & near) | (on & seen[1])

        for at, way, seen in ((mirrored, 0, forth), (place, 1, back)):
            for which, found in enumerate(seen):
                ahead = _put(ahead, found, at + np.uint32(2 * which + way) * half)
        forth = passed(forth, stops.before, mirrored, -words)
        back = passed(back, stops.behind, place, 0)
        return forth, back, ahead

    none = jnp.zeros(words, jnp.uint32)
    begin = ((none, none), (none, none), stops.ahead)
    return stops._replace(ahead=repeat(lines, line, begin)[2])


def _marker(goal: Array, size: int, tall: int, wide: int) -> Callable[[Stops], Stops]:
    """A function that makes the goal a stop and a corner of every run, and notes it in `ahead`; and
    makes the last cell of each part a stop, which lies outside.
    """
    place_of = place_in_parts(goal, size, tall, wide)

    def mark(i: Array, stops: Stops) -> Stops:
        part = i.astype(jnp.uint32)
        last = part * jnp.uint32(size) + np.uint32(size - 1)
        place, bit = place_of(part)

        def marked(table: Array, at: Array) -> Array:
            return write(table, read(table, at) | bit, at)

        stop = write(stops.stop, read(stops.stop, last) | (_ONE << _TOP), last)
        ahead = marked(stops.ahead, place)
        return stops._replace(
            stop=marked(stop, place),
            before=marked(stops.before, place),
            behind=marked(stops.behind, place),
            ahead=marked(ahead, place + np.uint32(4 * size)),
        )

    return lambda stops: repeat(4, mark, stops)


def _put(array: Array, part: Array, place: Array) -> Array:
    return lax.dynamic_update_slice(array, part, (place,))
