"""What the path planner reports: the reached cells and, where the goal is not among them, what
blocks (PY16 §3.2).

The seed is the reached cell nearest the goal; the blocked cell on its greedy step towards the goal
belongs to the obstacle that separates, an 8-connected piece of blocked cells. On real maps such a
piece often consists of several touching objects, so the report names every object that meets its
contour.
"""

from typing import NamedTuple

import jax.numpy as jnp

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.paths.contour import obstacle_ahead
from srt_jax.paths.reach import flood_words
from srt_jax.paths.seed import seed_cells
from srt_jax.types import Array


class Blockage(NamedTuple):
    """What keeps the agent from the goal; all empty where nothing does.

    seed: int32 [B, 2], the reached cell nearest the goal, (-1, -1) where nothing blocks.
    contour: uint32 [B, H, words], packed, reached cells that touch the separating piece by a side
      or a corner.
    on_contour: bool [B, M], the objects of that piece that touch the contour.
    """

    seed: Array
    contour: Array
    on_contour: Array


def find_blockage(
    labels: Array,
    free: Array,
    reached: Array,
    goal: Array,
    size: Array,
    *,
    num_obstacles: int,
    among: Array,
) -> Blockage:
    """Returns what blocks the way from the `reached` cells to `goal`; an empty report where `among`
    is False.

    Args:
      labels: int32 [B, L, H, W].
      free: uint32 [B, H, words], packed, the cells open now (some obstacles may be gone).
      reached: uint32 [B, H, words], from `reach` on `free`.
      goal, size: int32 [B, 2].
      among: bool [B], the tasks to report on: those whose goal is not reached.
    """
    _, _, H, W = labels.shape
    seed = jnp.where(among[:, None], seed_cells(packing.unpack(reached, W), goal), -1)
    # the cell where the search stopped, and the blocked cell ahead of it; the seed, if there is
    # one, lies on the map, and so does the goal
    ahead = obstacle_ahead(packing.unpack(free, W), seed, goal)
    # the whole piece that this cell belongs to
    blocked = jnp.where(
        among[:, None, None], packing.words_inside(size, H, W) & ~free, jnp.uint32(0)
    )
    piece = flood_words(blocked, packing.words_of_cell(ahead, H, W), through_corners=True)
    # the reached cells around it, and the objects of the piece that touch these
    contour = packing.dilate(piece) & reached
    on_contour = obstacles.all_met_by(labels, packing.dilate(contour) & piece, num_obstacles)
    return Blockage(seed, contour, on_contour)
