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
- an answer that costs more is thinned: what it does not need, dearest first, stays, and the route
  goes round;
- else the first obstacle needed that is not settled yet is settled: in one child it is gone, in the
  other it stays.
  Of least sets found only then, the first is taken: a shorter route through another is passed over
  in 2 or 3 of 100 random tasks that need opening (`python -m experiments.campaigns.removal`).

The node of the least bound is next, the latest of several: children in which one more obstacle is
gone come first. Where the price is the optimum, such a dive keeps the bound and ends with it. If
the nodes allowed do not suffice, the least bound of those left is proven all the same, and the best
answer found stands beside it. Costs and bounds are exact sums (`sums`): only what is returned is
rounded, down.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.obstacles import Labels, Survey
from srt_jax.removal import sums
from srt_jax.removal.nodes import (
    Nodes,
    decisions_at,
    first_nodes,
    following,
    paid_at,
    with_bound,
    with_children,
)
from srt_jax.removal.prices import Prices, Terms, prices_of
from srt_jax.removal.route import NEVER, Route, route_through
from srt_jax.removal.sums import Costs
from srt_jax.types import Array, Task


class Removal(NamedTuple):
    """The answer to each task of a batch.

    free, reached: uint32 [B, H, words], packed, the cells free and those reached with nothing
      destroyed.
    bound: float32 [B], proven: no set of less total cost opens a way. 0 where a path exists, inf
      where nothing helps.
    cost: float32 [B], of the best set found, inf where none was. Both are exact sums, rounded down.
    route: of the best set found; `num_cells` 0 where none was.
    needed: int32 [B, M], the index into the route from which each obstacle must be destroyed, NEVER
      if it need not.
    """

    free: Array
    reached: Array
    bound: Array
    cost: Array
    route: Route
    needed: Array


def search_least(
    task: Task, room: Array, among: Array, *, capacity: int, max_nodes: int
) -> Removal:
    """Returns the least removal of every task in `among` (bool [B]), whose start is free and whose
    goal is on the map.

    `room` (int32 [B]) is how many of the `capacity` cells a route may use; one that needs more ends
    the search, with its number of cells. `max_nodes`: branches looked at, at most.
    """

    search = functools.partial(_search, capacity=capacity, max_nodes=max_nodes)
    args = (task.destroyable, task.removal_cost, task.start, task.goal, room, among)
    return Removal(*obstacles.of_all(search, task.labels, *args))


class _Best(NamedTuple):
    """The best answer so far. cost: of the obstacles, a number of `sums`; `never` while there is
    none.
    """

    cost: Array
    route: Route
    needed: Array


class _State(NamedTuple):
    """num: int32 [], nodes expanded. reached: the mask of cells reached with nothing destroyed.
    is_too_long: bool [].

    low: the least bound of the open nodes, a number of `sums`. at: int32 [], the node that is next.
    """

    num: Array
    nodes: Nodes
    best: _Best
    reached: Array
    is_too_long: Array
    low: Array
    at: Array


class _Walk(NamedTuple):
    """One answer: over tight obstacles, else over all that can be had; then without one or another
    that it may not need.

    num_tried: int32 []. left: bool [M], what it may not need. is_thinning, continues: bool [].
    needed: as in `Removal`. cost: of these, a number of `sums`.
    """

    num_tried: Array
    route: Route
    needed: Array
    cost: Array
    left: Array
    is_thinning: Array
    continues: Array


class _Map(NamedTuple):
    """What does not change during the search on one map. known: from one pass over its labels.

    may_go: bool [M]. costs: of M obstacles. start, goal: int32 [2]. room: int32 [], the cells a
      route may use.
    """

    labels: Labels
    known: Survey
    may_go: Array
    costs: Costs
    start: Array
    goal: Array
    room: Array


class _Answer(NamedTuple):
    """What one node leads to. best: with the answer of this node. branch: int32 [], the obstacle to
    branch on, -1 none. is_too_long: bool [], whether the route of this node does not fit.
    """

    best: _Best
    branch: Array
    is_too_long: Array


