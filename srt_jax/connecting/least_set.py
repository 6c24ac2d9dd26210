"""The least set of obstacles that joins the terminals, by branch and bound.

In a relaxation an obstacle's cost is shared out evenly over its nodes, and a tree pays the shares
of the nodes that it holds: no more than the obstacles cost that it needs. Where every obstacle is
one node, joined by sides and overlapping no other, the least tree is the answer. Else an obstacle
of which the tree holds some nodes only is paid too little: it is gone in one child, paid in full,
and stays in the other. A tree's own obstacles, thinned by those that it can do without, are an
answer; the search ends when no open node has a bound below the best. For more than MAX_EXACT
terminals a bound by cuts and a tree that is not the least take the place of the least tree, and the
search goes on until every obstacle of its answers is settled.
"""

import math
from collections import Counter
from fractions import Fraction
from heapq import heappop, heappush
from typing import NamedTuple

from srt_jax.connecting.graph import Graph, are_joined
from srt_jax.connecting.steiner import Weights, cut_bound, least_tree, members, near_tree
from srt_jax.types import OUTSIDE

MAX_EXACT = 8
"""Terminals for which least trees are computed: 3^7 steps for each node of the graph."""

_MAX_SHARED = 64  # bits of the common multiple of the numbers of nodes


class Found(NamedTuple):
    """gone: the best set, None where no set joins the terminals. cost: of that set; bound: no set
    costs less; None where there is none.
    """

    gone: frozenset[int] | None
    cost: Fraction | None
    bound: Fraction | None


class _Costs(NamedTuple):
    """whole: of each obstacle, an integer. share: of each of its nodes. unit: what 1 is worth."""

    whole: dict[int, int]
    share: dict[int, int]
    unit: Fraction


def search(
    graph: Graph, cost: dict[int, Fraction], terminals: list[int], max_branches: int
) -> Found:
    """Returns the least set, or the best found.

    Args:
      cost: of each obstacle that can be destroyed.
      terminals: nodes, no two the same.
    """
    needed = members(graph.owners, terminals)
    if not needed <= cost.keys() or not are_joined(graph, terminals, cost.keys() | needed):
        return Found(None, None, None)
    costs = _as_integers(graph, cost)
    best, best_cost = frozenset(cost), sum(costs.whole.values())
    heap = [(0, 0, frozenset(needed), frozenset[int]())]
    num = 0
    while heap and heap[0][0] < best_cost and num < max_branches:
        bound, _, gone, stays = heappop(heap)
        num += 1
        relaxed = _relaxed(graph, costs, terminals, gone, stays)
        if relaxed is None:
            continue
        value, nodes = relaxed
        bound = max(bound, value + sum(costs.whole[one] for one in gone))
        answer = _thinned(graph, costs, terminals, members(graph.owners, nodes) | gone)
        answer_cost = sum(costs.whole[one] for one in answer)
        if answer_cost < best_cost:
            best, best_cost = answer, answer_cost
        if bound >= best_cost:
            continue
        # What the tree pays too little for, the most first; by cuts, what it takes at all.
        held = Counter(one for node in nodes for one in graph.owners[node] - gone)
        is_exact = len(terminals) <= MAX_EXACT
        short = {
            one: costs.whole[one] - (costs.share[one] * count if is_exact else 0)
            for one, count in held.items()
        }
        branch = max(short, key=lambda one: (short[one], -one), default=None)
        if branch is None or not short[branch]:
            continue
        heappush(heap, (bound, -2 * num, gone | {branch}, stays))
        heappush(heap, (bound, -2 * num - 1, gone, stays | {branch}))
    low = min(heap[0][0], best_cost) if heap else best_cost
    return Found(best, best_cost * costs.unit, low * costs.unit)


def _as_integers(graph: Graph, cost: dict[int, Fraction]) -> _Costs:
    """Costs in a unit of which they and, where that is not too small, their shares are whole."""
    count = Counter(
        one for owners in graph.owners if OUTSIDE not in owners for one in owners if one in cost
    )
    parts = math.lcm(*count.values()) if count else 1
    parts = parts if parts.bit_length() <= _MAX_SHARED else 1 << _MAX_SHARED
    scale = math.lcm(*(value.denominator for value in cost.values())) * parts
    whole = {one: int(value * scale) for one, value in cost.items()}
    share = {one: value // max(1, count[one]) for one, value in whole.items()}
    return _Costs(whole, share, Fraction(1, scale))


def _relaxed(
    graph: Graph,
    costs: _Costs,
    terminals: list[int],
    gone: frozenset[int],
    stays: frozenset[int],
) -> tuple[int, set[int]] | None:
    """A lower bound on what is paid besides `gone`, and the nodes of a tree; None without one."""

    def weight_of(owners: frozenset[int]) -> int | None:
        rest = owners - gone
        if not rest <= costs.whole.keys() or rest & stays:
            return None
        return sum(costs.share[one] for one in rest)

    weight: Weights = [weight_of(owners) for owners in graph.owners]
    if len(terminals) <= MAX_EXACT:
        return least_tree(graph.beside, weight, terminals)
    tree = near_tree(graph.beside, weight, terminals)
    return tree and (cut_bound(graph.beside, weight, terminals), tree[1])


def _thinned(
    graph: Graph, costs: _Costs, terminals: list[int], gone: set[int] | frozenset[int]
) -> frozenset[int]:
    """The set without what it can do without, the dearest first."""
    left = set(gone)
    for one in sorted(left, key=lambda one: (-costs.whole[one], one)):
        if are_joined(graph, terminals, left - {one}):
            left.discard(one)
    return frozenset(left)
