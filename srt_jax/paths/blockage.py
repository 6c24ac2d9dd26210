"""What the path planner reports: the reached cells and, where the goal is not among them, what
blocks (PY16 §3.2).

The seed is the reached cell nearest the goal; the blocked cell on its greedy step towards the goal
belongs to the obstacle that separates, an 8-connected piece of blocked cells. On real maps such a
piece often consists of several touching objects, so the report names every object that meets its
contour.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.obstacles import Labels
from srt_jax.paths.contour import ahead_in_words
from srt_jax.paths.reach import flood_group
from srt_jax.paths.seed import nearest_in_words
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

    def one_map(
        labels: Labels, free: Array, reached: Array, goal: Array, size: Array, is_one: Array
    ) -> Blockage:
        ends = Ends(jnp.full(2, -1, jnp.int32), goal, size)
        known = jnp.bool_(True)
        return blockage_of(labels, free, ends, reached, num_obstacles, known, is_one)

    return obstacles.of_all(one_map, labels, free, reached, goal, size, among)


class Ends(NamedTuple):
    """The start and the goal of one map, and its height and width before padding: int32 [2]
    each.
    """

    start: Array
    goal: Array
    size: Array


class _Regions(NamedTuple):
    """The carry of both floods. reached, piece: masks; what the agent reaches, and the separating
    piece. seed: int32 [2].
    """

    reached: Array
    piece: Array
    seed: Array


def blockage_of(
    labels: Labels,
    free: Array,
    ends: Ends,
    reached: Array,
    num_obstacles: int,
    is_known: Array,
    is_requested: Array,
) -> Blockage:
    """Returns `find_blockage` of one map; for use inside a marked call.

    Args:
      free: a mask. reached: a mask, what is reached from the start, where that `is_known` (bool
        []); else it is flooded.
      is_requested: bool [], whether there is anything to report.
    """
    height, width = labels.all.shape[2:]
    inside = packing.words_inside(ends.size[None], height, width)[0]

    def flood(phase: Array, state: _Regions) -> _Regions:
        # One body for both floods: it takes long to compile.
        is_piece = phase == 1
        # the cell where the search stopped, and the blocked cell ahead of it; the seed, if there is
        # one, lies on the map, and so does the goal
        seed = nearest_in_words(state.reached, ends.goal, width)
        ahead = ahead_in_words(free, seed, ends.goal, ends.size, width)
        # first the cells reached, through sides; then the whole piece that the cell ahead belongs
        # to, through corners
        source = packing.words_of_cell(jnp.where(is_piece, ahead, ends.start)[None], height, width)
        passable = jnp.where(is_piece, inside & ~free, free)
        cells = flood_group(
            passable,
            source[0] & passable,
            group=1,
            through_corners=is_piece,
            may_be_small=True,
        )
        return _Regions(
            jnp.where(is_piece, state.reached, cells),
            jnp.where(is_piece, cells, state.piece),
            jnp.where(is_piece, seed, state.seed),
        )

    def report() -> Blockage:
        begin = _Regions(reached, nothing, nowhere)
        first = jnp.where(is_known, jnp.int32(1), jnp.int32(0))
        found = lax.fori_loop(first, jnp.int32(2), flood, begin)
        # the reached cells around the piece, and the objects of the piece that touch these
        contour = packing.dilate(found.piece) & found.reached
        beside = packing.dilate(contour) & found.piece
        return Blockage(found.seed, contour, obstacles.met_by(labels, beside, num_obstacles))

    nothing, nowhere = jnp.zeros_like(free), jnp.full(2, -1, jnp.int32)
    empty = Blockage(nowhere, nothing, jnp.zeros(num_obstacles, bool))
    return lax.cond(is_requested, report, lambda: empty)
