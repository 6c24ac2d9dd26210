"""How the masks of a batch lie in machine words: 32 cells of a row in one uint32, and several maps
side by side in lanes.

words: uint32 [B, H, ceil(W / 32)]; bit i of word w is column 32 w + i, columns past W are 0.
lanes: uint32 [B / group, H, words * group]; the word w of map m of a group lies at w * group + m.
  So one row of the whole group is one long vector, and the neighbouring word is a plain slice,
  shifted by `group`.
quads: uint32 [B, H, W / 4], W a multiple of 32: the bytes of the bool mask as they are, four to a
  number, little endian. On the host that is a view of the mask without a copy; a kernel that starts
  from quads packs twice as fast as from bools.
"""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.words import WORD, num_words
from srt_jax.engine.in_place import read
from srt_jax.types import Array

# free and reached of one group: to stay within the second-level cache of one core
_GROUP_BYTES = 640 * 1024


def group_size(batch: int, height: int, width: int) -> int:
    """Returns how many maps lie side by side: a power of two that fits the cache, no more than the
    batch needs.
    """
    bytes_per_map = 2 * 4 * height * (num_words(width) + 2)
    group = 1
    while group < min(batch, 32) and 2 * group * bytes_per_map <= _GROUP_BYTES:
        group *= 2
    return group


def pack(mask: Array) -> Array:
    """Returns bool [B, H, W] as words, uint32 [B, H, ceil(W / 32)]."""
    batch, height, width = mask.shape
    words = num_words(width)
    byte = jnp.pad(mask.astype(jnp.uint8), ((0, 0), (0, 0), (0, words * WORD - width)))
    quad = lax.bitcast_convert_type(byte.reshape(batch, height, words, 8, 4), jnp.uint32)
    return _joined(_nibble(quad))


def pack_row(tests: Array) -> Array:
    """Returns one row, bool [W], as words, uint32 [ceil(W / 32)]; a third of the time of `pack`
    where the cells are tests that have just been made, and no bytes in memory.
    """
    bits = jnp.pad(tests.astype(jnp.uint32), (0, -len(tests) % WORD))
    for length in (1, 2, 4, 8, 16):  # neighbours become one, twice as long
        pairs = bits.reshape(-1, 2)
        bits = pairs[:, 0] | (pairs[:, 1] << np.uint32(length))
    return bits


def _joined(nibbles: Array) -> Array:
    """Eight nibbles each, uint32 [..., 8], as words, uint32 [...]: a vector and its fold each."""
    rank = nibbles.ndim
    shift = (jnp.uint32(4) * jnp.arange(8, dtype=jnp.uint32)).reshape((1,) * (rank - 1) + (8,))
    return lax.reduce(nibbles << shift, jnp.uint32(0), lax.bitwise_or, (rank - 1,))


def _nibble(quad: Array) -> Array:
    """Four cells, 0 or 1 in a byte each, as four bits: one multiply brings bits 0, 8, 16, 24 to
    28..31.
    """
    return (quad * jnp.uint32(0x10204080)) >> jnp.uint32(28)


def unpack(words: Array, width: int) -> Array:
    """Returns words, uint32 [B, H, words], as bool [B, H, width]."""
    batch, height, count = words.shape
    shift = jnp.arange(WORD, dtype=jnp.uint32)[None, None, None]
    bits = (words[..., None] >> shift) & jnp.uint32(1)
    return bits.astype(bool).reshape(batch, height, count * WORD)[:, :, :width]


def to_lanes(words: Array, group: int) -> Array:
    """Returns words, uint32 [B, H, words], in lanes; empty maps fill the last group."""
    batch, height, count = words.shape
    if batch % group:
        words = jnp.pad(words, ((0, -batch % group), (0, 0), (0, 0)))
    return (
        words.reshape(-1, group, height, count)
        .transpose(0, 2, 3, 1)
        .reshape(-1, height, count * group)
    )


def from_lanes(lanes: Array, group: int, batch: int) -> Array:
    """Returns the inverse of `to_lanes`: uint32 [batch, H, words]."""
    groups, height, _ = lanes.shape
    return (
        lanes.reshape(groups, height, -1, group)
        .transpose(0, 3, 1, 2)
        .reshape(groups * group, height, -1)[:batch]
    )


