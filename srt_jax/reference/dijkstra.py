"""Dijkstra's search with buckets, on exact integers: the length of a shortest path to every
cell.
"""

from heapq import heappop, heappush

import numpy as np

STRAIGHT, DIAGONAL = 1_136_689, 1_607_521
"""A Pell pair, 1 : sqrt 2. Where two lengths have n diagonal moves more or less and differ at all,
they differ by about 1 / (2.8 n) or more, and the pair errs by n / (2.8 STRAIGHT^2): lengths are
ordered rightly while n < STRAIGHT."""


def dijkstra(free: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """Returns the length of a shortest path from `start` to each cell, inf where there is none; all
    inf from a blocked start.

    A diagonal move needs both cells beside it free. The sums are integers, so they do not depend on
    the order of the moves.

    Args:
      free: bool [H, W], True where the agent fits.
      start: (row, col).

    Returns:
      float64 [H, W], in cell sides.
    """
    height, width = free.shape
    field = np.full((height, width), np.inf)
    if not (0 <= start[0] < height and 0 <= start[1] < width and free[start]):
        return field
    costs = _flood(
        np.pad(np.asarray(free, bool), 1).ravel().tolist(),
        (start[0] + 1) * (width + 2) + start[1] + 1,
        width + 2,
    )
    for cell, cost in costs.items():
        field[cell // (width + 2) - 1, cell % (width + 2) - 1] = cost / STRAIGHT
    return field


def _flood(is_open: list[bool], source: int, stride: int) -> dict[int, int]:
    """Returns the integer cost of each cell reached; a bucket holds the cells met at one cost, a
    heap the costs to come.
    """
    settled: dict[int, int] = {}
    buckets, costs = {0: [source]}, [0]
    while costs:
        cost = heappop(costs)
        for cell in buckets.pop(cost):
            if cell in settled:
                continue
            settled[cell] = cost
            for step in (-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1):
                other = cell + step
                is_diagonal = step not in (-stride, -1, 1, stride)
                if not is_open[other] or other in settled:
                    continue
                if is_diagonal and not (
                    is_open[cell + _vertical(step, stride)]
                    and is_open[cell + _horizontal(step, stride)]
                ):
                    continue
                longer = cost + (DIAGONAL if is_diagonal else STRAIGHT)
                if longer not in buckets:
                    buckets[longer] = []
                    heappush(costs, longer)
                buckets[longer].append(other)
    return settled


def _vertical(step: int, stride: int) -> int:
    return stride if step > 1 else -stride


def _horizontal(step: int, stride: int) -> int:
    return step - _vertical(step, stride)
