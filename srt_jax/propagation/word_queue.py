"""A queue of words whose cells have just been reached: what sweeps of a flood cannot finish in a
few rounds.

In a maze the flood turns back at every corner, and each turn would cost a sweep over the whole map;
a queue visits only words that change. `open_cells` may be reached and are not yet; `due` are
those of them beside a cell that has been. A word waits in the queue exactly while it has cells due,
so the queue never holds more entries than there are words. Taking a word reaches the whole run of
each due cell, inside the word, and makes the open cells beside these runs due. It ends, because
every word taken loses at least one open cell.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart
from sign_model.foundation.sizes import next_power_of_two
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.types import Array

_ONE, _TOP = 1, 31  # shifts by one cell, and between neighbouring words
_PARTS = 16


class _Flood(NamedTuple):
    """head, tail: uint32 [], counts of words taken and queued so far; queue: uint32 [room], a ring
    of word indices; open_cells, due: uint32 [words], flat, see above.
    """

    head: Array
    tail: Array
    open_cells: Array
    due: Array
    queue: Array


def flood_rest(
    free: Array,
    reached: Array,
    *,
    group: int,
    through_corners: bool | Array,
    fill_runs: Callable,
    limit: Array,
) -> tuple[Array, Array]:
    """Returns the flood of a group in lanes from what has been reached, and whether it is complete,
    bool [].

    Args:
      free, reached: uint32 [H + 2, lanes], lanes as in `packing`; the first and the last row and
        `group` lanes on either side are empty, so that no word lacks a neighbour. Inside each word
        whole runs have been reached.
      through_corners: whether cells that share only a corner are connected.
      fill_runs: (free, reached) -> reached, spread over runs inside each word.
      limit: uint32 [], how many words may be taken.
    """
    lanes = free.shape[1]
    beside = _beside(lanes, group, through_corners)
    # each computed apart: the compiler would else work out the one in every use of the other
    open_cells = apart(lambda free, reached: (free & ~reached).reshape(-1))(free, reached)
    near = functools.partial(_due, beside=beside, margin=lanes + group)
    due = apart(near)(reached.reshape(-1), open_cells)
    num, queue = apart(_nonzero)(due)
    mask = jnp.uint32(queue.shape[0] - 1)

    def take(state: _Flood) -> _Flood:
        head, tail, open_cells, due, queue = state
        # reach the runs of the due cells of the next word
        word = read_apart(queue, head & mask)
        free_here = read_apart(open_cells, word)
        due_here = read_apart(due, word) & free_here
        new = fill_runs(free_here, due_here)
        open_cells = write(open_cells, free_here & ~new, word)
        # always 0, but written in this form it has to wait for the read
        due = write(due, due_here & ~new, word)
        flood = _Flood(head + jnp.uint32(1), tail, open_cells, due, queue)
        if through_corners is not False:  # runs touch more words than they end in
            return make_due(flood, word, new, beside)
        flood = make_due(flood, word, new, beside[:2])
        # to the sides seldom: few runs go on in the next word
        goes_on = jnp.uint32(0)
        for offset, moved in beside[2:]:
            goes_on |= moved(new) & read_apart(flood.open_cells, word + jnp.uint32(offset % 2**32))
        return lax.while_loop(
            lambda state: state[0],
            lambda state: (jnp.bool_(False), make_due(state[1], word, new, beside[2:])),
            (goes_on != 0, flood),
        )[1]

    def make_due(state: _Flood, word: Array, new: Array, beside: list) -> _Flood:
        """Makes open cells beside `new` due, and queues a word that had none."""
        head, tail, open_cells, due, queue = state
        for offset, moved in beside:
            to = word + jnp.uint32(offset % 2**32)
            had = read_apart(due, to)
            gets = moved(new) & read_apart(open_cells, to)
            due = write(due, had | gets, to)
            queue = write(queue, to, tail & mask)
            tail = tail + ((had == 0) & (gets != 0)).astype(jnp.uint32)
        return _Flood(head, tail, open_cells, due, queue)

    state = _Flood(jnp.uint32(0), num, open_cells, due, queue)
    # ends with an empty queue: each word taken loses at least one open cell
    end = lax.while_loop(
        lambda state: (state.head != state.tail) & (state.head < limit), take, state
    )
    return free & ~end.open_cells.reshape(free.shape), end.head == end.tail


def _beside(
    lanes: int, group: int, through_corners: bool | Array
) -> list[tuple[int, Callable[[Array], Array]]]:
    """The neighbouring words, as offsets, and which of their cells touch given cells of a word."""
    one, top = jnp.uint32(_ONE), jnp.uint32(_TOP)
    to_left, to_right = (-group, lambda cells: cells << top), (group, lambda cells: cells >> top)
    if through_corners is False:
        return [(-lanes, lambda cells: cells), (lanes, lambda cells: cells), to_left, to_right]

    def wide(cells: Array) -> Array:
        return cells | chosen((cells << one) | (cells >> one), through_corners)

    rows = [(-lanes, wide), (lanes, wide)]
    corners = [
        (row + side, lambda cells, moved=moved: chosen(moved(cells), through_corners))
        for row in (-lanes, lanes)
        for side, moved in (to_left, to_right)
    ]
    return [*rows, to_left, to_right, *corners]


def chosen(words: Array, is_chosen: bool | Array) -> Array:
    """Returns `words` where `is_chosen` (True, or bool []), else 0."""
    return words if is_chosen is True else jnp.where(is_chosen, words, jnp.uint32(0))


def _due(reached: Array, open_cells: Array, beside: list, margin: int) -> Array:
    """The open cells that touch reached ones; flat, as these are. `margin`: words at either end
    beyond which none is open.
    """
    size = len(reached) - 2 * margin
    near = jnp.zeros(size, jnp.uint32)
    for offset, moved in beside:
        first = margin - offset
        near = near | moved(reached[first : first + size])
    return jnp.pad(near & open_cells[margin : margin + size], margin)


def _nonzero(words: Array) -> tuple[Array, Array]:
    """How many words are not 0, and their indices, in a list whose length is a power of two."""
    size, one = len(words), np.uint32(_ONE)
    queue = jnp.zeros(next_power_of_two(size), jnp.uint32)
    # Most are 0: so many at once are passed by, the i-th of each part. One that is not 0 ends it.
    step = -(-size // _PARTS)
    words = jnp.pad(words, (0, _PARTS * step - size))
    parts = [words[part * step : (part + 1) * step] for part in range(_PARTS)]
    filled = jnp.pad(functools.reduce(jnp.bitwise_or, parts), (0, 1), constant_values=1)

    def next_filled(at: Array) -> Array:
        return lax.while_loop(lambda at: read(filled, at) == 0, lambda at: at + one, at)

    def note(state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        at, num, queue = state

        def one_part(part: Array, state: tuple[Array, Array]) -> tuple[Array, Array]:
            num, queue = state
            # what is no entry is overwritten by the next one
            index = part.astype(jnp.uint32) * np.uint32(step) + at
            return num + (read(words, index) != 0).astype(jnp.uint32), write(queue, index, num)

        num, queue = repeat(_PARTS, one_part, (num, queue))
        return next_filled(at + one), num, queue

    begin = (next_filled(jnp.uint32(0)), jnp.uint32(0), queue)
    return lax.while_loop(lambda state: state[0] < np.uint32(step), note, begin)[1:]
