"""One step of the MAP iteration: M-, P- and A-step on the situations of all batch slots, and the
candidates they give (PY16 §3.1).

A step goes through its candidates pass by pass, one action for every situation of every slot, and
ends when all are exhausted: so its working set stays in the fastest cache. Situations are uint32
[W, K, B], as in `iteration`, which keeps the best candidates.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.records import Array
from sign_model.foundation.words import WORD, pack_columns
from sign_model.map_batch.counts import (
    bit_index,
    hash_of,
    lowest_bit,
    union_of_rows,
    weighted_count,
)
from sign_model.map_batch.lanes import Slots

NO_CANDIDATE = np.uint32(0xFFFFFFFF)
"""The key of no candidate: above that of every candidate."""

_MAX_RATING = (1 << 16) - 3  # so that rating + 1 fits into 16 bits and no key equals NO_CANDIDATE
# Bits per pass of the M-step: few enough to compile fast, many enough to keep its sums in
# registers.
_BITS_A_PASS = 8


class StepTables(NamedTuple):
    """What all slots share."""

    explains: Array  # uint32 [F, A / 32]
    breaks: Array  # uint32 [F, A / 32]
    keeps: Array  # uint32 [W, A]
    needs: Array  # uint32 [W, A]
    held: Array  # uint32 [DIGITS, W, 1]
    unmet: Array  # uint32 [DIGITS, W, 1]
    table_digits: tuple[Array, ...]  # uint32 [DIGITS, S, 1], for each table made from a start


class Candidates(NamedTuple):
    """The situations before the actions tried in a step; candidate m K + k came from situation k in
    pass m.
    """

    before: Array  # uint32 [W, M K, B]
    action: Array  # int32 [M K, B]
    key: Array  # uint32 [M K, B], of `_keys`


def _m_step(domain: StepTables, situations: Array, alive: Array) -> Array:
    """Returns the actions whose causal matrices fit: they explain a part of the situation and break
    nothing of it.

    Args:
      domain: `explains` and `breaks`.
      situations: uint32 [W, K, B].
      alive: bool [K, B].

    Returns:
      A bitmap of actions, uint32 [A / 32, K, B].
    """
    # The features, a few at a time: [W * passes, K, B].
    num_words, num_passes = situations.shape[0], WORD // _BITS_A_PASS
    shifts = jnp.arange(num_passes, dtype=jnp.uint32) * _BITS_A_PASS
    parts = (situations[:, None] >> shifts[None, :, None, None]).reshape(-1, *situations.shape[1:])
    rows = (
        m.reshape(num_words * num_passes, _BITS_A_PASS, -1)
        for m in (domain.explains, domain.breaks)
    )

    # OR the table rows of the features that each situation has.
    def add_features(
        sums: tuple[Array, Array], features: tuple[Array, Array, Array]
    ) -> tuple[tuple[Array, Array], None]:
        part, explains, breaks = features
        explained, broken = sums
        for bit in range(_BITS_A_PASS):
            has_feature = ((part & jnp.uint32(1 << bit)) != 0)[None]
            explained = explained | jnp.where(
                has_feature, explains[bit][:, None, None], jnp.uint32(0)
            )
            broken = broken | jnp.where(has_feature, breaks[bit][:, None, None], jnp.uint32(0))
        return (explained, broken), None

    nothing = jnp.zeros((domain.explains.shape[1], *situations.shape[1:]), jnp.uint32)
    explained, broken = lax.scan(add_features, (nothing, nothing), (parts, *rows))[0]
    return jnp.where(alive[None], explained & ~broken, jnp.uint32(0))


class _Expansion(NamedTuple):
    """The carry of the passes of a step."""

    number: Array  # int32 [], passes done, m
    untried: "_Untried"
    candidates: Candidates  # those of the passes done; the rest have the key NO_CANDIDATE


def expand(domain: StepTables, branch: int, slots: Slots) -> Candidates:
    """Returns the candidates of a step: the first `branch` fitting actions of every situation, in
    ascending order.

    Pass m takes the m-th fitting action of every situation of every slot, and writes the situations
    before them as candidates m K to m K + K - 1.
    """
    num_words, beam, _ = slots.situations.shape

    # M-step, for all passes at once. The weight of a feature depends on whether it holds at the
    # start.
    bitmap = _m_step(domain, slots.situations, slots.alive)
    feature_digits = (domain.held & slots.start[None]) | (domain.unmet & ~slots.start[None])
    ranks = jnp.arange(beam, dtype=jnp.uint32)[:, None] << 8

    def one_pass(state: _Expansion) -> _Expansion:
        # The next action of each situation, -1 where none is left.
        m, untried, done = state
        untried, action = _take_one(bitmap, untried)
        is_valid, action = action >= 0, jnp.maximum(action, 0)

        # P-step and A-step.
        before = _p_step(domain, slots.situations, action)
        rating = _a_step(domain, feature_digits, slots.start_tables, before)
        key = _keys(slots, before, rating, is_valid, ranks, m)

        # Write the candidates of this pass.
        at = m * beam
        return _Expansion(
            m + 1,
            untried,
            Candidates(
                lax.dynamic_update_slice_in_dim(done.before, before, at, 1),
                lax.dynamic_update_slice_in_dim(done.action, action, at, 0),
                lax.dynamic_update_slice_in_dim(done.key, key, at, 0),
            ),
        )

    first = _first_expansion(bitmap, num_words, branch)

    # Ends: after `branch` passes, or earlier when no situation has an untried action.
    def continues(state: _Expansion) -> Array:
        m, untried, _ = state
        return (m < branch) & (
            untried.word | functools.reduce(jnp.bitwise_or, untried.groups)
        ).any()

    return lax.while_loop(continues, one_pass, first).candidates


def _first_expansion(bitmap: Array, num_words: int, branch: int) -> _Expansion:
    """Returns the carry before the first pass: no candidate yet, and all actions of the bitmap,
    uint32 [A / 32, K, B], untried. `num_words` is W.
    """
    _, beam, num_slots = bitmap.shape
    size = branch * beam
    candidates = Candidates(
        jnp.zeros((num_words, size, num_slots), jnp.uint32),
        jnp.zeros((size, num_slots), jnp.int32),
        jnp.full((size, num_slots), NO_CANDIDATE, jnp.uint32),
    )
    groups = _groups(bitmap)
    nothing = jnp.zeros((beam, num_slots), jnp.uint32)
    untried = _Untried(groups, nothing, nothing.astype(jnp.int32))
    return _Expansion(jnp.int32(0), untried, candidates)


def _keys(
    slots: Slots,
    before: Array,
    rating: Array,
    is_valid: Array,
    ranks: Array,
    m: Array,
) -> Array:
    """Returns the keys of the candidates of one pass, uint32 [K, B]; the least key is the best.

        bits 16-31   0 if the situation is included in the start, else its rating + 1
        bits 8-15    k, the rank of the situation it came from: ties go to the children of the best
        bits 0-7     m, the pass: then to the lowest action

    So no two candidates of a slot have the same key, and a key tells where its candidate lies.
    NO_CANDIDATE: there is no candidate, or its situation was kept before.

    Args:
      slots: their starts and visited situations.
      before: uint32 [W, K, B], the situations.
      rating: uint32 [K, B].
      is_valid: bool [K, B], whether there was an action left to try.
      ranks: uint32 [K, 1], k << 8.
      m: int32 [], the pass.
    """
    # Forget what was kept in an earlier step.
    tag = hash_of(before)
    address = (tag % jnp.uint32(slots.visited.shape[0])).astype(jnp.int32)
    is_new = jnp.take_along_axis(slots.visited, address, 0, mode="promise_in_bounds") != tag
    # The stop rule, bit by bit; rating 0 has no other meaning.
    is_done = ((before & ~slots.start[:, None]) == 0).all(axis=0)
    rating = jnp.where(is_done, jnp.uint32(0), jnp.minimum(rating, jnp.uint32(_MAX_RATING)) + 1)
    return jnp.where(is_valid & is_new, (rating << 16) | ranks | m.astype(jnp.uint32), NO_CANDIDATE)


class _Untried(NamedTuple):
    """The actions of each situation that were not tried yet: the rest of the current word, and
    which later words hold any.
    """

    # uint32 [K, B] each, bit i % 32 of group i // 32: word i of the bitmap holds some
    groups: tuple[Array, ...]
    word: Array  # uint32 [K, B], what is left of the current word
    place: Array  # int32 [K, B], the number of the current word


def _groups(bitmap: Array) -> tuple[Array, ...]:
    """Returns which words of the bitmap, uint32 [A / 32, K, B], are not 0: `_Untried.groups`."""
    filled = jnp.concatenate(
        [bitmap != 0, jnp.zeros((-bitmap.shape[0] % WORD, *bitmap.shape[1:]), bool)]
    )
    return tuple(pack_columns(filled))


def _take_one(bitmap: Array, untried: _Untried) -> tuple[_Untried, Array]:
    """Returns what is left without the lowest untried action of every situation, and that action,
    int32 [K, B], -1 where there is none.

    A pass takes one bit of the current word, and fetches the next word that holds any when the
    current one is empty.
    """
    # The first group that holds any word, and the first word in it.
    groups = untried.groups
    group, number = groups[-1], jnp.full(untried.place.shape, len(groups) - 1, jnp.int32)
    for i in range(len(groups) - 2, -1, -1):
        group, number = (
            jnp.where(groups[i] != 0, groups[i], group),
            jnp.where(groups[i] != 0, i, number),
        )
    first = lowest_bit(group)
    next_place = jnp.maximum(number * WORD + bit_index(first), 0)

    # Fetch that word where the current one is empty, and strike it off its group.
    is_empty = (untried.word == 0) & (group != 0)
    fetched = jnp.take_along_axis(bitmap, next_place[None], 0, mode="promise_in_bounds")[0]
    word = jnp.where(is_empty, fetched, untried.word)
    place = jnp.where(is_empty, next_place, untried.place)
    groups = tuple(jnp.where(is_empty & (number == i), g ^ first, g) for i, g in enumerate(groups))

    # Take its lowest bit.
    bit = lowest_bit(word)
    untried = _Untried(groups, word ^ bit, place)
    return untried, jnp.where(word != 0, place * WORD + bit_index(bit), -1)


def _p_step(domain: StepTables, situations: Array, action: Array) -> Array:
    """Returns the situation before each action: uint32 [W, K, B], int32 [K, B] -> uint32 [W, K,
    B].
    """
    keeps, needs = (
        m.at[:, action].get(mode="promise_in_bounds") for m in (domain.keeps, domain.needs)
    )
    return (situations & keeps) | needs


def _a_step(
    domain: StepTables,
    feature_digits: Array,
    start_tables: tuple[Array, ...],
    before: Array,
) -> Array:
    """Returns the rating of each situation by the sign's weights, uint32 [K, B].

    Args:
      domain: the weights of the tables' columns.
      feature_digits: uint32 [DIGITS, W, B], the weights of the features themselves.
      start_tables: uint32 [F, S, B] each.
      before: uint32 [W, K, B], the situations.
    """
    rating = weighted_count(before, feature_digits)
    for table, digits in zip(start_tables, domain.table_digits):
        rating = rating + weighted_count(union_of_rows(before, table), digits)
    return rating
