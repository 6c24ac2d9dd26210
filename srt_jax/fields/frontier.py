"""Which cells can still improve a neighbour? As a list, cheapest first, for `cell_queue` to start
from.
"""

import functools

import jax.numpy as jnp
from jax import lax

from sign_model.ground.marks import apart
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.fields.goal_bound import Target
from srt_jax.types import Array

_BINS = 1024


def frontier(
    field: Array, straight: Array, diagonal: Array, towards: Target | None = None
) -> Array:
    """Returns the cells from which a legal move would lower the cost of a neighbour; none where all
    costs are exact.

    Args:
      field: uint32 [H + 2, W + 2], see `row_sweeps`.
      towards: leave out the cells that cannot lie on a shortest path to this one.

    Returns:
      uint32 [H, words], packed.
    """
    height, stride = field.shape
    width = stride - 2

    def row_words(row: Array) -> Array:
        """One row at a time: XLA would split a step over the whole map among threads, which no
        marked call can hold.
        """
        above, here, below = lax.dynamic_slice(field, (row, jnp.int32(0)), (3, stride))
        can_improve = _can_improve(above, here, below, straight, diagonal)
        if towards is not None:
            cols = jnp.arange(1, width + 1, dtype=jnp.int32)
            can_improve &= here[1:-1] + towards.at_least(row + 1, cols, straight, diagonal) <= most
        return packing.pack(can_improve[None, None, :width])[0, 0]

    most = jnp.uint32(0) if towards is None else towards.cost(field.reshape(-1), stride)

    return lax.map(row_words, jnp.arange(height - 2, dtype=jnp.int32))


def _can_improve(
    above: Array, here: Array, below: Array, straight: Array, diagonal: Array
) -> Array:
    """Which cells of a row can lower a neighbour, bool [W]; from three rows with their border.

    As signed numbers blocked cells are negative, and cost more than nothing can: they drop out of a
    maximum by themselves.
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


def listed(words: Array, stride: int, room: int) -> tuple[Array, Array]:
    """Returns the set cells as indices into the flat bordered field, and their number; those past
    `room` - 1 are left out.

    Args:
      words: uint32 [H, words], packed.
      stride: columns of the bordered field.
      room: length of the list, a power of two.

    Returns:
      uint32 [room] and uint32 [].
    """
    per_row = jnp.uint32(words.shape[1])
    words = jnp.pad(words.reshape(-1), (0, 1))
    num_words = jnp.uint32(words.shape[0])
    one = jnp.uint32(1)

    def step(state: tuple) -> tuple:
        """Takes the lowest bit of the word in hand; when that was the last, the next word."""
        ahead, word, num, cells = state
        which = ahead - one
        bit = lax.population_count((word & -word) - one)
        cell = (
            (which // per_row + one) * jnp.uint32(stride)
            + one
            + which % per_row * jnp.uint32(packing.WORD)
            + bit
        )
        cells = write(cells, cell, num)
        num = jnp.minimum(num + (word != 0).astype(jnp.uint32), jnp.uint32(room - 1))
        word = word & (word - one)
        is_spent = word == 0
        return (
            ahead + is_spent.astype(jnp.uint32),
            jnp.where(is_spent, read(words, ahead), word),
            num,
            cells,
        )

    state = (one, words[0], jnp.uint32(0), jnp.zeros(room, jnp.uint32))
    _, _, num, cells = lax.while_loop(
        lambda state: (state[0] < num_words) | (state[1] != 0), step, state
    )
    return cells, num


def cheapest_first(cells: Array, num: Array, cost: Array) -> Array:
    """Returns the first `num` cells in order of cost, coarsely: by counting in about a thousand
    bins; then zeros.

    Args:
      cells: uint32 [room], from `listed`; cost: uint32 [N], the flat field.

    Returns:
      uint32 [room].
    """
    zero = jnp.uint32(0)
    most = lax.fori_loop(
        zero, num, lambda i, most: jnp.maximum(most, read(cost, read(cells, i))), jnp.uint32(1)
    )
    shift = jnp.maximum(jnp.int32(32 - 10) - lax.clz(most).astype(jnp.int32), 0).astype(jnp.uint32)
    bin_of = apart(lambda cost, cell, shift: read(cost, cell) >> shift)

    def count(i: Array, counts: Array) -> Array:
        at = bin_of(cost, read_apart(cells, i), shift)
        return write(counts, read_apart(counts, at) + jnp.uint32(1), at)

    def add_up(i: Array, state: tuple) -> tuple:
        total, counts = state
        total = total + read_apart(counts, i)
        return total, write(counts, total, i)

    def place(i: Array, state: tuple) -> tuple:
        ends, ordered = state
        cell = read_apart(cells, i)
        at = bin_of(cost, cell, shift)
        last = read_apart(ends, at) - jnp.uint32(1)
        return write(ends, last, at), write(ordered, cell, last)

    counts = lax.fori_loop(zero, num, count, jnp.zeros(_BINS, jnp.uint32))
    num_bins = jnp.where(num > 1, jnp.uint32(_BINS), zero)  # one cell is in order as it is
    _, ends = lax.fori_loop(zero, num_bins, add_up, (zero, counts))
    return lax.fori_loop(zero, num, place, (ends, jnp.zeros_like(cells)))[1]
