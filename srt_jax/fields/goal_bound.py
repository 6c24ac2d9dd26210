"""Where only the path to one cell is requested: which cells can lie on it (the bound of A*, for
sweeps and queues).

A cell whose cost and least distance to the target add up to more than the target's own cost so far
cannot lie on a shortest path there, so it need not be followed up. Every cell on any shortest path
is within the bound at any time, for the target's cost only falls; so all of these end with exact
costs, and the path read off them is the one read off a whole field. Other cells keep the cost they
have got, which is no less than their exact one.
"""

from typing import NamedTuple

import jax.numpy as jnp

from srt_jax.engine.in_place import read
from srt_jax.moves import is_on_map
from srt_jax.types import Array


class Target(NamedTuple):
    """The requested cell, int32 (row, col) in a field with its border; (0, 0), a blocked cell, if
    it is outside the map.
    """

    row: Array
    col: Array

    def index(self, stride: int) -> Array:
        """Returns the place in the flat field, uint32."""
        return (self.row * stride + self.col).astype(jnp.uint32)

    def cost(self, flat: Array, stride: int) -> Array:
        """Returns the cost of the target in a flat field, uint32."""
        return read(flat, self.index(stride))

    def at_least(self, row: Array, col: Array, straight: Array, diagonal: Array) -> Array:
        """Returns the octile distance of cells to the target, uint32: no path there costs less."""
        down, across = (
            jnp.abs(a.astype(jnp.int32) - b) for a, b in ((row, self.row), (col, self.col))
        )
        low, high = (pick(down, across).astype(jnp.uint32) for pick in (jnp.minimum, jnp.maximum))
        return high * straight + low * (diagonal - straight)


def target_of(cell: Array, height: int, width: int) -> Target:
    """Returns `cell`, int32 [2] of a map of that size, as a target."""
    is_inside = is_on_map(cell[0], cell[1], height, width)
    return Target(*(jnp.where(is_inside, place + 1, 0) for place in (cell[0], cell[1])))
