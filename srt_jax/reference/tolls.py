"""Length and tolls by a heap: the least sum to every cell, and the least over every set of
obstacles paid once.
"""

from heapq import heappop, heappush
from itertools import combinations
from typing import NamedTuple

import numpy as np

MAX_DESTROYABLE = 12
"""Twice as many searches with every obstacle more."""

_MOVES = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]


def least_sums(
    labels: np.ndarray,
    toll: np.ndarray,
    start: tuple[int, int],
    *,
    straight: int = 5741,
    diagonal: int = 8119,
    cell_cost: np.ndarray | None = None,
) -> np.ndarray:
    """Returns the least sum of length and tolls from `start` to each cell, inf where none leads;
    all inf from a start that lies outside or that an obstacle covers.

    A move pays for every obstacle that it needs gone (those on the cell entered, and on a diagonal
    those on the two cells beside it) unless the cell left lies in that obstacle.

    Args:
      labels: int [L, H, W] or [H, W], ids, -1 free, -2 never to be entered.
      toll: float [M], in cell sides, rounded to whole 1 / straight; inf of what must stay.
      straight, diagonal: the lengths of moves, whole numbers.
      cell_cost: float [H, W], by whose mean over its two cells the length of a move is multiplied;
        then nothing is rounded, and a diagonal is sqrt 2 long.

    Returns:
      float64 [H, W], in cell sides.
    """
    layers = np.asarray(labels).reshape(-1, *np.shape(labels)[-2:])
    height, width = layers.shape[1:]
    owners = [
        [frozenset(layers[:, r, c].tolist()) - {-1} for c in range(width)] for r in range(height)
    ]
    if cell_cost is None:
        cell, straight_move, diagonal_move = np.ones((height, width)).tolist(), straight, diagonal
        price = {i: _units(t, straight) for i, t in enumerate(np.asarray(toll).tolist())}
    else:
        cell, straight, straight_move, diagonal_move = np.asarray(cell_cost).tolist(), 1, 1, 2**0.5
        price = {i: t if np.isfinite(t) else None for i, t in enumerate(np.asarray(toll).tolist())}
    price[-2] = None
    sums = np.full((height, width), np.inf)
    if not (0 <= start[0] < height and 0 <= start[1] < width) or owners[start[0]][start[1]]:
        return sums
    best: dict[tuple[int, ...], float] = {tuple(start): 0}
    heap: list[tuple[float, int, int]] = [(0, *start)]
    settled = set()
    while heap:
        here, row, col = heappop(heap)
        if (row, col) in settled:
            continue
        settled.add((row, col))
        sums[row, col] = here / straight
        for down, right in _MOVES:
            to = (row + down, col + right)
            if not (0 <= to[0] < height and 0 <= to[1] < width):
                continue
            needed = owners[to[0]][to[1]]
            if down and right:
                needed = needed | owners[row][to[1]] | owners[to[0]][col]
            tolls = [price[i] for i in needed - owners[row][col]]
            paid = sum(toll for toll in tolls if toll is not None)
            if None in tolls:
                continue
            mean = (cell[row][col] + cell[to[0]][to[1]]) / 2
            cost = here + (diagonal_move if down and right else straight_move) * mean + paid
            if cost < best.get(to, cost + 1):
                best[to] = cost
                heappush(heap, (cost, *to))
    return sums


class Best(NamedTuple):
    """The least total of length and tolls, each obstacle paid once.

    total: in cell sides, inf where nothing helps. length: of a route of that total. destroyed: a
    set
      that it takes, ids ascending.
    """

    total: float
    length: float
    destroyed: tuple[int, ...]


def brute_force_total(
    labels: np.ndarray,
    destroyable: np.ndarray,
    toll: np.ndarray,
    start: tuple[int, int],
    goal: tuple[int, int],
) -> Best:
    """Returns the least length + tolls of what is destroyed, by a search for every set of
    obstacles.

    Args:
      labels: as for `least_sums`. destroyable: bool [M], at most MAX_DESTROYABLE True.
      toll: float [M], in cell sides, rounded as there.

    Raises:
      ValueError: too many destroyable obstacles.
    """
    ids = np.flatnonzero(destroyable).tolist()
    if len(ids) > MAX_DESTROYABLE:
        raise ValueError(
            f"{len(ids)} obstacles are destroyable, brute force takes at most {MAX_DESTROYABLE}"
        )
    layers = np.asarray(labels).reshape(-1, *np.shape(labels)[-2:])
    best = Best(np.inf, np.inf, ())
    if (layers[:, start[0], start[1]] != -1).any():
        return best
    for number in range(len(ids) + 1):
        for chosen in combinations(ids, number):
            free = np.all((layers == -1) | np.isin(layers, chosen), axis=0)
            length = least_sums(np.where(free, -1, -2), np.zeros(0), start)[tuple(goal)]
            total = length + sum(round(float(toll[i]) * 5741) for i in chosen) / 5741
            if total < best.total - 1e-9:
                best = Best(total, float(length), chosen)
    return best


def _units(toll: float, straight: int) -> int | None:
    return round(toll * straight) if np.isfinite(toll) else None
