"""The least removal by trying every set of obstacles: exact for overlaps, obstacles in parts,
corner contacts, any costs.
"""

from collections.abc import Iterator
from itertools import combinations
from math import fsum
from typing import NamedTuple

import numpy as np

from srt_jax.reference.dijkstra import dijkstra

MAX_DESTROYABLE = 16
"""Twice as many sets with every obstacle more: beyond this it takes minutes."""


class Removal(NamedTuple):
    """What must go.

    is_solvable: whether the goal can be reached with every destroyable obstacle gone.
    cost: the least total removal cost; 0 where a path exists, inf where the task is not solvable.
    sets: every set of ids of that cost that opens the way, each ascending, in order.
    obstacles: of those the one with the shortest route, the first of several; empty where nothing
      is needed or helps.
    length: of that route, in cell sides, inf where there is none.
    """

    is_solvable: bool
    cost: float
    sets: list[tuple[int, ...]]
    obstacles: tuple[int, ...]
    length: float


def brute_force_removal(
    labels: np.ndarray,
    destroyable: np.ndarray,
    removal_cost: np.ndarray,
    start: tuple[int, int],
    goal: tuple[int, int],
) -> Removal:
    """Returns the least total cost of obstacles to destroy so that the goal can be reached, by
    brute force.

    A set that opens the way can be destroyed as one walks: whoever walks the route of the opened
    map and meets a cell that is still covered stands beside all its owners. So the route is as long
    as the shortest path once the set is gone.

    Args:
      labels: int32 [L, H, W] or [H, W], ids, negative where free; -2 can never be opened.
      destroyable: bool [M]; at most MAX_DESTROYABLE True.
      removal_cost: float [M], positive.
      start, goal: (row, col); a start on any obstacle makes the task unsolvable.

    Raises:
      ValueError: too many destroyable obstacles.
    """
    layers = np.asarray(labels).reshape(-1, *np.shape(labels)[-2:])
    ids = np.flatnonzero(destroyable).tolist()
    if len(ids) > MAX_DESTROYABLE:
        raise ValueError(
            f"{len(ids)} obstacles are destroyable, brute force takes at most {MAX_DESTROYABLE}"
        )
    least: list[tuple[int, ...]] = []
    least_cost = float("inf")
    for cost, chosen in _by_cost(ids, np.asarray(removal_cost, np.float64)):
        if cost > least_cost:
            break
        if _leads(_open_cells(layers, chosen), start, goal, np.all(layers == -1, axis=0)):
            least, least_cost = [*least, chosen], cost
    lengths = [dijkstra(_open_cells(layers, chosen), start)[goal] for chosen in least]
    best = int(np.argmin(lengths)) if least else -1
    return Removal(
        bool(least),
        least_cost,
        least,
        least[best] if least else (),
        float(lengths[best]) if least else float("inf"),
    )


def _by_cost(ids: list[int], costs: np.ndarray) -> Iterator[tuple[float, tuple[int, ...]]]:
    """Returns every set of ids with its total cost, cheapest first."""
    sets = (chosen for number in range(len(ids) + 1) for chosen in combinations(ids, number))
    return iter(sorted((fsum(costs[list(chosen)]), chosen) for chosen in sets))


def _open_cells(layers: np.ndarray, gone: tuple[int, ...]) -> np.ndarray:
    """Returns bool [H, W], the cells whose owners are all gone."""
    return np.all((layers == -1) | np.isin(layers, gone), axis=0)


def _leads(
    free: np.ndarray, start: tuple[int, int], goal: tuple[int, int], free_before: np.ndarray
) -> bool:
    """Returns whether the goal can be reached; a start that was covered cannot be left.

    As no corner is cut, moves along rows and columns reach all. The map is one long binary number,
    with a blocked bit at the end of each row.
    """
    if not (free_before[start] and free[goal]):
        return False
    stride = free.shape[1] + 1
    open_cells = int(
        "".join("".join("1" if cell else "0" for cell in row) + "0" for row in free.tolist())[::-1],
        2,
    )
    reached, before = 1 << (start[0] * stride + start[1]), 0
    while reached != before:
        before = reached
        reached |= (
            reached << 1 | reached >> 1 | reached << stride | reached >> stride
        ) & open_cells
    return bool(reached >> (goal[0] * stride + goal[1]) & 1)
