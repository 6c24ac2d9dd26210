"""Sets as words of 32 bits, for the kernels of both packages: member i is bit i % 32 of word
i // 32, and unused bits are 0.

32 bits, since JAX has no 64-bit integers unless they are switched on. Searches on the host pack
into 64 (`sign_model.bits`). How the masks of maps lie in such words: `srt_jax.engine.packing`.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.records import Array

WORD = 32


def num_words(count: int) -> int:
    """Returns how many words hold a set of `count` possible members."""
    return -(-count // WORD)


def pack_rows(bits: np.ndarray, words: int) -> np.ndarray:
    """Returns sets on the host, bool [..., N], as uint32 [..., words]; N is at most 32 * words."""
    padded = np.zeros((*bits.shape[:-1], words * WORD), np.uint8)
    padded[..., : bits.shape[-1]] = bits
    return np.packbits(padded, axis=-1, bitorder="little").view("<u4").astype(np.uint32)


def pack_columns(bits: Array) -> Array:
    """Returns sets along the leading axis, bool [N, ...], as uint32 [words, ...]: at least one
    word.

    For use inside jit: the batch is the minor axis there, and stays it.
    """
    words = max(1, num_words(bits.shape[0]))
    missing = words * WORD - bits.shape[0]
    if missing:
        bits = jnp.pad(bits, ((0, missing), *[(0, 0)] * (bits.ndim - 1)))
    wide = bits.reshape(words, WORD, *bits.shape[1:]).astype(jnp.uint32)
    shifts = jnp.arange(WORD, dtype=jnp.uint32).reshape(1, WORD, *[1] * (bits.ndim - 1))
    return (wide << shifts).sum(axis=1, dtype=jnp.uint32)


def pack_members(members: Array, is_in: Array, words: int) -> Array:
    """Returns the set of those `members`, int32 [n], that are in (bool [n]): uint32 [words]."""
    index = jnp.maximum(members, 0).astype(jnp.uint32)
    bits = jnp.where(is_in, jnp.uint32(1) << (index % WORD), jnp.uint32(0))
    places = jnp.arange(words, dtype=jnp.uint32)
    spread = jnp.where(places[:, None] == (index // WORD)[None], bits[None], jnp.uint32(0))
    return lax.reduce(spread, jnp.uint32(0), lax.bitwise_or, (1,))


def contains(words: Array, members: Array) -> Array:
    """Returns whether each of `members`, int32 [...], is in the set uint32 [words]; a negative
    number is read as 0.
    """
    index = jnp.maximum(members, 0).astype(jnp.uint32)
    word = words[0] if words.shape[0] == 1 else words[index // WORD]
    return (word >> (index % WORD)) & jnp.uint32(1) != 0
