"""The corners that a search by jump points has reached: of a few cells of a map what is known.

The arrays are as large as the map. They are not cleared: a bit for each cell tells which entries
count. For use inside a marked call, where they stay in place (`in_place`).
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from sign_model.foundation.words import num_words
from srt_jax.engine.in_place import read_apart, write
from srt_jax.types import Array

NO_COST = np.uint32(2**32 - 1)

_ONE, _LOW = np.uint32(1), np.uint32(31)


class Room(NamedTuple):
    """Room to work in, whose contents do not matter: cost, leg, uint32 [H * W]. To clear it for
    every map would take a quarter of a search.
    """

    cost: Array
    leg: Array


def room_of(height: int, width: int) -> Room:
    """Returns room for maps of a size."""
    # filled with the same, one would be copied from the other
    size = height * width
    return Room(jnp.zeros(size, jnp.uint32), jnp.ones(size, jnp.uint32))


class Corners(NamedTuple):
    """seen: uint32 [ceil(H * W / 32)], a bit for each cell, of those that have been reached as a
    corner; room: their cost and leg.
    """

    seen: Array
    room: Room


def none_of(room: Room) -> Corners:
    """Returns that no cell has been reached."""
    return Corners(jnp.zeros(num_words(room.cost.size), jnp.uint32), room)


def corner_at(corners: Corners, cell: Array) -> tuple[Array, Array]:
    """Returns cost and leg of a corner; NO_COST and 0 of a cell not reached as one."""
    is_seen = is_corner(corners, cell)
    cost, leg = read_apart(corners.room.cost, cell), read_apart(corners.room.leg, cell)
    return jnp.where(is_seen, cost, NO_COST), jnp.where(is_seen, leg, jnp.uint32(0))


def is_corner(corners: Corners, cell: Array) -> Array:
    """Returns whether a cell has been reached as a corner, bool []."""
    return (read_apart(corners.seen, cell >> np.uint32(5)) >> (cell & _LOW)) & _ONE != 0


def with_corner(corners: Corners, cell: Array, cost: Array, leg: Array) -> Corners:
    """Returns the corners with cost and leg of one, known or new."""
    word = cell >> np.uint32(5)
    seen = read_apart(corners.seen, word) | (_ONE << (cell & _LOW))
    room = Room(write(corners.room.cost, cost, cell), write(corners.room.leg, leg, cell))
    return Corners(write(corners.seen, seen, word), room)
