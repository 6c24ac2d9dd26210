"""A queue of cells whose cost has just fallen: the costs of a small rough map, cell by cell.

Cells leave in the order they came, which from one start is nearly the order of their costs; a cell
whose cost falls again comes back. It ends, because costs only fall, and then no move can improve
any cell: the costs are those of shortest paths.

A cell tries only the moves that follow from the one that led into it (the canonical ordering of
jump point search, without corner cutting): after a straight move the same one, and moves to a side
where the cell behind that side is blocked; after a diagonal move it and its two components. That
loses nothing. Let y be a cell, x -> y the last move of a shortest path, x's cost exact and p its
parent. If x -> y is straight and not tried after p -> x, then a shorter way leads from p to y past
x, which cannot be. If it is diagonal and not tried, then either a shorter way does likewise, or y
has an equally short way whose last move is a straight one. So some last move to y is always tried.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from sign_model.foundation.words import WORD, num_words
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.types import Array

CLOCKWISE = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""The eight moves (down, right) clockwise from up; not in the order of `moves.MOVES`.

In the bit masks of this module bit i stands for CLOCKWISE[i]: bit 0 up, 1 up right, 2 right, 3 down
right, 4 down, 5 down left, 6 left, 7 up left. Even bits are straight moves, odd ones diagonal, and
the two moves beside move i are i - 1 and i + 1, modulo 8.
"""

ANY = 8
"""In place of the move that led into a cell: all that are legal are tried."""

_WAITS = 16  # flag beside that move: the cell is in the queue
_NO_COST = np.uint32(2**32 - 1)


def neighbours(free: Array, width: int) -> Array:
    """Returns which of the eight neighbours are free, bit i for CLOCKWISE[i].

    Args:
      free: uint32 [H, words], packed.
      width: W.

    Returns:
      uint8 [(H + 2) * (W + 2)], flat, of the map with its border.
    """
    height = free.shape[0]
    byte = _bytes_within_margin(free, num_words(width + 4))

    def row_bits(row: Array) -> Array:
        """Row by row, ten times faster than all at once: there each byte of the flat result would
        be computed from its row and column.
        """
        rows = lax.dynamic_slice(byte, (row, np.int32(0)), (3, byte.shape[1]))
        moved = [
            rows[1 + r, 1 + c : 3 + c + width] << jnp.uint8(i) for i, (r, c) in enumerate(CLOCKWISE)
        ]
        return functools.reduce(jnp.bitwise_or, moved)

    return lax.map(row_bits, jnp.arange(height + 2, dtype=jnp.int32)).reshape(-1)


def _bytes_within_margin(free: Array, words: int) -> Array:
    """The cells as bytes of 0 and 1, two blocked ones around the map: uint32 [H, ...] -> uint8
    [H + 4, 32 * words]. The words are shifted: padding bytes would take three times as long as all
    the rest.
    """
    height, num = free.shape
    rows = jnp.zeros((height + 4, 1 + max(num, words)), jnp.uint32)
    rows = lax.dynamic_update_slice(rows, free, (np.int32(2), np.int32(1)))
    rows = (rows[:, 1:] << np.uint32(2)) | (rows[:, :-1] >> np.uint32(WORD - 2))
    return packing.unpack(rows[None, :, :words], WORD * words)[0].astype(jnp.uint8)


@functools.cache
def moves_to_try() -> np.ndarray:
    """Returns uint8 [256 * 16]: the moves to try, by the free neighbours and the move that led into
    the cell.
    """
    free, last = np.divmod(np.arange(256 * 16), 16)

    # bit i of `free` is CLOCKWISE[i]
    def is_free(move: int) -> np.ndarray:
        return (free >> move % 8 & 1).astype(bool)

    table = np.zeros(256 * 16, np.uint8)
    for move in range(8):
        is_legal = is_free(move) & (move % 2 == 0 or is_free(move - 1) & is_free(move + 1))
        follows = (last == ANY) | (last == move)
        # straight: a component of a diagonal, or to a side behind which is a blocked cell
        if move % 2 == 0:
            follows |= (last == (move + 1) % 8) | (last == (move - 1) % 8)
            follows |= (last == (move + 2) % 8) & ~is_free(move - 1) | (
                last == (move - 2) % 8
            ) & ~is_free(move + 1)
        else:  # diagonal: straight on and to such a side
            follows |= (last == (move + 1) % 8) & ~is_free(move - 2) | (
                last == (move - 1) % 8
            ) & ~is_free(move + 2)
        table |= (is_legal & follows).astype(np.uint8) << move
    return table


