"""The first of the shortest paths between two cells, cell by cell: Dijkstra's search with whole
numbers, then back from the goal.

Of several shortest paths the first is the one found so: going back from the goal, the cell before
is always the first neighbour from which a shortest path comes, the four straight neighbours before
the four diagonal ones, in row order each.
"""

from heapq import heappop, heappush

import numpy as np

_BACK = ((-1, 0), (0, -1), (0, 1), (1, 0), (-1, -1), (-1, 1), (1, -1), (1, 1))
"""Where the cell before lies, in the order of preference."""


def first_path(
    free: np.ndarray,
    start: tuple[int, int],
    goal: tuple[int, int],
    straight: int,
    diagonal: int,
) -> tuple[int, list[tuple[int, int]]]:
    """Returns the length of a shortest path, and the cells of the first one, start first.

    A diagonal move needs both cells beside it free. Without a path: -1 and no cell.

    Args:
      free: bool [H, W], True where the agent fits.
      start, goal: (row, col); may be blocked or lie outside.
      straight, diagonal: what a move costs.
    """
    height, width = free.shape

    def is_open(row: int, col: int) -> bool:
        return 0 <= row < height and 0 <= col < width and bool(free[row, col])

    def moves(row: int, col: int) -> list[tuple[int, int, int]]:
        """The neighbours that lie one move away, in the order of preference, and its cost."""
        out = []
        for down, right in _BACK:
            beside = is_open(row + down, col) and is_open(row, col + right)
            if beside and is_open(row + down, col + right):
                out.append((row + down, col + right, diagonal if down and right else straight))
        return out

    if not is_open(*start) or not is_open(*goal):
        return -1, []
    # the exact cost of every cell that can be reached
    cost = {start: 0}
    waiting = [(0, start)]
    while waiting:
        here, cell = heappop(waiting)
        if here > cost[cell]:
            continue
        for row, col, step in moves(*cell):
            if here + step < cost.get((row, col), here + step + 1):
                cost[row, col] = here + step
                heappush(waiting, (here + step, (row, col)))
    if goal not in cost:
        return -1, []
    # back from the goal, by the first neighbour that a shortest path comes from
    path = [goal]
    while path[-1] != start:
        path.append(
            next(
                (row, col)
                for row, col, step in moves(*path[-1])
                if cost[row, col] + step == cost[path[-1]]
            )
        )
    return cost[goal], path[::-1]
