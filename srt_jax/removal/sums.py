"""Sums of removal costs without rounding: whole numbers, in as many machine words as the costs of
one map need.

A float32 is a whole number of 24 bits times a power of two, so a sum of costs is a whole number of
the least such power. As numbers of several words, sums can be added and compared exactly, in any
order, on any machine. With floats they cannot: a small cost added to a large one may change
nothing, and two orders of the same costs may differ.

A number is uint32 [WORDS], least word first; of many the words are rows, uint32 [WORDS, many]. Only
the lowest `num_words` of a map's numbers can differ from 0: one for most maps, and loops go no
further. Only the last step, `to_float32`, rounds: down. For use inside a marked call (`kernel`),
map by map.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import compiled_whole
from srt_jax.engine.batching import each
from srt_jax.types import Array

WORDS = 10
"""Enough for the sum of 2^24 costs from the least positive float32 to the greatest: 277 + 24 + 3
bits.
"""

_ALL = 2**32 - 1
_MANTISSA = 2**23
_GREATEST = 0x7F7FFFFF
"""The bits of the greatest float32."""


class _Least(NamedTuple):
    """low: uint32 [WORDS], the words of the least number known so far, the highest first. among:
    bool [many], the numbers that have these words.
    """

    low: Array
    among: Array


class _Sum(NamedTuple):
    """A sum, row by row. total: uint32 [WORDS, ...]; carry: uint32 [...], to the next row."""

    total: Array
    carry: Array


class _Comparison(NamedTuple):
    """Two sums of several numbers compared, row by row. is_within: bool [M], whether the rows so
    far of the one are no more than those of the other. carry, carry_here: uint32 [M], carry_there:
    uint32 [], to the next row.
    """

    is_within: Array
    carry: Array
    carry_here: Array
    carry_there: Array


class Costs(NamedTuple):
    """The costs of one map as whole numbers digits * 2^place of the unit 2^(lowest - 149).

    digits: uint32 [M], below 2^24. place: int32 [M], below 0 where digits ends in zeros. lowest:
      int32 [].
    num_words: int32 [], the words that any sum of these costs has, two more of them, and `never` as
      the one greater number.
    """

    digits: Array
    place: Array
    lowest: Array
    num_words: Array


def costs_of(cost: Array, which: Array) -> Costs:
    """Returns the costs of the obstacles `which` (bool [M]) from float32 [M]; the others' may not
    be added.

    `make_task` lets only positive, finite costs pass. Where others arrive all the same, inside jit,
    those below 0 count as 0, and those that are not finite as the greatest float32.
    """
    bits = lax.bitcast_convert_type(cost, jnp.uint32)
    bits = jnp.where(bits >> 31 != 0, jnp.uint32(0), jnp.minimum(bits, jnp.uint32(_GREATEST)))
    exponent = (bits >> 23).astype(jnp.int32)
    fraction = bits & jnp.uint32(_MANTISSA - 1)
    digits = jnp.where(exponent > 0, fraction | jnp.uint32(_MANTISSA), fraction)
    place = jnp.maximum(exponent, 1) - 1
    counts = which & (digits != 0)
    num_zeros = lax.population_count((digits & -digits) - jnp.uint32(1)).astype(jnp.int32)
    lowest = jnp.min(jnp.where(counts, place + num_zeros, jnp.int32(277)))
    length = 32 - lax.clz(digits).astype(jnp.int32)
    highest = jnp.max(jnp.where(counts, place - lowest + length, 0))
    num_words = (highest + len(cost).bit_length() + 3 + 31) // 32
    return Costs(digits, place - lowest, lowest, num_words)


def never() -> Array:
    """Returns the number greater than every sum, uint32 [WORDS]."""
    return jnp.full(WORDS, _ALL, jnp.uint32)


def zero() -> Array:
    return jnp.zeros(WORDS, jnp.uint32)


def is_less(one: Array, other: Array) -> Array:
    """Returns whether one number is less than the other, bool []."""
    rows = jnp.arange(WORDS, dtype=jnp.int32)
    return jnp.max(jnp.where(one < other, rows, -1)) > jnp.max(jnp.where(one > other, rows, -1))


def least(numbers: Array, among: Array, num_words: Array) -> tuple[Array, Array]:
    """Returns the least of the numbers `among` (bool [many]), `never` where there is none, and
    which are it, bool [many].
    """

    def narrow(i: Array, state: _Least) -> _Least:
        at = num_words - 1 - i
        row = _word(numbers, at)
        word = jnp.min(jnp.where(state.among, row, jnp.uint32(_ALL)))
        low = lax.dynamic_update_slice(state.low, word[None], (at,))
        return _Least(low, state.among & (row == word))

    low, among = lax.fori_loop(jnp.int32(0), num_words, narrow, _Least(zero(), among))
    is_sum = _word(low, num_words - 1) != jnp.uint32(_ALL)
    return jnp.where(is_sum, low, jnp.uint32(_ALL)), among


def with_costs(numbers: Array, which: Array, number: Array, costs: Costs) -> Array:
    """Returns `numbers`, uint32 [WORDS, M], with `number` + cost of the obstacle in the columns
    `which` (bool [M]).
    """

    def one_row(at: Array, state: _Sum) -> _Sum:
        row = _word(state.total, at)
        total, carry = _add(_word(number, at), _row(costs, at), state.carry)
        row = jnp.where(which, total, row)
        return _Sum(lax.dynamic_update_index_in_dim(state.total, row, at, 0), carry)

    begin = _Sum(numbers, jnp.zeros(len(which), jnp.uint32))
    return lax.fori_loop(jnp.int32(0), costs.num_words, one_row, begin).total


def with_cost(number: Array, costs: Costs, obstacle: Array) -> Array:
    """Returns `number` + cost of one obstacle, int32 [], from 0 on."""
    one = costs._replace(digits=_entry(costs.digits, obstacle), place=_entry(costs.place, obstacle))
    return with_costs(zero()[:, None], jnp.ones(1, bool), number, one)[:, 0]


def are_within(forth: Array, back: Array, costs: Costs, limit: Array, paid: Array) -> Array:
    """Returns where forth + back <= limit + paid + cost, bool [M]; forth and back uint32 [WORDS,
    M], numbers of obstacles.
    """

    def one_row(at: Array, state: _Comparison) -> _Comparison:
        own, there = _add(_word(limit, at), _word(paid, at), state.carry_there)
        here, carry = _add(_word(forth, at), _word(back, at), state.carry)
        most, carry_here = _add(own, _row(costs, at), state.carry_here)
        # A higher row decides; the lower ones count where it is the same.
        is_within = (here < most) | ((here == most) & state.is_within)
        return _Comparison(is_within, carry, carry_here, there)

    nothing = jnp.zeros(forth.shape[1], jnp.uint32)
    begin = _Comparison(jnp.ones(forth.shape[1], bool), nothing, nothing, jnp.uint32(0))
    return lax.fori_loop(jnp.int32(0), costs.num_words, one_row, begin).is_within


def total(costs: Costs, which: Array) -> Array:
    """Returns the sum of the costs of the obstacles `which` (bool [M])."""
    # A word is added up in digits so short that no sum of them overflows.
    length = len(which).bit_length()
    width = next(width for width in (16, 8, 4) if width + length <= 32)

    def one_word(at: Array, state: _Sum) -> _Sum:
        carry = state.carry
        row = jnp.where(which, _row(costs, at), jnp.uint32(0))
        word = jnp.uint32(0)
        for place in range(0, 32, width):
            digit = (row >> place) & jnp.uint32(2**width - 1)
            carry = carry + jnp.sum(digit, dtype=jnp.uint32)
            word = word | (carry & jnp.uint32(2**width - 1)) << place
            carry = carry >> width
        return _Sum(lax.dynamic_update_slice(state.total, word[None], (at,)), carry)

    begin = _Sum(zero(), jnp.uint32(0))
    return lax.fori_loop(jnp.int32(0), costs.num_words, one_word, begin).total


def dearest(costs: Costs, among: Array) -> Array:
    """Returns which of the obstacles `among` (bool [M]) costs most, the first of several, int32 [];
    0 where there is none.
    """
    # the bits of the float32 again: as whole numbers they have the order of the costs
    bits = ((costs.place + costs.lowest).astype(jnp.uint32) << 23) + costs.digits
    return lax.argmax(jnp.where(among, bits + jnp.uint32(1), jnp.uint32(0)), 0, jnp.int32)


def to_float32(numbers: Array, costs: Costs) -> Array:
    """Returns the greatest float32 that is no more than each of the numbers, inf for `never`:
    [WORDS, many] -> [many].
    """
    rows = jnp.arange(WORDS, dtype=jnp.int32)[:, None]
    lengths = jnp.where(numbers != 0, 32 * rows + 32 - lax.clz(numbers).astype(jnp.int32), 0)
    last = jnp.max(lengths, axis=0) - 1  # the place of the highest bit
    exponent = jnp.maximum(costs.lowest + last - 23, 0)
    # the place of the lowest bit kept, below 0 where zeros are appended
    first = exponent - costs.lowest

    def word(at: Array) -> Array:
        return jnp.max(jnp.where(rows == at[None], numbers, jnp.uint32(0)), axis=0)

    low, high, shift = word(first >> 5), word((first >> 5) + 1), (first & 31).astype(jnp.uint32)
    digits = (low >> shift) | jnp.where(
        shift > 0, high << (jnp.uint32(32) - shift) % 32, jnp.uint32(0)
    )
    bits = jnp.minimum((exponent.astype(jnp.uint32) << 23) + digits, jnp.uint32(_GREATEST))
    bits = jnp.where(last < 0, jnp.uint32(0), bits)
    is_never = jnp.all(numbers == jnp.uint32(_ALL), axis=0)
    return jnp.where(is_never, jnp.inf, lax.bitcast_convert_type(bits, jnp.float32))


def totals(cost: Array, which: Array) -> Array:
    """Returns of each map the sum of the costs `which`, rounded down: float32 [B, K], bool [B,
    K] -> float32 [B].
    """

    def all_maps(cost: Array, which: Array) -> Array:
        def one_map(which: Array, cost: Array) -> Array:
            costs = costs_of(cost, which)
            return to_float32(total(costs, which)[:, None], costs)[0]

        return each(one_map, which, cost)

    return compiled_whole(all_maps)(cost, which)


def _row(costs: Costs, at: Array) -> Array:
    """Returns the word `at` of each cost, uint32 [M]."""
    shift = costs.place - 32 * at
    left = costs.digits << shift.clip(0, 31).astype(jnp.uint32)
    right = costs.digits >> (-shift).clip(0, 31).astype(jnp.uint32)
    return jnp.where(
        (shift >= 0) & (shift < 32),
        left,
        jnp.where((shift < 0) & (shift > -32), right, jnp.uint32(0)),
    )


def _add(one: Array, other: Array, carry: Array) -> tuple[Array, Array]:
    """Returns a word of a sum, and what is carried to the next."""
    both = one + other
    total = both + carry
    return total, ((both < one) | (total < both)).astype(jnp.uint32)


def _word(number: Array, at: Array) -> Array:
    """Returns the word `at` of one number, or of each of many."""
    return lax.dynamic_index_in_dim(number, at, keepdims=False)


def _entry(values: Array, at: Array) -> Array:
    return lax.dynamic_slice(values, (at,), (1,))
