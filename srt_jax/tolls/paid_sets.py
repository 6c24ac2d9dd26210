"""What a search remembers of the obstacles that it has paid for: a bit for each, and what having
paid for it is worth.

Where more than 32 obstacles need memory, some share a bit, as if they were one obstacle of the
least of their tolls: whoever has paid for one of them enters the others free of charge.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import read
from srt_jax.types import Array

REMEMBERED = 32
"""Bits of a label's memory."""

_NO_TOLL = np.uint32(2**32 - 1)


class Memory(NamedTuple):
    """What labels remember. bits: uint32 [M + 2], of each label + 2, 0 where it is not remembered.
    toll: uint32 [32], of each bit. boxes: int32 [32, 4], what it may pay for lies in: the least and
    greatest rows, the least and greatest columns. beyond: uint32 [32], the length of a way from
    there to the goal at least. shared: uint32 [], the bits of several obstacles.
    """

    bits: Array
    toll: Array
    boxes: Array
    beyond: Array
    shared: Array


class Metric(NamedTuple):
    """straight, diagonal: uint32 [], lengths of moves. start, goal: int32 [2], cells."""

    straight: Array
    diagonal: Array
    start: Array
    goal: Array


def octile(rows: Array, cols: Array, metric: Metric) -> Array:
    """Returns the octile distance, uint32 of the common shape, of differences that are not
    negative.
    """
    down, right = rows.astype(jnp.uint32), cols.astype(jnp.uint32)
    low, high = jnp.minimum(down, right), jnp.maximum(down, right)
    return high * metric.straight + low * (metric.diagonal - metric.straight)


def to_boxes(row: Array, col: Array, boxes: Array, metric: Metric) -> Array:
    """Returns the octile distance of a cell, int32 [] twice, to each box, int32 [N, 4]: uint32 [N].

    A way that needs an obstacle gone comes to one of its cells, or passes it across a corner, a
    straight move's distance off: so the box is taken as larger by a cell.
    """
    rows, cols = (
        jnp.maximum(jnp.maximum(low - place, place - high) - 1, 0)
        for low, high, place in ((boxes[:, 0], boxes[:, 1], row), (boxes[:, 2], boxes[:, 3], col))
    )
    return octile(rows, cols, metric)


def memory_of(which: Array, tolls: Array, boxes: Array, metric: Metric) -> Memory:
    """Returns the memory for the obstacles `which`, bool [M]: a bit for each, or, where there are
    too many, for all at about the same depth.

    Args:
      tolls: uint32 [M]. boxes: int32 [M, 4], as in `shapes`.
    """
    rank = jnp.cumsum(which.astype(jnp.int32), dtype=jnp.int32) - 1
    # How far along the way from start to goal: of those side by side a good way takes one.
    ahead = jnp.sign(metric.goal - metric.start)
    middles = (boxes[:, ::2] + boxes[:, 1::2]) // 2
    depth = (middles * ahead[None]).sum(axis=1, dtype=jnp.int32)
    least = jnp.min(jnp.where(which, depth, jnp.int32(2**20)))
    most = jnp.max(jnp.where(which, depth, jnp.int32(-(2**20))))
    part = (jnp.where(which, depth, least) - least) * REMEMBERED // jnp.maximum(most - least + 1, 1)
    bit = jnp.where(jnp.max(rank) < REMEMBERED, rank, part).clip(0, REMEMBERED - 1)
    bits = jnp.where(which, jnp.uint32(1) << bit.astype(jnp.uint32), jnp.uint32(0))
    away = jnp.array(np.array([[1, -1, 1, -1]], np.int32))
    far = jnp.int32(2**24)

    def of_bit(k: Array) -> tuple[Array, Array, Array]:
        has = which & (bit == k)
        is_shared = has.sum(dtype=jnp.int32) > 1
        box = jnp.min(jnp.where(has[:, None], boxes * away, far), axis=0) * away[0]
        toll = jnp.min(jnp.where(has, tolls, _NO_TOLL))
        return toll, box, jnp.where(is_shared, jnp.uint32(1) << k.astype(jnp.uint32), jnp.uint32(0))

    toll, own, shared = lax.map(of_bit, jnp.arange(REMEMBERED, dtype=jnp.int32))
    # One that stands for nothing lies beyond all limits.
    is_used = toll < _NO_TOLL
    own = jnp.where(is_used[:, None], own, 0)
    beyond = to_boxes(metric.goal[0], metric.goal[1], own, metric)
    return Memory(
        jnp.concatenate([jnp.zeros(2, jnp.uint32), bits]),
        jnp.where(is_used, toll, jnp.uint32(0)),
        own,
        beyond,
        jnp.sum(shared, dtype=jnp.uint32),
    )


def shared_of(memory: Memory) -> Array:
    """Returns which obstacles share a bit with another one: bool [M]."""
    return memory.bits[2:] & memory.shared != 0


def useful(
    bits: Array, row: Array, col: Array, total: Array, limit: Array, memory: Memory, metric: Metric
) -> Array:
    """Returns which of the bits may be worth something at a cell, int32 [] twice, that `total`
    leads to: those of obstacles that a way within the limit may still come to.
    """

    def look_at(state: tuple[Array, Array]) -> tuple[Array, Array]:
        left, kept = state
        bit = _lowest(left)
        box = lax.dynamic_slice(memory.boxes, (bit, jnp.uint32(0)), (1, 4))
        far = total + to_boxes(row, col, box, metric)[0] + read(memory.beyond, bit)
        lowest = left & -left
        return left ^ lowest, jnp.where(far <= limit, kept, kept ^ lowest)

    return lax.while_loop(lambda state: state[0] != 0, look_at, (bits, bits))[1]


def worth(bits: Array, memory: Memory) -> Array:
    """Returns the sum of the tolls of bits, uint32 []."""

    def add(state: tuple[Array, Array]) -> tuple[Array, Array]:
        left, total = state
        return left & (left - np.uint32(1)), total + read(memory.toll, _lowest(left))

    return lax.while_loop(lambda state: state[0] != 0, add, (bits, jnp.uint32(0)))[1]


def _lowest(bits: Array) -> Array:
    return lax.population_count((bits & -bits) - np.uint32(1))
