"""Which obstacles a route needs gone, and when: the agent destroys each from the last cell before
it is first in the way.

Stepping from one cell to the next needs every owner of the next cell gone, and on a diagonal the
owners of both cells beside it. All of these are neighbours of the cell stepped from, so they can be
destroyed from there: any shortest path on the map without the chosen obstacles is a route, and no
route that destroys only these is shorter.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole, runs_in_place
from srt_jax.engine.batching import each
from srt_jax.obstacles import Labels
from srt_jax.paths.corners import Room
from srt_jax.paths.shortest import path_of_map
from srt_jax.types import Array

NEVER = np.int32(2**31 - 1)
"""The index at which an obstacle is needed that is not needed at all."""

_FEW = 64
"""Up to so many obstacles, taking the least of those left is faster than sorting them all."""


class Route(NamedTuple):
    """A shortest path of one map, as in `types.Path`: cells int32 [N, 2], num_cells int32 [], cost
    float32 [].
    """

    cells: Array
    num_cells: Array
    cost: Array


def route_through(
    labels: Labels,
    free: Array,
    start: Array,
    goal: Array,
    num_obstacles: int,
    capacity: int,
    place: Room | None = None,
) -> tuple[tuple[Route, Array], Room | None]:
    """Returns the shortest route of one map over the cells `free` (a mask), when it needs each
    obstacle gone, and the `place` it was sought in, as of `path_of_map`.

    For use inside a marked call.

    Returns:
      the route, with room for `capacity` cells; int32 [M], the index into its cells from which the
      obstacle must be destroyed, NEVER where it is not in the way. A route that does not fit meets
      none.
    """
    width = labels.all.shape[3]
    path, place = path_of_map(free, start, goal, width, capacity, num_obstacles, place)
    route = Route(*path)
    return (route, needed_on(labels, route, num_obstacles)), place


def needed_on(labels: Labels, route: Route, num_obstacles: int) -> Array:
    """Returns when a route needs each obstacle gone, as `route_through` does."""
    num = jnp.where(route.num_cells <= len(route.cells), route.num_cells, 0)
    return _first_needed(labels, route.cells, num, num_obstacles)


def _first_needed(labels: Labels, cells: Array, num_cells: Array, num_obstacles: int) -> Array:
    def note(needed: Array, owner: Array, index: Array) -> Array:
        # the last place takes what belongs to no obstacle
        place = jnp.where(owner < 0, num_obstacles, owner)
        known = lax.dynamic_slice(needed, (place,), (1,))
        return lax.dynamic_update_slice(needed, jnp.minimum(known, index), (place,))

    def step(index: Array, needed: Array) -> Array:
        (row, col), (to_row, to_col) = lax.dynamic_slice(cells, (index, jnp.int32(0)), (2, 2))
        for layer in range(labels.all.shape[1]):
            for r, c in ((to_row, to_col), (to_row, col), (row, to_col)):
                needed = note(needed, labels.at(layer, r, c), index)
        return needed

    nothing = jnp.full(num_obstacles + 1, NEVER, jnp.int32)
    if cells.shape[0] < 2:  # no room for a move
        return nothing[:num_obstacles]
    return lax.fori_loop(0, num_cells - 1, step, nothing)[:num_obstacles]


def in_order(needed: Array, *, max_destroyed: int) -> tuple[Array, Array, Array]:
    """Returns the obstacles needed, in the order of need (ties: lowest id), with their indices, and
    how many there are.

    Args:
      needed: int32 [B, M], from `first_needed`.

    Returns:
      ids int32 [B, K], -1 after the last; indices int32 [B, K], -1 likewise; the true number int32
      [B], perhaps more than K.
    """
    num_obstacles = needed.shape[1]
    count = (needed < NEVER).sum(axis=1, dtype=jnp.int32)
    select = _least_first if max_destroyed <= _FEW else _sorted
    at, ids = select(needed, count, min(max_destroyed, num_obstacles))
    missing = max(0, max_destroyed - num_obstacles)
    at, ids = (jnp.pad(x, ((0, 0), (0, missing)), constant_values=NEVER) for x in (at, ids))
    is_one = at < NEVER
    return jnp.where(is_one, ids, -1), jnp.where(is_one, at, -1), count


def _sorted(needed: Array, count: Array, most: int) -> tuple[Array, Array]:
    """The least `most` indices of each route, ties by id, and whose they are; int32 [B, most]."""
    ids_of = jnp.broadcast_to(jnp.arange(needed.shape[1], dtype=jnp.int32), needed.shape)
    at, ids = lax.sort((needed, ids_of), dimension=1, num_keys=2)
    return at[:, :most], ids[:, :most]


def _least_first(needed: Array, count: Array, most: int) -> tuple[Array, Array]:
    """`_sorted`, one after the other: of thousands of obstacles a route needs a few gone. Where a
    route needs fewer than `most`, NEVER follows.
    """

    def one_route(needed: Array, count: Array) -> tuple[Array, Array]:
        def take(i: Array, state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
            left, at, ids = state
            which = lax.argmin(left, 0, jnp.int32)
            first = lax.dynamic_slice(left, (which,), (1,))
            at = lax.dynamic_update_slice(at, first, (i,))
            ids = lax.dynamic_update_slice(ids, which[None], (i,))
            return lax.dynamic_update_slice(left, first | NEVER, (which,)), at, ids

        none = jnp.full(most, NEVER, jnp.int32)
        return lax.fori_loop(jnp.int32(0), jnp.minimum(count, most), take, (needed, none, none))[1:]

    def all_routes(needed: Array, count: Array) -> tuple[Array, Array]:
        if runs_in_place():
            return each(one_route, needed, count)
        return _sorted(needed, count, most)

    return compiled_whole(all_routes)(needed, count)
