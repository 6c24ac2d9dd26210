"""Break or go round: the least sum of a route's length and of the tolls of what it destroys.

The way round is the first answer. A search that remembers what is paid for (`paid_search`) looks
for a better one; not where no obstacle could be part of it, since its toll and the octile distance
over it are too dear together (`shapes`). It finds and proves the least sum, unless more obstacles
matter than it can remember one by one, or it runs out of room. Then branch and bound goes on:

- a node says which obstacles are gone, and paid for, and which stay; its lower bound is what is
  paid and the least sum that the search finds with some obstacles paid for together;
- the way of that sum costs so much with every toll paid: an answer, perhaps the best so far;
- of what it destroys the dearest obstacle that is not remembered by itself is gone in one child, at
  its toll, and stays in the other.

The node of the least bound is next, the latest of several. If the nodes allowed do not suffice, or
searches get too long, the least bound of those left is proven all the same. Sums are whole numbers,
so nothing is rounded but the tolls, to the units of the map's fixed point.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.in_place import write
from srt_jax.obstacles import Labels
from srt_jax.removal.nodes import Decisions, decisions_of
from srt_jax.tolls import entry
from srt_jax.tolls.paid_labels import Room
from srt_jax.tolls.paid_search import UNREACHED, Best, search_once
from srt_jax.tolls.paid_sets import Metric, memory_of, octile, shared_of
from srt_jax.tolls.shapes import places_of, rectangles_of
from srt_jax.tolls.stops import changes_of, stops_of
from srt_jax.types import Array

MORE_LABELS = np.uint32(2**15)
"""Branch and bound ends once it has made so many labels more than a search has room for."""


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
    [], the node that is next. floor: uint32 [], the least bound of nodes that could not be settled.
    num_labels: uint32 [], of all searches. store: room for labels.
    """

    num: Array
    nodes: _Nodes
    best: Array
    gone: Array
    low: Array
    at: Array
    floor: Array
    num_labels: Array
    store: Room


class _Look(NamedTuple):
    """What a search found, and which obstacles it remembered together with others, and at all: bool
    [M] each.
    """

    best: Best
    is_shared: Array
    is_remembered: Array


