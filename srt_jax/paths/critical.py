"""Which single cells keep start and goal joined: those whose blocking cuts the way.

Whatever the eight moves reach, the four straight ones reach too (`moves`): a diagonal needs both
cells beside it free. So a cell cuts the way exactly if it separates start and goal in the graph of
straight moves, and the rule of corners needs no care of its own: it holds on the map with the cell
blocked as well.

Number the cells of one way by straight moves, p1 = goal, p2, ..., pk = start. A cell off the way
cuts nothing, as the way itself remains. Without pn some way is left exactly if one leads from a
cell pi, i < n, to a cell pj, j > n, over cells off the way alone: of any walk around pn, take the
piece between the last of its cells with a number below n and the next one with a number above. Let
far(i) be the greatest number that a walk from pi comes to whose cells between are off the way. Then
pn is critical exactly if far(i) <= n for all i < n. One flood in the order of the numbers finds
that: when pn is looked at, all cells off the way that p1 to pn-1 lead to have been flooded, and the
greatest number beside them is known. Every word of cells is flooded once in all, whatever the
number of critical cells.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import compiled_whole, runs_in_place
from sign_model.foundation.sizes import next_power_of_two
from sign_model.foundation.words import WORD, num_words
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.batching import batch_kernel, each_or_all
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.moves import STRAIGHT_MOVES, is_on_map
from srt_jax.paths.reach import fill_runs
from srt_jax.propagation.lengths import UNREACHED, solve_map
from srt_jax.types import Array


def critical_cells(free: Array, start: Array, goal: Array) -> Array:
    """Returns the cells that every way from `start` to `goal` passes: with any one of them blocked
    there is none. All False where there is none anyway.

    Start and goal are among them. A diagonal move between two free cells counts as passing either,
    since with one of them blocked it is not legal. For those who place towers, doors or guards: to
    block a cell that is not critical leaves a way.

    Exact; about as fast as `cost_to_come`, however many cells are critical. Memory besides argument
    and result: 20 bytes a cell of the one map in work.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start, goal: int32 [..., 2], (row, col); may lie outside the map.

    Returns:
      bool [..., H, W].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> free[1, 3] = True  # the only gap
      >>> cells = srt_jax.critical_cells(free, (2, 0), (2, 6))
      >>> np.argwhere(cells).tolist()  # the gap, the cells before and behind, start and goal
      [[1, 2], [1, 3], [1, 4], [2, 0], [2, 6]]
    """
    (free, start, goal), batch = arguments.mask_and_cells(free=free, start=start, goal=goal)
    return eager.call(_critical_maps, batch, free, start, goal)


@batch_kernel
def _critical_maps(free: Array, start: Array, goal: Array) -> Array:
    words = compiled_whole(each_or_all(_critical_of_map))(free, start, goal)
    return packing.unpack(words, free.shape[2])


class _Shape(NamedTuple):
    """Static: the words of a row, one empty word on each side, and the cells in them."""

    lanes: int
    height: int

    @property
    def stride(self) -> int:
        return self.lanes * WORD

    @property
    def num_words(self) -> int:
        return self.lanes * (self.height + 2)


class _Way(NamedTuple):
    """at: uint32 [], the cell in work; num: uint32 [], cells so far; number: uint32 [cells], of
    each cell of the way, from 1 at the goal, 0 of all others.
    """

    at: Array
    num: Array
    number: Array


def _critical_of_map(free: Array, start: Array, goal: Array) -> Array:
    """Returns the critical cells of one map, packed: uint32 [H, words]."""
    height, width = free.shape
    shape = _Shape(num_words(width) + 2, height)
    way, first = _number_way(free, start, goal, shape)
    words = jnp.pad(packing.pack(free[None])[0], 1)
    find = _by_flood if runs_in_place() else _by_rounds
    return find(words, way, first, shape).reshape(height + 2, shape.lanes)[1:-1, 1:-1]


def _number_way(free: Array, start: Array, goal: Array, shape: _Shape) -> tuple[_Way, Array]:
    """The way from the goal back to the start, and the place of the goal; no cells where there is
    none.

    It ends at the start: a cell entered straight has a straight neighbour that is nearer the start,
    and one entered diagonally has that in both cells beside the move. Lengths fall from cell to
    cell, so none comes twice.
    """
    height, width = free.shape
    length, _ = solve_map(free, start)
    margin = ((1, 1), (WORD, shape.stride - WORD - width))
    length = jnp.pad(length, margin, constant_values=UNREACHED).reshape(-1)
    is_inside = is_on_map(goal[0], goal[1], height, width)
    first = jnp.where(is_inside, (goal[0] + 1) * shape.stride + WORD + goal[1], 0)
    first = first.astype(jnp.uint32)
    is_there = read(length, first) < UNREACHED
    number = jnp.zeros(shape.num_words * WORD, jnp.uint32)
    number = write(number, is_there.astype(jnp.uint32), first)

    def step(way: _Way) -> _Way:
        near = [way.at + offset for offset in _offsets(shape.stride)]
        to, least = near[0], read(length, near[0])
        for other in near[1:]:
            there = read(length, other)
            to, least = jnp.where(there < least, other, to), jnp.minimum(there, least)
        num = way.num + jnp.uint32(1)
        return _Way(to, num, write(way.number, num, to))

    begin = _Way(first, is_there.astype(jnp.uint32), number)
    end = lax.while_loop(lambda way: is_there & (read(length, way.at) > 0), step, begin)
    return end, first


def _offsets(stride: int) -> list[Array]:
    """The straight moves, as steps in a flat array: uint32 []."""
    return [jnp.uint32((down * stride + right) % 2**32) for down, right in STRAIGHT_MOVES]


class _Numbered(NamedTuple):
    """The carry over the cells of the way. at: uint32 [], the cell in work. n, far: uint32 [], its
    number, and the greatest one that the cells before it lead to. critical: uint32 [words]. closed,
    due, queue, tail: as in `_Flood`; between two cells of the way nothing is due.
    """

    at: Array
    n: Array
    far: Array
    closed: Array
    due: Array
    queue: Array
    tail: Array
    critical: Array


class _Flood(NamedTuple):
    """head, tail: uint32 [], counts of words taken and queued. far: uint32 [], as in `_Numbered`.
    closed: uint32 [words], cells off the way not flooded yet; due: those beside a flooded one.
    queue: uint32 [room], a ring of the words that have such cells.
    """

    head: Array
    tail: Array
    far: Array
    closed: Array
    due: Array
    queue: Array


def _by_flood(words: Array, way: _Way, first: Array, shape: _Shape) -> Array:
    """Cell by cell of the way, word by word of what lies beside it: uint32 [words]."""
    one, top, bits = jnp.uint32(1), jnp.uint32(WORD - 1), jnp.uint32(5)
    number, num = way.number, way.num
    on_way = packing.pack((number != 0).reshape(1, shape.height + 2, shape.stride)).reshape(-1)
    closed = words.reshape(-1) & ~on_way
    room = next_power_of_two(shape.num_words)
    mask = jnp.uint32(room - 1)
    beside = (
        (jnp.uint32(-shape.lanes % 2**32), lambda cells: cells),
        (jnp.uint32(shape.lanes), lambda cells: cells),
        (jnp.uint32(2**32 - 1), lambda cells: cells << top),
        (one, lambda cells: cells >> top),
    )

    def farthest(far: Array, word: Array, cells: Array) -> Array:
        """The greatest number among cells of a word, or `far`."""

        def look(state: tuple[Array, Array]) -> tuple[Array, Array]:
            left, far = state
            bit = lax.population_count((left & -left) - one)
            return left & (left - one), jnp.maximum(far, read(number, (word << bits) + bit))

        return lax.while_loop(lambda state: state[0] != 0, look, (cells, far))[1]

    def take(state: _Flood) -> _Flood:
        word = read_apart(state.queue, state.head & mask)
        here = read_apart(state.closed, word)
        due = read_apart(state.due, word) & here
        new = fill_runs(here, due)
        closed = write(state.closed, here & ~new, word)
        # always 0, but written in this form it has to wait for the read
        due = write(state.due, due & ~new, word)
        far = farthest(state.far, word, ((new << one) | (new >> one)) & read(on_way, word))
        queue, tail = state.queue, state.tail
        for offset, moved in beside:
            to = word + offset
            had = read_apart(due, to)
            gets = moved(new)
            far = farthest(far, to, gets & read(on_way, to))
            gets = gets & read_apart(closed, to)
            due = write(due, had | gets, to)
            queue = write(queue, to, tail & mask)
            tail = tail + ((had == 0) & (gets != 0)).astype(jnp.uint32)
        return _Flood(state.head + one, tail, far, closed, due, queue)

    def visit(state: _Numbered) -> _Numbered:
        at, n = state.at, state.n
        word, bit = at >> bits, one << (at & top)
        is_critical = state.far <= n
        old = read_apart(state.critical, word)
        critical = write(state.critical, jnp.where(is_critical, old | bit, old), word)
        # what touches the cell: cells of the way, and others, which become due
        far, due, queue, tail, ahead = state.far, state.due, state.queue, state.tail, at
        for offset in _offsets(shape.stride):
            cell = at + offset
            there = read(number, cell)
            far = jnp.maximum(far, there)
            ahead = jnp.where(there == n + one, cell, ahead)
            to = cell >> bits
            had = read_apart(due, to)
            gets = (one << (cell & top)) & read_apart(state.closed, to)
            due = write(due, had | gets, to)
            queue = write(queue, to, tail & mask)
            tail = tail + ((had == 0) & (gets != 0)).astype(jnp.uint32)
        flood = _Flood(state.tail, tail, far, state.closed, due, queue)
        # Ends: each word taken loses at least one cell.
        flood = lax.while_loop(lambda flood: flood.head != flood.tail, take, flood)
        return _Numbered(
            ahead,
            n + one,
            flood.far,
            flood.closed,
            flood.due,
            flood.queue,
            flood.tail,
            critical,
        )

    nothing = jnp.zeros(shape.num_words, jnp.uint32)
    begin = _Numbered(
        first, one, one, closed, nothing, jnp.zeros(room, jnp.uint32), jnp.uint32(0), nothing
    )
    return lax.while_loop(lambda state: state.n <= num, visit, begin).critical


class _Round(NamedTuple):
    """far: uint32 [H + 2, cells of a row], the greatest number that a cell off the way leads to, so
    far; is_changing: bool [].
    """

    far: Array
    is_changing: Array


def _by_rounds(words: Array, way: _Way, first: Array, shape: _Shape) -> Array:
    """All cells at once: as many rounds as the longest walk beside the way has moves."""
    del first
    number = way.number.reshape(shape.height + 2, shape.stride)
    is_off = packing.unpack(words[None], shape.stride)[0] & (number == 0)

    def around(far: Array) -> Array:
        seen = jnp.pad(jnp.maximum(far, number), 1)
        height, width = far.shape
        sides = [
            seen[1 + down : 1 + down + height, 1 + right : 1 + right + width]
            for down, right in STRAIGHT_MOVES
        ]
        return functools.reduce(jnp.maximum, sides)

    def once_more(state: _Round) -> _Round:
        far = jnp.where(is_off, jnp.maximum(state.far, around(state.far)), jnp.uint32(0))
        return _Round(far, jnp.any(far != state.far))

    begin = _Round(jnp.zeros_like(number), jnp.bool_(True))
    far = lax.while_loop(lambda state: state.is_changing, once_more, begin).far
    # by number: the farthest that each cell of the way leads to, and of all before it
    beyond = jnp.where(number != 0, around(far), jnp.uint32(0)).reshape(-1)
    of_number = jnp.zeros(number.size + 1, jnp.uint32).at[number.reshape(-1)].max(beyond)
    before = jnp.pad(lax.cummax(of_number.at[0].set(jnp.uint32(0))), (1, 0))
    is_critical = (number != 0) & (before[number] <= number)
    return packing.pack(is_critical[None])[0].reshape(-1)
