"""Break or go round: the least sum of a route's length and of the tolls of what it destroys.

The way round is the first answer. Where no obstacle could be part of a better one, since its toll
and the octile distance over it are too dear together, it is the best at once. Else one search that
remembers what is paid for (`paid_once`) finds the least sum. Where it runs out of memory, it still
has an answer and perhaps a lower bound that is less, and branch and bound goes on:

- a node says which obstacles are gone, and paid for, and which stay; its lower bound is what is
  paid and the least sum (`spread`) with entries into the others free of charge, but for those that
  no least way enters twice (`shapes`), which keep their tolls;
- the way of that sum costs so much with every toll paid once: an answer, perhaps the best so far;
- what it takes free of charge may be paid more in truth: the dearest of these obstacles is gone in
  one child, at its toll, and stays in the other;
- an obstacle stays, too, where its toll and the bound, if that does not hold it already, or the
  octile distance over it and what is paid, together are no better than the best answer.

The node of the least bound is next, the latest of several. If the nodes allowed do not suffice, the
least bound of those left is proven all the same. Sums are whole numbers, so nothing is rounded but
the tolls, to the units of the map's fixed point.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.engine.in_place import read_apart, write
from srt_jax.removal.nodes import Decisions, decisions_of
from srt_jax.tolls import entry, shapes
from srt_jax.tolls.paid_once import Best, memory_of, search_once
from srt_jax.tolls.spread import UNREACHED, Ground, Size, sums_of
from srt_jax.tolls.way_back import way_back
from srt_jax.types import Array


class Found(NamedTuple):
    """The best set of one map. total: uint32 [], what its way costs at most, UNREACHED where no way
    was found. bound: uint32 [], no way costs less. gone: bool [M], the set.
    """

    total: Array
    bound: Array
    gone: Array


class _Nodes(NamedTuple):
    """parent, obstacle: int32 [n], -1 of the first. is_gone: bool [n], else it stays. bound: uint32
    [n], UNREACHED where a node is closed.
    """

    decisions: Decisions
    bound: Array


class _State(NamedTuple):
    """num: int32 [], searches done. low: uint32 [], the least bound of the open nodes. at: int32
    [], the node that is next."""

    num: Array
    nodes: _Nodes
    best: Array
    gone: Array
    low: Array
    at: Array


def search(
    ground: Ground, tolls: Array, size: Size, max_nodes: int, way_round: Array, room: Array
) -> Found:
    """Returns the best set of obstacles of one map; the empty set where nothing is better than the
    way round. For use inside a marked call.

    Args:
      ground: with a start that is free, or none, and the goal.
      tolls: uint32 [M], CLOSED of what must stay.
      max_nodes: searches for bounds, at most; the one that remembers comes first.
      way_round: uint32 [], the length of the way that needs nothing gone, UNREACHED where there is
        none or it is not known.
      room: uint32 [], as of `search_once`.
    """
    M = tolls.shape[0]
    goal = ground.goal
    is_single, nearest, boxes = shapes.shapes_of(ground, size, M)
    # What may be entered free of charge, since it may be paid for already.
    is_free = ~is_single & (tolls > 0) & (tolls < entry.CLOSED)
    num_places = 2 * max_nodes + 1

    def is_hopeless(low: Array, paid: Array, best: Array) -> Array:
        """Which obstacles no better answer destroys besides what is paid for.

        The bound holds tolls already, but none of those that are free of charge in it.
        """
        without = jnp.where(is_free, low, jnp.uint32(0))
        return _add(jnp.maximum(without, _add(nearest, paid)), tolls) >= best

    def step(state: _State) -> _State:
        node = state.at
        gone, stays = decisions_of(state.nodes.decisions, node, M)
        paid = entry.total(tolls, gone)
        stays = stays | (~gone & is_hopeless(state.low, paid, state.best))
        asked = jnp.where(is_free, jnp.uint32(0), tolls)
        asked = jnp.where(stays, jnp.uint32(entry.CLOSED), asked)
        asked = entry.with_ends(jnp.where(gone, jnp.uint32(0), asked))

        # Only a way that is better than the best so far.
        is_worth_it = paid < state.best
        start = jnp.where(is_worth_it, ground.start, jnp.uint32(0))
        limit = jnp.where(is_worth_it, state.best - paid - 1, jnp.uint32(0))
        sums = sums_of(ground._replace(start=start), asked, limit, size)
        at_goal = read_apart(sums, goal)
        is_there = (goal != 0) & is_worth_it & (at_goal <= limit)
        back = way_back(ground, asked, sums, jnp.where(is_there, goal, 0), size, M)

        # The answer.
        own = _add(back.length, entry.total(tolls, back.needed))
        own = jnp.where(is_there, own, jnp.uint32(UNREACHED))
        is_better = own < state.best
        best = jnp.minimum(own, state.best)
        best_gone = jnp.where(is_better, back.needed, state.gone)

        # The children: what was taken free of charge is settled, the dearest first.
        bound = jnp.where(is_there, jnp.maximum(_add(paid, at_goal), state.low), UNREACHED)
        doubtful = back.needed & is_free & ~gone & is_there
        branch = lax.argmax(jnp.where(doubtful, tolls, jnp.uint32(0)), 0, jnp.int32)
        is_open = jnp.any(doubtful)
        nodes = state.nodes
        bounds = write(nodes.bound, jnp.uint32(UNREACHED), node.astype(jnp.uint32))
        decisions = nodes.decisions
        toll = lax.dynamic_index_in_dim(tolls, branch, keepdims=False)
        for child, child_bound in enumerate((bound, _add(bound, toll))):
            to = (2 * state.num + 1 + child).astype(jnp.uint32)
            child_bound = jnp.where(is_open, child_bound, jnp.uint32(UNREACHED))
            bounds = write(bounds, child_bound, to)
            decisions = Decisions(
                write(decisions.parent, node, to),
                write(decisions.obstacle, branch, to),
                write(decisions.is_gone, jnp.bool_(child == 1), to),
            )
        low = jnp.min(bounds)
        ids = jnp.arange(num_places, dtype=jnp.int32)
        after = jnp.max(jnp.where(bounds == low, ids, -1))
        return _State(state.num + 1, _Nodes(decisions, bounds), best, best_gone, low, after)

    # No way is shorter than the octile distance.
    far = jnp.where(goal != 0, read_apart(ground.left, ground.start), jnp.uint32(UNREACHED))
    far = jnp.where(ground.start != 0, far, jnp.uint32(UNREACHED))

    # The search that remembers; none where nothing could be part of a better answer.
    stays = is_hopeless(far, jnp.uint32(0), way_round) | (tolls >= entry.CLOSED)
    is_settled = (way_round < UNREACHED) & jnp.all(stays)
    nowhere = Best(jnp.uint32(UNREACHED), jnp.zeros(M, bool), jnp.uint32(UNREACHED))

    def look() -> Best:
        memory = memory_of(is_free & ~stays, tolls, boxes, ground, size)
        asked = entry.with_ends(jnp.where(stays, jnp.uint32(entry.CLOSED), tolls))
        limit = jnp.minimum(way_round, jnp.uint32(UNREACHED)) - 1
        return search_once(ground, asked, memory, limit, room, size)

    # Its arrays alone take as long to fill as all before.
    first = lax.cond(is_settled, lambda: nowhere, look)
    is_better = first.total < way_round
    best = jnp.minimum(first.total, way_round)

    none = jnp.full(num_places, -1, jnp.int32)
    bounds = jnp.full(num_places, UNREACHED, jnp.uint32)
    # It holds tolls, so that nodes have bounds of their own, without them.
    floor = jnp.minimum(first.bound, best)
    low = jnp.where(floor < best, far, best)
    nodes = _Nodes(
        Decisions(none, none, jnp.zeros(num_places, bool)),
        write(bounds, low, jnp.uint32(0)),
    )
    begin = _State(
        num=jnp.int32(0),
        nodes=nodes,
        best=best,
        gone=first.needed & is_better,
        low=low,
        at=jnp.int32(0),
    )
    # Ends: no open node has a bound below the best answer, or `max_nodes` are searched.
    end = lax.while_loop(
        lambda state: (state.num < max_nodes) & (jnp.maximum(state.low, floor) < state.best),
        step,
        begin,
    )
    return Found(end.best, jnp.minimum(jnp.maximum(end.low, floor), end.best), end.gone)


def _add(one: Array, other: Array) -> Array:
    """Returns a sum, at most UNREACHED."""
    return jnp.minimum(one + other, jnp.uint32(UNREACHED))
