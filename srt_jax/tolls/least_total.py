"""The answer of mode "shortest" to every task of a batch: the set of obstacles, the route through
it, the total and its bound.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole
from srt_jax import obstacles
from srt_jax.engine.batching import each_keeping
from srt_jax.obstacles import Labels
from srt_jax.paths.shortest import exact_path_of_map
from srt_jax.propagation import fixed_point
from srt_jax.propagation.lengths import UNREACHED as NO_PATH
from srt_jax.removal.prices import goal_price
from srt_jax.removal.route import NEVER, Route, needed_on
from srt_jax.tolls import entry
from srt_jax.tolls.break_or_round import Found, search
from srt_jax.tolls.paid_labels import Room, most_labels, room_for_labels
from srt_jax.tolls.paid_search import UNREACHED
from srt_jax.tolls.paid_sets import Metric
from srt_jax.types import Array, Task


class LeastTotal(NamedTuple):
    """The answer to each task of a batch.

    route: shortest with the obstacles gone that it needs; `num_cells` 0 where none was found.
    needed: int32 [B, M], the index into the route from which each obstacle must be destroyed, NEVER
      if it need not.
    total: float32 [B], length and tolls of the route; inf without one, or where it does not fit.
    bound: float32 [B], proven: no route has a lesser total. inf where none exists.
    free, reached, price: what is known at first, from `prices.goal_prices`.
    """

    route: Route
    needed: Array
    total: Array
    bound: Array
    free: Array
    reached: Array
    price: Array


class _Ways(NamedTuple):
    """The best set so far, and the route through it, as in `LeastTotal`."""

    found: Found
    route: Route
    needed: Array


def least_total(
    task: Task,
    toll: Array,
    room: Array,
    among: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> LeastTotal:
    """Returns the least total of every task in `among` (bool [B]), whose start is free and whose
    goal is on the map. All of a map in one go: its labels are read while they are at hand.

    Args:
      toll: float32 [B], what one unit of removal cost is worth in cell sides.
      room: int32 [B], how many of the `capacity` cells a route may use.
      max_nodes: searches, at most.
    """
    price = jnp.where(task.destroyable, task.removal_cost * toll[:, None], jnp.inf)
    one_map = functools.partial(_of_map, capacity=capacity, max_nodes=max_nodes)
    # As many as fit a map of the task's own size: padding changes nothing.
    num_labels = most_labels(task.size[:, 0], task.size[:, 1]).astype(jnp.uint32)
    ends = (task.destroyable, task.removal_cost, task.start, task.goal, among)
    args = (price, room, num_labels, *ends)
    height, width = task.labels.shape[2:]

    def all_maps(labels: Array, *args: Array) -> tuple:
        return each_keeping(
            lambda store, which, *args: one_map(store, Labels(labels, which), *args),
            room_for_labels(height, width),
            jnp.arange(len(labels), dtype=jnp.int32),
            *args,
        )

    return LeastTotal(*compiled_whole(all_maps)(task.labels, *args))


def _of_map(
    store: Room,
    labels: Labels,
    price: Array,
    room: Array,
    num_labels: Array,
    may_go: Array,
    cost: Array,
    start: Array,
    goal: Array,
    is_asked: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple[tuple, Room]:
    """The answer on one map; price float32 [M]. store: as of `search`, which it is returned to."""
    num_obstacles = len(price)
    width = labels.all.shape[3]
    known = obstacles.survey(labels, num_obstacles)
    reached, least = goal_price(labels, known, may_go, cost, start, goal, is_asked)
    is_requested = is_asked & jnp.isfinite(least)
    # The units, in which the longest route over whatever can be opened is held.
    openable = obstacles.open_cells(labels, price < jnp.inf)
    scale = jnp.asarray(fixed_point.finest_scale_within(openable, width), jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    tolls = entry.in_units(price, straight)

    # The way round, then the best set and the route through it, by one body: that of a path
    # search takes long to compile.
    apart = jnp.abs(start - goal).astype(jnp.uint32)
    far = apart.max() * straight + apart.min() * (diagonal - straight)
    least_gain = far + jnp.min(tolls)

    def step(phase: Array, both: tuple[_Ways, Room]) -> tuple[_Ways, Room]:
        state, store = both
        is_first = phase == 0

        def look(state: tuple[Array, Found, Room]) -> tuple[Array, Found, Room]:
            metric = Metric(straight, diagonal, start, goal)
            args = (labels, known.free, tolls, metric, max_nodes, way_round, num_labels, state[2])
            return jnp.bool_(False), *search(*args)

        # Whoever breaks goes as far as the octile distance and pays the least toll.
        way_round = state.found.total
        may_gain = is_requested & (way_round > least_gain)
        settled = state.found._replace(bound=way_round)
        # A loop of one step or none: a branch would copy the room for labels.
        _, found, store = lax.while_loop(
            lambda state: state[0], look, (~is_first & may_gain, settled, store)
        )
        # Where going round is the best, that route is known.
        is_new = is_requested & (is_first | (found.total < state.found.total))

        def walk() -> tuple[Route, Array, Array]:
            passable = obstacles.opened(labels, known, found.gone, known.free, found.gone)
            path, own_scale, _ = exact_path_of_map(
                passable, start, goal, width, capacity, num_obstacles
            )
            cells, num_cells, units = path
            is_there = units != NO_PATH
            cost = fixed_point.length_where(is_there, units, own_scale)
            # In other units than tolls are it is no bound.
            is_bound = is_there & (own_scale == scale) & (units < UNREACHED)
            total = jnp.where(is_bound, units.astype(jnp.uint32), jnp.uint32(UNREACHED))
            route = Route(cells, num_cells, cost)
            return route, needed_on(labels, route, num_obstacles), total

        same = state.route, state.needed, found.total
        route, needed, units = lax.cond(is_new, walk, lambda: same)
        found = found._replace(total=jnp.where(is_first, units, found.total))
        return _Ways(found, route, needed), store

    begin = _Ways(
        Found(jnp.uint32(UNREACHED), jnp.uint32(UNREACHED), jnp.zeros(num_obstacles, bool)),
        Route(jnp.full((capacity, 2), -1, jnp.int32), jnp.int32(0), jnp.float32(np.inf)),
        jnp.full(num_obstacles, NEVER, jnp.int32),
    )
    (found, route, needed), store = lax.fori_loop(jnp.int32(0), jnp.int32(2), step, (begin, store))

    # The total counted again along the route: it may need less than the set.
    is_there = found.total < UNREACHED
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
    return (route, needed, total_length, bound, known.free, reached, least), store


def _num_diagonal(route: Route) -> Array:
    """The diagonal moves of a route, int32 []; of one that does not fit, none."""
    before, after = route.cells[:-1], route.cells[1:]
    is_move = after[:, 0] >= 0
    return jnp.sum(is_move & (before != after).all(axis=1), dtype=jnp.int32)