def search(
    labels: Labels,
    free: Array,
    tolls: Array,
    metric: Metric,
    max_nodes: int,
    way_round: Array,
    room: Array,
    store: Room,
) -> tuple[Found, Room]:
    """Returns the best set of obstacles of one map; the empty set where nothing is better than the
    way round. For use inside a marked call.

    Args:
      free: uint32 [H, words], the cells that no obstacle covers, packed.
      tolls: uint32 [M], CLOSED of what must stay.
      metric: from a start that is free to another cell of the map.
      max_nodes: searches, at most.
      way_round: uint32 [], the length of the way that needs nothing gone, UNREACHED where there is
        none or it is not known.
      room, store: as of `search_once`; the store is returned with the answer.
    """
    M = tolls.shape[0]
    num_places = 2 * max_nodes + 1
    changes = changes_of(labels, free)
    nobody = jnp.zeros(M, bool)
    nowhere = Best(
        jnp.uint32(UNREACHED), nobody, jnp.uint32(UNREACHED), jnp.bool_(False), jnp.uint32(0)
    )

    def step(state: _State) -> _State:
        node = state.at
        gone, stays = decisions_of(state.nodes.decisions, node, M)
        paid = entry.total(tolls, gone)
        asked = jnp.where(gone, jnp.uint32(0), jnp.where(stays, jnp.uint32(UNREACHED), tolls))

        # Only a way that is better than the best so far; what could not be part of one stays.
        limit = jnp.where(paid < state.best, state.best - paid, jnp.uint32(0))
        places = places_of(labels, changes, asked, metric, limit)
        matters = places.matters

        def look(state: tuple[Array, _Look, Room]) -> tuple[Array, _Look, Room]:
            # What may be entered twice.
            own = matters & (asked > 0)
            own = own & ~rectangles_of(labels, changes, places.boxes, own)
            memory = memory_of(own, asked, places.boxes, metric)
            price = jnp.where(matters, asked, jnp.uint32(UNREACHED))
            # Where the way round is known, a better one pays something.
            is_known = way_round < UNREACHED
            least = jnp.where(is_known, jnp.min(price), jnp.uint32(0))
            near = jnp.where(is_known, places.near, jnp.uint32(2**32 - 1))
            stops = stops_of(changes, near, metric.goal, labels.all.shape[3])
            found, store = search_once(
                labels, stops, price, memory, metric, least, limit - 1, room, state[2]
            )
            return jnp.bool_(False), _Look(found, shared_of(memory), own), store

        # Without a way round it may be that nothing is in the way.
        is_settled = (limit == 0) | ((limit < UNREACHED) & ~jnp.any(matters))
        # A loop of one step or none: a branch would copy the room for labels.
        _, (found, is_shared, is_remembered), store = lax.while_loop(
            lambda state: state[0], look, (~is_settled, _Look(nowhere, nobody, nobody), state.store)
        )

        # The answer.
        total = _add(found.total, paid)
        is_better = total < state.best
        best = jnp.minimum(total, state.best)
        best_gone = jnp.where(is_better, jnp.logical_or(found.needed, gone), state.gone)

        # The children.
        bound = jnp.maximum(_add(found.bound, paid), state.low)
        is_open = found.is_full | (found.bound < found.total)
        doubtful = jnp.where(found.is_full, is_remembered, is_shared)
        on_it = doubtful & found.needed
        doubtful = jnp.where(jnp.any(on_it), on_it, doubtful & found.is_full)
        branch = lax.argmax(jnp.where(doubtful, tolls, jnp.uint32(0)), 0, jnp.int32)
        branches = is_open & jnp.any(doubtful)
        floor = jnp.where(is_open & ~branches, jnp.minimum(bound, state.floor), state.floor)
        nodes = state.nodes
        bounds = write(nodes.bound, jnp.uint32(UNREACHED), node.astype(jnp.uint32))
        decisions = nodes.decisions
        for child in range(2):
            to = (2 * state.num + 1 + child).astype(jnp.uint32)
            child_bound = jnp.where(branches, bound, jnp.uint32(UNREACHED))
            bounds = write(bounds, child_bound, to)
            decisions = Decisions(
                write(decisions.parent, node, to),
                write(decisions.obstacle, branch, to),
                write(decisions.is_gone, jnp.bool_(child == 1), to),
            )
        low = jnp.min(bounds)
        ids = jnp.arange(num_places, dtype=jnp.int32)
        after = jnp.max(jnp.where(bounds == low, ids, -1))
        spent = state.num_labels + found.num_labels
        nodes = _Nodes(decisions, bounds)
        return _State(state.num + 1, nodes, best, best_gone, low, after, floor, spent, store)

    # No way is shorter than the octile distance.
    apart = jnp.abs(metric.start - metric.goal)
    far = octile(apart[0], apart[1], metric)
    none = jnp.full(num_places, -1, jnp.int32)
    bounds = jnp.full(num_places, UNREACHED, jnp.uint32)
    begin = _State(
        num=jnp.int32(0),
        nodes=_Nodes(
            Decisions(none, none, jnp.zeros(num_places, bool)), write(bounds, far, jnp.uint32(0))
        ),
        best=jnp.minimum(way_round, UNREACHED),
        gone=nobody,
        low=far,
        at=jnp.int32(0),
        floor=jnp.uint32(UNREACHED),
        num_labels=jnp.uint32(0),
        store=store,
    )

    # Ends: no open node has a bound below the best answer, `max_nodes` are searched, or so many
    # labels are made that it would take too long.
    def goes_on(state: _State) -> Array:
        may_go_on = (state.num < max_nodes) & (state.num_labels < room + MORE_LABELS)
        return may_go_on & (state.low < state.best)

    end = lax.while_loop(goes_on, step, begin)
    bound = jnp.minimum(jnp.minimum(end.low, end.floor), end.best)
    return Found(end.best, bound, end.gone), end.store


def _add(one: Array, other: Array) -> Array:
    """Returns a sum, at most UNREACHED."""
    return jnp.minimum(one + other, jnp.uint32(UNREACHED))
