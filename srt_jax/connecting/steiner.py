"""Least trees that hold given nodes of a graph with weights at the nodes.

`least_tree` is exact: the dynamic program of Dreyfus and Wagner (Networks 1, 1971) over subsets of
the terminals, of 3^k steps for k of them. `cut_bound` is a lower bound for any number: the dual
ascent of Wong (Math. Programming 28, 1984). A tree directed away from the first terminal pays the
weight of a node at the one move to it, and some move of it enters each set of nodes that holds a
terminal but not the first. Such sets grow around one terminal after the other, as those nearer than
d in Dijkstra's algorithm, and use up what is left of the weights of the moves into them.
`near_tree` is a tree, not the least: the nearest terminal is joined next (Takahashi and Matsuyama
1980). Weights are Python's integers, None for nodes that are closed, and sums exact.
"""

from collections.abc import Iterable
from heapq import heapify, heappop, heappush

Weights = list[int | None]


def least_tree(
    beside: list[list[int]], weight: Weights, terminals: list[int]
) -> tuple[int, set[int]] | None:
    """Returns the weight and the nodes of a least tree; None where the terminals cannot be joined.

    Terminals are open. Of trees of equal weight it is always the same one.
    """
    *others, root = terminals
    if not others:
        return weight[root] or 0, {root}
    full = (1 << len(others)) - 1
    # Of each set of terminals and each node: the least tree that holds them, and where from.
    best: list[dict[int, int]] = [{} for _ in range(full + 1)]
    origin: list[dict[int, tuple[int, int]]] = [{} for _ in range(full + 1)]
    for mask in range(1, full + 1):
        costs, before = best[mask], origin[mask]
        if mask & (mask - 1) == 0:
            node = others[mask.bit_length() - 1]
            costs[node], before[node] = weight[node] or 0, (0, node)
        part = (mask - 1) & mask
        while 2 * part > mask:  # each way to part it once
            rest = best[mask ^ part]
            for node, cost in best[part].items():
                other = rest.get(node)
                if other is not None:
                    total = cost + other - (weight[node] or 0)
                    if total < costs.get(node, total + 1):
                        costs[node], before[node] = total, (part, node)
            part = (part - 1) & mask
        _spread(beside, weight, costs, before)
    if root not in best[full]:
        return None
    nodes, todo = {root}, [(full, root)]
    while todo:
        mask, node = todo.pop()
        nodes.add(node)
        part, earlier = origin[mask][node]
        if earlier != node:
            todo.append((mask, earlier))
        elif part:
            todo += [(part, node), (mask ^ part, node)]
    return best[full][root], nodes


def _spread(
    beside: list[list[int]],
    weight: Weights,
    costs: dict[int, int],
    before: dict[int, tuple[int, int]],
) -> None:
    """Dijkstra's algorithm from many nodes at their costs; lowers `costs`."""
    heap = [(cost, node) for node, cost in costs.items()]
    heapify(heap)
    while heap:
        cost, node = heappop(heap)
        if cost > costs[node]:
            continue
        for to in beside[node]:
            own = weight[to]
            if own is not None and cost + own < costs.get(to, cost + own + 1):
                costs[to], before[to] = cost + own, (0, node)
                heappush(heap, (cost + own, to))


def near_tree(
    beside: list[list[int]], weight: Weights, terminals: list[int]
) -> tuple[int, set[int]] | None:
    """Returns the weight and the nodes of a tree; None where the terminals cannot be joined."""
    nodes, left = {terminals[0]}, set(terminals[1:]) - {terminals[0]}
    while left:
        costs = dict.fromkeys(sorted(nodes), 0)
        before: dict[int, tuple[int, int]] = {}
        _spread(beside, weight, costs, before)
        reached = [(costs[node], node) for node in left if node in costs]
        if not reached:
            return None
        node = min(reached)[1]
        left.discard(node)
        while node not in nodes:
            nodes.add(node)
            node = before[node][1]
        left -= nodes
    return sum(weight[node] or 0 for node in nodes), nodes


def cut_bound(beside: list[list[int]], weight: Weights, terminals: list[int]) -> int:
    """Returns a number that no tree weighs less than; terminals can be joined, and weigh 0."""
    root, bound, grown = terminals[0], 0, {terminals[0]}
    # Of each move to a node, in the order of `beside`: what is left of the node's weight.
    left = [[own or 0] * len(near) for own, near in zip(weight, beside)]
    for terminal in terminals[1:]:
        while terminal not in grown:
            inner, costs = _innermost(beside, weight, left, terminals, terminal)
            if costs.get(root) == 0:
                grown.update(node for node in terminals if node in (inner, terminal))
                continue
            # Up to the next terminal: the cuts on the way, each as far as it adds to the bound.
            far = min(costs[node] for node in terminals if costs.get(node))
            bound += far
            for node, cost in costs.items():
                if cost < far:
                    for i, other in enumerate(beside[node]):
                        beyond = min(costs.get(other, far), far)
                        if weight[other] is not None and beyond > cost:
                            left[node][i] -= beyond - cost
    return bound


def _innermost(
    beside: list[list[int]],
    weight: Weights,
    left: list[list[int]],
    terminals: list[int],
    terminal: int,
) -> tuple[int, dict[int, int]]:
    """A terminal that a tree of no weight leads to from the given one, and from which none leads to
    a terminal that none leads back from; and the costs that lead to it.
    """
    passed = {terminal}
    while True:
        costs = _costs_to(beside, weight, left, terminal)
        within = [node for node in terminals if costs.get(node) == 0 and node not in passed]
        if costs.get(terminals[0]) == 0 or not within:
            return terminal, costs
        terminal = within[0]
        passed.add(terminal)


def _costs_to(
    beside: list[list[int]], weight: Weights, left: list[list[int]], terminal: int
) -> dict[int, int]:
    """What is left of the weights on the cheapest way from each node to the terminal."""
    costs, heap = {terminal: 0}, [(0, terminal)]
    while heap:
        cost, node = heappop(heap)
        if cost > costs[node]:
            continue
        for i, other in enumerate(beside[node]):
            total = cost + left[node][i]
            if weight[other] is not None and total < costs.get(other, total + 1):
                costs[other] = total
                heappush(heap, (total, other))
    return costs


def members(owners: list[frozenset[int]], nodes: Iterable[int]) -> set[int]:
    """Returns the obstacles that cover any of these nodes."""
    return set().union(*(owners[node] for node in nodes))
