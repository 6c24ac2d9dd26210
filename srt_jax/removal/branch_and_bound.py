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
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from sign_model.foundation.loops import in_a_loop, in_a_loop_keeping
from sign_model.foundation.marks import compiled_whole
from srt_jax import obstacles
from srt_jax.engine.buckets import SMALL_MAP
from srt_jax.obstacles import Labels, Survey
from srt_jax.paths.corners import Room
from srt_jax.paths.shortest import room_for
from srt_jax.removal import sums
from srt_jax.removal.nodes import (
    Decisions,
    Nodes,
    decisions_of,
    first_nodes,
    following,
    with_bound,
    with_children,
)
from srt_jax.removal.prices import Terms, prices_of
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

    height, width = task.labels.shape[2:]
    # One function takes less time than several where LLVM's optimisation is left out at first.
    is_whole = height * width <= SMALL_MAP
    search = functools.partial(_search, capacity=capacity, max_nodes=max_nodes, is_whole=is_whole)
    args = (task.destroyable, task.removal_cost, task.start, task.goal, room, among)
    if is_whole:
        one_map = lambda labels, *args: search(labels, None, *args)[0]  # noqa: E731
        return Removal(*obstacles.of_all(one_map, task.labels, *args))
    return Removal(*obstacles.one_by_one(search, task.labels, room_for(height, width), *args))


class _Best(NamedTuple):
    """The best answer so far. cost: of the obstacles, a number of `sums`; `never` while there is
    none.
    """

    cost: Array
    route: Route
    needed: Array


class _State(NamedTuple):
    """num: int32 [], nodes expanded. reached: the mask of cells reached with nothing destroyed.
    is_too_long, continues: bool [].

    low: the least bound of the open nodes, a number of `sums`. at: int32 [], the node that is next.
    """

    num: Array
    nodes: Nodes
    best: _Best
    reached: Array
    is_too_long: Array
    low: Array
    at: Array
    continues: Array


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


class _Node(NamedTuple):
    """What is known at a node. gone, tight, affordable: bool [M], as in `Prices`; bound: a number
    of `sums`. is_worth_it: bool [], whether it may lead to a better answer than the best.
    """

    gone: Array
    tight: Array
    affordable: Array
    bound: Array
    is_worth_it: Array


def _search(
    labels: Labels,
    place: Room | None,
    may_go: Array,
    cost: Array,
    start: Array,
    goal: Array,
    room: Array,
    is_requested: Array,
    *,
    capacity: int,
    max_nodes: int,
    is_whole: bool,
) -> tuple[tuple, Room | None]:
    """The search on one map; place: where routes are sought, may_go bool [M], cost float32 [M].

    Either as a whole in a marked call, or each step is a marked call of its own, and the loops
    round them are not: LLVM takes twice as long for one function as for its steps.
    """

    def marked(step: Callable[..., Any], **options: int) -> Callable[..., Any]:
        # Such a call must use each of its arguments (`marks`), hence the empty ones.
        step = functools.partial(step, **options) if options else step
        return step if is_whole else compiled_whole(in_a_loop(step))

    known, all_costs, state = marked(_begin, capacity=capacity, max_nodes=max_nodes)(
        labels, may_go, cost, is_requested
    )
    costs = all_costs._replace(lowest=())

    walk_in = _try_walk if is_whole else compiled_whole(in_a_loop_keeping(_try_walk))

    def expand(both: tuple[_State, Room | None]) -> tuple[_State, Room | None]:
        state, place = both
        nodes = state.nodes
        node, reached, walk = marked(_look, capacity=capacity)(
            labels,
            known,
            Terms(start, goal, costs, may_go),
            Decisions(nodes.parent, nodes.obstacle, nodes.is_gone),
            nodes.paid,
            state.at,
            state.low,
            state.best.cost,
            state.num,
            state.reached,
        )

        def try_walk(both: tuple[_Walk, Room | None]) -> tuple[_Walk, Room | None]:
            walk, place = both
            before = walk._replace(cost=(), continues=())
            at_node = node._replace(is_worth_it=())
            return walk_in(place, before, labels, known, all_costs, start, goal, room, at_node)

        # Ends: after the second set of obstacles; or thinning, where each time there is one less
        # that may not be needed.
        walk, place = lax.while_loop(lambda both: both[0].continues, try_walk, (walk, place))
        own = _Best(walk.cost, walk.route, walk.needed)
        kept = (state.num, nodes, state.best, state.at)
        settled = marked(_settle, max_nodes=max_nodes)(
            *kept, own, node.gone, node.bound, node.is_worth_it, costs, room
        )
        return state._replace(reached=reached, **settled), place

    # Ends: no open node has a bound below the best cost, or `max_nodes` are expanded, or a route
    # does not fit. The least bound of the open nodes, or the best cost, is then proven.
    end, place = lax.while_loop(lambda both: both[0].continues, expand, (state, place))
    bound, cost = marked(_proven)(end.low, end.best.cost, Costs((), (), all_costs.lowest, ()))
    return (known.free, end.reached, bound, cost, end.best.route, end.best.needed), place


