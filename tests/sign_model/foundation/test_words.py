"""Sets as words of 32 bits: the same bits on the host and inside jit, whatever the layout."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.foundation.sizes import next_power_of_two
from sign_model.foundation.words import (
    WORD,
    contains,
    num_words,
    pack_columns,
    pack_members,
    pack_rows,
)

SIZES = [1, 31, 32, 33, 64, 70]


def number_of(bits):
    """The words of one set, bit by bit in Python."""
    words = [0] * num_words(len(bits))
    for member in np.flatnonzero(bits).tolist():
        words[member // WORD] |= 1 << (member % WORD)
    return words


@pytest.mark.parametrize("size", SIZES)
def test_rows_and_columns_are_packed_into_the_same_words(size):
    bits = np.random.default_rng(size).random((5, size)) < 0.4
    rows = pack_rows(bits, num_words(size))
    assert rows.dtype == np.uint32
    assert rows.tolist() == [number_of(row) for row in bits]
    assert np.array_equal(jax.jit(pack_columns)(jnp.asarray(bits.T)), rows.T)


@pytest.mark.parametrize("size", SIZES)
def test_a_set_contains_its_members_and_no_others(size):
    is_member = np.random.default_rng(size).random(size) < 0.4
    members = np.random.default_rng(0).permutation(size).astype(np.int32)
    words = jax.jit(pack_members, static_argnums=2)(members, is_member[members], num_words(size))
    assert np.asarray(words).tolist() == number_of(is_member)
    every = np.arange(size, dtype=np.int32)
    assert np.array_equal(jax.jit(contains)(words, every), is_member)


def test_an_empty_set_of_columns_has_one_word():
    assert pack_columns(jnp.zeros((0, 3), bool)).tolist() == [[0, 0, 0]]


def test_the_next_power_of_two_is_at_least_the_count_and_the_least():
    assert [next_power_of_two(count) for count in (0, 1, 2, 3, 4, 5, 8, 9)] == [
        *(1, 1, 2, 4, 4, 8, 8, 16)
    ]
    assert [next_power_of_two(count, least=4) for count in (0, 3, 4, 5)] == [4, 4, 4, 8]
