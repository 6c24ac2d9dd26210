"""The map as a graph: a node is a piece of cells with the same owners, joined by sides; an edge
joins pieces that share a side.
"""

from typing import NamedTuple

import numpy as np

from srt_jax.components import pieces
from srt_jax.types import FREE, OUTSIDE


class Graph(NamedTuple):
    """of_cell: int64 [H, W], the node of each cell. owners: of each node, the obstacles that cover
    it, OUTSIDE among them where it lies outside the map. beside: of each node, those next to it.
    """

    of_cell: np.ndarray
    owners: list[frozenset[int]]
    beside: list[list[int]]


def graph_of(labels: np.ndarray) -> Graph:
    """Returns the graph of one map, int32 [L, H, W]."""
    height, width = labels.shape[1:]
    stacked = np.sort(labels.reshape(len(labels), -1).T, axis=1)
    kinds, kind = np.unique(stacked, axis=0, return_inverse=True)
    of_cell = pieces(kind.reshape(height, width))
    num = int(of_cell.max()) + 1
    kind_of = np.zeros(num, np.int64)
    kind_of[of_cell.ravel()] = kind.ravel()
    sets = [frozenset(one) - {FREE} for one in kinds.tolist()]
    pairs = [
        np.stack([one.ravel(), other.ravel()])
        for one, other in ((of_cell[:, :-1], of_cell[:, 1:]), (of_cell[:-1], of_cell[1:]))
    ]
    edges = np.concatenate(pairs, axis=1)
    edges = np.unique(np.sort(edges[:, edges[0] != edges[1]], axis=0), axis=1)
    beside: list[list[int]] = [[] for _ in range(num)]
    for one, other in edges.T.tolist():
        beside[one].append(other)
        beside[other].append(one)
    return Graph(of_cell, [sets[one] for one in kind_of.tolist()], beside)


def is_open(owners: frozenset[int], gone: set[int] | frozenset[int]) -> bool:
    """Returns whether a node can be walked on with these obstacles gone."""
    return OUTSIDE not in owners and owners <= gone


def are_joined(graph: Graph, terminals: list[int], gone: set[int] | frozenset[int]) -> bool:
    """Returns whether the terminals, nodes, are joined with these obstacles gone."""
    if not all(is_open(graph.owners[node], gone) for node in terminals):
        return False
    seen, stack = {terminals[0]}, [terminals[0]]
    while stack:
        for node in graph.beside[stack.pop()]:
            if node not in seen and is_open(graph.owners[node], gone):
                seen.add(node)
                stack.append(node)
    return seen.issuperset(terminals)
