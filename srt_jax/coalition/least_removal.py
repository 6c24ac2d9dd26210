"""The least removal of a coalition: which obstacles to destroy so that every goal is reached.

With agents of different abilities the problem is as hard as Set Cover, even without overlaps. So
branch and bound, on the graph of regions:

- a node says which obstacles are paid for and which stay. Its bound grows in steps: while an agent
  is cut off, every solution destroys one of certain obstacles: for each region that the agent might
  enter next, one that covers it; where all that covers it is paid for but nobody comes beside it,
  the same for the agents who are able to destroy it. The cheapest of these raises the bound, and
  what it costs is taken from all of them. No cost is taken twice, so the sum is proven. With one
  agent this is Dijkstra's search;
- once all goals are reached with what costs nothing any more, that is an answer; what it does not
  need is left out again, dearest first;
- if the answer costs more than the bound, its dearest obstacle that is not settled is settled: in
  one child it is paid for, in the other it stays.

The node of the least bound is next. If the nodes allowed do not suffice, the least bound of those
left is proven all the same. Costs and bounds are exact sums (`removal.sums`).

One loop, a fixpoint at a step: few operations are compiled. For use inside a marked call.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.coalition import numbers, regions
from srt_jax.coalition.joint_reach import Outcome, Powers, are_reached, fixpoint
from srt_jax.coalition.regions import Graph
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
from srt_jax.removal.sums import Costs
from srt_jax.types import Array


class Team(NamedTuple):
    """What does not change during the search on one map. Sets are uint32 [Z], as in `regions`.

    begin, goal: int32 [A], regions, -1 where an agent does nothing or has no goal.
    able: uint32 [A, Z]. never: what nobody ever destroys.
    costs: of M obstacles.
    """

    begin: Array
    goal: Array
    able: Array
    never: Array
    costs: Costs


class Least(NamedTuple):
    """The best set found, uint32 [Z], and numbers of `sums`: its cost and the proven bound, both
    `never` where none was found.
    """

    chosen: Array
    cost: Array
    bound: Array


class _Node(NamedTuple):
    """The node in work. at: int32 []. paid, stays: sets. left: uint32 [WORDS, M], what is left of
    each cost; free: the obstacles of which nothing is. bound: a number.
    """

    at: Array
    paid: Array
    stays: Array
    left: Array
    free: Array
    bound: Array


class _Thinning(NamedTuple):
    """is_on: bool [], else the bound still grows. chosen: an answer. untried: what of it may not be
    needed. without: int32 [], the obstacle left out in the next fixpoint.
    """

    is_on: Array
    chosen: Array
    untried: Array
    without: Array


class _State(NamedTuple):
    """num: int32 [], nodes expanded. low: the least bound of the open nodes. continues: bool []."""

    num: Array
    nodes: Nodes
    node: _Node
    thinning: _Thinning
    best: Least
    low: Array
    continues: Array


def search(graph: Graph, team: Team, is_solvable: Array, max_nodes: int) -> tuple[Least, Graph]:
    """Returns the least removal of one map; `is_solvable`: whether all goals can be reached."""
    num_obstacles = len(team.costs.digits)
    none = jnp.zeros_like(team.never)

    # The first node settles nothing.
    low = jnp.where(is_solvable, sums.zero(), sums.never())
    nodes = first_nodes(max_nodes, low)
    begin = _State(
        num=jnp.int32(0),
        nodes=nodes,
        node=_opened(nodes, jnp.int32(0), team),
        thinning=_Thinning(jnp.bool_(False), none, none, jnp.int32(0)),
        best=Least(none, sums.never(), sums.never()),
        low=low,
        continues=is_solvable,
    )

    def step(both: tuple[_State, Graph]) -> tuple[_State, Graph]:
        state, graph = both
        # What is reached with what costs nothing, or without an obstacle that may not be needed.
        node, thinning = state.node, state.thinning
        spared = thinning.chosen & ~_single(thinning.without, len(none))
        free = jnp.where(thinning.is_on, spared, node.free)
        never = team.never | node.stays
        powers = Powers(team.begin, team.able, free, never, jnp.int32(0))
        out, graph = fixpoint(graph, powers)
        is_there, graph = are_reached(graph, jnp.int32(0), team.goal)
        is_there = is_there | (team.goal < 0)
        is_answer = jnp.all(is_there)

        # The bound grows, or an obstacle is left out or kept.
        raised, is_dead = _raise(node, team, out, is_there)
        node = _select(thinning.is_on | is_answer, node, raised)
        chosen = jnp.where(is_answer, out.gone, thinning.chosen)
        left = thinning.untried & ~_single(thinning.without, len(none))
        untried = jnp.where(thinning.is_on, left, chosen)
        untried = untried & chosen
        own = sums.total(team.costs, regions.members(chosen, num_obstacles))
        costs_nothing = regions.set_of(jnp.pad(team.costs.digits == 0, (0, 1)))
        is_least = ~sums.is_less(node.bound, own) & ~jnp.any(untried & costs_nothing != 0)
        untried = jnp.where(is_least, jnp.zeros_like(untried), untried)
        is_on = thinning.is_on | is_answer
        thinning = _Thinning(is_on, chosen, untried, _dearest(untried, team.costs))

        # The end of a node: it is thinned, or cannot lead to a better answer.
        is_thin = is_on & jnp.all(untried == 0)
        is_futile = ~is_on & (is_dead | ~sums.is_less(node.bound, state.best.cost))
        state = state._replace(node=node, thinning=thinning)
        # A loop of one step or none, which leaves the arrays in place.
        closes = (is_thin | is_futile).astype(jnp.int32)
        state = lax.fori_loop(
            jnp.int32(0), closes, lambda _, state: _close(state, team, max_nodes), state
        )
        return state, graph

    # Ends: each fixpoint frees an obstacle, or tries one that has not been tried, or is the last of
    # a node; and there are at most `max_nodes`.
    end, graph = lax.while_loop(lambda both: both[0].continues, step, (begin, graph))
    bound = jnp.where(sums.is_less(end.low, end.best.cost), end.low, end.best.cost)
    return end.best._replace(bound=bound), graph


def _raise(node: _Node, team: Team, out: Outcome, is_there: Array) -> tuple[_Node, Array]:
    """The node with a higher bound, and whether nothing can help an agent that is cut off there."""
    num_agents, num_obstacles = len(is_there), len(team.costs.digits)
    ids = jnp.arange(num_agents, dtype=jnp.int32)
    cut_off = ids == lax.argmax((~is_there).astype(jnp.int32), 0, jnp.int32)

    # Who else must get further: the agents able to destroy what is paid for and nobody reaches.
    def more(_: Array, those: Array) -> Array:
        unmet = _union(out.unmet, those)
        return those | (jnp.any(team.able & unmet[None] != 0, axis=1) & (team.begin >= 0))

    those = lax.fori_loop(jnp.int32(0), jnp.int32(num_agents), more, cut_off)
    needed = _union(out.priced, those)

    # The cheapest of what is needed raises the bound.
    which = regions.members(needed, num_obstacles)
    step, _ = sums.least(node.left, which, team.costs.num_words)
    left = numbers.less(node.left, which, step, team.costs.num_words)
    is_free = which & jnp.all(left == 0, axis=0)
    free = node.free | regions.set_of(jnp.pad(is_free, (0, 1)))
    bound = numbers.plus(node.bound, step, team.costs.num_words)
    return node._replace(left=left, free=free, bound=bound), jnp.all(needed == 0)


def _close(state: _State, team: Team, max_nodes: int) -> _State:
    """The node in work is closed, its children are added, and the next node is opened."""
    node, thinning, nodes = state.node, state.thinning, state.nodes
    is_answer = thinning.is_on
    bound = jnp.where(sums.is_less(state.low, node.bound), node.bound, state.low)

    # A better answer.
    own = sums.total(team.costs, regions.members(thinning.chosen, len(team.costs.digits)))
    is_better = is_answer & sums.is_less(own, state.best.cost)
    best = Least(
        jnp.where(is_better, thinning.chosen, state.best.chosen),
        jnp.where(is_better, own, state.best.cost),
        state.best.bound,
    )

    # The children, closed ones where they cannot be better; the one that pays is later.
    unsettled = thinning.chosen & ~node.paid
    branch = _dearest(unsettled, team.costs)
    is_open = is_answer & jnp.any(unsettled != 0) & sums.is_less(bound, best.cost)
    nodes = with_bound(nodes, sums.never(), node.at)
    child_bound = jnp.where(is_open, bound, sums.never())
    nodes = with_children(nodes, state.num, node.at, branch, child_bound, team.costs)

    # The node of the least bound, the latest of several.
    low, after = following(nodes, team.costs)
    num = state.num + 1
    return state._replace(
        num=num,
        nodes=nodes,
        node=_opened(nodes, after, team),
        thinning=thinning._replace(is_on=jnp.bool_(False)),
        best=best,
        low=low,
        continues=(num < max_nodes) & sums.is_less(low, best.cost),
    )


def _opened(nodes: Nodes, at: Array, team: Team) -> _Node:
    """The node `at` before its bound has grown."""
    num_obstacles = len(team.costs.digits)
    is_paid, stays = decisions_at(nodes, at, num_obstacles)
    empty = jnp.zeros((sums.WORDS, num_obstacles), jnp.uint32)
    to_pay = ~is_paid
    left = sums.with_costs(empty, to_pay, sums.zero(), team.costs)
    is_free = ~to_pay | (team.costs.digits == 0)
    paid, stays, free = (regions.set_of(jnp.pad(x, (0, 1))) for x in (is_paid, stays, is_free))
    return _Node(at, paid, stays, left, free, paid_at(nodes, at.clip(0)))


def _select(is_one: Array, one: _Node, other: _Node) -> _Node:
    return _Node(*(jnp.where(is_one, a, b) for a, b in zip(one, other)))


def _single(obstacle: Array, words: int) -> Array:
    """Returns the set of one obstacle."""
    bit = jnp.uint32(1) << (obstacle & 31).astype(jnp.uint32)
    return jnp.where(jnp.arange(words, dtype=jnp.int32) == obstacle >> 5, bit, jnp.uint32(0))


def _union(sets: Array, which: Array) -> Array:
    """Returns the union of those of the sets, uint32 [A, Z], that `which` (bool [A]) names."""
    return lax.reduce(
        jnp.where(which[:, None], sets, jnp.uint32(0)), jnp.uint32(0), lax.bitwise_or, (0,)
    )


def _dearest(words: Array, costs: Costs) -> Array:
    """Returns which obstacle of a set costs most, the first of several; 0 of an empty set."""
    return sums.dearest(costs, regions.members(words, len(costs.digits)))
