"""Sums and differences of the exact numbers of `removal.sums`, uint32 [WORDS], word by word."""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.types import Array


class _Rows(NamedTuple):
    """numbers: uint32 [WORDS, ...]. carry: uint32 [...], to or from the next word."""

    numbers: Array
    carry: Array


def plus(one: Array, other: Array, num_words: Array) -> Array:
    """Returns the sum of two numbers, of which only the first `num_words` words are not 0."""

    def word(at: Array, state: _Rows) -> _Rows:
        here, there = _word(state.numbers, at), _word(other, at)
        both = here + there
        total = both + state.carry
        carry = ((both < here) | (total < both)).astype(jnp.uint32)
        return _Rows(lax.dynamic_update_index_in_dim(state.numbers, total, at, 0), carry)

    return lax.fori_loop(jnp.int32(0), num_words, word, _Rows(one, jnp.uint32(0))).numbers


def less(numbers: Array, which: Array, number: Array, num_words: Array) -> Array:
    """Returns `numbers`, uint32 [WORDS, M], without `number` in the columns `which` (bool [M]),
    none of which is smaller.
    """

    def word(at: Array, state: _Rows) -> _Rows:
        here, there = _word(state.numbers, at), _word(number, at)
        rest = here - there
        left = rest - state.carry
        borrow = ((here < there) | (rest < state.carry)).astype(jnp.uint32)
        row = jnp.where(which, left, here)
        return _Rows(lax.dynamic_update_index_in_dim(state.numbers, row, at, 0), borrow)

    nothing = jnp.zeros(numbers.shape[1], jnp.uint32)
    return lax.fori_loop(jnp.int32(0), num_words, word, _Rows(numbers, nothing)).numbers


def _word(number: Array, at: Array) -> Array:
    return lax.dynamic_index_in_dim(number, at, keepdims=False)
