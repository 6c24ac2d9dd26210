"""A* over the eight moves, with its CLOSED set (PY16 §3.2; Hart, Nilsson & Raphael 1968)."""

from heapq import heappop, heappush
from itertools import pairwise
from typing import NamedTuple

import numpy as np

ROOT = 2**0.5


class Search(NamedTuple):
    """How a search ended.

    cost: length of the path in cell sides, inf where there is none.
    path: its cells (row, col), start first; empty where there is none.
    closed: bool [H, W], the cells expanded: the set CLOSED.
    num_expansions: how many that were.
    """

    cost: float
    path: list[tuple[int, int]]
    closed: np.ndarray
    num_expansions: int


def astar(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> Search:
    """Returns a shortest path; where there is none CLOSED holds every cell that can be reached, all
    of them expanded.

    PY16 §3.2: that second use finds the seed. A diagonal move needs both cells beside it free. Ties
    go to the greater cost-to-come, then to the cell first in row order.

    Args:
      free: bool [H, W], True where the agent fits.
      start, goal: (row, col); a start that is blocked or outside reaches nothing.
    """
    # The map as one list, with a blocked rim: no test for the border in the loop.
    height, width = free.shape
    stride = width + 2
    is_open = np.pad(np.asarray(free, bool), 1).ravel().tolist()
    source, target = ((row + 1) * stride + col + 1 for row, col in (start, goal))
    heuristic = octile_field(height, width, goal)
    closed, parent = [False] * len(is_open), [0] * len(is_open)
    cost = [float("inf")] * len(is_open)
    num_expansions, waiting = 0, []
    if is_free_at(free, start):
        cost[source] = 0.0
        waiting = [(heuristic[source], 0.0, source)]
    # Ends: the goal is expanded, or all that can be reached is. A cell is pushed again when a
    # shorter way to it is found; the longer entries are skipped.
    while waiting:
        _, minus_cost, cell = heappop(waiting)
        if closed[cell]:
            continue
        closed[cell] = True
        num_expansions += 1
        if cell == target and is_free_at(free, goal):
            path = _trace_back(parent, source, target, stride)
            return Search(length_of(path), path, remove_padding(closed, free.shape), num_expansions)
        for other, step in _moves(is_open, cell, stride):
            longer = step - minus_cost
            if longer < cost[other]:
                cost[other] = longer
                parent[other] = cell
                heappush(waiting, (longer + heuristic[other], -longer, other))
    return Search(float("inf"), [], remove_padding(closed, free.shape), num_expansions)


def _moves(is_open: list[bool], cell: int, stride: int) -> list[tuple[int, float]]:
    """Returns the cells one move away, each with the length of the move."""
    up, down, left, right = cell - stride, cell + stride, cell - 1, cell + 1
    north, south, west, east = is_open[up], is_open[down], is_open[left], is_open[right]
    moves = []
    if north:
        moves.append((up, 1.0))
        if west and is_open[up - 1]:
            moves.append((up - 1, ROOT))
        if east and is_open[up + 1]:
            moves.append((up + 1, ROOT))
    if south:
        moves.append((down, 1.0))
        if west and is_open[down - 1]:
            moves.append((down - 1, ROOT))
        if east and is_open[down + 1]:
            moves.append((down + 1, ROOT))
    if west:
        moves.append((left, 1.0))
    if east:
        moves.append((right, 1.0))
    return moves


def octile_field(height: int, width: int, goal: tuple[int, int]) -> list[float]:
    """Returns the octile distance to the goal of every cell of the padded map, row after row."""
    rows = np.abs(np.arange(-1, height + 1) - goal[0])[:, None]
    cols = np.abs(np.arange(-1, width + 1) - goal[1])[None, :]
    return (np.maximum(rows, cols) + (ROOT - 1) * np.minimum(rows, cols)).ravel().tolist()


def is_free_at(free: np.ndarray, cell: tuple[int, int]) -> bool:
    """Returns whether the cell lies on the map and is free."""
    return 0 <= cell[0] < free.shape[0] and 0 <= cell[1] < free.shape[1] and bool(free[cell])


def _trace_back(parent: list[int], source: int, target: int, stride: int) -> list[tuple[int, int]]:
    cells = [target]
    while cells[-1] != source:
        cells.append(parent[cells[-1]])
    return [(cell // stride - 1, cell % stride - 1) for cell in reversed(cells)]


def length_of(path: list[tuple[int, int]]) -> float:
    """Returns the length of a path in cell sides; its two kinds of moves are counted apart, so that
    it is rounded once.
    """
    num_diagonal = sum(a[0] != b[0] and a[1] != b[1] for a, b in pairwise(path))
    return len(path) - 1 - num_diagonal + num_diagonal * ROOT


def remove_padding(flags: list[bool], shape: tuple[int, ...]) -> np.ndarray:
    """Returns bool [H, W] from the flags of a map padded by a cell on every side, row after row."""
    return np.array(flags, bool).reshape(shape[0] + 2, shape[1] + 2)[1:-1, 1:-1]
