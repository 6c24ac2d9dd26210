"""One map of a batch in machine words: which cells are open once obstacles are gone, which obstacles border a region.

For use inside a marked call (`kernel`), map by map: rows of labels are read from the whole batch, since a map cut out of it
would be a copy. A mask is uint32 [H, words], packed as in `packing`.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from srt_jax import packing
from srt_jax.kernel import apart, compiled_whole, each, read, runs_in_place, write
from srt_jax.types import FREE

_MOST_SELECTED = 16
"""Words of obstacles up to which picking one by comparing is faster than a table look-up per cell."""


class Labels(NamedTuple):
    """The labels of one map: all int32 [B, L, H, W], and which of the batch, int32 []."""

    all: Array
    which: Array

    def row(self, layer: int, row: Array) -> Array:
        """Returns int32 [W]."""
        width = self.all.shape[3]
        return lax.dynamic_slice(self.all, (self.which, jnp.int32(layer), row, jnp.int32(0)), (1, 1, 1, width)).reshape(width)

    def at(self, layer: int, row: Array, col: Array) -> Array:
        """Returns int32 [], the nearest cell's label where the cell lies outside."""
        return lax.dynamic_slice(self.all, (self.which, jnp.int32(layer), row, col), (1, 1, 1, 1))[0, 0, 0, 0]


def as_words(which: Array) -> Array:
    """Returns a set of obstacles, bool [M], as uint32 [ceil(M / 32)]."""
    return packing.pack(which[None, None])[0, 0]


def open_cells(labels: Labels, gone: Array) -> Array:
    """Returns the cells that are free once the obstacles `gone` (bool [M]) are: every owner of a cell has to go."""
    _, num_layers, height, _ = labels.all.shape
    words = as_words(gone)

    def row_words(row: Array) -> Array:
        is_open = functools.reduce(jnp.logical_and, (_is_open(labels.row(i, row), words) for i in range(num_layers)))
        return packing.pack(is_open[None, None])[0, 0]

    return lax.map(row_words, jnp.arange(height, dtype=jnp.int32))


def _is_open(ids: Array, gone: Array) -> Array:
    if len(gone) <= _MOST_SELECTED:
        word = jnp.zeros(ids.shape, jnp.uint32)
        for i in range(len(gone)):
            word = jnp.where(ids >> 5 == i, gone[i], word)
    else:
        word = jnp.where(ids >= 0, jnp.take(gone, (ids >> 5).clip(0)), jnp.uint32(0))
    return (ids == FREE) | (word >> (ids & 31).astype(jnp.uint32) & jnp.uint32(1) != 0)


def all_open_cells(labels: Array, gone: Array) -> Array:
    """Returns `open_cells` of a batch: labels int32 [B, L, H, W], gone bool [B, M] -> uint32 [B, H, words]."""

    def all_maps(labels: Array, gone: Array) -> Array:
        return each(lambda which, gone: open_cells(Labels(labels, which), gone), _numbers(labels), gone)

    return compiled_whole(all_maps)(labels, gone)


def all_met_by(labels: Array, cells: Array, num_obstacles: int) -> Array:
    """Returns `met_by` of a batch: labels int32 [B, L, H, W], cells uint32 [B, H, words] -> bool [B, M]."""

    def all_maps(labels: Array, cells: Array) -> Array:
        def one_map(which: Array, cells: Array) -> Array:
            return met_by(Labels(labels, which), cells, num_obstacles)

        return each(one_map, _numbers(labels), cells)

    return compiled_whole(all_maps)(labels, cells)


def _numbers(labels: Array) -> Array:
    return jnp.arange(len(labels), dtype=jnp.int32)


