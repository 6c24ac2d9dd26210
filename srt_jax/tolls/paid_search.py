"""The least sum of a route's length and of the tolls of what it destroys, each paid once: a search
by jump points that remembers what has been paid for.

THE WAY. Let S be the obstacles that a least way destroys. With these gone it is a shortest path,
and of all shortest paths one consists of legs between corners of what stays, as
`paths.jump_points` says: any number of diagonal moves in one direction, then a run of straight
moves. So legs go through obstacles, each paid for where it is first entered; corners are those of
all obstacles, which holds those of what stays, whatever S may be.

THE SEARCH. A label is a way to a cell: its sum, which of the obstacles on it have been paid for
(`paid_sets`), and the moves to try from there. Those paid for are free from there on, all others
are paid at the door (`entry`). Of rectangles no least way enters one twice (`shapes`), so they need
no memory. A leg ends with a label at a corner, where the moves of `jump_points` begin, and at a
door, from where it goes on. Labels wait in buckets of the sum and the octile distance to the goal,
and a leg ends as well where these are more than the best answer.

WHICH LABELS ARE DROPPED. Of two labels of one cell, one is worse than the other if its sum is more
than the other's with the tolls of what it alone has paid for added: whoever has the other may pay
these tolls again, should they be needed, and go the same way from there. A toll that is paid for is
worth nothing where any way from the cell through the obstacle's bounding box to the goal is longer
than the best answer allows; it is forgotten. Labels of one sum that have paid for the same are one,
with the moves of both.

WHY IT ENDS WITH THE LEAST. Of the least way above, every corner and door gets its label, with its
sum, by induction: the label before tries the leg. It is never dropped: a label that it is worse
than, followed by the rest of the way, would be cheaper than the least. Where it is one with
another, both try the rest of the way. Nothing is below the least sum, for labels are ways.

Where obstacles share a bit, the map is one on which they are one obstacle of the least of their
tolls. Then the least sum is a lower bound, and the way found an answer, the best one where it costs
no more with every toll paid. Where labels find no room, there is an answer, but no bound.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.obstacles import Labels
from srt_jax.paths.jump_points import moves_to_try
from srt_jax.paths.jump_tables import next_stop
from srt_jax.tolls import entry
from srt_jax.tolls.paid_sets import Memory, Metric, octile, useful, worth
from srt_jax.tolls.stops import Stops
from srt_jax.types import Array

UNREACHED = entry.CLOSED
"""The sum of a way that does not exist, or is too dear to be held."""

_BUCKETS, _SHIFT = 4096, np.uint32(9)
_ONE = np.uint32(1)

# Moves: runs 0 right, 1 down, 2 left, 3 up, then diagonals 4 down right, 5 down left, 6 up right,
# 7 up left. A set of moves has a bit for each; the bits above are those that have been tried.
_NO_MOVE, _TRIED = np.uint32(8), np.uint32(8)
_RUNS, _EVERY = np.uint32(15), np.uint32(255)
_DOWN = np.array([0, 1, 0, -1, 1, 1, -1, -1, 0], np.int32).astype(np.uint32)
_RIGHT = np.array([1, 0, -1, 0, 1, -1, 1, -1, 0], np.int32).astype(np.uint32)
_COMPONENTS = np.array([0] * 4 + [0b0011, 0b0110, 0b1001, 0b1100, 0], np.uint32)

# How a label was reached: by a move, through a door or not.
_DOOR, _ORIGIN = np.uint32(8), np.uint32(4)


class Best(NamedTuple):
    """total: uint32 [], of the way found, UNREACHED where none is within the limit. needed: bool
    [M], what it needs gone. bound: uint32 [], no way within the limit costs less; UNREACHED where
    there is none. is_full: bool [], whether labels found no room; then the bound is 0. num_labels:
    uint32 [], as many as were made.
    """

    total: Array
    needed: Array
    bound: Array
    is_full: Array
    num_labels: Array


class _Store(NamedTuple):
    """Labels, all uint32 [room], the first of which is none. origin: 16 times the label that it
    came from, and how. others: another label of the same cell. after: the next one of its bucket.
    """

    sums: Array
    paid: Array
    origin: Array
    cell: Array
    moves: Array
    others: Array
    after: Array


class _Labels(NamedTuple):
    """num, num_more, num_waiting: uint32 [], of all, of those that are not the first of their cell,
    and of those that wait. limit: uint32 [], the dearest sum that may matter. best: uint32
    [], the label of the best answer. is_full: bool [], whether one had no room. first: uint32
    [H * W], of each cell. heads: uint32 [_BUCKETS + 1], of each bucket, the last one of none.
    """

    num: Array
    num_more: Array
    num_waiting: Array
    limit: Array
    best: Array
    is_full: Array
    first: Array
    heads: Array
    store: _Store


class _Leg(NamedTuple):
    """Where legs are on their way, all uint32 []. move: the one in work, _NO_MOVE for none; row,
    col, sum: where. The diagonal that runs begin from: diagonal, its_row, its_col, its_sum. runs,
    diagonals: to be tried from there, and from the label.
    """

    move: Array
    row: Array
    col: Array
    sum: Array
    diagonal: Array
    its_row: Array
    its_col: Array
    its_sum: Array
    runs: Array
    diagonals: Array


class _Rivals(NamedTuple):
    """label: uint32 [], the next to compare with, 0 for none. same: uint32 [], one of the same sum
    that has paid for the same. is_worse: bool [], than one of those before.
    """

    label: Array
    same: Array
    is_worse: Array


class _Candidate(NamedTuple):
    """A label to be; all but is_goal uint32 []."""

    row: Array
    col: Array
    sum: Array
    far: Array
    paid: Array
    moves: Array
    origin: Array
    is_goal: Array


def search_once(
    labels: Labels,
    stops: Stops,
    tolls: Array,
    memory: Memory,
    metric: Metric,
    limit: Array,
    room: Array,
) -> Best:
    """Returns the best way of one map. For use inside a marked call.

    Args:
      tolls: uint32 [M], CLOSED of what must stay.
      memory: of those that may be entered twice.
      metric: from a free start to another cell.
      limit: uint32 [], less than UNREACHED: no way dearer than that is looked for.
      room: uint32 [], how many labels may be made besides the first of each cell, at most
        `most_labels`.
    """
    height, width = labels.all.shape[2:]
    num_cells = height * width
    start, goal = (cell.astype(jnp.uint32) for cell in (metric.start, metric.goal))
    # Of obstacles that share a bit, its toll.
    bit = lax.population_count((memory.bits & -memory.bits) - _ONE)[2:]
    shared = jnp.take(memory.toll, bit, mode="clip")
    asked = jnp.where((memory.bits[2:] != 0) & (tolls < UNREACHED), shared, tolls)
    asked = entry.with_ends(asked)
    owner_at = _owner_reader(labels)

    def to_goal(row: Array, col: Array) -> Array:
        rows, cols = (jnp.where(a > b, a - b, b - a) for a, b in ((row, goal[0]), (col, goal[1])))
        return octile(rows, cols, metric)

    advance = _advancer(labels, owner_at, stops, asked, memory, metric, to_goal, room)

    def take(state: tuple[Array, _Labels]) -> tuple[Array, _Labels]:
        # The first label of the next bucket that has one leaves it.
        bucket, held = state
        store = held.store
        bucket = lax.while_loop(
            lambda bucket: read(held.heads, bucket & np.uint32(_BUCKETS - 1)) == 0,
            lambda bucket: bucket + _ONE,
            bucket,
        )
        ring = bucket & np.uint32(_BUCKETS - 1)
        label = read_apart(held.heads, ring)
        cell, here = read_apart(store.cell, label), read_apart(store.sums, label)
        row, col = cell // np.uint32(width), cell % np.uint32(width)
        far = here + to_goal(row, col)
        heads = write(held.heads, read_apart(store.after, label), ring)
        # One that is here early, from a bucket too far off, goes back.
        is_early = (far >> _SHIFT) > bucket
        back = jnp.where(is_early, _ring_of(far, bucket), np.uint32(_BUCKETS))
        head = read_apart(heads, back)
        after = write(store.after, head, label)
        heads = write(heads, jnp.where(is_early, label, head), back)
        moves = read_apart(store.moves, label)
        todo = jnp.where(is_early | (far > held.limit), jnp.uint32(0), moves & _EVERY)
        tried = (moves | (moves << _TRIED)) & ~_EVERY
        store = store._replace(
            after=after, moves=write(store.moves, jnp.where(is_early, moves, tried), label)
        )
        num_waiting = held.num_waiting - (~is_early).astype(jnp.uint32)
        held = held._replace(num_waiting=num_waiting, heads=heads, store=store)

        # All legs from there.
        place = (row, col, here)
        nothing = jnp.uint32(_NO_MOVE)
        leg = _Leg(nothing, *place, nothing, *place, todo & _RUNS, todo >> np.uint32(4))
        paid = read_apart(store.paid, label)
        _, held = lax.while_loop(
            lambda state: _goes_on(state[0]),
            lambda state: advance(*state, place, paid, label, bucket),
            (leg, held),
        )
        return bucket, held

    # The start, by all eight moves.
    num_places = num_cells + most_labels(height, width) + 2
    none = jnp.zeros(num_places, jnp.uint32)
    at_start = start[0] * np.uint32(width) + start[1]
    least = to_goal(start[0], start[1])
    bucket = least >> _SHIFT
    store = _Store(
        none,
        none,
        none,
        write(none, at_start, _ONE),
        write(none, _EVERY, _ONE),
        none,
        none,
    )
    held = _Labels(
        num=jnp.uint32(2),
        num_more=jnp.uint32(0),
        num_waiting=jnp.uint32(1),
        limit=limit,
        best=jnp.uint32(0),
        is_full=jnp.bool_(False),
        first=write(jnp.zeros(num_cells, jnp.uint32), _ONE, at_start),
        heads=write(jnp.zeros(_BUCKETS + 1, jnp.uint32), _ONE, bucket & np.uint32(_BUCKETS - 1)),
        store=store,
    )
    # Ends: moves are tried once for each sum of a cell and each set paid for.
    _, held = lax.while_loop(
        lambda state: (state[1].num_waiting != 0) & (state[0] << _SHIFT <= state[1].limit),
        take,
        (bucket, held),
    )
    return _best_of(labels, owner_at, tolls, held, metric)


def most_labels(height: Any, width: Any) -> Any:
    """Returns how many labels a map of this size has room for besides the first of each cell, of
    the common type.
    """
    return (height + 2) * (width + 2) // 2 + 1024


def _ring_of(far: Array, bucket: Array) -> Array:
    """The bucket of labels so far, the last of those in use for one that is farther off."""
    ahead = jnp.minimum((far >> _SHIFT) - bucket, np.uint32(_BUCKETS - 1))
    return (bucket + ahead) & np.uint32(_BUCKETS - 1)


def _goes_on(leg: _Leg) -> Array:
    is_over = (leg.move == _NO_MOVE) & (leg.diagonal == _NO_MOVE)
    return ~is_over | (leg.runs | leg.diagonals != 0)


def _lowest(bits: Array) -> Array:
    return lax.population_count((bits & -bits) - _ONE)


def _owner_reader(labels: Labels) -> Callable:
    """A function of a layer, a row and a column, uint32, that returns a label, int32 []; outside
    the map any one.
    """
    num_layers, height, width = labels.all.shape[1:]
    flat = labels.all.reshape(-1)
    base = labels.which.astype(jnp.uint32) * np.uint32(num_layers * height * width)

    def owner_at(layer: int, row: Array, col: Array) -> Array:
        place = base + np.uint32(layer * height * width) + row * np.uint32(width) + col
        return read(flat, place)

    return owner_at


def _advancer(
    labels: Labels,
    owner_at: Callable,
    stops: Stops,
    asked: Array,
    memory: Memory,
    metric: Metric,
    to_goal: Callable,
    room: Array,
) -> Callable:
    """A function that goes on by a run to its next stop, or by a diagonal move, and makes a label
    where one is due.
    """
    bits = memory.bits
    num_layers, height, width = labels.all.shape[1:]
    down_by, right_by, components, to_try = (
        jnp.asarray(table) for table in (_DOWN, _RIGHT, _COMPONENTS, moves_to_try())
    )
    goal = metric.goal.astype(jnp.uint32)
    insert = _inserter(memory, metric, room, width)

    def scan(move: Array, row: Array, col: Array) -> tuple[Array, Array, Array]:
        """The length of a run to its next stop, and whether there is a corner in the line before,
        and behind; 1 and none of a diagonal move.
        """
        is_run = move < np.uint32(4)
        run = move & np.uint32(3)
        at, bit, _, length = next_stop(stops.stop, run, row, col, height, width, is_asked=is_run)
        before, behind = ((read(table, at) >> bit) & _ONE for table in (stops.before, stops.behind))
        walls = jnp.where(is_run, before | behind << _ONE, jnp.uint32(0))
        return jnp.where(is_run, length, _ONE), walls, is_run

    def door(row: Array, col: Array, to_row: Array, to_col: Array, paid: Array) -> tuple:
        """What the move pays, the bits of what it needs gone, and whether it needs any that the
        cell before does not lie in and that is not known to be paid for.
        """
        cells = ((row, col), (to_row, to_col), (row, to_col), (to_row, col))
        owners = [[owner_at(layer, *cell) for layer in range(num_layers)] for cell in cells]
        known, low, high = owners[0], jnp.uint32(0), jnp.uint32(0)
        behind, is_door = jnp.uint32(0), jnp.bool_(False)
        for ids in owners[1:]:
            for i, owner in enumerate(ids):
                place = (owner + 2).astype(jnp.uint32)
                held = read(bits, place)
                is_new = owner != -1
                for other in [*known, *ids[:i]]:
                    is_new = is_new & (owner != other)
                # Obstacles that share a bit are paid for together, but each is noted.
                is_open = held & (paid | behind) != 0
                toll = jnp.where(is_new & ~is_open, read(asked, place), jnp.uint32(0))
                low, high = low + (toll & np.uint32(0xFFFF)), high + (toll >> np.uint32(16))
                behind = behind | held
                is_known = held & paid & ~memory.shared != 0
                is_door = is_door | (is_new & ~is_known)
            known = [*known, *ids]
        return entry.joined(low, high), behind, is_door

    def advance(
        leg: _Leg, held: _Labels, place: tuple, paid: Array, label: Array, bucket: Array
    ) -> tuple[_Leg, _Labels]:
        # What is next: the run in work, another one from the same cell, the diagonal it began
        # from, another one from the label.
        goes_on, is_run = leg.move != _NO_MOVE, leg.runs != 0
        is_first = ~goes_on & ~is_run & (leg.diagonal == _NO_MOVE)
        diagonal = jnp.where(is_first, _lowest(leg.diagonals) + np.uint32(4), leg.diagonal)
        diagonals = jnp.where(is_first, leg.diagonals & (leg.diagonals - _ONE), leg.diagonals)
        its = (leg.its_row, leg.its_col, leg.its_sum)
        its = [jnp.where(is_first, a, b) for a, b in zip(place, its)]
        move = jnp.where(is_run, _lowest(leg.runs), diagonal)
        move = jnp.where(goes_on, leg.move, move)
        runs = jnp.where(goes_on, leg.runs, leg.runs & (leg.runs - _ONE))
        runs = jnp.where(is_run, runs, jnp.uint32(0))
        row, col, here = (
            jnp.where(goes_on, a, b) for a, b in zip((leg.row, leg.col, leg.sum), its)
        )

        # Where it leads to, and the door before that.
        length, walls, is_run = scan(move, row, col)
        down, right = read_apart(down_by, move), read_apart(right_by, move)
        to_row, to_col = row + length * down, col + length * right
        last_row, last_col = to_row - down, to_col - right
        base = here + length * jnp.where(is_run, metric.straight, metric.diagonal)
        is_inside = (to_row < np.uint32(height)) & (to_col < np.uint32(width))
        far = to_goal(to_row, to_col)
        is_near = is_inside & (base <= held.limit) & (base + far <= held.limit)
        toll, behind, is_door = door(last_row, last_col, to_row, to_col, paid)
        total = base + toll
        is_near = is_near & (total <= held.limit) & (total + far <= held.limit)

        # A label, or on.
        is_goal = (to_row == goal[0]) & (to_col == goal[1])
        is_due = is_near & (is_door | is_goal | (walls != 0))
        goes_on = is_near & ~is_due
        # Most are worse than the label that their cell has got.
        cell = jnp.where(is_due, to_row * np.uint32(width) + to_col, jnp.uint32(0))
        first = read_apart(held.first, cell)
        is_less = (first != 0) & (read_apart(held.store.sums, first) < total)
        gives_up = (paid | behind) & ~read_apart(held.store.paid, first)
        is_due = is_due & ~(is_less & (gives_up == 0))
        todo = jnp.where(
            is_run,
            read(to_try, move & np.uint32(3) | walls << np.uint32(2)),
            _ONE << move | read(components, move),
        )
        origin = (label << _ORIGIN) | move | jnp.where(is_door, _DOOR, jnp.uint32(0))
        new = _Candidate(to_row, to_col, total, far, paid | behind, todo, origin, is_goal)
        _, held = lax.while_loop(
            lambda state: state[0],
            lambda state: (jnp.bool_(False), insert(state[1], new, bucket)),
            (is_due, held),
        )
        runs_on, walks_on = goes_on & is_run, goes_on & ~is_run
        its_row, its_col, its_sum = (
            jnp.where(walks_on, a, b) for a, b in zip((to_row, to_col, base), its)
        )
        return _Leg(
            jnp.where(runs_on, move, _NO_MOVE),
            to_row,
            to_col,
            base,
            jnp.where(is_run | walks_on, diagonal, _NO_MOVE),
            its_row,
            its_col,
            its_sum,
            jnp.where(walks_on, read(components, move), runs),
            diagonals,
        ), held

    return advance


def _inserter(memory: Memory, metric: Metric, room: Array, width: int) -> Callable:
    """A function that adds a label, if it is no worse than those of its cell."""

    def insert(held: _Labels, new: _Candidate, bucket: Array) -> _Labels:
        store = held.store
        cell = new.row * np.uint32(width) + new.col
        row, col = new.row.astype(jnp.int32), new.col.astype(jnp.int32)
        paid = useful(new.paid, row, col, new.sum, held.limit, memory, metric)

        def rival(state: _Rivals) -> _Rivals:
            sums, has = read(store.sums, state.label), read(store.paid, state.label)
            is_worse = sums + worth(paid & ~has, memory) < new.sum
            is_same = (sums == new.sum) & (has == paid)
            same = jnp.where(is_same, state.label, state.same)
            return _Rivals(read(store.others, state.label), same, is_worse)

        first = read_apart(held.first, cell)
        rivals = lax.while_loop(
            lambda state: ~state.is_worse & (state.label != 0),
            rival,
            _Rivals(first, jnp.uint32(0), jnp.bool_(False)),
        )
        is_known = rivals.same != 0
        is_full = ~rivals.is_worse & ~is_known & (first != 0) & (held.num_more >= room)
        is_kept = ~rivals.is_worse & ~is_full
        # Label 0, which is none, takes what is not kept.
        at = jnp.where(is_known, rivals.same, held.num)
        at = jnp.where(is_kept, at, jnp.uint32(0))
        old = read_apart(store.moves, at)
        had = jnp.where(is_known & is_kept, old, jnp.uint32(0))
        todo = jnp.where(new.is_goal, jnp.uint32(0), new.moves & ~(had | (had >> _TRIED)))
        is_queued = is_kept & (todo != 0) & (had & _EVERY == 0)
        is_made = is_kept & ~is_known
        ring = jnp.where(is_queued, _ring_of(new.sum + new.far, bucket), np.uint32(_BUCKETS))
        head = read_apart(held.heads, ring)
        after = jnp.where(is_queued, head, read_apart(store.after, at))
        others = jnp.where(is_made, first, read_apart(store.others, at))
        origin = jnp.where(is_made, new.origin, read_apart(store.origin, at))
        made = _Store(
            write(store.sums, new.sum, at),
            write(store.paid, paid, at),
            write(store.origin, origin, at),
            write(store.cell, cell, at),
            write(store.moves, had | todo, at),
            write(store.others, others, at),
            write(store.after, after, at),
        )
        is_best = is_made & new.is_goal
        return _Labels(
            held.num + is_made.astype(jnp.uint32),
            held.num_more + (is_made & (first != 0)).astype(jnp.uint32),
            held.num_waiting + is_queued.astype(jnp.uint32),
            jnp.where(is_best, new.sum - _ONE, held.limit),
            jnp.where(is_best, at, held.best),
            held.is_full | is_full,
            write(held.first, jnp.where(is_made, at, first), cell),
            write(held.heads, jnp.where(is_queued, at, head), ring),
            made,
        )

    return insert


class _Walk(NamedTuple):
    """label: uint32 []; needed: uint32 [M + 1], the last of no obstacle; length: uint32 []."""

    label: Array
    needed: Array
    length: Array


def _best_of(
    labels: Labels, owner_at: Callable, tolls: Array, held: _Labels, metric: Metric
) -> Best:
    """Back from the goal: what the way needs, and what it costs."""
    width = labels.all.shape[3]
    num_obstacles, store = len(tolls), held.store
    down_by, right_by = jnp.asarray(_DOWN), jnp.asarray(_RIGHT)

    def step(walk: _Walk) -> _Walk:
        came = read(store.origin, walk.label)
        origin, move = came >> _ORIGIN, came & np.uint32(7)
        (row, col), (from_row, from_col) = (
            (cell // np.uint32(width), cell % np.uint32(width))
            for cell in (read(store.cell, walk.label), read(store.cell, origin))
        )
        before = row - read(down_by, move), col - read(right_by, move)
        needed = walk.needed
        for cell in ((row, col), (before[0], col), (row, before[1])):
            for layer in range(labels.all.shape[1]):
                owner = owner_at(layer, *cell)
                is_one = (owner >= 0) & (came & _DOOR != 0)
                place = jnp.where(is_one, owner, num_obstacles).astype(jnp.uint32)
                needed = write(needed, jnp.uint32(1), place)
        # A leg is no longer than the octile distance of its ends.
        rows, cols = (jnp.where(a > b, a - b, b - a) for a, b in ((row, from_row), (col, from_col)))
        return _Walk(origin, needed, walk.length + octile(rows, cols, metric))

    is_there = held.best != 0
    begin = _Walk(held.best, jnp.zeros(num_obstacles + 1, jnp.uint32), jnp.uint32(0))
    # Ends: the sums fall from label to label, down to the start, which is label 1.
    walk = lax.while_loop(lambda walk: walk.label > _ONE, step, begin)
    needed = walk.needed[:num_obstacles] != 0
    total = walk.length + entry.total(tolls, needed)
    total = jnp.where(is_there, jnp.minimum(total, UNREACHED), jnp.uint32(UNREACHED))
    bound = jnp.where(is_there, read(store.sums, held.best), jnp.uint32(UNREACHED))
    bound = jnp.where(held.is_full, jnp.uint32(0), bound)
    return Best(total, needed & is_there, bound, held.is_full, held.num)