def quads_to_lanes(quads: Array, group: int) -> Array:
    """Returns quads, uint32 [B, H, W / 4], in lanes; B is a multiple of `group`."""
    batch, height, count = quads.shape
    quads = quads.reshape(batch // group, group, height, count // 8, 8).transpose(0, 2, 3, 1, 4)
    return _joined(_nibble(quads)).reshape(batch // group, height, -1)


def bits_inside(width: Array, words: int) -> Array:
    """Returns words of a row with the columns below `width` set: int32 [...] -> uint32 [...,
    words].
    """
    first = WORD * jnp.arange(words, dtype=jnp.int32)
    count = jnp.clip(width[..., None] - first.reshape((1,) * width.ndim + (-1,)), 0, WORD).astype(
        jnp.uint32
    )
    all_set = jnp.uint32(2**32 - 1)
    return jnp.where(
        count == WORD, all_set, (jnp.uint32(1) << (count & jnp.uint32(WORD - 1))) - jnp.uint32(1)
    )


def words_inside(size: Array, height: int, width: int) -> Array:
    """Returns masks of the cells inside maps of the sizes int32 [B, 2], packed: uint32 [B, height,
    words].
    """
    rows = jnp.arange(height, dtype=jnp.int32)[None, :, None]
    bits = bits_inside(size[:, 1], num_words(width))
    return jnp.where(rows < size[:, 0, None, None], bits[:, None], jnp.uint32(0))


def words_of_cell(cell: Array, height: int, width: int) -> Array:
    """Returns masks of one cell each, int32 [B, 2], none if it lies outside, packed: uint32 [B,
    height, words].
    """
    rows = jnp.arange(height, dtype=jnp.int32)[None, :, None]
    words = jnp.arange(num_words(width), dtype=jnp.int32)[None, None]
    row, col = cell[:, 0, None, None], cell[:, 1, None, None]
    is_there = (rows == row) & (words == col // WORD) & (col < width)
    return jnp.where(is_there, jnp.uint32(1) << (col % WORD).astype(jnp.uint32), jnp.uint32(0))


def has(words: Array, cell: Array, width: int) -> Array:
    """Returns whether `cell`, int32 [2], lies on the map and is set, bool []: words uint32 [H,
    words], of W columns.
    """
    row, col = cell[0], cell[1]
    word = lax.dynamic_slice(words, (row, col >> 5), (1, 1))[0, 0]
    is_set = (word >> (col & 31).astype(jnp.uint32)) & jnp.uint32(1) != 0
    return is_set & (row >= 0) & (row < words.shape[0]) & (col >= 0) & (col < width)


def dilate(masks: Array, group: int = 1) -> Array:
    """Returns the cells of each mask and all that touch them by side or corner.

    Bits past the map's last column may be set as well.

    Args:
      masks: uint32 [..., H, words * group], in lanes; packed masks are lanes with a group of 1.
    """
    *batch, height, lanes = masks.shape
    one, top = jnp.uint32(1), jnp.uint32(WORD - 1)
    # rows first: a border of empty rows and words saves every edge case
    padded = jnp.zeros((*batch, height + 2, lanes + 2 * group), jnp.uint32)
    first = [*[0] * len(batch), 1, group]
    padded = lax.dynamic_update_slice(padded, masks, [np.int32(place) for place in first])
    tall = padded[..., :-2, :] | padded[..., 1:-1, :] | padded[..., 2:, :]
    # then columns: the end bits come from the neighbouring words
    here, before, behind = (
        tall[..., group:-group],
        tall[..., : -2 * group],
        tall[..., 2 * group :],
    )
    return here | (here << one) | (here >> one) | (before >> top) | (behind << top)


def for_each_cell(mask: Array, visit: Callable[[Any, Array, Array], Any], out: Any) -> Any:
    """Returns `out` after out = visit(out, row, col) for each cell of a mask in row order.

    The arrays in `out` stay in place in a marked call (see `in_place`).

    Args:
      mask: uint32 [H, words], packed.
      visit: takes row and col as uint32 [].
      out: a pytree of arrays.
    """
    per_row, one = jnp.uint32(mask.shape[1]), jnp.uint32(1)
    # behind the last word one that is not empty, where every search for the next one ends
    num_all = np.uint32(mask.size)
    words = jnp.pad(mask.reshape(-1), (0, 1), constant_values=1)

    def next_filled(at: Array, word: Array) -> tuple[Array, Array]:
        return lax.while_loop(
            lambda scan: scan[1] == 0,
            lambda scan: (scan[0] + one, read(words, scan[0] + one)),
            (at, word),
        )

    def step(state: tuple[Array, Array, Any]) -> tuple[Array, Array, Any]:
        at, word, out = state
        bit = lax.population_count((word & -word) - one)
        out = visit(out, at // per_row, at % per_row * jnp.uint32(WORD) + bit)
        return *next_filled(at, word & (word - one)), out

    # ends: every step takes a bit away
    begin = (*next_filled(jnp.uint32(0), words[0]), out)
    return lax.while_loop(lambda state: state[0] < num_all, step, begin)[2]
