"""The labels of a search (`paid_search`): where they are kept, how they wait, and which of one cell
are dropped.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from srt_jax.engine.in_place import read_apart, write
from srt_jax.tolls.paid_sets import Memory, Metric, useful, worth
from srt_jax.types import Array

BUCKETS, SHIFT = 4096, np.uint32(9)
_ONE = np.uint32(1)

EVERY, TRIED = np.uint32(255), np.uint32(8)
"""A set of moves has a bit for each; the bits above are those that have been tried."""

PAID = np.uint32(1 << 16)
"""Beside the moves of a label: whether a toll has been paid on the way."""


class Record(NamedTuple):
    """A label, all uint32 []. origin: 16 times the label that it came from, and how. others:
    another label of the same cell. after: the next one of its bucket.
    """

    sum: Array
    paid: Array
    origin: Array
    cell: Array
    moves: Array
    others: Array
    after: Array


_FIELDS = len(Record._fields)


def record_of(store: Array, label: Array) -> Record:
    """All of a label, read once: what is written afterwards depends on it, so that the store stays
    in place.
    """
    fields = apart(_fields_of)(store, label)
    return Record(*(fields[i] for i in range(_FIELDS)))


def _fields_of(store: Array, label: Array) -> Array:
    return lax.dynamic_slice(store, (label * np.uint32(_FIELDS),), (_FIELDS,))


def with_record(store: Array, record: Record, label: Array) -> Array:
    """The store with the record of a label."""
    return lax.dynamic_update_slice(store, jnp.stack(record), (label * np.uint32(_FIELDS),))


class Room(NamedTuple):
    """first, store: as in `Held`, with what earlier searches have left there."""

    first: Array
    store: Array


class Held(NamedTuple):
    """num, num_more, num_waiting: uint32 [], of all, of those that are not the first of their cell,
    and of those that wait. limit: uint32 [], the dearest sum that may matter. best: uint32
    [], the label of the best answer. is_full: bool [], whether one had no room. first: uint32
    [H * W], of each cell. heads: uint32 [BUCKETS + 1], of each bucket, the last one of none.
    store: uint32 [_FIELDS * room], records, the first of which is of no label.
    """

    num: Array
    num_more: Array
    num_waiting: Array
    limit: Array
    best: Array
    is_full: Array
    first: Array
    heads: Array
    store: Array


class _Rivals(NamedTuple):
    """label: uint32 [], the next to compare with, 0 for none. same: uint32 [], one of the same sum
    that has paid for the same. is_worse: bool [], than one of those before.
    """

    label: Array
    same: Array
    is_worse: Array


class Candidate(NamedTuple):
    """A label to be; all but is_goal uint32 []."""

    row: Array
    col: Array
    sum: Array
    far: Array
    paid: Array
    moves: Array
    origin: Array
    is_goal: Array


def most_labels(height: Any, width: Any) -> Any:
    """Returns how many labels a map of this size has room for besides the first of each cell, of
    the common type.
    """
    return (height + 2) * (width + 2) // 2 + 1024


def room_for_labels(height: int, width: int) -> Room:
    """Returns where `search_once` keeps its labels."""
    num_places = height * width + most_labels(height, width) + 2
    return Room(jnp.zeros(height * width, jnp.uint32), jnp.zeros(_FIELDS * num_places, jnp.uint32))


def first_of(held: Held, cell: Array) -> tuple[Array, Record]:
    """Returns the first label of a cell, 0 where it has none, and the record read there.

    What an earlier search has left is known by its record: it is beyond those in use, or of another
    cell. So nothing is cleared: that would take as long as fifty steps.
    """
    label = read_apart(held.first, cell)
    record = record_of(held.store, label)
    is_one = (label < held.num) & (record.cell == cell)
    return jnp.where(is_one, label, jnp.uint32(0)), record


def ring_of(far: Array, bucket: Array) -> Array:
    """The bucket of labels so far, the last of those in use for one that is farther off."""
    ahead = jnp.minimum((far >> SHIFT) - bucket, np.uint32(BUCKETS - 1))
    return (bucket + ahead) & np.uint32(BUCKETS - 1)


def inserter(memory: Memory, metric: Metric, limit: Array, room: Array, width: int) -> Callable:
    """A function that adds a label, if it is no worse than those of its cell, of which `first` is
    the first.
    """

    def insert(held: Held, new: Candidate, first: Array, bucket: Array) -> Held:
        store = held.store
        cell = new.row * np.uint32(width) + new.col
        row, col = new.row.astype(jnp.int32), new.col.astype(jnp.int32)
        paid = useful(new.paid, row, col, new.sum, limit, memory, metric)

        def rival(state: _Rivals) -> _Rivals:
            own = record_of(store, state.label)
            is_worse = own.sum + worth(paid & ~own.paid, memory) < new.sum
            is_same = (own.sum == new.sum) & (own.paid == paid)
            same = jnp.where(is_same, state.label, state.same)
            return _Rivals(own.others, same, is_worse)

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
        old = record_of(store, at)
        had = jnp.where(is_known & is_kept, old.moves, jnp.uint32(0))
        todo = jnp.where(new.is_goal, jnp.uint32(0), new.moves & ~(had | (had >> TRIED)))
        is_queued = is_kept & (todo & EVERY != 0) & (had & EVERY == 0)
        is_made = is_kept & ~is_known
        ring = jnp.where(is_queued, ring_of(new.sum + new.far, bucket), np.uint32(BUCKETS))
        head = read_apart(held.heads, ring)
        made = Record(
            sum=new.sum,
            paid=paid,
            origin=jnp.where(is_made, new.origin, old.origin),
            cell=cell,
            moves=had | todo,
            others=jnp.where(is_made, first, old.others),
            after=jnp.where(is_queued, head, old.after),
        )
        is_best = is_made & new.is_goal
        return Held(
            held.num + is_made.astype(jnp.uint32),
            held.num_more + (is_made & (first != 0)).astype(jnp.uint32),
            held.num_waiting + is_queued.astype(jnp.uint32),
            jnp.where(is_best, new.sum - _ONE, held.limit),
            jnp.where(is_best, at, held.best),
            held.is_full | is_full,
            write(held.first, jnp.where(is_made, at, first), cell),
            write(held.heads, jnp.where(is_queued, at, head), ring),
            with_record(store, made, at),
        )

    return insert
