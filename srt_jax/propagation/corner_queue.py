"""A search for the costs of all cells that walks from corner to corner: most cells never wait in a
queue.

Moves follow the canonical ordering of `cell_queue`, which says why nothing is lost: straight on
after a straight move, and to a side behind which a wall has just ended; after a diagonal move the
same one and its two components. So only where a wall ends does a straight walk branch. At such a
cell, a corner, it stops, and the corner waits in a bucket of its cost; a diagonal walk sends a
straight one along each component from every cell. (N. Sturtevant, S. Rabin: Canonical orderings on
grids, IJCAI 2016, with a queue of cells.) A walk ends where it lowers no cost. One that comes
before a cheaper one writes costs that fall again, which is right, and rare: cells are written 1.0
to 1.2 times each, on mazes, streets and noise alike.

The queue never overflows: a corner for which there is no room is left out, and once the queue is
empty, all cells are looked at, each as a corner with all its moves. It ends, because costs only
fall, and after a look without loss no move can improve any cell.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from sign_model.foundation.sizes import next_power_of_two
from srt_jax import moves
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.propagation import row_sweeps
from srt_jax.propagation.cell_queue import ANY, CLOCKWISE, moves_to_try
from srt_jax.types import Array

_AT_ONCE = 4  # cells of a straight walk without a branch
_WIDER = 1  # a bucket is so many bits wider than the highest power of two in a straight move's cost

_PLACES = 4  # of an entry of the queue

_ONE = np.uint32(1)
# sets of moves have bit i for CLOCKWISE[i]: even ones are straight, odd ones diagonal
_STRAIGHTS, _DIAGONALS = np.uint32(0x55), np.uint32(0xAA)
_NONE = np.uint32(8)  # in place of a diagonal move


class _Queue(NamedTuple):
    """num: uint32 [], corners that wait; spare: uint32 [], the first entry not in use, 0 where
    there is none; is_short: bool [], whether a corner was left out; first: uint32 [buckets], the
    first entry of each bucket, or 0; entries: uint32 [4 * room], an entry every fourth place: the
    next one of the same bucket, or the next spare one; the corner; the moves to try from there.
    """

    num: Array
    spare: Array
    is_short: Array
    first: Array
    entries: Array


class _Search(NamedTuple):
    """runs: uint32 [], straight moves to be tried from the cell `at`, whose cost is `here`; part:
    uint32 [], the diagonal move that leads on from there, or _NONE; diagonals: uint32 [], moves to
    be tried yet from `corner`; bucket: uint32 [], the one in work, not modulo their number;
    next_cell: uint32 [], where to look for corners left out; cost: uint32 [N].
    """

    runs: Array
    diagonals: Array
    part: Array
    at: Array
    here: Array
    corner: Array
    bucket: Array
    next_cell: Array
    cost: Array
    queue: _Queue


class _Run(NamedTuple):
    """goes_on: bool []; stops: bool [], whether it ends in a corner, or before a wall, at a cell
    whose cost fell; at, here: uint32 [], the last cell whose cost fell, and its cost; cost: uint32
    [N].
    """

    goes_on: Array
    stops: Array
    at: Array
    here: Array
    cost: Array


def begin(free: Array, width: int, start: Array, diagonal: Array) -> tuple[Array, Array]:
    """Returns what `spread` starts from: the cost of every cell, uint32 [N], 0 at the start, and
    where that lies, uint32 []; 0 if it is not a free cell of the map.

    Args:
      free: uint32 [H, words], packed.
      width: W.
      start: int32 [2].
    """
    cell = place_of(free, width, start)
    unreached = row_sweeps.unreached(diagonal)
    cost = jnp.full((free.shape[0] + 2) * (width + 2), unreached, jnp.uint32)
    return write(cost, jnp.where(cell == 0, unreached, jnp.uint32(0)), cell), cell


def place_of(free: Array, width: int, cell: Array) -> Array:
    """Returns where a cell, int32 [2], lies in a flat bordered field, uint32 []; 0 if it is not a
    free cell of the map.
    """

    def place(free: Array, cell: Array) -> Array:
        flat = (cell[0] + 1) * (width + 2) + cell[1] + 1
        return jnp.where(packing.has(free, cell, width), flat, 0).astype(jnp.uint32)

    return apart(place)(free, cell)


def spread(
    cost: Array,
    free_beside: Array,
    start: Array,
    is_cut: Array | bool,
    straight: Array,
    diagonal: Array,
    shape: tuple[int, int],
    room: int | None = None,
) -> Array:
    """Returns the exact costs; for use inside a marked call.

    Args:
      cost: uint32 [N], a flat bordered field (`row_sweeps`); what blocked cells hold stays.
      free_beside: uint8 [N], from `cell_queue.neighbours`.
      start: uint32 [], the cell to start from, whose cost is 0; 0 for none.
      is_cut: whether any cell that is reached may improve others, so that all are looked at.
      straight, diagonal: uint32 [], the fixed point.
      shape: (H, W).
      room: of the queue, a power of two; by default enough for most maps.
    """
    height, width = shape
    size = np.uint32(cost.shape[0])
    room = room or max(64, next_power_of_two(cost.shape[0] // 16))
    buckets = _num_buckets(height, width)
    shift = np.uint32(31 + _WIDER) - lax.clz(straight)
    ring, zero = np.uint32(buckets - 1), jnp.uint32(0)
    least_unreached = row_sweeps.unreached(diagonal)
    table = jnp.asarray(moves_to_try())
    offset = jnp.asarray(_offsets(width + 2))
    walk = _walker(free_beside, straight)

    def moves_of(cell: Array, led_by: Array | np.uint32) -> Array:
        return apart(_moves_of)(free_beside, table, cell, jnp.asarray(led_by))

    def take(search: _Search) -> _Search:
        """Takes the next corner out of the queue, which is not empty."""
        queue = search.queue
        bucket = lax.while_loop(
            lambda bucket: read(queue.first, bucket & ring) == 0,
            lambda bucket: bucket + _ONE,
            search.bucket,
        )
        index = read_apart(queue.first, bucket & ring)
        after, corner, todo = (
            read_apart(queue.entries, index + np.uint32(i)) for i in range(_PLACES - 1)
        )
        first = write(queue.first, after, bucket & ring)
        # always the spare one, but written in this form it has to wait for the reads
        is_none = (corner == 0) | (todo == 0)
        entries = write(queue.entries, jnp.where(is_none, after, queue.spare), index)
        here = read_apart(search.cost, corner)
        # one that has been reached at a lower cost waits, if it is a corner, in a lower bucket
        todo = jnp.where(here >> shift == bucket, todo, zero)
        queue = _Queue(queue.num - _ONE, index, queue.is_short, first, entries)
        return _at_corner(search._replace(bucket=bucket, queue=queue), corner, here, todo)

    def look(search: _Search) -> _Search:
        """Takes the next cell of all, while there may be corners that were left out."""
        begins = search.next_cell == size
        cell = jnp.where(begins, zero, search.next_cell)
        here = read_apart(search.cost, cell)
        todo = jnp.where(here < least_unreached, moves_of(cell, np.uint32(ANY)), zero)
        queue = search.queue._replace(is_short=search.queue.is_short & ~begins)
        search = search._replace(bucket=here >> shift, next_cell=cell + _ONE, queue=queue)
        return _at_corner(search, cell, here, todo)

    def step_diagonally(search: _Search) -> _Search:
        """One diagonal move: the one in work, or the next one from the corner."""
        begins = search.part == _NONE
        move = jnp.where(begins, _lowest(search.diagonals), search.part)
        left = jnp.where(begins, search.diagonals & (search.diagonals - _ONE), search.diagonals)
        last = jnp.where(begins, search.corner, search.at)
        at = last + read(offset, move & np.uint32(7))
        here = read_apart(search.cost, last) + diagonal
        old = read_apart(search.cost, at)
        todo = jnp.where(here < old, moves_of(at, move), zero)
        return search._replace(
            runs=todo & _STRAIGHTS,
            diagonals=left,
            part=jnp.where(todo & (_ONE << move) != 0, move, _NONE),
            at=at,
            here=here,
            cost=write(search.cost, jnp.minimum(old, here), at),
        )

    def add(queue: _Queue, run: _Run, todo: Array) -> _Queue:
        """Puts the corner where a run has stopped into the queue; none where nothing is to do."""

        def once(state: tuple[Array, _Queue]) -> tuple[Array, _Queue]:
            _, queue = state
            spare, bucket = queue.spare, (run.here >> shift) & ring
            is_full = spare == 0
            next_spare, head = read_apart(queue.entries, spare), read_apart(queue.first, bucket)
            entries = write(queue.entries, jnp.where(is_full, next_spare, head), spare)
            entries = write(entries, run.at, spare + _ONE)
            entries = write(entries, todo, spare + np.uint32(2))
            return jnp.bool_(False), _Queue(
                queue.num + (~is_full).astype(jnp.uint32),
                jnp.where(is_full, zero, next_spare),
                queue.is_short | is_full,
                write(queue.first, jnp.where(is_full, head, spare), bucket),
                entries,
            )

        return lax.while_loop(lambda state: state[0], once, (todo != 0, queue))[1]

    def step(search: _Search) -> _Search:
        """The next straight walk; what comes before it, where none is due."""
        search = lax.while_loop(lambda s: _is_done_here(s) & (s.queue.num != 0), take, search)
        search = lax.while_loop(lambda s: _is_done_here(s) & _must_look(s, size), look, search)
        search = lax.while_loop(
            lambda s: (s.runs == 0) & ((s.diagonals != 0) | (s.part != _NONE)),
            step_diagonally,
            search,
        )
        move = _lowest(search.runs)
        by = read_apart(offset, move & np.uint32(7))
        begin = _Run(move < _NONE, jnp.bool_(False), search.at, search.here, search.cost)
        run = lax.while_loop(lambda run: run.goes_on, lambda run: walk(run, move, by), begin)
        todo = jnp.where(run.stops, moves_of(run.at, move), zero)  # none from a dead end
        queue = add(search.queue, run, todo)
        runs = search.runs & (search.runs - _ONE)
        return search._replace(runs=runs, cost=run.cost, queue=queue)

    # entry 0 stands for none; the others are spare, one after the other
    places = np.uint32(_PLACES * room)
    entries = (jnp.arange(places, dtype=jnp.uint32) + np.uint32(_PLACES)) & (places - _ONE)
    entries = write(entries, zero, zero)
    first = jnp.zeros(buckets, jnp.uint32)
    queue = _Queue(zero, jnp.uint32(_PLACES), jnp.asarray(is_cut), first, entries)
    todo = jnp.where(start != 0, moves_of(start, np.uint32(ANY)), zero)
    none, end = jnp.uint32(_NONE), jnp.uint32(size)
    search = _Search(zero, zero, none, start, zero, start, zero, end, cost, queue)
    return lax.while_loop(
        lambda s: ~_is_done_here(s) | (s.queue.num != 0) | _must_look(s, size),
        step,
        _at_corner(search, start, zero, todo),
    ).cost


def _walker(free_beside: Array, straight: Array) -> Callable[[_Run, Array, Array], _Run]:
    """A function that walks on by a straight move, whose offset is `by`, for a few cells."""
    goes_by = jnp.asarray(_goes_straight_on())

    def on_by(free_beside: Array, goes_by: Array, cell: Array) -> Array:
        return read(goes_by, read(free_beside, cell).astype(jnp.uint32)).astype(jnp.uint32)

    def walk(run: _Run, move: Array, by: Array) -> _Run:
        # without a branch: a cell past the end of the walk is written again as it was
        cost, goes_on, stops, num = run.cost, jnp.bool_(True), jnp.bool_(False), jnp.uint32(0)
        for i in range(1, _AT_ONCE + 1):
            cell, here = run.at + by * np.uint32(i), run.here + straight * np.uint32(i)
            old = read_apart(cost, cell)
            falls = goes_on & (here < old)
            cost = write(cost, jnp.where(falls, here, old), cell)
            is_plain = (apart(on_by)(free_beside, goes_by, cell) >> move) & _ONE != 0
            num = num + falls.astype(jnp.uint32)
            stops, goes_on = stops | (falls & ~is_plain), falls & is_plain
        return _Run(goes_on, stops, run.at + by * num, run.here + straight * num, cost)

    return walk


def _goes_straight_on() -> np.ndarray:
    """uint8 [256]: by which straight moves a walk that led into the cell goes on and does nothing
    else, by the free neighbours.
    """
    table = moves_to_try().reshape(256, 16)
    return np.bitwise_or.reduce(
        [(table[:, move] == 1 << move).astype(np.uint8) << move for move in (0, 2, 4, 6)]
    )


def _moves_of(free_beside: Array, table: Array, cell: Array, led_by: Array) -> Array:
    beside = read(free_beside, cell).astype(jnp.uint32)
    return read(table, (beside << np.uint32(4)) | led_by).astype(jnp.uint32)


def _offsets(stride: int) -> np.ndarray:
    """uint32 [8]: the distances of the neighbours in a flat bordered field."""
    steps = [down * stride + right for down, right in CLOCKWISE]
    return np.array(steps, np.int32).astype(np.uint32)


def _num_buckets(height: int, width: int) -> int:
    """How many buckets the queue has, a power of two: more than any walk is long."""
    longest, shortest = max(height, width), min(height, width)
    most = max(
        (straight * longest + diagonal * shortest) >> (straight.bit_length() - 1 + _WIDER)
        for straight, diagonal in moves.FIXED_POINTS
    )
    return next_power_of_two(most + 3)


def _lowest(bits: Array) -> Array:
    """Returns the index of the lowest bit set; 32 where none is."""
    return lax.population_count((bits & -bits) - _ONE)


def _at_corner(search: _Search, corner: Array, here: Array, todo: Array) -> _Search:
    """Makes the moves `todo` from a corner the next ones; none is left from the last one."""
    runs, diagonals = todo & _STRAIGHTS, todo & _DIAGONALS
    return search._replace(runs=runs, diagonals=diagonals, at=corner, here=here, corner=corner)


def _is_done_here(search: _Search) -> Array:
    return (search.runs == 0) & (search.diagonals == 0) & (search.part == _NONE)


def _must_look(search: _Search, size: np.uint32) -> Array:
    is_left_out = (search.next_cell < size) | search.queue.is_short
    return (search.queue.num == 0) & is_left_out
