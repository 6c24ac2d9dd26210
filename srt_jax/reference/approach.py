"""As near as one gets, slowly: every free cell is looked at, and a breadth-first search finds what
can be reached.
"""

from collections import deque

import numpy as np

from srt_jax.reference.first_path import first_path

Cell = tuple[int, int]
_STRAIGHT, _DIAGONAL = 5741, 8119


def approach(free: np.ndarray, start: Cell, goal: Cell) -> list[Cell]:
    """Returns the cells of the route from `start`, or the free cell nearest to it, to the reachable
    cell nearest `goal`; no cell where none is free.

    Nearness is octile distance; ties go to the lowest row, then the lowest column. Of several
    shortest routes it is the first (`first_path`).

    Args:
      free: bool [H, W], True where the agent fits.
      start, goal: (row, col); may be blocked or lie outside.
    """
    cells = [(row, col) for row, col in np.argwhere(free).tolist()]
    if not cells:
        return []
    begin = min(cells, key=lambda cell: (_octile(cell, start), cell))
    reached, waiting = {begin}, deque([begin])
    while waiting:
        row, col = waiting.popleft()
        for other in ((row - 1, col), (row, col - 1), (row, col + 1), (row + 1, col)):
            is_inside = 0 <= other[0] < free.shape[0] and 0 <= other[1] < free.shape[1]
            if is_inside and free[other] and other not in reached:
                reached.add(other)
                waiting.append(other)
    end = min(reached, key=lambda cell: (_octile(cell, goal), cell))
    return first_path(free, begin, end, _STRAIGHT, _DIAGONAL)[1]


def _octile(cell: Cell, other: Cell) -> int:
    """Returns the octile distance in whole numbers, with a ratio near enough to sqrt 2."""
    down, across = abs(cell[0] - other[0]), abs(cell[1] - other[1])
    return max(down, across) * _STRAIGHT + min(down, across) * (_DIAGONAL - _STRAIGHT)
