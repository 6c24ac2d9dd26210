"""A shortest path, or its length, between two cells alone: without the field of costs where there
is a faster way.

On CPU by jump points (`jump_points`), or, where walls end at every other cell, by A* cell by cell
(`cell_search`); a cheap look at the map decides. Elsewhere, where a queue would be copied at every
step, the whole field is computed by sweeps, and the path read off it. The cells are the same, since
they are defined by the costs.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, compiled_whole, is_marking, runs_in_place
from sign_model.foundation.sizes import next_power_of_two
from srt_jax.engine import arguments, cores, eager, packing
from srt_jax.engine.batching import batch_kernel, each_keeping
from srt_jax.moves import is_on_map, max_path_cells
from srt_jax.obstacles import MANY
from srt_jax.paths import cell_search, jump_points
from srt_jax.paths.corners import NO_COST, Room, room_of
from srt_jax.paths.jump_walk import walk_back
from srt_jax.paths.path import at_front, first_path
from srt_jax.propagation import fixed_point
from srt_jax.propagation.lengths import UNREACHED, solve_map
from srt_jax.types import Array, Path

_CELLS_A_CORNER = 10
"""The free cells for each corner, a free cell beside the end of a wall, on the roughest map that is
searched by jump points. Streets, rooms and mazes of wide corridors have 18 and more; mazes whose
corridors are two cells wide 11, scattered obstacles on 3 % of the map 9: the former are searched in
two thirds of the time by jump points, the latter in a third by cells.
"""


def shortest_path(free: Array, start: Array, goal: Array, *, max_cells: int | None = None) -> Path:
    """Returns a shortest path from `start` to `goal`; num_cells 0 and cost inf where none leads
    there.

    By jump point search (PY16 §3.2) on CPU, several times as fast as a field of costs; among
    scattered obstacles by A* cell by cell. Of all shortest paths it is this one, on every machine:
    going back from the goal, the cell before is always the first neighbour from which a shortest
    path comes, the four straight neighbours before the four diagonal ones, in row order each.
    Lengths are those of `cost_to_come`, bit for bit.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start, goal: int32 [..., 2], (row, col); may lie outside the map.
      max_cells: how many cells `cells` holds, at least 1. If a path is longer, its `cells` are all
        -1 and `num_cells` is its true number of cells: retry with a larger `max_cells`. By default
        enough for the longest path of the batch; inside jit, for any path on a map of this shape
        (three quarters of its cells).

    Returns:
      Path: cells int32 [..., N, 2], start first, -1 after the goal; num_cells int32 [...]; cost
        float32 [...].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit, or max_cells < 1.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[1:, 3] = False  # a wall with a gap in the first row
      >>> path = srt_jax.shortest_path(free, (2, 2), (1, 4))
      >>> path.cells[: int(path.num_cells)].tolist()
      [[2, 2], [1, 2], [0, 2], [0, 3], [0, 4], [1, 4]]
      >>> path.cost.item()
      5.0
    """
    (free, start, goal), batch = arguments.mask_and_cells(free=free, start=start, goal=goal)
    if max_cells is not None and max_cells < 1:
        raise ValueError(f"max_cells must be at least 1, got {max_cells}: a path holds its start")

    def call(room: int) -> Path:
        return Path(**eager.call(_path_maps, batch, free, start, goal, max_cells=room))

    height, width = free.shape[-2:]
    most = max_path_cells(height, width)
    if max_cells is not None or arguments.is_traced(free, start, goal):
        return call(int(max_cells or max(1, most)))
    # as much room as most paths need, or those of this shape needed last; more, if one needs it
    usual = min(_usual_room(height, width), max(1, most))
    room = max(usual, _rooms.get((height, width), 0))
    path = call(room)
    longest = int(jnp.max(path.num_cells, initial=0))
    needed = usual if longest <= usual else next_power_of_two(longest)
    _rooms[height, width] = needed
    if longest > room:
        return call(needed)
    if needed == room:
        return path
    # cut off on the host, where no shape is compiled
    cells = np.asarray(path.cells) if cores.is_on_host(path.cells) else path.cells
    return path.replace(cells=jnp.asarray(cells[..., :needed, :]))


_rooms: dict[tuple[int, int], int] = {}
"""The cells that the paths of the last call on maps of a height and width had room for: where paths
are long, as in mazes, all would else be searched for twice at every call.
"""


def _usual_room(height: int, width: int) -> int:
    return next_power_of_two(2 * max(height, width))


def path_length(free: Array, start: Array, goal: Array) -> Array:
    """Returns the cost of `shortest_path`, float32 [...]."""
    (free, start, goal), batch = arguments.mask_and_cells(free=free, start=start, goal=goal)
    return eager.call(_length_maps, batch, free, start, goal)


@batch_kernel
def _length_maps(free: Array, start: Array, goal: Array) -> Array:
    def one_map(free: Array, start: Array, goal: Array, room: Room | None) -> tuple:
        return length_of_map(packing.pack(free[None])[0], start, goal, free.shape[1], room)

    return compiled_whole(_with_room(one_map))(free, start, goal)


def _path_maps(free: Array, start: Array, goal: Array, *, max_cells: int) -> dict[str, Array]:
    def one_map(free: Array, start: Array, goal: Array, room: Room | None) -> tuple:
        words = packing.pack(free[None])[0]
        path, room = path_of_map(words, start, goal, free.shape[1], max_cells, room=room)
        cells, num_cells, cost = path
        return {"cells": cells, "num_cells": num_cells, "cost": cost}, room

    return batch_kernel(compiled_whole(_with_room(one_map)))(free, start, goal)


def _with_room(one_map: Callable) -> Callable:
    """Returns one_map(free, start, goal, room) -> (result, room) of one map as a function of a
    batch: in a marked call the maps are searched in the same room one after the other.
    """

    def run(free: Array, start: Array, goal: Array) -> Any:
        if not runs_in_place():
            return jax.vmap(lambda *args: one_map(*args, None)[0])(free, start, goal)
        room = room_for(*free.shape[1:])
        return each_keeping(lambda room, *args: one_map(*args, room), room, free, start, goal)

    return run


def room_for(height: int, width: int) -> Room | None:
    """Returns room to search maps of a size in, one after the other; None where no marked call
    would use it.
    """
    is_used = is_marking() and max(height, width) <= jump_points.LONGEST_SIDE
    return room_of(height, width) if is_used else None


def path_of_map(
    free: Array,
    start: Array,
    goal: Array,
    width: int,
    max_cells: int,
    num_obstacles: int | None = None,
    room: Room | None = None,
) -> tuple[tuple[Array, Array, Array], Room | None]:
    """Returns the path of one map, as in `types.Path`: (cells, num_cells, cost), and the room; for
    use inside a marked call.

    Args:
      free: uint32 [H, words], packed.
      start, goal: int32 [2].
      width: W.
      num_obstacles: M, if known: among few obstacles jump points serve, and there is less to
        compile.
      room: from `room_for`; without it, the search makes its own, which takes longer.
    """
    path, scale, room = exact_path_of_map(free, start, goal, width, max_cells, num_obstacles, room)
    cells, num_cells, units = path
    is_there = units != UNREACHED
    return (cells, num_cells, fixed_point.length_where(is_there, units, scale)), room


def exact_path_of_map(
    free: Array,
    start: Array,
    goal: Array,
    width: int,
    max_cells: int,
    num_obstacles: int | None = None,
    room: Room | None = None,
) -> tuple[tuple[Array, Array, Array], Array, Room | None]:
    """Returns the path of one map with its length in units, int32 [], UNREACHED where there is
    none; the scale of these, int32 []; and the room; args as of `path_of_map`.
    """
    if not _is_searched(free.shape[0], width):
        cost, scale = solve_map(packing.unpack(free[None], width)[0], start)
        return (*first_path(cost, scale, goal, max_cells), _cost_at(cost, goal)), scale, room
    straight, diagonal, scale = _fixed_point(free, width)
    may_be_rough = num_obstacles is None or num_obstacles >= MANY
    found = _found(free, start, goal, straight, diagonal, width, max_cells, may_be_rough, room)
    is_there = found.units != UNREACHED
    cells = at_front(found.cells, found.num, is_there)
    path = cells, jnp.where(is_there, found.num, 0), found.units
    return path, scale, found.room


def length_of_map(
    free: Array, start: Array, goal: Array, width: int, room: Room | None = None
) -> tuple[Array, Room | None]:
    """Returns the cost alone of `path_of_map`, float32 [], and the room."""
    if not _is_searched(free.shape[0], width):
        return _length_at(*solve_map(packing.unpack(free[None], width)[0], start), goal), room
    straight, diagonal, scale = _fixed_point(free, width)
    found = _found(free, start, goal, straight, diagonal, width, 0, room=room)
    length = fixed_point.length_where(found.units != UNREACHED, found.units, scale)
    return length, found.room


def _is_searched(height: int, width: int) -> bool:
    """Whether a queue runs in place here, and a leg of jump points can be as long as the map."""
    return runs_in_place() and max(height, width) <= jump_points.LONGEST_SIDE


class _Found(NamedTuple):
    """is_sought: bool [], whether the path is yet to be found; units: int32 [], its length,
    UNREACHED where there is none; num: int32 [], of the cells at the end of `cells`, int32
    [max_cells, 2]; room: what was worked in.
    """

    is_sought: Array
    units: Array
    num: Array
    cells: Array
    room: Room | None


def _found(
    free: Array,
    start: Array,
    goal: Array,
    straight: Array,
    diagonal: Array,
    width: int,
    max_cells: int,
    may_be_rough: bool = True,
    room: Room | None = None,
) -> _Found:
    """The path by the way that is faster on the map; without cells where `max_cells` is 0. By jump
    points also where the other way has no room.
    """
    pair = straight, diagonal

    def by_cells(found: _Found) -> _Found:
        costs = cell_search.search(free, start, goal, *pair, width)
        units = jnp.where(costs.goal == 0, UNREACHED, costs.at_goal.astype(jnp.int32))
        found = found._replace(is_sought=costs.is_short, units=units)
        if not max_cells:
            return found
        cells, num = cell_search.walk_back(costs, goal, *pair, width, found.cells)
        return found._replace(cells=cells, num=num)

    def by_jump_points(found: _Found) -> _Found:
        best, corners = jump_points.search(free, start, goal, *pair, width, room=found.room)
        is_there = best.cost != NO_COST
        units = jnp.where(is_there, best.cost.astype(jnp.int32), UNREACHED)
        found = found._replace(is_sought=jnp.bool_(False), units=units)
        if room is not None:
            found = found._replace(room=corners.room)
        if not max_cells:
            return found
        cells, num = walk_back(best, corners, goal, *pair, width, found.cells)
        return found._replace(cells=cells, num=num)

    none = jnp.full((max_cells, 2), -1, jnp.int32)
    found = _Found(jnp.bool_(True), jnp.int32(UNREACHED), jnp.int32(0), none, room)
    if not may_be_rough:
        return by_jump_points(found)
    # compiled apart: within the loops of `solve` they would take the compiler half as long again
    found = found._replace(room=None)
    found = lax.cond(_is_rough(free), apart(by_cells), lambda found: found, found)
    # a loop that runs at most once: the room stays in place
    found = found._replace(room=room)
    return lax.while_loop(lambda found: found.is_sought, apart(by_jump_points), found)


def _is_rough(free: Array) -> Array:
    """Whether walls end so often that a search cell by cell is faster than jump points: where many
    of the squares of 2 x 2 cells have three free ones.
    """
    height, words = free.shape
    one = jnp.uint32(1)

    def row(i: Array, state: tuple[Array, Array]) -> tuple[Array, Array]:
        above, excess = state
        below = lax.dynamic_slice(free, (i, np.int32(0)), (1, words))[0]
        # squares between words have a blocked cell too many, and count only now and then
        right, aside = above >> one, below >> one
        corners = ((above & below) & (right ^ aside)) | ((above ^ below) & (right & aside))
        num_corners, num_free = lax.population_count(corners), lax.population_count(below)
        return below, excess + (num_corners * _CELLS_A_CORNER - num_free).astype(jnp.int32)

    # row by row: as one sum it would take the compiler a quarter of a second
    excess = repeat(height, row, (free[0], jnp.zeros(words, jnp.int32)))[1]
    return jnp.sum(excess, dtype=jnp.int32) > 0


def _fixed_point(free: Array, width: int) -> tuple[Array, Array, Array]:
    """(straight, diagonal), uint32 [] each, and the scale."""
    scale = jnp.asarray(fixed_point.finest_scale_of_words(free, width), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    return straight, diagonal, scale


def _length_at(cost: Array, scale: Array, goal: Array) -> Array:
    """The length at `goal` of one map's exact costs; inf where it is not reached or outside."""
    at_goal = _cost_at(cost, goal)
    return fixed_point.length_where(at_goal != UNREACHED, at_goal, scale)


def _cost_at(cost: Array, goal: Array) -> Array:
    """The cost at `goal`; UNREACHED outside the map."""
    is_inside = is_on_map(goal[0], goal[1], *cost.shape)
    at_goal = lax.dynamic_slice(cost, (goal[0], goal[1]), (1, 1))[0, 0]
    return jnp.where(is_inside, at_goal, jnp.int32(UNREACHED))
