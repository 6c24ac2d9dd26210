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

_BITS_AT_ONCE = 8
"""Features whose rows are joined at once: more rows leave the fastest cache."""


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


def weighted_count(words: Array, digits: Array) -> Array:
    """Returns the sum of the weights of all 1-bits.

    Args:
      words: uint32 [W, K, B].
      digits: uint32 [DIGITS, W, B or 1], of `digits_of`.

    Returns:
      uint32 [K, B].
    """
    # One reduction over digits and words: term by term it runs at a fourth of the speed.
    places = jnp.arange(DIGITS, dtype=jnp.uint32)[:, None, None, None]
    counts = lax.population_count(words[None] & digits[:, :, None])
    return (counts << places).sum((0, 1), dtype=jnp.uint32)


def union_of_rows(situations: Array, table: Array) -> Array:
    """Returns for each situation the OR of the table rows of its features.

    Args:
      situations: uint32 [W, K, B].
      table: uint32 [F, S, B], F = 32 W.

    Returns:
      uint32 [S, K, B].
    """
    # A few features after the other, with their rows.
    num_columns, num_tasks = table.shape[1:]
    shifts = jnp.arange(WORD // _BITS_AT_ONCE, dtype=jnp.uint32) * _BITS_AT_ONCE
    parts = situations[:, None] >> shifts[None, :, None, None]
    parts = parts.reshape(-1, *situations.shape[1:])
    rows = table.reshape(-1, _BITS_AT_ONCE, num_columns, num_tasks)

    def add_features(
        union: tuple[Array, ...], part_and_rows: tuple[Array, Array]
    ) -> tuple[tuple[Array, ...], None]:
        part, rows_of_part = part_and_rows
        for bit in range(_BITS_AT_ONCE):  # unrolled: a reduction over the bits is half as fast
            has_feature = (part & jnp.uint32(1 << bit)) != 0
            union = tuple(
                column | jnp.where(has_feature, rows_of_part[bit, s][None], jnp.uint32(0))
                for s, column in enumerate(union)
            )
        return union, None

    nothing = (jnp.zeros(situations.shape[1:], jnp.uint32),) * num_columns
    return jnp.stack(lax.scan(add_features, nothing, (parts, rows))[0])


def lowest_bit(word: Array) -> Array:
    """Returns each word with only its lowest 1-bit, 0 for 0; uint32 [...]."""
    return word & (jnp.uint32(0) - word)


def bit_index(bit: Array) -> Array:
    """Returns the index of the single 1-bit of each word, int32 [...]; -1 for 0."""
    return jnp.int32(WORD - 1) - lax.clz(bit).astype(jnp.int32)


def hash_of(situations: Array) -> Array:
    """Returns a hash of each situation, never 0: uint32 [W, ...] -> uint32 [...]."""

    def mix(h: Array, word: Array) -> tuple[Array, None]:
        h = (h ^ word) * jnp.uint32(0x9E3779B1)
        return h ^ (h >> 15), None

    # A loop over the words: unrolled it runs at a fourth of the speed where they are many.
    first = jnp.full(situations.shape[1:], np.uint32(0x811C9DC5), jnp.uint32)
    h = lax.scan(mix, first, situations)[0] * jnp.uint32(0x85EBCA6B)
    return (h ^ (h >> 13)) | jnp.uint32(1 << 31)
