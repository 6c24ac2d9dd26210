"""Jump point search without corner cutting (PY16 §3.2; Harabor & Grastien 2012: diagonals need both
side cells).

Of the many shortest paths to a cell those count that make their diagonal moves first. So a straight
run has to stop only where a wall beside it has just ended: there a turn became possible that no
diagonal could have taken earlier. A diagonal run has to stop only where a straight run off it finds
such a place.
"""

from collections.abc import Iterator
from heapq import heappop, heappush

import numpy as np

from srt_jax.reference.astar import Search, is_free_at, length_of, octile_field, remove_padding

_NOWHERE = 0
"""No jump point: the corner of the padded map, which is always blocked."""


def jps(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> Search:
    """Returns a shortest path, as A* does; CLOSED holds jump points only, so it may miss the seed
    (PY16 §3.2).

    Args:
      free: bool [H, W], True where the agent fits.
      start, goal: (row, col); a start that is blocked or outside reaches nothing.
    """
    # The map as one list, with a blocked rim, as in `astar`.
    height, width = free.shape
    stride = width + 2
    is_open = np.pad(np.asarray(free, bool), 1).ravel().tolist()
    source, target = ((row + 1) * stride + col + 1 for row, col in (start, goal))
    target = target if is_free_at(free, goal) else _NOWHERE
    heuristic = octile_field(height, width, goal)
    closed, parent, cost = [False] * len(is_open), {source: source}, {source: 0.0}
    waiting = [(heuristic[source], 0.0, source)] if is_free_at(free, start) else []
    num_expansions = 0
    # Ends: the goal is expanded, or every jump point that can be reached is.
    while waiting:
        _, minus_cost, cell = heappop(waiting)
        if closed[cell]:
            continue
        closed[cell] = True
        num_expansions += 1
        if cell == target:
            path = _filled_in(parent, source, target, stride)
            return Search(length_of(path), path, remove_padding(closed, free.shape), num_expansions)
        for vertical, horizontal in _directions(is_open, cell, parent[cell], stride):
            point = _jump(is_open, cell, vertical, horizontal, stride, target)
            longer = _distance(cell, point, stride) - minus_cost
            if point != _NOWHERE and longer < cost.get(point, float("inf")):
                cost[point] = longer
                parent[point] = cell
                heappush(waiting, (longer + heuristic[point], -longer, point))
    return Search(float("inf"), [], remove_padding(closed, free.shape), num_expansions)


def _directions(
    is_open: list[bool], cell: int, parent: int, stride: int
) -> Iterator[tuple[int, int]]:
    """Yields the moves worth trying, as offsets (vertical, horizontal), for one who comes from
    `parent`.
    """
    rows, cols = cell // stride - parent // stride, cell % stride - parent % stride
    vertical, horizontal = stride * ((rows > 0) - (rows < 0)), (cols > 0) - (cols < 0)
    if cell == parent:
        for ahead in (-stride, 0, stride):
            yield from ((ahead, beside) for beside in (-1, 0, 1) if ahead or beside)
    elif vertical and horizontal:
        yield from ((vertical, 0), (0, horizontal), (vertical, horizontal))
    else:
        yield vertical, horizontal
        for side in (-1, 1) if vertical else (-stride, stride):
            if is_open[cell + side] and not is_open[cell + side - vertical - horizontal]:
                yield (0, side) if vertical else (side, 0)
                yield (vertical, side) if vertical else (side, horizontal)


def _jump(
    is_open: list[bool], cell: int, vertical: int, horizontal: int, stride: int, target: int
) -> int:
    """Returns the jump point in that direction, or _NOWHERE."""
    if not vertical:
        return _run(is_open, cell, horizontal, stride, target)
    if not horizontal:
        return _run(is_open, cell, vertical, 1, target)
    while (
        is_open[cell + vertical]
        and is_open[cell + horizontal]
        and is_open[cell + vertical + horizontal]
    ):
        cell += vertical + horizontal
        if (
            cell == target
            or _run(is_open, cell, vertical, 1, target) != _NOWHERE
            or _run(is_open, cell, horizontal, stride, target) != _NOWHERE
        ):
            return cell
    return _NOWHERE


def _run(is_open: list[bool], cell: int, step: int, side: int, target: int) -> int:
    """Returns where a straight run has to stop: at the target, or where a wall on either side has
    just ended; or _NOWHERE.
    """
    cell += step
    while is_open[cell]:
        if (
            cell == target
            or (is_open[cell + side] and not is_open[cell + side - step])
            or (is_open[cell - side] and not is_open[cell - side - step])
        ):
            return cell
        cell += step
    return _NOWHERE


def _distance(a: int, b: int, stride: int) -> float:
    """Returns the length of a straight or diagonal run between two cells."""
    rows, cols = abs(a // stride - b // stride), abs(a % stride - b % stride)
    return max(rows, cols) * (2**0.5 if rows and cols else 1.0)


def _filled_in(
    parent: dict[int, int], source: int, target: int, stride: int
) -> list[tuple[int, int]]:
    """Returns the path through the jump points, cell by cell."""
    cells, cell = [target], target
    while cell != source:
        before = parent[cell]
        rows, cols = before // stride - cell // stride, before % stride - cell % stride
        step = stride * ((rows > 0) - (rows < 0)) + (cols > 0) - (cols < 0)
        cells += range(cell + step, before + step, step)
        cell = before
    return [(cell // stride - 1, cell % stride - 1) for cell in reversed(cells)]
