"""The kernel of tolls: the least sum of length and tolls from the start to the cells of a map.

Label correcting on exact integers: it ends when no move can improve a cell, and those
sums are one set of numbers, whatever the order in which moves are tried. On CPU cell by cell, in
buckets of the sum, about the length of a move each; a bucket is a ring of cells linked both ways,
so that a cell whose sum falls moves from one to another and every cell is in one at most. Elsewhere
all cells at once, until nothing changes.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart, runs_in_place
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.moves import MOVES
from srt_jax.tolls import entry
from srt_jax.tolls.around import are_even
from srt_jax.types import FREE, OUTSIDE, Array

UNREACHED = entry.CLOSED
"""The sum of a cell that no way leads to, or only one too dear to be held."""

STEPS = tuple((down, right) for down in (-1, 0, 1) for right in (-1, 0, 1))
"""To the nine cells of a square, in row order; the middle one is the cell itself."""

MIDDLE = 4
NUM_BUCKETS = 256


class Ground(NamedTuple):
    """What does not change while tolls do: of a map with a border that is OUTSIDE, N cells in all.

    labels: int32 [N, L]; no cell has one label in two layers. is_even: bool [N], as of `around`.
      straight, diagonal: uint32 [], lengths of moves. start: uint32 [], a cell, 0 for none.
    """

    labels: Array
    is_even: Array
    straight: Array
    diagonal: Array
    start: Array


class Size(NamedTuple):
    """Static: rows and columns of the map."""

    height: int
    width: int

    @property
    def stride(self) -> int:
        return self.width + 2

    @property
    def num_cells(self) -> int:
        return (self.height + 2) * self.stride


def ground_of(labels: Array, straight: Array, diagonal: Array, start: Array, size: Size) -> Ground:
    """Returns the ground of one map: labels int32 [L, H, W]; start int32 [2]."""
    bordered = bordered_layers(labels)
    return Ground(
        labels=jnp.stack([layer.reshape(-1) for layer in bordered], axis=1),
        is_even=are_even(jnp.stack(bordered)).reshape(-1),
        straight=straight,
        diagonal=diagonal,
        start=place(start, size),
    )


def bordered_layers(labels: Array) -> list[Array]:
    """Returns the layers of one map, int32 [L, H, W], without what a cell has twice and with a
    border that is OUTSIDE.
    """
    layers = [labels[0]]
    for layer in labels[1:]:
        is_known = functools.reduce(jnp.logical_or, [layer == other for other in layers])
        layers.append(jnp.where(is_known, FREE, layer))
    return [jnp.pad(layer, 1, constant_values=OUTSIDE) for layer in layers]


def place(cell: Array, size: Size) -> Array:
    """Returns a cell, int32 [2], as a place in the bordered map, uint32; 0 where it lies
    outside.
    """
    row, col = cell[0], cell[1]
    is_inside = (row >= 0) & (row < size.height) & (col >= 0) & (col < size.width)
    at = (row + 1) * size.stride + col + 1
    return jnp.where(is_inside, at, 0).astype(jnp.uint32)


def sums_of(ground: Ground, tolls: Array, size: Size) -> Array:
    """Returns the least sums, uint32 [(H + 2) * (W + 2)].

    Args:
      tolls: uint32 [M + 2], from `entry.with_ends`; CLOSED of what must stay.
    """
    sums = jnp.full(size.num_cells, UNREACHED, jnp.uint32)
    is_there = ground.start != 0
    sums = write(sums, jnp.where(is_there, jnp.uint32(0), jnp.uint32(UNREACHED)), ground.start)
    solve = _spread if runs_in_place() else _relax_all
    return solve(ground, tolls, size, sums)


def nine_moves(ground: Ground) -> Array:
    """Returns the lengths of the moves to the nine cells round one, 0 to itself: uint32 [9]."""
    is_move, is_diagonal = (
        jnp.array(np.array([test(down, right) for down, right in STEPS]))
        for test in (
            lambda down, right: bool(down or right),
            lambda down, right: bool(down and right),
        )
    )
    length = jnp.where(is_diagonal, ground.diagonal, ground.straight)
    return jnp.where(is_move, length, jnp.uint32(0))


def nine_offsets(size: Size) -> Array:
    """Returns the steps to the nine cells in the bordered map: uint32 [9], those back wrapped."""
    offsets = [down * size.stride + right for down, right in STEPS]
    return jnp.array((np.array(offsets, np.int64) % 2**32).astype(np.uint32))


def square(array: Array, cell: Array, size: Size) -> Array:
    """Returns the entries of the nine cells around one, in row order: [9, ...]."""
    rest = array.shape[1:]
    zeros = [jnp.uint32(0)] * len(rest)
    rows = [
        lax.dynamic_slice(array, (cell + jnp.uint32((shift - 1) % 2**32), *zeros), (3, *rest))
        for shift in (-size.stride, 0, size.stride)
    ]
    return jnp.concatenate(rows)


def square_of(size: Size) -> Callable[[Array, Array], Array]:
    """Returns `square` on maps of one size."""
    return functools.partial(square, size=size)


def tolls_at(labels: Array, tolls: Array) -> Array:
    """Returns the tolls of labels: uint32, of the shape of `labels`."""
    return jnp.take(tolls, (labels + 2).astype(jnp.uint32), mode="clip")


class _Rings(NamedTuple):
    """bucket: uint32 [], the one in work. num_waiting: uint32 []. sums: uint32 [N]. after, before:
    uint32 [N + buckets], the links; a cell in no ring is linked to itself.
    """

    bucket: Array
    num_waiting: Array
    sums: Array
    after: Array
    before: Array


class _Trial(NamedTuple):
    """left: uint32 [], a bit for each of MOVES that improves its cell; the others as in
    `_Rings`.
    """

    left: Array
    num_waiting: Array
    sums: Array
    after: Array
    before: Array


def _spread(ground: Ground, tolls: Array, size: Size, sums: Array) -> Array:
    """Cell by cell, bucket by bucket."""
    N, one = jnp.uint32(size.num_cells), jnp.uint32(1)
    bits = entry.bucket_bits(ground.diagonal)
    lengths, offset = nine_moves(ground), nine_offsets(size)
    order = jnp.arange(9, dtype=jnp.uint32)
    is_move = order != MIDDLE

    def ring_of(key: Array, bucket: Array) -> Array:
        """The ring of a bucket, or the last of those in use for one that is farther off."""
        ahead = jnp.minimum((key >> bits) - bucket, jnp.uint32(NUM_BUCKETS - 1))
        return N + ((bucket + ahead) & jnp.uint32(NUM_BUCKETS - 1))

    def unlinked(after: Array, before: Array, cell: Array) -> tuple[Array, Array]:
        last, following = read_apart(before, cell), read_apart(after, cell)
        after, before = write(after, following, last), write(before, last, following)
        return write(after, cell, cell), write(before, cell, cell)

    def linked(after: Array, before: Array, cell: Array, ring: Array) -> tuple[Array, Array]:
        first = read_apart(after, ring)
        before = write(write(before, cell, first), ring, cell)
        return write(write(after, first, cell), cell, ring), before

    def add_doors(totals: Array, labels: Array, tolls: Array, cell: Array) -> Array:
        nine = square(labels, cell, size)
        paid = tolls_at(nine, tolls)
        doors = [entry.of_move(nine, paid, MIDDLE, move) for move in range(8)]
        doors = [*doors[:MIDDLE], jnp.uint32(0), *doors[MIDDLE:]]
        return totals + jnp.stack(doors)

    def step(state: _Rings) -> _Rings:
        # The first cell of the ring in work, if it has one, leaves it.
        ring = N + (state.bucket & jnp.uint32(NUM_BUCKETS - 1))
        cell = read_apart(state.after, ring)
        is_cell = cell != ring
        at = jnp.where(is_cell, cell, jnp.uint32(0))
        after, before = unlinked(state.after, state.before, at)
        here = read_apart(state.sums, at)

        # What each move leads to. Only where labels change a move may pay.
        is_uneven = is_cell & ~read(ground.is_even, at)
        _, totals = lax.while_loop(
            lambda trial: trial[0],
            lambda trial: (jnp.bool_(False), add_doors(trial[1], ground.labels, tolls, at)),
            (is_uneven, here + lengths),
        )

        # The moves that improve a cell; one that is here early, from a bucket too far off, goes
        # back.
        is_better = totals < apart(square_of(size))(state.sums, at)
        mask = jnp.sum((is_better & is_move).astype(jnp.uint32) << order, dtype=jnp.uint32)
        is_early = (here >> bits) > state.bucket
        mask = jnp.where(is_early, one << MIDDLE, mask)
        mask = jnp.where(is_cell, mask, jnp.uint32(0))

        def improve(trial: _Trial) -> _Trial:
            move = lax.population_count((trial.left & -trial.left) - one)
            to = at + read(offset, move)
            is_new = read_apart(trial.after, to) == to
            after, before = unlinked(trial.after, trial.before, to)
            ring = ring_of(read_apart(totals, move), state.bucket)
            after, before = linked(after, before, to, ring)
            return _Trial(
                trial.left & (trial.left - one),
                trial.num_waiting + is_new.astype(jnp.uint32),
                write(trial.sums, read_apart(totals, move), to),
                after,
                before,
            )

        # Ends: each step takes one of the moves away.
        num_waiting = state.num_waiting - is_cell.astype(jnp.uint32)
        trial = _Trial(mask, num_waiting, state.sums, after, before)
        trial = lax.while_loop(lambda trial: trial.left != 0, improve, trial)
        bucket = state.bucket + (~is_cell).astype(jnp.uint32)
        return _Rings(bucket, trial.num_waiting, trial.sums, trial.after, trial.before)

    links = jnp.arange(size.num_cells + NUM_BUCKETS, dtype=jnp.uint32)
    zero = jnp.uint32(0)
    after, before = linked(links, links, ground.start, ring_of(zero, zero))
    num = (ground.start != 0).astype(jnp.uint32)
    begin = _Rings(zero, num, sums, after, before)
    # Ends: sums only fall, and the bucket rises where no cell is left in it.
    return lax.while_loop(lambda state: state.num_waiting != 0, step, begin).sums


class _Round(NamedTuple):
    """sums: uint32 [H + 2, W + 2]; is_changing: bool [], whether the last round lowered any."""

    sums: Array
    is_changing: Array


def _relax_all(ground: Ground, tolls: Array, size: Size, sums: Array) -> Array:
    """All cells at once: as many rounds as the longest least way has moves."""
    shape = (size.height + 2, size.width + 2)
    lengths = entry.lengths_of_moves(ground.straight, ground.diagonal)
    labels = jnp.moveaxis(ground.labels.reshape(*shape, -1), -1, 0)
    paid = tolls_at(labels, tolls)

    def shifted(array: Array, down: int, right: int, outside: int) -> Array:
        wide = jnp.pad(array, [(0, 0)] * (array.ndim - 2) + [(1, 1)] * 2, constant_values=outside)
        return wide[..., 1 + down : 1 + down + shape[0], 1 + right : 1 + right + shape[1]]

    nine = jnp.stack([shifted(labels, *step, OUTSIDE) for step in STEPS])
    tolls_of_nine = jnp.stack([shifted(paid, *step, entry.CLOSED) for step in STEPS])
    doors = [
        lengths[move] + entry.of_move(nine, tolls_of_nine, 4, move, is_back=True)
        for move in range(8)
    ]

    def once_more(state: _Round) -> _Round:
        least = state.sums
        for move, (down, right) in enumerate(MOVES):
            offer = shifted(state.sums, down, right, UNREACHED) + doors[move]
            least = jnp.minimum(least, jnp.minimum(offer, jnp.uint32(UNREACHED)))
        return _Round(least, jnp.any(least < state.sums))

    begin = _Round(sums.reshape(shape), jnp.bool_(True))
    return lax.while_loop(lambda state: state.is_changing, once_more, begin).sums.reshape(-1)
