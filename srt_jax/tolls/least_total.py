"""The answer of mode "shortest" to every task of a batch: the set of obstacles, the route through
it, the total and its bound.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax import obstacles
from srt_jax.fields import fixed_point
from srt_jax.obstacles import Labels
from srt_jax.removal.route import NEVER, Route, route_through
from srt_jax.tolls import entry
from srt_jax.tolls.search import search
from srt_jax.tolls.spread import UNREACHED, Size, ground_of
from srt_jax.types import Array, Task


class LeastTotal(NamedTuple):
    """The answer to each task of a batch.

    route: shortest with the obstacles gone that it needs; `num_cells` 0 where none was found.
    needed: int32 [B, M], the index into the route from which each obstacle must be destroyed, NEVER
      if it need not.
    total: float32 [B], length and tolls of the route; inf without one, or where it does not fit.
    bound: float32 [B], proven: no route has a lesser total. inf where none exists.
    """

    route: Route
    needed: Array
    total: Array
    bound: Array


def least_total(
    task: Task, toll: Array, room: Array, among: Array, *, capacity: int, max_nodes: int
) -> LeastTotal:
    """Returns the least total of every task in `among` (bool [B]), whose start is free and whose
    goal is on the map.

    Args:
      toll: float32 [B], what one unit of removal cost is worth in cell sides.
      room: int32 [B], how many of the `capacity` cells a route may use.
      max_nodes: searches, at most.
    """
    price = jnp.where(task.destroyable, task.removal_cost * toll[:, None], jnp.inf)
    one_map = functools.partial(_of_map, capacity=capacity, max_nodes=max_nodes)
    args = (price, task.start, task.goal, room, among)
    return LeastTotal(*obstacles.of_all(one_map, task.labels, *args))


def _of_map(
    labels: Labels,
    price: Array,
    start: Array,
    goal: Array,
    room: Array,
    is_requested: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple:
    """The answer on one map; price float32 [M]."""
    num_obstacles = len(price)
    size = Size(*labels.all.shape[2:])
    # The units, in which the longest route over whatever can be opened is held.
    openable = obstacles.open_cells(labels, price < jnp.inf)
    scale = jnp.asarray(fixed_point.finest_scale_within(openable, size.width), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    tolls = entry.in_units(price, straight)

    # The set.
    own = lax.dynamic_index_in_dim(labels.all, labels.which, keepdims=False)
    ground = ground_of(own, straight, diagonal, start, goal, size)
    ground = ground._replace(start=jnp.where(is_requested, ground.start, jnp.uint32(0)))
    found = search(ground, tolls, size, max_nodes)
    is_there = found.total < UNREACHED

    # The route through it, of which the total is counted again: it may need less than the set.
    free = obstacles.open_cells(labels, found.gone & is_there)
    free = jnp.where(is_there, free, jnp.uint32(0))
    route, needed = route_through(labels, free, start, goal, num_obstacles, capacity)
    fits = is_there & (route.num_cells > 0) & (route.num_cells <= room)
    num_diagonal = _num_diagonal(route)
    num_straight = jnp.maximum(route.num_cells - 1, 0) - num_diagonal
    length = num_straight.astype(jnp.uint32) * straight + num_diagonal.astype(jnp.uint32) * diagonal
    total = length + entry.total(tolls, needed < NEVER)

    # Both as lengths; where only rounding makes them equal, the bound is a step lower.
    bound = fixed_point.length_where(found.bound < UNREACHED, found.bound.astype(jnp.int32), scale)
    bound = jnp.where(is_requested, bound, jnp.inf)
    total_length = fixed_point.length_where(fits, total.astype(jnp.int32), scale)
    is_open = fits & (found.bound < total) & (bound >= total_length)
    bound = jnp.where(is_open, jnp.nextafter(total_length, jnp.float32(0)), bound)
    return route, needed, total_length, bound


def _num_diagonal(route: Route) -> Array:
    """The diagonal moves of a route, int32 []; of one that does not fit, none."""
    before, after = route.cells[:-1], route.cells[1:]
    is_move = after[:, 0] >= 0
    return jnp.sum(is_move & (before != after).all(axis=1), dtype=jnp.int32)
