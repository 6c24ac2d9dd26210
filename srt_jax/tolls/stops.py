"""Where straight runs over labelled cells have to stop, as bit maps: where labels change, and at
corners.

Bit maps lie as those of `paths.jump_tables`, by rows and by columns, and runs are numbered as
there. A run stops at the first cell that obstacles cover which do not all cover the cell before,
and may have to be paid for; at a corner, beside which, to one side, obstacles have just ended or
become others; at the goal; and outside the map.
"""

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
    obstacle is in the line before and behind. square: uint32 [size], of the layout by rows: the top
    left cells of four with the same labels.
    """

    stop: Array
    before: Array
    behind: Array
    square: Array


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


def stops_of(changes: Changes, goal: Array, width: int) -> Stops:
    """Returns the bit maps of one map; for use inside a marked call.

    Args:
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
    by_cols = jnp.split(transposed(jnp.concatenate([along, down, owned], axis=1)), 3)
    # A line and the next one differ, so that no run goes on from one to the other.
    lines = in_both(_closed(along), _closed(by_cols[1]))
    across, owned = in_both(down, by_cols[0]), in_both(owned, by_cols[2])

    parts = [(tall, wide), (wide, tall)] if tall != wide else [(2 * tall, wide)]
    new = jnp.zeros(4 * size, jnp.uint32)
    stops, first = Stops(new, new, new, jnp.zeros(2 * size, jnp.uint32)), 0
    for groups, words in parts:
        stops = _strips(stops, (lines, across, owned), margin, first, groups, words)
        first += groups * WORD * words
    return stops._replace(stop=_with_ends(stops.stop, goal, size, tall, wide))


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
        return Stops(stop, before, behind, _put(stops.square, square, place))

    return repeat(groups, strip, stops)


def _with_ends(stop: Array, goal: Array, size: int, tall: int, wide: int) -> Array:
    """Makes the goal a stop of every run, and so the last cell of each part, which lies outside."""
    place_of = place_in_parts(goal, size, tall, wide)

    def mark(i: Array, stop: Array) -> Array:
        part = i.astype(jnp.uint32)
        last = part * jnp.uint32(size) + np.uint32(size - 1)
        stop = write(stop, read(stop, last) | (_ONE << _TOP), last)
        place, bit = place_of(part)
        return write(stop, read(stop, place) | bit, place)

    return repeat(4, mark, stop)


def _put(array: Array, part: Array, place: Array) -> Array:
    return lax.dynamic_update_slice(array, part, (place,))