def _begin(
    labels: Labels,
    may_go: Array,
    cost: Array,
    is_requested: Array,
    *,
    capacity: int,
    max_nodes: int,
) -> tuple[Survey, Costs, _State]:
    """One pass over the labels, the exact costs, and the state before the first node."""
    known = obstacles.survey(labels, len(cost))
    # The first node settles nothing. Its bound is 0; a task that is not requested has it closed, so
    # the search ends before it begins.
    low = jnp.where(is_requested, sums.zero(), sums.never())
    best = _Best(sums.never(), _nowhere(capacity), jnp.full(len(cost), NEVER, jnp.int32))
    state = _State(
        jnp.int32(0),
        first_nodes(max_nodes, low),
        best,
        jnp.zeros_like(known.free),
        is_too_long=jnp.bool_(False),
        low=low,
        at=jnp.int32(0),
        continues=is_requested,
    )
    return known, sums.costs_of(cost, may_go), state


def _look(
    labels: Labels,
    known: Survey,
    terms: Terms,
    decisions: Decisions,
    paid: Array,
    at: Array,
    low: Array,
    best_cost: Array,
    num: Array,
    reached: Array,
    *,
    capacity: int,
) -> tuple[_Node, Array, _Walk]:
    """The bound of the node that is next, what was reached at the first one, and the walk before
    its first try.
    """
    # What it has paid and the price of the goal from there. It is never below its parent's bound,
    # the least of the open ones.
    num_obstacles = len(terms.may_go)
    gone, stays = decisions_of(decisions, at, num_obstacles)
    terms = terms._replace(may_go=terms.may_go & ~stays)
    prices = prices_of(
        labels,
        known,
        terms,
        gone,
        lax.dynamic_index_in_dim(paid, at, axis=1, keepdims=False),
        best_cost,
    )
    bound = jnp.where(sums.is_less(low, prices.goal), prices.goal, low)
    is_worth_it = sums.is_less(bound, best_cost)
    walk = _Walk(
        jnp.int32(0),
        _nowhere(capacity),
        jnp.full(num_obstacles, NEVER, jnp.int32),
        sums.zero(),
        jnp.zeros(num_obstacles, bool),
        is_thinning=jnp.bool_(False),
        continues=is_worth_it,
    )
    node = _Node(gone, prices.tight, prices.affordable, bound, is_worth_it)
    return node, jnp.where(num == 0, prices.reached, reached), walk


