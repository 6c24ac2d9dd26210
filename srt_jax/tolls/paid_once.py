"""The least sum of a route's length and of the tolls of what it destroys, each paid once: a search
that remembers what has been paid for.

THE SEARCH. A label is a way to a cell: its sum, and which of the obstacles on it have been paid
for. Those are free from there on, all others are paid at the door (`entry`). Of rectangles no least
way enters one twice (`shapes`), so they need no memory. Labels wait in buckets of the sum and the
octile distance to the goal, as in `spread`.

WHICH LABELS ARE DROPPED. Of two labels of one cell, one is never better than the other if its sum
is no less than the other's with the tolls of what it alone has paid for added: whoever has the
other may pay these tolls again, should they be needed, and go the same way from there. And a toll
that is paid for is worth nothing where any way from the cell through the obstacle's bounding box to
the goal is longer than the best answer allows. So nearly every cell has one label, its first one,
kept at the cell's own place; the others have places behind those of the cells.

WHY IT ENDS WITH THE LEAST. Let a label lie on a least way. Where it was dropped, the label that it
was compared with, followed by the rest of that way, is no dearer; and so on from cell to cell,
until the goal is reached at no more than the least sum. Nothing is below it, for labels are ways.

Where more than 32 obstacles need memory, some share a bit, and whoever has paid for one of them
enters the others free of charge. Then the least sum is a lower bound, and the way found an answer,
the best one where it costs no more with every toll paid. Where labels find no room, there is an
answer, but no bound.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.tolls import entry
from srt_jax.tolls.around import EVEN
from srt_jax.tolls.spread import (
    MIDDLE,
    NUM_BUCKETS,
    UNREACHED,
    Ground,
    Size,
    nine_moves,
    nine_offsets,
    octile_of,
    square,
    square_of,
    tolls_at,
)
from srt_jax.types import Array

REMEMBERED = 32
"""Bits of a label's memory."""


_FINER = np.uint32(3)
"""Buckets are so many halvings finer than the longest move: fewer labels are looked at twice."""


class Memory(NamedTuple):
    """What labels remember. bits: uint32 [M + 2], of each label + 2, 0 where it is not remembered.
    toll: uint32 [32], of each bit. top, bottom, left, right: uint32 [32], the bounding boxes, rows
    and columns with the border. Obstacles may share a bit: its toll is the greatest of theirs.
    """

    bits: Array
    toll: Array
    top: Array
    bottom: Array
    left: Array
    right: Array


class Best(NamedTuple):
    """total: uint32 [], of the way found, UNREACHED where none is within the limit. needed: bool
    [M], what it needs gone. bound: uint32 [], no way within the limit costs less; UNREACHED where
    there is none.
    """

    total: Array
    needed: Array
    bound: Array


