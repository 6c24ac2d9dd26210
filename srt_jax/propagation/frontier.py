"""The frontier: the cells that can still lower the cost of a neighbour, as a list, cheapest first,
from which `cell_queue` starts.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import apart
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.types import Array

_BINS = 1024


class CellList(NamedTuple):
    """cells: uint32 [room], indices into the flat bordered field, then zeros; num: uint32 []."""

    cells: Array
    num: Array


def frontier(field: Array, straight: Array, diagonal: Array) -> Array:
    """Returns the cells from which a legal move would lower the cost of a neighbour; none where all
    costs are exact.

    Args:
      field: uint32 [H + 2, W + 2], see `row_sweeps`.

    Returns:
      uint32 [H, words], packed.
    """
    height, stride = field.shape
    width = stride - 2

    def row_words(row: Array) -> Array:
        """One row at a time: XLA would split a step over the whole map among threads, which a
        marked call cannot hold.
        """
        above, here, below = lax.dynamic_slice(field, (row, jnp.int32(0)), (3, stride))
        can_improve = _can_improve(above, here, below, straight, diagonal)
        return packing.pack(can_improve[None, None, :width])[0, 0]

    return lax.map(row_words, jnp.arange(height - 2, dtype=jnp.int32))


def _can_improve(
    above: Array, here: Array, below: Array, straight: Array, diagonal: Array
) -> Array:
    """Which cells of a row can lower a neighbour, bool [W]; from three rows with their border.

    As signed numbers the costs of blocked cells are negative, so they never win a maximum.
    """
    above, here, below = (lax.bitcast_convert_type(row, jnp.int32) for row in (above, here, below))
    straight, diagonal = straight.astype(jnp.int32), diagonal.astype(jnp.int32)
    sign = jnp.int32(-(2**31))
    middle, left, right = slice(1, -1), slice(None, -2), slice(2, None)
    straights = [above[middle], below[middle], here[left], here[right]]
    diagonals = [
        row[side] | (row[middle] & sign) | (here[side] & sign)
        for row in (above, below)
        for side in (left, right)
    ]
    cost = here[middle]
    can_improve = functools.reduce(jnp.maximum, straights) > cost + straight
    can_improve |= functools.reduce(jnp.maximum, diagonals) > cost + diagonal
    return can_improve & (cost >= 0)


def list_cells(words: Array, stride: int, room: int) -> CellList:
    """Returns the set cells as indices into the flat bordered field, in row order; those past
    `room` - 1 are left out.

    Args:
      words: uint32 [H, words], packed.
      stride: columns of the bordered field.
      room: length of the list, a power of two.
    """
    one = jnp.uint32(1)

    def visit(state: CellList, row: Array, col: Array, is_set: Array) -> CellList:
        cell = (row + one) * jnp.uint32(stride) + one + col
        # the entry after the last is written again and again until a set cell takes it
        cells = write(state.cells, cell, state.num)
        num = jnp.minimum(state.num + is_set.astype(jnp.uint32), jnp.uint32(room - 1))
        return CellList(cells, num)

    return packing.for_each_cell(words, visit, CellList(jnp.zeros(room, jnp.uint32), jnp.uint32(0)))


class _Sums(NamedTuple):
    """total: uint32 [], cells in the bins so far; ends: uint32 [bins], where each of these ends."""

    total: Array
    ends: Array


class _Order(NamedTuple):
    """ends: uint32 [bins], the last free place of each bin, plus 1; cells: uint32 [room], in
    order.
    """

    ends: Array
    cells: Array


def cheapest_first(cells: Array, num: Array, cost: Array) -> Array:
    """Returns the first `num` cells in order of cost, coarsely: by counting in about a thousand
    bins; then zeros.

    Args:
      cells: uint32 [room], and num: uint32 [], from `list_cells`.
      cost: uint32 [N], the flat field.

    Returns:
      uint32 [room].
    """
    # bins of equal width, a power of two, up to the greatest cost
    zero = jnp.uint32(0)
    most = lax.fori_loop(
        zero, num, lambda i, most: jnp.maximum(most, read(cost, read(cells, i))), jnp.uint32(1)
    )
    shift = jnp.maximum(jnp.int32(32 - 10) - lax.clz(most).astype(jnp.int32), 0).astype(jnp.uint32)
    bin_of = apart(lambda cost, cell, shift: read(cost, cell) >> shift)

    def count(i: Array, counts: Array) -> Array:
        at = bin_of(cost, read_apart(cells, i), shift)
        return write(counts, read_apart(counts, at) + jnp.uint32(1), at)

    def add_up(i: Array, state: _Sums) -> _Sums:
        total = state.total + read_apart(state.ends, i)
        return _Sums(total, write(state.ends, total, i))

    def place(i: Array, state: _Order) -> _Order:
        cell = read_apart(cells, i)
        at = bin_of(cost, cell, shift)
        last = read_apart(state.ends, at) - jnp.uint32(1)
        return _Order(write(state.ends, last, at), write(state.cells, cell, last))

    # counting sort: how many cells each bin holds, where each bin ends, each cell to its bin
    counts = lax.fori_loop(zero, num, count, jnp.zeros(_BINS, jnp.uint32))
    num_bins = jnp.where(num > 1, jnp.uint32(_BINS), zero)  # one cell is in order as it is
    ends = lax.fori_loop(zero, num_bins, add_up, _Sums(zero, counts)).ends
    return lax.fori_loop(zero, num, place, _Order(ends, jnp.zeros_like(cells))).cells
