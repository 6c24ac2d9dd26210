"""What a search by jump points reads of a map: bit maps, made by word operations of the packed
map.

A bit map is uint32, flat, line by line: `words` words a line, of 32 cells each. In the layout by
rows a line is a row of the map, in the one by columns a column. Each line ends with at least one
blocked cell that is not of the map, and after the last line comes at least one blocked line; so the
neighbours of a cell lie at fixed distances, and where there is none, one finds a blocked cell.

A run is a walk of straight moves in one direction. Runs are numbered: 0 right, 1 down, 2 left, 3
up. Even ones go along the lines of the layout by rows, odd ones along those by columns; from 2 on
they go backwards. So bit maps by run are in four parts of equal size, the layouts taking turns.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart
from sign_model.foundation.words import WORD
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.types import Array

_ONE, _TOP = np.uint32(1), np.uint32(WORD - 1)
_HALVES = ((16, 0xFFFF), (8, 0xFF00FF), (4, 0xF0F0F0F), (2, 0x33333333), (1, 0x55555555))


class NextStop(NamedTuple):
    """Where a run stops, all uint32 []. at, bit: the word and the bit of the bit map; to: the
    column, or the row, of the cell; length: the moves that lead there.
    """

    at: Array
    bit: Array
    to: Array
    length: Array


def next_stop(
    stop: Array,
    run: Array,
    row: Array,
    col: Array,
    height: int,
    width: int,
    is_asked: Array | None = None,
) -> NextStop:
    """Returns the first stop of a run from the next cell on; for use inside a marked call.

    Args:
      stop: of the tables. run, row, col: uint32 [].
      is_asked: bool [], whether there is a run; else what is returned has no meaning. There always
        is one where None.
    """
    tall, wide = groups_of(height, width)
    is_vertical, is_forth = run & _ONE != 0, run < np.uint32(2)
    line, pos = jnp.where(is_vertical, col, row), jnp.where(is_vertical, row, col)
    words = np.uint32(wide)
    if tall != wide:
        words = jnp.where(is_vertical, np.uint32(tall), words)
    first = run * np.uint32(WORD * tall * wide) + line * words + (pos >> np.uint32(5))
    bit = pos & _TOP
    mask = jnp.where(is_forth, np.uint32(2**32 - 2) << bit, (_ONE << bit) - _ONE)
    by = jnp.where(is_forth, _ONE, np.uint32(2**32 - 1))
    begin = read_apart(stop, first) & mask
    at, word = lax.while_loop(
        lambda scan: scan[1] == 0,
        lambda scan: (scan[0] + by, read(stop, scan[0] + by)),
        (first, begin if is_asked is None else jnp.where(is_asked, begin, _ONE)),
    )
    # the nearest of them
    bit = _TOP - lax.clz(jnp.where(is_forth, word & -word, word))
    to = (pos & ~_TOP) + (at - first) * np.uint32(WORD) + bit
    return NextStop(at, bit, to, jnp.where(is_forth, to - pos, pos - to))


class JumpTables(NamedTuple):
    """stop: uint32 [4 * size], by run: where it has to stop, at a blocked cell, a corner or the
      goal. A corner is a free cell beside which, to one side, a wall has just ended.
    ahead: uint32 [4 * size]: from which cells the next stop of a run *across* the lines is a corner
      or the goal; and these themselves. Part 0 down, 1 right, 2 up, 3 left.
    square: uint32 [2 * size], of which the first half counts: the top left cells of 2 x 2 free
      ones.
    free: uint32 [2 * size + 2 * margin], the free cells in both layouts, with a margin of none.
    """

    stop: Array
    ahead: Array
    square: Array
    free: Array


def _margin(tall: int, wide: int) -> int:
    return max(tall, wide) + 1


def walls_at(tables: JumpTables, place: NextStop, run: Array, height: int, width: int) -> Array:
    """Returns whether the cell where a run stops is a corner with its wall in the line before, bit
    2, and in the line behind, bit 3; uint32 [].
    """
    tall, wide = groups_of(height, width)
    words = jnp.where(run & _ONE != 0, np.uint32(tall), np.uint32(wide)) if tall != wide else wide
    # the place of the cell in `free`, where the layouts lie one behind the other
    first = place.at - (run >> _ONE) * np.uint32(2 * WORD * tall * wide)
    cell = (first + np.uint32(_margin(tall, wide))) * np.uint32(WORD) + place.bit
    back = jnp.where(run < np.uint32(2), np.uint32(2**32 - 1), _ONE)
    line = jnp.uint32(words) * np.uint32(WORD)

    def is_free(cell: Array) -> Array:
        return read(tables.free, cell >> np.uint32(5)) >> (cell & _TOP)

    above, below = cell - line, cell + line
    before = is_free(above) & ~is_free(above + back)
    behind = is_free(below) & ~is_free(below + back)
    return (((before & _ONE) << np.uint32(2)) | ((behind & _ONE) << np.uint32(3))) * (
        is_free(cell) & _ONE
    )


def groups_of(height: int, width: int) -> tuple[int, int]:
    """Returns how many groups of 32 rows, and of 32 columns, the bit maps of a map have."""
    return height // WORD + 1, width // WORD + 1


def jump_tables(free: Array, goal: Array, width: int) -> JumpTables:
    """Returns the tables of one map; for use inside a marked call.

    Args:
      free: uint32 [H, words], packed.
      goal: int32 [2], a cell of the map.
      width: W.
    """
    tall, wide = groups_of(free.shape[0], width)
    size = WORD * tall * wide
    # both layouts, one behind the other, with a margin around them
    margin = _margin(tall, wide)

    def padded(free: Array) -> Array:
        return _put(jnp.zeros((WORD * tall, wide), jnp.uint32), free, (0, 0))

    def joined(rows: Array, columns: Array) -> Array:
        both = jnp.zeros(2 * size + 2 * margin, jnp.uint32)
        return _put(_put(both, rows.reshape(-1), margin), columns.reshape(-1), margin + size)

    rows = apart(padded)(free)
    both = apart(joined)(rows, transposed(rows))

    # squares have lines of one length in both layouts: one loop for all
    parts = [(tall, wide), (wide, tall)] if tall != wide else [(2 * tall, wide)]
    # All is overwritten. Were what it is filled with the same, arrays would be copied.
    stop, ahead = jnp.zeros(4 * size, jnp.uint32), jnp.ones(4 * size, jnp.uint32)
    tables = JumpTables(stop, ahead, jnp.zeros(2 * size, jnp.uint32), both)
    first = 0
    for groups, words in parts:
        tables = _corners(tables, margin, first, groups, words)
        first += groups * WORD * words
    tables = _with_goal(tables, goal, size, tall, wide)
    first = 0
    for groups, words in parts:
        ahead = _look_ahead(tables.ahead, both, margin, first, groups * WORD, words)
        tables = tables._replace(ahead=ahead)
        first += groups * WORD * words
    return tables


def transposed(rows: Array) -> Array:
    """Returns the bit map by columns of one by rows, uint32 [32 * tall, wide] -> [32 * wide, tall]:
    each block of 32 lines by exchanging halves, halves of halves and so on.
    """
    lines, words = rows.shape

    def block(i: Array, out: Array) -> Array:
        x = _slice(rows.reshape(-1), i.astype(jnp.uint32) * jnp.uint32(WORD * words), WORD * words)
        for by, mask in _HALVES:
            pairs = x.reshape(WORD // 2 // by, 2, by * words)
            first, second = pairs[:, 0], pairs[:, 1]
            moved = ((first >> np.uint32(by)) ^ second) & np.uint32(mask)
            x = jnp.stack([first ^ (moved << np.uint32(by)), second ^ moved], 1).reshape(-1)
        zero = jnp.uint32(0)
        column = x.reshape(WORD, words).T[..., None]
        return lax.dynamic_update_slice(out, column, (zero, zero, i.astype(jnp.uint32)))

    groups = lines // WORD
    new = jnp.zeros((words, WORD, groups), jnp.uint32)
    return repeat(groups, block, new).reshape(WORD * words, groups)


def _corners(tables: JumpTables, margin: int, first: int, groups: int, words: int) -> JumpTables:
    """Fills in all tables, 32 lines at a time: they stay in the first-level cache. In place of
    `ahead` come the stops of runs across the lines that are not blocked.
    """
    length, half = WORD * words, np.uint32(tables.square.size)

    def strip(i: Array, tables: JumpTables) -> JumpTables:
        place = i.astype(jnp.uint32) * jnp.uint32(length) + jnp.uint32(first)
        # three lines, each with its words to the left and to the right
        near = [
            [
                _slice(tables.free, place + np.uint32(margin + line + word), length)
                for word in (-1, 0, 1)
            ]
            for line in (-words, 0, words)
        ]
        last = [(here << _ONE) | (left >> _TOP) for left, here, _ in near]
        following = [(here >> _ONE) | (right << _TOP) for _, here, right in near]
        above, here, below = (line[1] for line in near)
        stops, aheads = [], []
        for beside, line in ((last, 0), (following, 2)):  # forwards, backwards
            stops.append(~here | (above & ~beside[0]) | (below & ~beside[2]))
            aheads.append(here & ((last[1] & ~last[line]) | (following[1] & ~following[line])))
        stop, ahead = (
            _put(_put(table, forth, place), back, place + half)
            for table, (forth, back) in ((tables.stop, stops), (tables.ahead, aheads))
        )
        square = here & following[1] & below & following[2]
        return JumpTables(stop, ahead, _put(tables.square, square, place), tables.free)

    return repeat(groups, strip, tables)


def place_in_parts(
    cell: Array, size: int, tall: int, wide: int
) -> Callable[[Array], tuple[Array, Array]]:
    """Returns a function of a part, uint32 [], that returns the word of a cell, int32 [2], in that
    part of a bit map by run, and its bit.
    """
    row, col = cell[0].astype(jnp.uint32), cell[1].astype(jnp.uint32)
    by_rows = row * jnp.uint32(wide) + (col >> np.uint32(5))
    by_cols = col * jnp.uint32(tall) + (row >> np.uint32(5))

    def place_of(part: Array) -> tuple[Array, Array]:
        is_by_rows = part & _ONE == 0
        place = part * jnp.uint32(size) + jnp.where(is_by_rows, by_rows, by_cols)
        return place, _ONE << (jnp.where(is_by_rows, col, row) & _TOP)

    return place_of


def _with_goal(tables: JumpTables, goal: Array, size: int, tall: int, wide: int) -> JumpTables:
    """Makes the goal a stop of every run."""
    place_of = place_in_parts(goal, size, tall, wide)

    def mark(i: Array, tables: JumpTables) -> JumpTables:
        place, bit = place_of(i.astype(jnp.uint32))
        stop, ahead = (
            write(table, read(table, place) | bit, place) for table in (tables.stop, tables.ahead)
        )
        return tables._replace(stop=stop, ahead=ahead)

    return repeat(4, mark, tables)


def _look_ahead(
    ahead: Array, free: Array, margin: int, first: int, lines: int, words: int
) -> Array:
    """Fills in `ahead` of one layout, or of both, line by line against the run: from the last line
    for runs down, from the first for runs up. In its place are the stops that are not blocked.
    """
    half = np.uint32(ahead.size // 2)
    base, margin_ = np.uint32(first), np.uint32(margin)

    def line(i: Array, state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        down, up, ahead = state
        place = i.astype(jnp.uint32) * jnp.uint32(words)
        at_up, at_down = base + place, base + np.uint32((lines - 1) * words) - place
        own = functools.partial(_slice, length=words)
        # read after what is written before, else the array would be copied
        down = apart(own)(ahead, at_down) | (own(free, at_down + margin_) & down)
        ahead = _put(ahead, down, at_down)
        up = apart(own)(ahead, at_up + half) | (own(free, at_up + margin_) & up)
        return down, up, _put(ahead, up, at_up + half)

    none = jnp.zeros(words, jnp.uint32)
    return repeat(lines, line, (none, none, ahead))[2]


def _slice(array: Array, place: Array, length: int) -> Array:
    return lax.dynamic_slice(array, (place,), (length,))


def _put(array: Array, part: Array, place: Any) -> Array:
    """`place`: the index of the first entry, or one of each axis."""
    return lax.dynamic_update_slice(array, part, place if isinstance(place, tuple) else (place,))
