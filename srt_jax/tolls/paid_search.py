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
door, from where it goes on (`paid_legs`). Corners of what a label is known to have paid for are
passed by: on its way that obstacle is gone, and the way above turns at corners of what stays. Else
whoever has come through a building would be back in it, free of charge, from each of its corners.
Labels wait in buckets of the sum and the octile distance to the goal (`paid_labels`), and a leg
ends as well where these are more than the best answer.

WHAT IS NOT LOOKED AT. The way round is known, so a better way pays at least the least toll: as long
as a label has paid nothing, that toll is added to its sum where it is compared with the limit. And
the limit is near the octile distance first, three eighths of the way to that of the way round;
where there is an answer within it, most labels are never made, else the search begins anew. What is
left out so is not on a way within the limit, and all else happens in the same order: the answer is
the same, also of several of one sum.

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
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.obstacles import Labels
from srt_jax.tolls import entry
from srt_jax.tolls.paid_labels import (
    BUCKETS,
    EVERY,
    PAID,
    SHIFT,
    TRIED,
    Held,
    Record,
    Room,
    record_of,
    ring_of,
    with_record,
)
from srt_jax.tolls.paid_legs import (
    DOOR,
    DOWN,
    NO_MOVE,
    ORIGIN,
    RIGHT,
    RUNS,
    Leg,
    advancer,
    has_more,
)
from srt_jax.tolls.paid_sets import Memory, Metric, octile
from srt_jax.tolls.stops import Stops
from srt_jax.types import Array

UNREACHED = entry.CLOSED
"""The sum of a way that does not exist, or is too dear to be held."""

_ONE = np.uint32(1)


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


class _Looks(NamedTuple):
    """is_over: bool []. limit: uint32 [], of the look that is next. num_labels: uint32 [], of all.
    held: of the last look.
    """

    is_over: Array
    limit: Array
    num_labels: Array
    held: Held