def _search(
    labels: Labels,
    may_go: Array,
    cost: Array,
    start: Array,
    goal: Array,
    room: Array,
    is_requested: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple:
    """The search on one map; may_go bool [M], cost float32 [M]."""
    num_obstacles = len(cost)
    height, width = labels.all.shape[2:]
    known = obstacles.survey(labels, num_obstacles)
    given = _Map(labels, known, may_go, sums.costs_of(cost, may_go), start, goal, room)
    nowhere = (_nowhere(capacity), jnp.full(num_obstacles, NEVER, jnp.int32))

    def is_unfinished(state: _State) -> Array:
        return (
            (state.num < max_nodes) & sums.is_less(state.low, state.best.cost) & ~state.is_too_long
        )

    # The first node settles nothing. Its bound is 0; a task that is not requested has it closed, so
    # the search ends before it begins.
    low = jnp.where(is_requested, sums.zero(), sums.never())
    nodes = first_nodes(max_nodes, low)
    best = _Best(sums.never(), *nowhere)
    reached = jnp.zeros((height, packing.num_words(width)), jnp.uint32)
    begin = _State(jnp.int32(0), nodes, best, reached, jnp.bool_(False), low, jnp.int32(0))

    # Ends: no open node has a bound below the best cost, or `max_nodes` are expanded, or a route
    # does not fit. The least bound of the open nodes, or the best cost, is then proven.
    end = lax.while_loop(is_unfinished, lambda state: _expand(state, given, nowhere), begin)
    bound = jnp.where(sums.is_less(end.low, end.best.cost), end.low, end.best.cost)
    bound, cost = sums.to_float32(jnp.stack([bound, end.best.cost], axis=1), given.costs)
    return known.free, end.reached, bound, cost, end.best.route, end.best.needed


def _expand(state: _State, given: _Map, nowhere: tuple[Route, Array]) -> _State:
    """Expands the node that is next: closes it, adds its children, and picks the node after it."""
    nodes, best, at = state.nodes, state.best, state.at

    # The bound of the node: what it has paid and the price of the goal from there. It is never
    # below its parent's bound, the least of the open ones.
    gone, stays = decisions_at(nodes, at, len(given.may_go))
    paid = paid_at(nodes, at)
    terms = Terms(given.start, given.goal, given.costs, given.may_go & ~stays)
    prices = prices_of(given.labels, given.known, terms, gone, paid, best.cost)
    bound = jnp.where(sums.is_less(state.low, prices.goal), prices.goal, state.low)

    # An answer, where the node may still lead to one that is better than the best.
    answer = lax.cond(
        sums.is_less(bound, best.cost),
        functools.partial(_answer_at, given, nowhere),
        lambda *_: _Answer(best, jnp.int32(-1), jnp.bool_(False)),
        best,
        gone,
        prices,
        bound,
    )

    # The node is closed, unless the search ends here: then its bound must still count.
    nodes = with_bound(nodes, jnp.where(answer.is_too_long, bound, sums.never()), at)
    child_bound = jnp.where(answer.branch >= 0, bound, sums.never())
    nodes = with_children(nodes, state.num, at, answer.branch, child_bound, given.costs)
    reached = jnp.where(state.num == 0, prices.reached, state.reached)
    low, after = following(nodes, given.costs)
    return _State(state.num + 1, nodes, answer.best, reached, answer.is_too_long, low, after)


def _answer_at(
    given: _Map,
    nowhere: tuple[Route, Array],
    best: _Best,
    gone: Array,
    prices: Prices,
    bound: Array,
) -> _Answer:
    """The best answer with that of this node, and the obstacle to branch on."""
    none = jnp.zeros(len(given.may_go), bool)
    begin = _Walk(
        jnp.int32(0),
        *nowhere,
        sums.zero(),
        none,
        is_thinning=jnp.bool_(False),
        continues=jnp.bool_(True),
    )
    # Ends: after the second set of obstacles; or thinning, where each time there is one less that
    # may not be needed.
    own = lax.while_loop(
        lambda state: state.continues,
        lambda state: _try_walk(state, given, gone, prices, bound),
        begin,
    )

    # The answer replaces the best one if it costs less and fits. One that does not fit is returned
    # where there is no other, for its number of cells.
    is_too_long = own.route.num_cells > given.room
    is_better = sums.is_less(own.cost, best.cost) & ~is_too_long
    is_returned = is_better | (is_too_long & (best.route.num_cells == 0))
    pairs = ((own.route, own.needed), (best.route, best.needed))
    route, needed = jax.tree.map(lambda a, b: jnp.where(is_returned, a, b), *pairs)

    # The first obstacle on the route that is not settled; none if the route needs only what is
    # gone.
    order = jnp.where(gone, NEVER, own.needed)
    first = lax.argmin(order, 0, jnp.int32)
    is_settled = jnp.min(order) == NEVER
    branch = jnp.where(is_settled | is_too_long, -1, first)
    better = _Best(jnp.where(is_better, own.cost, best.cost), route, needed)
    return _Answer(better, branch, is_too_long)


def _try_walk(state: _Walk, given: _Map, gone: Array, prices: Prices, bound: Array) -> _Walk:
    """Walks once: over the tight obstacles, then if that leads nowhere over all affordable ones,
    then without the dearest one that may not be needed.
    """
    # Which obstacles are open this time, and the route over them.
    ids = jnp.arange(len(given.may_go), dtype=jnp.int32)
    spared = (ids == sums.dearest(given.costs, state.left)) & state.left
    without = (state.needed < NEVER) & ~spared
    tight_or_more = gone | jnp.where(state.num_tried == 0, prices.tight, prices.affordable)
    opened = jnp.where(state.is_thinning, without, tight_or_more)
    capacity = state.route.cells.shape[0]
    free = obstacles.opened(given.labels, given.known, opened, given.known.free, opened)
    found = route_through(given.labels, free, given.start, given.goal, len(given.may_go), capacity)

    # If nothing leads round the spared obstacle, the route before it is kept.
    is_there = found[0].num_cells > 0
    is_kept = state.is_thinning & ~is_there
    route, needed = jax.tree.map(
        lambda a, b: jnp.where(is_kept, a, b), (state.route, state.needed), found
    )
    own = sums.total(given.costs, needed < NEVER)
    left = (needed < NEVER) & (~state.is_thinning | (state.left & ~spared))

    # What costs no more than any answer needs all that it destroys, unless some of it costs
    # nothing.
    is_least = ~sums.is_less(bound, own) & ~jnp.any(left & (given.costs.digits == 0))
    is_thinning = (
        (route.num_cells > 0) & (route.num_cells <= given.room) & ~is_least & jnp.any(left)
    )
    continues = is_thinning | (~is_there & (state.num_tried == 0))
    return _Walk(state.num_tried + 1, route, needed, own, left, is_thinning, continues)


def _nowhere(capacity: int) -> Route:
    return Route(jnp.full((capacity, 2), -1, jnp.int32), jnp.int32(0), jnp.float32(jnp.inf))
