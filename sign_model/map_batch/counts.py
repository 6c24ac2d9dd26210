"""Weighted counts over packed words, the batch last: how a sign's weights rate situations inside
the jitted search.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.words import WORD, pack_columns
from sign_model.map_batch.tables import MAX_WEIGHT

DIGITS = MAX_WEIGHT.bit_length()


def digits_of(weights: jax.Array) -> jax.Array:
    """int32 [n] -> uint32 [DIGITS, n / 32, 1]: for each binary digit the words of those weights
    that have it.
    """
    return jnp.stack(
        [pack_columns(((weights >> d) & 1).astype(bool))[:, None] for d in range(DIGITS)]
    )


def weighted_count(words: list[jax.Array], digits: jax.Array) -> jax.Array:
    """The sum of the weights of all 1-bits: words [K, B] each, digits uint32 [DIGITS, len(words), B
    or 1] -> uint32 [K, B].
    """
    total = jnp.zeros(words[0].shape, jnp.uint32)
    for d in range(DIGITS):
        count = jnp.zeros(words[0].shape, jnp.uint32)
        for w, word in enumerate(words):
            count = count + lax.population_count(word & digits[d, w][None])
        total = total + (count << d)
    return total


def needed(situations: jax.Array, table: jax.Array) -> list[jax.Array]:
    """OR of the table rows of each situation's features: [W, K, B], [F, S, B] -> S words [K, B]."""
    num_words, num_columns, num_tasks = situations.shape[0], table.shape[1], situations.shape[2]
    rows = table.reshape(num_words, WORD, num_columns, num_tasks)

    def one_word(found, word_and_rows):
        word, of_word = word_and_rows
        for bit in range(WORD):  # written out: a reduction over the bits runs at half the speed
            held = (word & jnp.uint32(1 << bit)) != 0
            found = tuple(
                n | jnp.where(held, of_word[bit, s][None], jnp.uint32(0))
                for s, n in enumerate(found)
            )
        return found, None

    nothing = (jnp.zeros(situations.shape[1:], jnp.uint32),) * num_columns
    return list(lax.scan(one_word, nothing, (situations, rows))[0])


def lowest(word: jax.Array) -> jax.Array:
    """The lowest 1-bit of each word alone, 0 of 0."""
    return word & (jnp.uint32(0) - word)


def position(bit: jax.Array) -> jax.Array:
    """The place of a single 1-bit, -1 of 0."""
    return jnp.int32(WORD - 1) - lax.clz(bit).astype(jnp.int32)


def hash_of(situations: jax.Array) -> jax.Array:
    """uint32 [W, ...] -> uint32 [...], never 0."""
    h = jnp.full(situations.shape[1:], np.uint32(0x811C9DC5), jnp.uint32)
    for word in situations:
        h = (h ^ word) * jnp.uint32(0x9E3779B1)
        h = h ^ (h >> 15)
    h = h * jnp.uint32(0x85EBCA6B)
    return (h ^ (h >> 13)) | jnp.uint32(1 << 31)