def memory_of(which: Array, tolls: Array, boxes: Array, ground: Ground, size: Size) -> Memory:
    """Returns the memory for the obstacles `which`, bool [M]: a bit for each, or, where there are
    too many, for all at about the same depth.

    Args:
      tolls: uint32 [M]. boxes: uint32 [M, 4], the least and greatest rows, the least and greatest
        columns, of the map with its border.
    """
    rank = jnp.cumsum(which.astype(jnp.int32), dtype=jnp.int32) - 1
    # How far along the way from start to goal: of those side by side a good way takes one.
    stride = jnp.uint32(size.stride)
    ends = [
        jnp.stack([cell // stride, cell % stride]).astype(jnp.int32)
        for cell in (ground.start, ground.goal)
    ]
    ahead = jnp.sign(ends[1] - ends[0])
    middles = ((boxes[:, ::2] + boxes[:, 1::2]) // 2).astype(jnp.int32)
    depth = (middles * ahead[None]).sum(axis=1, dtype=jnp.int32)
    least = jnp.min(jnp.where(which, depth, jnp.int32(2**30)))
    most = jnp.max(jnp.where(which, depth, jnp.int32(-(2**30))))
    part = (jnp.where(which, depth, least) - least) * REMEMBERED // jnp.maximum(most - least + 1, 1)
    bit = jnp.where(jnp.max(rank) < REMEMBERED, rank, part).clip(0, REMEMBERED - 1)
    bits = jnp.where(which, jnp.uint32(1) << bit.astype(jnp.uint32), jnp.uint32(0))
    most_of = jnp.stack([tolls, boxes[:, 1], boxes[:, 3]], axis=1)
    least_of = jnp.stack([boxes[:, 0], boxes[:, 2]], axis=1)

    def of_bit(k: Array) -> tuple[Array, Array]:
        has = (which & (bit == k))[:, None]
        return (
            jnp.max(jnp.where(has, most_of, jnp.uint32(0)), axis=0),
            jnp.min(jnp.where(has, least_of, jnp.uint32(UNREACHED)), axis=0),
        )

    greatest, least = lax.map(of_bit, jnp.arange(REMEMBERED, dtype=jnp.int32))
    return Memory(
        jnp.concatenate([jnp.zeros(2, jnp.uint32), bits]),
        toll=greatest[:, 0],
        top=least[:, 0],
        bottom=greatest[:, 1],
        left=least[:, 1],
        right=greatest[:, 2],
    )


class _Labels(NamedTuple):
    """By label: first those of the N cells, then others in the order they were made.

    sums, paid: uint32, the sum, and what is paid for. origin: uint32, the label that it came from.
    place: uint32, its cell. others: uint32, another label of the same cell, 0 for none. after,
    before: uint32, the links of the rings, whose own entries come last.
    """

    sums: Array
    paid: Array
    origin: Array
    place: Array
    others: Array
    after: Array
    before: Array


class _Queued(NamedTuple):
    """What changes for every label that is queued, as in `_Labels`."""

    sums: Array
    paid: Array
    origin: Array
    after: Array
    before: Array


class _State(NamedTuple):
    """bucket: uint32 [], the one in work. num_waiting: uint32 []. limit: uint32 [], the dearest sum
    that may matter. num: uint32 [], labels made besides the first ones. is_full: bool [], whether
    one had no room.
    """

    bucket: Array
    num_waiting: Array
    limit: Array
    num: Array
    is_full: Array
    labels: _Labels


class _Trial(NamedTuple):
    """left: uint32 [], a bit for each of the nine cells that may get a label; the rest as in
    `_State`.
    """

    left: Array
    num_waiting: Array
    num: Array
    is_full: Array
    labels: _Labels


class _Rivals(NamedTuple):
    """label: uint32 [], the next to compare with, 0 for none. is_worse: bool [], than one of those
    before.
    """

    label: Array
    is_worse: Array


def search_once(
    ground: Ground, tolls: Array, memory: Memory, limit: Array, room: Array, size: Size
) -> Best:
    """Returns the best way of one map. For use inside a marked call.

    Args:
      ground: with a goal; a start of 0 for none.
      tolls: uint32 [M + 2], from `entry.with_ends`; CLOSED of what must stay.
      limit: uint32 [], less than UNREACHED: no way dearer than that is looked for.
      room: uint32 [], how many labels besides the first ones may be made, at most half of the map's
        cells with its border.
    """
    N, num_extra = size.num_cells, size.num_cells // 2 + 1
    rings, one = jnp.uint32(N + num_extra), jnp.uint32(1)
    bits = entry.bucket_bits(ground.diagonal) - _FINER
    lengths, offset = nine_moves(ground), nine_offsets(size)
    order = jnp.arange(9, dtype=jnp.uint32)
    is_move = order != MIDDLE
    goal = ground.goal
    worth = _worth_of(ground, memory, size)

    def ring_of(key: Array, bucket: Array) -> Array:
        ahead = jnp.minimum((key >> bits) - bucket, jnp.uint32(NUM_BUCKETS - 1))
        return rings + ((bucket + ahead) & jnp.uint32(NUM_BUCKETS - 1))

    def unlinked(after: Array, before: Array, label: Array) -> tuple[Array, Array]:
        last, following = read_apart(before, label), read_apart(after, label)
        after, before = write(after, following, last), write(before, last, following)
        return write(after, label, label), write(before, label, label)

    def linked(after: Array, before: Array, label: Array, ring: Array) -> tuple[Array, Array]:
        last = read_apart(before, ring)
        after = write(write(after, label, last), ring, label)
        return after, write(write(before, last, label), label, ring)

    def pay_doors(state: tuple, at: Array, own: Array) -> tuple:
        """What the moves pay besides, and what is paid for behind them."""
        _, totals, paid = state
        nine = square(ground.labels, at, size)
        which = (nine + 2).astype(jnp.uint32)
        known = jnp.take(memory.bits, which, mode="clip")
        toll = jnp.where(known & own != 0, jnp.uint32(0), tolls_at(nine, tolls))
        doors = [entry.of_move(nine, toll, MIDDLE, move) for move in range(8)]
        doors = [*doors[:MIDDLE], jnp.uint32(0), *doors[MIDDLE:]]
        held = known[:, 0]
        for layer in range(1, known.shape[1]):
            held = held | known[:, layer]
        behind = [held[i] for i in range(9)]
        for move, cells in enumerate(entry.BESIDE):
            i = move if move < MIDDLE else move + 1
            for cell in cells:
                behind[i] = behind[i] | held[entry.around(*cell)]
        return jnp.bool_(False), totals + jnp.stack(doors), paid | jnp.stack(behind)

    def step(state: _State) -> _State:
        # The first label of the ring in work, if it has one, leaves it.
        ring = rings + (state.bucket & jnp.uint32(NUM_BUCKETS - 1))
        first = read_apart(state.labels.after, ring)
        is_label = first != ring
        label = jnp.where(is_label, first, jnp.uint32(0))
        after, before = unlinked(state.labels.after, state.labels.before, label)
        at = read_apart(state.labels.place, label)
        here, own = read_apart(state.labels.sums, label), read_apart(state.labels.paid, label)

        # What each move leads to.
        is_uneven = is_label & (read(ground.seen, at) & jnp.uint8(EVEN) == 0)
        _, totals, paid = lax.while_loop(
            lambda trial: trial[0],
            lambda trial: pay_doors(trial, at, own),
            (is_uneven, here + lengths, jnp.full(9, 0, jnp.uint32) | own),
        )
        keys = totals + square(ground.left, at, size)

        # The cells whose first label does not say at once that nothing is gained.
        look = apart(square_of(size))
        has_less = (look(state.labels.sums, at) <= totals) & (
            paid & ~look(state.labels.paid, at) == 0
        )
        is_tried = ~has_less & (totals < UNREACHED) & (keys <= state.limit) & is_move
        mask = jnp.sum(is_tried.astype(jnp.uint32) << order, dtype=jnp.uint32)
        # One that is here early, from a bucket too far off, goes back.
        is_early = (keys[MIDDLE] >> bits) > state.bucket
        mask = jnp.where(is_early, one << MIDDLE, mask)
        mask = jnp.where(is_label, mask, jnp.uint32(0))

        def improve(trial: _Trial) -> _Trial:
            move = lax.population_count((trial.left & -trial.left) - one)
            to = at + read(offset, move)
            total, behind = read_apart(totals, move), read_apart(paid, move)
            labels = trial.labels
            old, held = read_apart(labels.sums, to), read_apart(labels.paid, to)

            def rival(state: _Rivals) -> _Rivals:
                sums, has = read_apart(labels.sums, state.label), read(labels.paid, state.label)
                is_worse = sums + worth(behind & ~has, to, total, limit) <= total
                return _Rivals(read(labels.others, state.label), is_worse)

            # Whether it is better than the first label, or no worse than any.
            gives_up = worth(held & ~behind, to, old, limit)
            is_first = (old == UNREACHED) | (total + gives_up <= old)
            rivals = lax.while_loop(
                lambda state: ~state.is_worse & (state.label != 0),
                rival,
                _Rivals(jnp.where(is_early | is_first, jnp.uint32(0), to), jnp.bool_(False)),
            )
            is_more = ~(is_early | is_first | rivals.is_worse)
            is_full = is_more & (trial.num >= room)
            new = jnp.where(is_first, to, jnp.uint32(N) + trial.num)
            new = jnp.where(is_early, label, new)
            is_kept = ~rivals.is_worse & ~is_full

            def add(state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
                """Runs at most once, for a label that is not the first one of its cell."""
                _, place, others = state
                others = write(others, read_apart(others, to), new)
                return jnp.bool_(False), write(place, to, new), write(others, new, to)

            _, place, others = lax.while_loop(
                lambda state: state[0], add, (is_more & ~is_full, labels.place, labels.others)
            )

            def put(state: tuple[Array, _Queued, Array]) -> tuple[Array, _Queued, Array]:
                """Runs at most once."""
                _, queued, num_waiting = state
                is_new = read_apart(queued.after, new) == new
                after, before = unlinked(queued.after, queued.before, new)
                ring = ring_of(read_apart(keys, move), bucket)
                after, before = linked(after, before, new, ring)
                came_from = jnp.where(is_early, read_apart(queued.origin, new), label)
                made = _Queued(
                    write(queued.sums, total, new),
                    write(queued.paid, behind, new),
                    write(queued.origin, came_from, new),
                    after,
                    before,
                )
                return jnp.bool_(False), made, num_waiting + is_new.astype(jnp.uint32)

            queued = _Queued(*(getattr(labels, name) for name in _Queued._fields))
            _, queued, num_waiting = lax.while_loop(
                lambda state: state[0], put, (is_kept, queued, trial.num_waiting)
            )
            labels = _Labels(place=place, others=others, **queued._asdict())
            return _Trial(
                trial.left & (trial.left - one),
                num_waiting,
                trial.num + (is_more & is_kept).astype(jnp.uint32),
                trial.is_full | is_full,
                labels,
            )

        # Ends: each step takes one of the cells away.
        bucket, limit = state.bucket, state.limit
        num_waiting = state.num_waiting - is_label.astype(jnp.uint32)
        labels = state.labels._replace(after=after, before=before)
        trial = lax.while_loop(
            lambda trial: trial.left != 0,
            improve,
            _Trial(mask, num_waiting, state.num, state.is_full, labels),
        )
        return _State(
            bucket + (~is_label).astype(jnp.uint32),
            trial.num_waiting,
            jnp.minimum(limit, read_apart(trial.labels.sums, goal)),
            trial.num,
            trial.is_full,
            trial.labels,
        )

    # The start, or nothing.
    every = jnp.arange(N + num_extra + NUM_BUCKETS, dtype=jnp.uint32)
    own, nothing = every[: N + num_extra], jnp.zeros(N + num_extra, jnp.uint32)
    is_there = ground.start != 0
    sums = jnp.full(N + num_extra, UNREACHED, jnp.uint32)
    sums = write(sums, jnp.where(is_there, jnp.uint32(0), jnp.uint32(UNREACHED)), ground.start)
    key = read(ground.left, ground.start)
    after, before = linked(every, every, ground.start, ring_of(key, key >> bits))
    begin = _State(
        key >> bits,
        is_there.astype(jnp.uint32),
        limit,
        jnp.uint32(0),
        jnp.bool_(False),
        _Labels(sums, nothing, nothing, own, nothing, after, before),
    )
    # Ends: a label is better than those that it replaces, and the bucket rises where none is left.
    end = lax.while_loop(
        lambda state: (state.num_waiting != 0) & (state.bucket <= state.limit >> bits), step, begin
    )
    return _best_of(ground, tolls, end, limit, size)


def _worth_of(
    ground: Ground, memory: Memory, size: Size
) -> Callable[[Array, Array, Array, Array], Array]:
    """A function of some obstacles' bits, a cell, a sum and the limit: what having paid for these
    obstacles is worth there at most, uint32 [].
    """
    stride, one = jnp.uint32(size.stride), jnp.uint32(1)

    def beyond(value: Array, low: Array, high: Array) -> Array:
        """How far a row or column lies outside a range: int32 []."""
        outside = jnp.where(value > high, value - high, jnp.uint32(0))
        return jnp.where(value < low, low - value, outside).astype(jnp.int32)

    def worth(bits: Array, cell: Array, total: Array, limit: Array) -> Array:
        def add(state: tuple[Array, Array]) -> tuple[Array, Array]:
            left, sum_of_tolls = state
            bit = lax.population_count((left & -left) - one)
            low_row, high_row = read(memory.top, bit), read(memory.bottom, bit)
            low_col, high_col = read(memory.left, bit), read(memory.right, bit)
            least = total
            for place in (cell, ground.goal):
                rows = beyond(place // stride, low_row, high_row)
                cols = beyond(place % stride, low_col, high_col)
                least = least + octile_of(rows, cols, ground.straight, ground.diagonal)
            toll = jnp.where(least <= limit, read(memory.toll, bit), jnp.uint32(0))
            both = jnp.minimum(sum_of_tolls + toll, jnp.uint32(UNREACHED))
            return left & (left - one), both

        # At the goal nothing is.
        bits = jnp.where(cell == ground.goal, jnp.uint32(0), bits)
        return lax.while_loop(lambda state: state[0] != 0, add, (bits, jnp.uint32(0)))[1]

    return worth


class _Walk(NamedTuple):
    """label: uint32 []; needed: uint32 [M + 1], the last of no obstacle; length: uint32 []."""

    label: Array
    needed: Array
    length: Array


def _best_of(ground: Ground, tolls: Array, end: _State, limit: Array, size: Size) -> Best:
    """Back from the goal: what the way needs, and what it costs.

    A label that the way goes through may have been replaced by a better one since: sums fall on the
    way back all the same, and the way counted is no dearer than the one found.
    """
    num_obstacles = len(tolls) - 2
    stride = jnp.uint32(size.stride)
    labels = end.labels
    at_goal = read(labels.sums, ground.goal)
    is_there = (ground.goal != 0) & (ground.start != 0) & (at_goal <= limit)

    def step(walk: _Walk) -> _Walk:
        origin = read(labels.origin, walk.label)
        here, there = read(labels.place, walk.label), read(labels.place, origin)
        # The cells beside a diagonal move: in the one's row, in the other's column.
        across = here - here % stride + there % stride
        along = there - there % stride + here % stride
        needed = walk.needed
        for cell in (here, across, along):
            for layer in range(ground.labels.shape[1]):
                owner = lax.dynamic_slice(ground.labels, (cell, jnp.uint32(layer)), (1, 1))[0, 0]
                owner = jnp.where(owner < 0, num_obstacles, owner).astype(jnp.uint32)
                needed = write(needed, jnp.uint32(1), owner)
        is_diagonal = (here // stride != there // stride) & (here % stride != there % stride)
        move = jnp.where(is_diagonal, ground.diagonal, ground.straight)
        return _Walk(origin, needed, walk.length + move)

    nothing = jnp.zeros(num_obstacles + 1, jnp.uint32)
    begin = _Walk(jnp.where(is_there, ground.goal, ground.start), nothing, jnp.uint32(0))
    # Ends: the sums fall from label to label, down to the start.
    walk = lax.while_loop(lambda walk: walk.label != ground.start, step, begin)
    needed = walk.needed[:num_obstacles] != 0
    total = walk.length + entry.total(tolls[2:], needed)
    total = jnp.where(is_there, jnp.minimum(total, UNREACHED), jnp.uint32(UNREACHED))
    bound = jnp.where(is_there, at_goal, jnp.uint32(UNREACHED))
    return Best(total, needed & is_there, jnp.where(end.is_full, jnp.uint32(0), bound))
