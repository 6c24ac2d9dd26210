"""The least removal: which obstacles to destroy so that start and goal are joined at the least total cost, and the route.

Where every obstacle is connected by sides and no two overlap, the price of the goal (`prices`) is the optimum. In general the
problem is NP-hard (Hauser 2014; Erickson & LaValle 2013) and the price a lower bound only: an obstacle in several pieces, or
two on one cell, may be paid once where they are needed twice, or apart where they are needed together. So branch and bound:

- a node says which obstacles must go and which must stay; its bound is the cost of the first plus the price with these gone;
- the shortest route over all that is tight there (a member of some cheapest chain) needs some obstacles: an answer, and if it
  costs no more than the bound, the least, and of the least sets the one with the shortest route, for all of these are tight;
- an answer that costs more is thinned: what it does not need, dearest first, stays, and the route goes round it;
- else the first obstacle needed that is not settled yet is: one child has it gone, one has it stay. Of least sets found
  only then, the first is taken: a shorter route through another is passed over in 2 or 3 of 100 random tasks that need
  opening (`python -m experiments.campaigns.removal`).

The node of the least bound is next, the latest of several: children in which one more obstacle is gone come first. Where the
price is the optimum, such a dive keeps the bound and ends with it. If the nodes allowed do not suffice, the least bound of
those left is proven all the same, and the best answer found stands beside it. Costs and bounds are exact sums (`sums`): only
what is returned is rounded, down.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from srt_jax import obstacles, sums
from srt_jax.engine import packing
from srt_jax.obstacles import Labels
from srt_jax.paths.reach import flood_group
from srt_jax.removal.prices import Prices, Terms, prices_of
from srt_jax.removal.route import NEVER, Route, route_through
from srt_jax.sums import Costs
from srt_jax.types import Task


class Removal(NamedTuple):
    """The answer to each task of a batch.

    reached: uint32 [B, H, words], packed, the cells reached with nothing destroyed.
    bound: float32 [B], proven: no set of less total cost opens a way. 0 where a path exists, inf where nothing helps.
    route: of the best set found; `num_cells` 0 where none was.
    needed: int32 [B, M], the index into the route from which each obstacle must be destroyed, NEVER if it need not.
    """

    reached: Array
    bound: Array
    route: Route
    needed: Array


def least_removal(task: Task, room: Array, among: Array, *, capacity: int, max_nodes: int) -> Removal:
    """Returns the least removal of every task in `among` (bool [B]), whose start is free and whose goal is on the map.

    `room` (int32 [B]) is how many of the `capacity` cells a route may use; one that needs more ends the search, with its
    number of cells. `max_nodes`: branches looked at, at most.
    """

    search = functools.partial(_search, capacity=capacity, max_nodes=max_nodes)
    args = (task.destroyable, task.removal_cost, task.start, task.goal, room, among)
    return Removal(*obstacles.of_all(search, task.labels, *args))


class _Best(NamedTuple):
    """The best answer so far. cost: of the obstacles, a number of `sums`; `never` while there is none."""

    cost: Array
    route: Route
    needed: Array


class _Nodes(NamedTuple):
    """Open nodes in the order they were made.

    gone, stays: uint32 [n, words], sets of obstacles. paid, bound: uint32 [WORDS, n], what is gone costs, and the bound, numbers
    of `sums`; the bound is `never` where a node is closed.
    """

    gone: Array
    stays: Array
    paid: Array
    bound: Array


class _State(NamedTuple):
    """num: int32 [], nodes expanded. reached: the mask of cells reached with nothing destroyed. is_too_long: bool []."""

    num: Array
    nodes: _Nodes
    best: _Best
    reached: Array
    is_too_long: Array


class _Walk(NamedTuple):
    """One answer: over tight obstacles, else over all that can be had; and once more without what it does not need.

    opened: bool [M], what the next route may need gone. is_thin: bool [], whether none of that is needless.
    needed: as in `Removal`. cost: of these, a number of `sums`. num_tried: int32 []. goes_on: bool [].
    """

    opened: Array
    is_thin: Array
    route: Route
    needed: Array
    cost: Array
    num_tried: Array
    goes_on: Array


def _search(
    labels: Labels,
    may_go: Array,
    cost: Array,
    start: Array,
    goal: Array,
    room: Array,
    is_asked: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple:
    """The search on one map; may_go bool [M], cost float32 [M]."""
    num_obstacles = len(cost)
    height, width = labels.all.shape[2:]
    costs = sums.costs_of(cost, may_go)
    nowhere = (_nowhere(capacity), jnp.full(num_obstacles, NEVER, jnp.int32))

    def expanded(state: _State) -> _State:
        nodes, best = state.nodes, state.best
        _, at = _next(nodes.bound, costs)
        gone, stays = (_as_set(_entry(sets, at), num_obstacles) for sets in (nodes.gone, nodes.stays))
        paid, known = (_column(numbers, at) for numbers in (nodes.paid, nodes.bound))
        prices = prices_of(labels, Terms(start, goal, costs, may_go & ~stays), gone, paid, best.cost)
        bound = jnp.where(sums.is_less(known, prices.goal), prices.goal, known)
        is_open = sums.is_less(bound, best.cost)
        new = lax.cond(is_open, tried, lambda *_: (best, jnp.int32(-1), jnp.bool_(False)), best, gone, prices, bound)
        best, branch, is_too_long = new
        # Closed, unless the search ends here: its bound holds on.
        nodes = nodes._replace(bound=_put_column(nodes.bound, jnp.where(is_too_long, bound, sums.never()), at))
        child_bound = jnp.where(branch >= 0, bound, sums.never())
        nodes = _branched(nodes, state.num, gone, stays, paid, branch, child_bound, costs)
        return _State(state.num + 1, nodes, best, jnp.where(state.num == 0, prices.reached, state.reached), is_too_long)

    def tried(best: _Best, gone: Array, prices: Prices, bound: Array) -> tuple:
        """The best answer with this node's, the obstacle to branch on (-1 none), whether its route is too long to be told."""

        def walk(state: _Walk) -> _Walk:
            opened = _thinned(labels, start, goal, state.opened, cost, state.is_thin)
            route, needed = route_through(labels, obstacles.open_cells(labels, opened), start, goal, num_obstacles, capacity)
            own = sums.total(costs, needed < NEVER)
            is_there, fits = route.num_cells > 0, route.num_cells <= room
            # What costs no more than any answer needs all that it destroys, if nothing is to be had for nothing.
            is_least = ~sums.is_less(bound, own) & ~jnp.any((needed < NEVER) & (costs.digits == 0))
            is_next = is_there & fits & ~state.is_thin & ~is_least
            return _Walk(
                opened=jnp.where(is_next, needed < NEVER, gone | prices.affordable),
                is_thin=is_next,
                route=route,
                needed=needed,
                cost=own,
                num_tried=state.num_tried + 1,
                goes_on=is_next | (~is_there & (state.num_tried == 0)),
            )

        begin = _Walk(gone | prices.tight, jnp.bool_(False), *nowhere, sums.zero(), jnp.int32(0), jnp.bool_(True))
        # Ends: after the second set of obstacles, or once thinned.
        own = lax.while_loop(lambda state: state.goes_on, walk, begin)
        is_too_long = own.route.num_cells > room
        is_better = sums.is_less(own.cost, best.cost) & ~is_too_long
        is_told = is_better | (is_too_long & (best.route.num_cells == 0))
        pairs = ((own.route, own.needed), (best.route, best.needed))
        route, best_needed = jax.tree.map(lambda a, b: jnp.where(is_told, a, b), *pairs)
        order = jnp.where(gone, NEVER, own.needed)
        first = jnp.argmin(order).astype(jnp.int32)
        is_settled = jnp.min(order) == NEVER
        branch = jnp.where(is_settled | is_too_long, -1, first)
        return _Best(jnp.where(is_better, own.cost, best.cost), route, best_needed), branch, is_too_long

    def goes_on(state: _State) -> Array:
        low, _ = _next(state.nodes.bound, costs)
        return (state.num < max_nodes) & sums.is_less(low, state.best.cost) & ~state.is_too_long

    size = 2 * max_nodes + 1
    no_set = jnp.zeros((size, -(-num_obstacles // packing.WORD)), jnp.uint32)
    closed = jnp.broadcast_to(sums.never()[:, None], (sums.WORDS, size))
    bounds = _put_column(closed, jnp.where(is_asked, sums.zero(), sums.never()), jnp.int32(0))
    nodes = _Nodes(no_set, no_set, jnp.zeros_like(closed), bounds)
    reached = jnp.zeros((height, packing.num_words(width)), jnp.uint32)
    begin = _State(jnp.int32(0), nodes, _Best(sums.never(), *nowhere), reached, jnp.bool_(False))
    end = lax.while_loop(goes_on, expanded, begin)
    low, _ = _next(end.nodes.bound, costs)
    bound = jnp.where(sums.is_less(low, end.best.cost), low, end.best.cost)
    return end.reached, sums.to_float32(bound, costs), end.best.route, end.best.needed


def _thinned(labels: Labels, start: Array, goal: Array, opened: Array, cost: Array, is_asked: Array) -> Array:
    """Returns `opened` (bool [M]) without what need not go for the goal to be reached, if `is_asked`; the dearest stay first.

    What is needed once is needed later, with less gone: each obstacle is tried once.
    """
    height, width = labels.all.shape[2:]
    at_start = obstacles.only(start, height, packing.num_words(width))
    # Costs are not negative, and as whole numbers the bits of such floats have the same order.
    dearness = lax.bitcast_convert_type(cost, jnp.uint32) // 2 + 1

    def without_one(state: tuple) -> tuple:
        opened, left = state
        dearest = jnp.argmax(jnp.where(left, dearness, jnp.uint32(0))).astype(jnp.int32)
        one = jnp.arange(len(opened), dtype=jnp.int32) == dearest
        passable = obstacles.open_cells(labels, opened & ~one)
        reached = flood_group(passable, at_start & passable, group=1, through_corners=False)
        return opened & ~(one & obstacles.holds(reached, goal)), left & ~one

    # Ends: one less is left each time.
    return lax.while_loop(lambda state: jnp.any(state[1]), without_one, (opened, opened & is_asked))[0]


def _branched(
    nodes: _Nodes, num: Array, gone: Array, stays: Array, paid: Array, branch: Array, bound: Array, costs: Costs
) -> _Nodes:
    """Adds both children of the `num`-th node expanded, closed ones where `bound` is; the one with more gone is later."""
    one = jnp.arange(len(gone), dtype=jnp.int32) == branch
    more_paid = sums.with_cost(paid, costs, branch.clip(0))
    for child, (more, less, cost) in enumerate(((gone, stays | one, paid), (gone | one, stays, more_paid))):
        at = 2 * num + 1 + child
        nodes = _Nodes(
            _put(nodes.gone, obstacles.as_words(more), at),
            _put(nodes.stays, obstacles.as_words(less), at),
            _put_column(nodes.paid, cost, at),
            _put_column(nodes.bound, bound, at),
        )
    return nodes


def _next(bound: Array, costs: Costs) -> tuple[Array, Array]:
    """The least bound, and the latest of the nodes that have it."""
    low, are_least = sums.least(bound, jnp.ones(bound.shape[1], bool), costs.num_words)
    ids = jnp.arange(bound.shape[1], dtype=jnp.int32)
    return low, jnp.max(jnp.where(are_least, ids, -1))


def _as_set(words: Array, num_obstacles: int) -> Array:
    return packing.unpack(words[None, None], num_obstacles)[0, 0]


def _entry(array: Array, at: Array) -> Array:
    return lax.dynamic_index_in_dim(array, at, keepdims=False)


def _put(array: Array, value: Array, at: Array) -> Array:
    return lax.dynamic_update_index_in_dim(array, value, at, 0)


def _column(numbers: Array, at: Array) -> Array:
    return lax.dynamic_index_in_dim(numbers, at, axis=1, keepdims=False)


def _put_column(numbers: Array, number: Array, at: Array) -> Array:
    return lax.dynamic_update_slice(numbers, number[:, None], (jnp.int32(0), at))


def _nowhere(capacity: int) -> Route:
    return Route(jnp.full((capacity, 2), -1, jnp.int32), jnp.int32(0), jnp.float32(jnp.inf))