def _settle(
    num: Array,
    nodes: Nodes,
    best: _Best,
    at: Array,
    own: _Best,
    gone: Array,
    bound: Array,
    is_worth_it: Array,
    costs: Costs,
    room: Array,
    *,
    max_nodes: int,
) -> dict[str, Any]:
    """Takes the answer of a node if it is better, closes the node, adds its children, and picks the
    node after it.
    """
    # The answer replaces the best one if it costs less and fits. One that does not fit is returned
    # where there is no other, for its number of cells.
    is_too_long = own.route.num_cells > room
    is_better = is_worth_it & sums.is_less(own.cost, best.cost) & ~is_too_long
    is_returned = is_better | (is_too_long & (best.route.num_cells == 0))
    pairs = ((own.route, own.needed), (best.route, best.needed))
    route, needed = jax.tree.map(lambda a, b: jnp.where(is_returned, a, b), *pairs)
    best = _Best(jnp.where(is_better, own.cost, best.cost), route, needed)

    # The first obstacle on the route that is not settled; none if the route needs only what is
    # gone.
    order = jnp.where(gone, NEVER, own.needed)
    first = lax.argmin(order, 0, jnp.int32)
    is_settled = jnp.min(order) == NEVER
    branch = jnp.where(is_settled | is_too_long, -1, first)

    # The node is closed, unless the search ends here: then its bound must still count.
    nodes = with_bound(nodes, jnp.where(is_too_long, bound, sums.never()), at)
    child_bound = jnp.where(branch >= 0, bound, sums.never())
    nodes = with_children(nodes, num, at, branch, child_bound, costs)
    low, after = following(nodes, costs)
    num = num + 1
    continues = (num < max_nodes) & sums.is_less(low, best.cost) & ~is_too_long
    return {
        "num": num,
        "nodes": nodes,
        "best": best,
        "is_too_long": is_too_long,
        "low": low,
        "at": after,
        "continues": continues,
    }


def _proven(low: Array, best_cost: Array, costs: Costs) -> tuple[Array, Array]:
    """The bound that is proven and the cost of the best answer, rounded down: float32 [] each."""
    bound = jnp.where(sums.is_less(low, best_cost), low, best_cost)
    bound, cost = sums.to_float32(jnp.stack([bound, best_cost], axis=1), costs)
    return bound, cost


def _try_walk(
    place: Room | None,
    state: _Walk,
    labels: Labels,
    known: Survey,
    costs: Costs,
    start: Array,
    goal: Array,
    room: Array,
    node: _Node,
) -> tuple[_Walk, Room | None]:
    """Walks once: over the tight obstacles, then if that leads nowhere over all affordable ones,
    then without the dearest one that may not be needed.
    """
    # Which obstacles are open this time, and the route over them.
    ids = jnp.arange(len(node.gone), dtype=jnp.int32)
    spared = (ids == sums.dearest(costs, state.left)) & state.left
    without = (state.needed < NEVER) & ~spared
    tight_or_more = node.gone | jnp.where(state.num_tried == 0, node.tight, node.affordable)
    opened = jnp.where(state.is_thinning, without, tight_or_more)
    capacity = state.route.cells.shape[0]
    free = obstacles.opened(labels, known, opened, known.free, opened)
    found, place = route_through(labels, free, start, goal, len(node.gone), capacity, place)

    # If nothing leads round the spared obstacle, the route before it is kept.
    is_there = found[0].num_cells > 0
    is_kept = state.is_thinning & ~is_there
    route, needed = jax.tree.map(
        lambda a, b: jnp.where(is_kept, a, b), (state.route, state.needed), found
    )
    own = sums.total(costs, needed < NEVER)
    left = (needed < NEVER) & (~state.is_thinning | (state.left & ~spared))

    # What costs no more than any answer needs all that it destroys, unless some of it costs
    # nothing.
    is_least = ~sums.is_less(node.bound, own) & ~jnp.any(left & (costs.digits == 0))
    is_thinning = (route.num_cells > 0) & (route.num_cells <= room) & ~is_least & jnp.any(left)
    continues = is_thinning | (~is_there & (state.num_tried == 0))
    walk = _Walk(state.num_tried + 1, route, needed, own, left, is_thinning, continues)
    return walk, place


def _nowhere(capacity: int) -> Route:
    return Route(jnp.full((capacity, 2), -1, jnp.int32), jnp.int32(0), jnp.float32(jnp.inf))
