"""Weighted counts of bits in packed words, with the batch as the last axis: how the weights of a
heuristic sign rate situations inside the jitted search.

W words hold the features of a situation, K situations form the beam, B tasks lie side by side.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.records import Array
from sign_model.foundation.words import WORD, pack_columns
from sign_model.map_batch.tables import MAX_WEIGHT

DIGITS = MAX_WEIGHT.bit_length()
"""How many binary digits a weight has."""


def digits_of(weights: Array) -> Array:
    """Returns the binary digits of weights as bit sets: digit d holds the items whose weight has
    bit d.

    Args:
      weights: int32 [n], n a multiple of 32, each from 0 to `MAX_WEIGHT`.

    Returns:
      uint32 [DIGITS, n / 32, 1].
    """
    return jnp.stack(
        [pack_columns(((weights >> d) & 1).astype(bool))[:, None] for d in range(DIGITS)]
    )


def weighted_count(words: list[Array], digits: Array) -> Array:
    """Returns the sum of the weights of all 1-bits.

    Args:
      words: uint32 [K, B] each.
      digits: uint32 [DIGITS, len(words), B or 1], of `digits_of`.

    Returns:
      uint32 [K, B].
    """
    total = jnp.zeros(words[0].shape, jnp.uint32)
    for d in range(DIGITS):
        count = jnp.zeros(words[0].shape, jnp.uint32)
        for w, word in enumerate(words):
            count = count + lax.population_count(word & digits[d, w][None])
        total = total + (count << d)
    return total


def union_of_rows(situations: Array, table: Array) -> list[Array]:
    """Returns for each situation the OR of the table rows of its features.

    Args:
      situations: uint32 [W, K, B].
      table: uint32 [F, S, B], F = 32 W.

    Returns:
      S words, uint32 [K, B] each.
    """
    # One word of features after the other, with the 32 rows of its features.
    num_words, num_columns, num_tasks = situations.shape[0], table.shape[1], situations.shape[2]
    rows = table.reshape(num_words, WORD, num_columns, num_tasks)

    def add_word(
        union: tuple[Array, ...], word_and_rows: tuple[Array, Array]
    ) -> tuple[tuple[Array, ...], None]:
        word, rows_of_word = word_and_rows
        for bit in range(WORD):  # unrolled: a reduction over the bits runs at half the speed
            has_feature = (word & jnp.uint32(1 << bit)) != 0
            union = tuple(
                column | jnp.where(has_feature, rows_of_word[bit, s][None], jnp.uint32(0))
                for s, column in enumerate(union)
            )
        return union, None

    nothing = (jnp.zeros(situations.shape[1:], jnp.uint32),) * num_columns
    return list(lax.scan(add_word, nothing, (situations, rows))[0])


def lowest_bit(word: Array) -> Array:
    """Returns each word with only its lowest 1-bit, 0 for 0; uint32 [...]."""
    return word & (jnp.uint32(0) - word)


def bit_index(bit: Array) -> Array:
    """Returns the index of the single 1-bit of each word, int32 [...]; -1 for 0."""
    return jnp.int32(WORD - 1) - lax.clz(bit).astype(jnp.int32)


def hash_of(situations: Array) -> Array:
    """Returns a hash of each situation, never 0: uint32 [W, ...] -> uint32 [...]."""
    h = jnp.full(situations.shape[1:], np.uint32(0x811C9DC5), jnp.uint32)
    for word in situations:
        h = (h ^ word) * jnp.uint32(0x9E3779B1)
        h = h ^ (h >> 15)
    h = h * jnp.uint32(0x85EBCA6B)
    return (h ^ (h >> 13)) | jnp.uint32(1 << 31)