class _Queue(NamedTuple):
    """head, tail: uint32 [], counts of cells taken from the queue and put into it; cost: uint32
    [N]; led_by: uint8 [N], the move that led into the cell (or ANY) and the flag _WAITS; queue:
    uint32 [room], a ring of cells; is_short: bool [], whether it was too short.
    """

    head: Array
    tail: Array
    cost: Array
    led_by: Array
    queue: Array
    is_short: Array


class _Trial(NamedTuple):
    """moves: uint32 [], a bit for each move left to try from `cell`, whose cost is `here`, uint32
    []; the others as in `_Queue`.
    """

    moves: Array
    tail: Array
    cost: Array
    led_by: Array
    queue: Array
    cell: Array
    here: Array


def spread(
    cost: Array,
    free_beside: Array,
    start: Array,
    straight: Array,
    diagonal: Array,
    stride: int,
    room: int,
) -> tuple[Array, Array]:
    """Returns the costs after every improvement that follows from the start, and whether the queue
    was too short for some.

    Args:
      cost: uint32 [N], a flat bordered field (`row_sweeps`).
      free_beside: uint8 [N], from `neighbours`.
      start: uint32 [], the cell to start from; 0 for none.
      stride: columns of the bordered field.
      room: of the queue, a power of two.

    Returns:
      uint32 [N]; bool [], if True some improvement was not followed up.
    """
    table = jnp.asarray(moves_to_try())
    offset = jnp.asarray(
        np.array([down * stride + right for down, right in CLOCKWISE], np.int32).astype(np.uint32)
    )
    one, mask = jnp.uint32(1), jnp.uint32(room - 1)

    def moves_of(free_beside: Array, table: Array, led_by: Array, cell: Array) -> Array:
        index = (read(free_beside, cell).astype(jnp.uint32) << jnp.uint32(4)) | (
            led_by & jnp.uint8(15)
        ).astype(jnp.uint32)
        return read(table, index).astype(jnp.uint32)

    def try_lowest(state: _Trial) -> _Trial:
        """Tries the lowest of the moves left, none if there is none.

        Without a branch: what is not to change is written again as it was.
        """
        moves, tail, cost, led_by, queue, cell, here = state
        # bit i of `moves` is CLOCKWISE[i]; an odd one is diagonal
        move = lax.population_count((moves & -moves) - one)
        to = cell + read(offset, move & jnp.uint32(7))
        total = here + jnp.where(move & one != 0, diagonal, straight)
        total = jnp.where(moves == 0, _NO_COST, total)
        old, old_led_by = read_apart(cost, to), read_apart(led_by, to)
        is_better = total < old
        cost = write(cost, jnp.minimum(old, total), to)
        led_by = write(
            led_by, jnp.where(is_better, move.astype(jnp.uint8) | jnp.uint8(_WAITS), old_led_by), to
        )
        # a cell whose cost falls is queued, unless it waits already
        queue = write(queue, to, tail & mask)
        tail = tail + (is_better & (old_led_by & jnp.uint8(_WAITS) == 0)).astype(jnp.uint32)
        return _Trial(moves & (moves - one), tail, cost, led_by, queue, cell, here)

    def take(state: _Queue) -> _Queue:
        """Tries the moves of the first cell: none where the queue could overflow."""
        head, tail, cost, led_by, queue, is_short = state
        cell = read_apart(queue, head & mask)
        head = head + one
        here, led = read_apart(cost, cell), read_apart(led_by, cell)
        moves = apart(moves_of)(free_beside, table, led, cell)
        is_full = tail - head > jnp.uint32(room - 10)  # a cell adds at most eight
        moves = jnp.where(is_full, jnp.uint32(0), moves)
        led_by = write(led_by, led & jnp.uint8(15), cell)  # it waits no longer
        # the first move outside the loop: few cells have more than one
        trial = try_lowest(_Trial(moves, tail, cost, led_by, queue, cell, here))
        trial = lax.while_loop(lambda trial: trial.moves != 0, try_lowest, trial)
        fields = (trial.cost, trial.led_by, trial.queue, is_short | is_full)
        return _Queue(head, trial.tail, *fields)

    zero = jnp.uint32(0)
    queue = write(jnp.zeros(room, jnp.uint32), start, zero)
    begin = _Queue(
        zero,
        (start != 0).astype(jnp.uint32),
        cost,
        jnp.full(cost.shape, ANY, jnp.uint8),
        queue,
        jnp.bool_(False),
    )
    done = lax.while_loop(lambda state: state.head != state.tail, take, begin)
    return done.cost, done.is_short
