"""The cells of the path that a search by jump points has found, going back from the goal: why they
are the ones defined is told in `jump_points`.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import read
from srt_jax.paths.jump_points import (
    COMES,
    LONGEST_SIDE,
    NO_COST,
    RUN,
    SIDE,
    Best,
    Corners,
    corner_at,
)
from srt_jax.types import Array

_BACK = np.array([(-1, 0), (0, -1), (0, 1), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)], np.int32)


def _steps_back() -> np.ndarray:
    """uint32 [32]: the index in `_BACK` of a leg's diagonal part, by bits 29 to 31 and 5 and 6."""
    first_second = ((4, 5), (4, 6), (5, 7), (6, 7))
    table = [[0, *first_second[i], 0] if i < 4 else [i] * 4 for i in range(8)]
    return np.array(table, np.uint32).reshape(-1)


class _Walk(NamedTuple):
    """row, col: int32 [], the cell reached, and its cost `here`, uint32 []; leg: uint32 [], the one
    that is walked back, `left` moves of its run; num: int32 [], cells so far; cells: int32
    [max_cells, 2], written from the back.
    """

    row: Array
    col: Array
    here: Array
    leg: Array
    left: Array
    num: Array
    cells: Array


def walk_back(
    best: Best,
    corners: Corners,
    goal: Array,
    straight: Array,
    diagonal: Array,
    width: int,
    cells: Array,
) -> tuple[Array, Array]:
    """Returns the cells of the path at the end of the array `cells`, int32 [max_cells, 2], and how
    many they are, int32 []; for use inside a marked call.

    Args:
      best, corners, straight, diagonal, width: of `search`; where the goal is not reached, it is
        the path.
      goal: int32 [2].
    """
    back_row, back_col = (jnp.asarray(steps) for steps in _BACK.T)
    steps_back = jnp.asarray(_steps_back())
    max_cells = len(cells)

    def run_of(leg: Array) -> Array:
        return np.uint32(LONGEST_SIDE) - ((leg >> RUN) & np.uint32(LONGEST_SIDE))

    def step(walk: _Walk) -> _Walk:
        comes = walk.leg >> COMES
        is_run = walk.left != 0
        side = (walk.leg >> SIDE) & np.uint32(3)
        by = jnp.where(is_run, comes, read(steps_back, comes * np.uint32(4) + side))
        row, col = walk.row + read(back_row, by), walk.col + read(back_col, by)
        here = walk.here - jnp.where(is_run, straight, diagonal)
        left = walk.left - is_run.astype(jnp.uint32)
        # a corner on the way, reached by a run that comes first
        cell = (row * width + col).astype(jnp.uint32)
        cost, other = corner_at(corners, cell)
        is_other = (cost == here) & ((left == 0) | (other >> COMES < comes))
        cells = lax.dynamic_update_slice(
            walk.cells, jnp.stack([row, col])[None], (max_cells - 1 - walk.num, np.int32(0))
        )
        return _Walk(
            row,
            col,
            here,
            jnp.where(is_other, other, walk.leg),
            jnp.where(is_other, run_of(other), left),
            walk.num + 1,
            cells,
        )

    last = (np.int32(max_cells - 1), np.int32(0))
    cells = lax.dynamic_update_slice(cells, goal[None], last)
    here = jnp.where(best.cost == NO_COST, jnp.uint32(0), best.cost)
    walk = _Walk(goal[0], goal[1], here, best.leg, run_of(best.leg), jnp.int32(1), cells)
    walk = lax.while_loop(lambda walk: walk.here != 0, step, walk)
    return walk.cells, walk.num