def search_once(
    labels: Labels,
    stops: Stops,
    tolls: Array,
    memory: Memory,
    metric: Metric,
    least: Array,
    limit: Array,
    room: Array,
    store: Room,
) -> tuple[Best, Room]:
    """Returns the best way of one map. For use inside a marked call.

    Args:
      tolls: uint32 [M], CLOSED of what must stay.
      memory: of those that may be entered twice.
      metric: from a free start to another cell.
      least: uint32 [], what every way within the limit pays at least.
      limit: uint32 [], less than UNREACHED: no way dearer than that is looked for.
      room: uint32 [], how many labels may be made besides the first of each cell, at most
        `most_labels`.
      store: `room_for_labels`, whose contents do not matter; it is returned with the answer.
    """
    width = labels.all.shape[3]
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

    advance = advancer(labels, owner_at, stops, asked, memory, metric, to_goal, least, limit, room)

    def take(state: tuple[Array, Held]) -> tuple[Array, Held]:
        # The first label of the next bucket that has one leaves it.
        bucket, held = state
        store = held.store
        bucket = lax.while_loop(
            lambda bucket: read(held.heads, bucket & np.uint32(BUCKETS - 1)) == 0,
            lambda bucket: bucket + _ONE,
            bucket,
        )
        ring = bucket & np.uint32(BUCKETS - 1)
        label = read_apart(held.heads, ring)
        own = record_of(store, label)
        cell, here, moves = own.cell, own.sum, own.moves
        row, col = cell // np.uint32(width), cell % np.uint32(width)
        far = here + to_goal(row, col)
        heads = write(held.heads, own.after, ring)
        # One that is here early, from a bucket too far off, goes back.
        is_early = (far >> SHIFT) > bucket
        back = jnp.where(is_early, ring_of(far, bucket), np.uint32(BUCKETS))
        head = read_apart(heads, back)
        heads = write(heads, jnp.where(is_early, label, head), back)
        owes = jnp.where(moves & PAID != 0, jnp.uint32(0), least)
        is_over = (far > held.limit) | (held.limit - far < owes)
        todo = jnp.where(is_early | is_over, jnp.uint32(0), moves & EVERY)
        tried = (moves & ~EVERY) | ((moves & EVERY) << TRIED)
        left = own._replace(after=head, moves=jnp.where(is_early, moves, tried))
        store = with_record(store, left, label)
        num_waiting = held.num_waiting - (~is_early).astype(jnp.uint32)
        held = held._replace(num_waiting=num_waiting, heads=heads, store=store)

        # All legs from there.
        place = (row, col, here)
        nothing = jnp.uint32(NO_MOVE)
        leg = Leg(nothing, *place, nothing, *place, todo & RUNS, todo >> np.uint32(4))
        _, held = lax.while_loop(
            lambda state: has_more(state[0]),
            lambda state: advance(*state, place, own.paid, moves & PAID, label, bucket),
            (leg, held),
        )
        return bucket, held

    # The start, by all eight moves.
    at_start = start[0] * np.uint32(width) + start[1]
    apart_by = to_goal(start[0], start[1])
    bucket = apart_by >> SHIFT
    nothing = jnp.uint32(0)
    begin = Record(nothing, nothing, nothing, at_start, jnp.uint32(EVERY), nothing, nothing)

    def look(state: _Looks) -> _Looks:
        held = Held(
            num=jnp.uint32(2),
            num_more=jnp.uint32(0),
            num_waiting=jnp.uint32(1),
            limit=state.limit,
            best=jnp.uint32(0),
            is_full=jnp.bool_(False),
            first=write(state.held.first, _ONE, at_start),
            heads=write(jnp.zeros(BUCKETS + 1, jnp.uint32), _ONE, bucket & np.uint32(BUCKETS - 1)),
            store=with_record(state.held.store, begin, jnp.uint32(_ONE)),
        )
        # Ends: moves are tried once for each sum of a cell and each set paid for.
        _, held = lax.while_loop(
            lambda state: (state[1].num_waiting != 0) & (state[0] << SHIFT <= state[1].limit),
            take,
            (bucket, held),
        )
        is_over = (state.limit == limit) | ((held.best != 0) & ~held.is_full)
        return _Looks(is_over, limit, state.num_labels + held.num, held)

    # A near limit first, if several tolls lie between it and the octile distance: else there is
    # too rarely an answer within it.
    left = limit - jnp.minimum(limit, apart_by + least)
    is_wide = (least != 0) & (left // np.uint32(3) >= least)
    first = jnp.where(is_wide, apart_by + least + left // np.uint32(8) * np.uint32(3), limit)
    held = Held(
        nothing,
        nothing,
        nothing,
        first,
        nothing,
        jnp.bool_(False),
        store.first,
        jnp.zeros(BUCKETS + 1, jnp.uint32),
        with_record(store.store, begin._replace(cell=nothing, moves=nothing), nothing),
    )
    looks = _Looks(jnp.bool_(False), first, nothing, held)
    # Ends: after the second look.
    looks = lax.while_loop(lambda state: ~state.is_over, look, looks)
    best = _best_of(labels, owner_at, tolls, looks.held, metric)
    return best._replace(num_labels=looks.num_labels), Room(looks.held.first, looks.held.store)


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


class _Walk(NamedTuple):
    """label: uint32 []; needed: uint32 [M + 1], the last of no obstacle; length: uint32 []."""

    label: Array
    needed: Array
    length: Array


def _best_of(labels: Labels, owner_at: Callable, tolls: Array, held: Held, metric: Metric) -> Best:
    """Back from the goal: what the way needs, and what it costs."""
    width = labels.all.shape[3]
    num_obstacles, store = len(tolls), held.store
    down_by, right_by = jnp.asarray(DOWN), jnp.asarray(RIGHT)

    def step(walk: _Walk) -> _Walk:
        came = record_of(store, walk.label).origin
        origin, move = came >> ORIGIN, came & np.uint32(7)
        (row, col), (from_row, from_col) = (
            (cell // np.uint32(width), cell % np.uint32(width))
            for cell in (record_of(store, walk.label).cell, record_of(store, origin).cell)
        )
        before = row - read(down_by, move), col - read(right_by, move)
        needed = walk.needed
        for cell in ((row, col), (before[0], col), (row, before[1])):
            for layer in range(labels.all.shape[1]):
                owner = owner_at(layer, *cell)
                is_one = (owner >= 0) & (came & DOOR != 0)
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
    bound = jnp.where(is_there, record_of(store, held.best).sum, jnp.uint32(UNREACHED))
    bound = jnp.where(held.is_full, jnp.uint32(0), bound)
    return Best(total, needed & is_there, bound, held.is_full, held.num)
