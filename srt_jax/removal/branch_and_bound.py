"""The least removal: which obstacles to destroy so that start and goal are joined at the least
total cost, and the route.

Where every obstacle is connected by sides and no two overlap, the price of the goal (`prices`) is
the optimum. In general the problem is NP-hard (Hauser 2014; Erickson & LaValle 2013) and the price
a lower bound only: an obstacle in several pieces, or two on one cell, may be paid once where they
are needed twice, or apart where they are needed together. So branch and bound:

- a node says which obstacles must go and which must stay; its bound is the cost of the first plus
  the price with these gone;
- the shortest route over all that is tight there (a member of some cheapest chain) needs some
  obstacles: an answer, and if it costs no more than the bound, the least, and of the least sets the
  one with the shortest route, for all of these are tight;
- else the first obstacle needed that is not settled yet is: one child has it gone, one has it stay.
  Of least sets found only then, the first is taken: a shorter route through another is passed over
  in 2 or 3 of 100 random tasks that need opening (`python -m experiments.campaigns.removal`).

The node of the least bound is next, the latest of several: children in which one more obstacle is
gone come first. Where the price is the optimum, such a dive keeps the bound and ends with it. If
the nodes allowed do not suffice, the least bound of those left is proven all the same, and the best
answer found stands beside it.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.obstacles import Labels
from srt_jax.removal.prices import Prices, Terms, prices_of
from srt_jax.removal.route import NEVER, Route, route_through
from srt_jax.types import Task

_EQUAL = 1e-6
"""Sums of the same costs in another order may differ by this part."""


class Removal(NamedTuple):
    """The answer to each task of a batch.

    reached: uint32 [B, H, words], packed, the cells reached with nothing destroyed.
    bound: float32 [B], proven: no set of less total cost opens a way. 0 where a path exists, inf
      where nothing helps.
    route: of the best set found; `num_cells` 0 where none was.
    needed: int32 [B, M], the index into the route from which each obstacle must be destroyed, NEVER
      if it need not.
    """

    reached: Array
    bound: Array
    route: Route
    needed: Array


def least_removal(
    task: Task, room: Array, among: Array, *, capacity: int, max_nodes: int
) -> Removal:
    """Returns the least removal of every task in `among` (bool [B]), whose start is free and whose
    goal is on the map.

    `room` (int32 [B]) is how many of the `capacity` cells a route may use; one that needs more ends
    the search, with its number of cells. `max_nodes`: branches looked at, at most.
    """

    search = functools.partial(_search, capacity=capacity, max_nodes=max_nodes)
    cost = jnp.where(task.destroyable, task.removal_cost, jnp.inf)
    return Removal(*obstacles.of_all(search, task.labels, cost, task.start, task.goal, room, among))


class _Best(NamedTuple):
    """The best answer so far. cost: float32 [], of the obstacles; inf while there is none."""

    cost: Array
    route: Route
    needed: Array


class _Nodes(NamedTuple):
    """Open nodes in the order they were made.

    gone, stays: uint32 [n, words], sets of obstacles. bound: float32 [n], inf where closed.
    """

    gone: Array
    stays: Array
    bound: Array


def _search(
    labels: Labels,
    cost: Array,
    start: Array,
    goal: Array,
    room: Array,
    is_asked: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple:
    """The search on one map; cost float32 [M], inf for what must stay."""
    num_obstacles = len(cost)
    height, width = labels.all.shape[2:]

    def sum_of(which: Array) -> Array:
        return jnp.sum(jnp.where(which, cost, jnp.float32(0)))

    def expanded(state: tuple) -> tuple:
        num, nodes, best, reached, _ = state
        at = _next(nodes.bound)
        gone, stays = (
            _as_set(_entry(sets, at), num_obstacles) for sets in (nodes.gone, nodes.stays)
        )
        paid = sum_of(gone)
        terms = Terms(start, goal, jnp.where(stays, jnp.inf, cost))
        prices = prices_of(labels, terms, gone, best.cost - paid)
        bound = jnp.maximum(_entry(nodes.bound, at), paid + prices.goal)
        is_open = bound * (1 + _EQUAL) < best.cost
        new = lax.cond(
            is_open, tried, lambda *_: (best, jnp.int32(-1), jnp.bool_(False)), best, gone, prices
        )
        best, branch, is_too_long = new
        nodes = nodes._replace(bound=_put(nodes.bound, jnp.where(is_too_long, bound, jnp.inf), at))
        nodes = _branched(nodes, num, gone, stays, branch, jnp.where(branch >= 0, bound, jnp.inf))
        return num + 1, nodes, best, jnp.where(num == 0, prices.reached, reached), is_too_long

    def tried(best: _Best, gone: Array, prices: Prices) -> tuple:
        """The best answer with this node's, the obstacle to branch on (-1 none), whether its
        route is too long to be told.
        """

        def walk(state: tuple) -> tuple:
            num_tried, _, _ = state
            opened = gone | jnp.where(num_tried == 0, prices.tight, prices.affordable)
            return num_tried + 1, *route_through(
                labels, obstacles.open_cells(labels, opened), start, goal, num_obstacles, capacity
            )

        none = (jnp.int32(0), _nowhere(capacity), jnp.full(num_obstacles, NEVER, jnp.int32))
        _, route, needed = lax.while_loop(lambda s: (s[0] < 2) & (s[1].num_cells == 0), walk, none)
        own = sum_of(needed < NEVER)
        is_too_long = route.num_cells > room
        is_better = (own < best.cost) & ~is_too_long
        is_told = is_better | (is_too_long & ~jnp.isfinite(best.cost))
        route, best_needed = jax.tree.map(
            lambda a, b: jnp.where(is_told, a, b), (route, needed), (best.route, best.needed)
        )
        order = jnp.where(gone, NEVER, needed)
        first = jnp.argmin(order).astype(jnp.int32)
        is_settled = jnp.min(order) == NEVER
        branch = jnp.where(is_settled | is_too_long, -1, first)
        return _Best(jnp.where(is_better, own, best.cost), route, best_needed), branch, is_too_long

    size = 2 * max_nodes + 1
    num_words = -(-num_obstacles // packing.WORD)
    sets = jnp.zeros((size, num_words), jnp.uint32)
    bounds = jnp.full(size, jnp.inf, jnp.float32)
    nodes = _Nodes(
        sets, sets, _put(bounds, jnp.where(is_asked, jnp.float32(0), jnp.inf), jnp.int32(0))
    )
    best = _Best(
        jnp.float32(jnp.inf), _nowhere(capacity), jnp.full(num_obstacles, NEVER, jnp.int32)
    )
    reached = jnp.zeros((height, packing.num_words(width)), jnp.uint32)

    def goes_on(state: tuple) -> Array:
        num, nodes, best, _, is_too_long = state
        return (num < max_nodes) & (jnp.min(nodes.bound) * (1 + _EQUAL) < best.cost) & ~is_too_long

    state = (jnp.int32(0), nodes, best, reached, jnp.bool_(False))
    _, nodes, best, reached, _ = lax.while_loop(goes_on, expanded, state)
    return reached, jnp.minimum(jnp.min(nodes.bound), best.cost), best.route, best.needed


def _branched(
    nodes: _Nodes, num: Array, gone: Array, stays: Array, branch: Array, bound: Array
) -> _Nodes:
    """Adds both children of the `num`-th node expanded, closed ones where `bound` is inf; the
    one with more gone is later.
    """
    one = jnp.arange(len(gone), dtype=jnp.int32) == branch
    for child, (more, less) in enumerate(((gone, stays | one), (gone | one, stays))):
        at = 2 * num + 1 + child
        more, less = obstacles.as_words(more), obstacles.as_words(less)
        nodes = _Nodes(
            _put(nodes.gone, more, at), _put(nodes.stays, less, at), _put(nodes.bound, bound, at)
        )
    return nodes


def _next(bound: Array) -> Array:
    """The latest of the nodes of least bound."""
    ids = jnp.arange(len(bound), dtype=jnp.int32)
    return jnp.max(jnp.where(bound == jnp.min(bound), ids, -1))


def _as_set(words: Array, num_obstacles: int) -> Array:
    return packing.unpack(words[None, None], num_obstacles)[0, 0]


def _entry(array: Array, at: Array) -> Array:
    return lax.dynamic_index_in_dim(array, at, keepdims=False)


def _put(array: Array, value: Array, at: Array) -> Array:
    return lax.dynamic_update_index_in_dim(array, value, at, 0)


def _nowhere(capacity: int) -> Route:
    return Route(jnp.full((capacity, 2), -1, jnp.int32), jnp.int32(0), jnp.float32(jnp.inf))