def met_by(labels: Labels, cells: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover at least one of `cells` (a mask): bool [M]."""
    if runs_in_place():
        return _met_cell_by_cell(labels, cells, num_obstacles)
    width = labels.all.shape[3]
    asked = packing.unpack(cells[None], width)[0]
    own = labels.all[labels.which]
    ids = jnp.where(asked[None] & (own >= 0), own, num_obstacles)
    return jnp.zeros(num_obstacles, bool).at[ids.reshape(-1)].set(True, mode="drop")


def _met_cell_by_cell(labels: Labels, cells: Array, num_obstacles: int) -> Array:
    """Takes the lowest bit of the word in hand; when that was the last, the next word."""
    per_row, one = jnp.uint32(cells.shape[1]), jnp.uint32(1)
    words = jnp.pad(cells.reshape(-1), (0, 1))
    num_words = jnp.uint32(words.shape[0])

    def step(state: tuple) -> tuple:
        ahead, word, met = state
        which = ahead - one
        bit = lax.population_count((word & -word) - one) & jnp.uint32(31)  # of an empty word: a cell that is not noted
        row, col = which // per_row, which % per_row * jnp.uint32(packing.WORD) + bit
        for layer in range(labels.all.shape[1]):
            owner = apart(lambda labels, row, col, layer=layer: labels.at(layer, row, col))(
                labels, row.astype(jnp.int32), col.astype(jnp.int32)
            )
            met = write(met, one, jnp.where((word != 0) & (owner >= 0), owner, num_obstacles).astype(jnp.uint32))
        word = word & (word - one)
        is_spent = word == 0
        return ahead + is_spent.astype(jnp.uint32), jnp.where(is_spent, read(words, ahead), word), met

    state = (one, words[0], jnp.zeros(num_obstacles + 1, jnp.uint32))
    met = lax.while_loop(lambda state: (state[0] < num_words) | (state[1] != 0), step, state)[2]
    return met[:num_obstacles] != 0


def owners_of(labels: Labels, cell: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover `cell`, int32 [2] inside the map: bool [M]."""
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)
    owners = (labels.at(layer, cell[0], cell[1]) for layer in range(labels.all.shape[1]))
    return functools.reduce(jnp.logical_or, (ids == owner for owner in owners))


def only(cell: Array, height: int, num_words: int) -> Array:
    """Returns the mask of one cell, int32 [2] inside the map."""
    mask = jnp.zeros((height, num_words), jnp.uint32)
    bit = jnp.uint32(1) << (cell[1] & 31).astype(jnp.uint32)
    return lax.dynamic_update_slice(mask, bit[None, None], (cell[0], cell[1] >> 5))


def holds(mask: Array, cell: Array) -> Array:
    """Returns whether `cell`, int32 [2] inside the map, is in the mask: bool []."""
    word = lax.dynamic_slice(mask, (cell[0], cell[1] >> 5), (1, 1))[0, 0]
    return word >> (cell[1] & 31).astype(jnp.uint32) & jnp.uint32(1) != 0


def beside(mask: Array) -> Array:
    """Returns the cells that share a side with one of the mask's, those inside it too; past the map's last column perhaps."""
    one, top = jnp.uint32(1), jnp.uint32(31)
    tall, wide = jnp.pad(mask, ((1, 1), (0, 0))), jnp.pad(mask, ((0, 0), (1, 1)))
    along = (mask << one) | (mask >> one) | (wide[:, :-2] >> top) | (wide[:, 2:] << top)
    return along | tall[:-2] | tall[2:]


def around(masks: Array) -> Array:
    """Returns the cells of each mask, uint32 [..., H, words], and all that touch them by side or corner."""
    one, top = jnp.uint32(1), jnp.uint32(31)
    sides = [(0, 0)] * (masks.ndim - 2)
    guarded = jnp.pad(masks, (*sides, (0, 0), (1, 1)))
    wide = masks | (masks << one) | (masks >> one) | (guarded[..., :-2] >> top) | (guarded[..., 2:] << top)
    wide = jnp.pad(wide, (*sides, (1, 1), (0, 0)))
    return wide[..., :-2, :] | wide[..., 1:-1, :] | wide[..., 2:, :]
