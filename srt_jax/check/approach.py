"""Whether the way as near as one gets begins, leads and ends as it must, on floods of our own."""

from types import SimpleNamespace

import numpy as np

from srt_jax.check.floods import free_cells, nearest_cell, piece_of
from srt_jax.check.walk import illegal_move, is_close, length_of

_NOWHERE = (-1, -1)


def approach_problems(
    task: SimpleNamespace, solution: SimpleNamespace, near: SimpleNamespace
) -> list[str]:
    """Returns what is wrong with an approach, a sentence each."""
    height, width = task.size
    labels = task.labels[:, :height, :width]
    free = free_cells(labels, np.zeros_like(task.destroyable))
    start, goal = (tuple(end.tolist()) for end in (task.start, task.goal))
    begin, end = (tuple(cell.tolist()) for cell in (near.begin, near.end))
    # Without a free cell there is no route.
    if not free.any():
        is_empty = near.num_cells == 0 and (near.cells == -1).all()
        is_empty &= begin == end == _NOWHERE and near.cost == near.gap == np.inf
        return [] if is_empty else ["no cell is free, so the approach must be empty"]
    # Its ends: nearest to the start, and to the goal among what is reached from there.
    problems = []
    true_begin = nearest_cell(free, start)
    true_end = nearest_cell(piece_of(free, true_begin), goal)
    if begin != true_begin:
        problems.append(f"the approach begins in {begin}, but must in {true_begin}")
    if end != true_end:
        problems.append(f"the approach ends in {end}, but must in {true_end}")
    seed = tuple(solution.seed.tolist())
    if seed != _NOWHERE and seed != true_end:
        problems.append(f"the approach must end in the seed {seed}, not in {true_end}")
    across = abs(np.array(true_end, np.int64) - goal)
    gap = across.max() - across.min() + across.min() * 2**0.5
    if not is_close(near.gap, gap):
        problems.append(f"the gap is {near.gap}, but the goal is {gap:.6f} away from {true_end}")
    return problems + _walk_problems(near, free, begin, end)


def _walk_problems(
    near: SimpleNamespace, free: np.ndarray, begin: tuple[int, ...], end: tuple[int, ...]
) -> list[str]:
    """What is wrong with the route itself, move by move."""
    num, cells = int(near.num_cells), near.cells
    if num > len(cells):  # it did not fit, and is not returned
        return [] if (cells == -1).all() else ["an approach that does not fit must be all -1"]
    if num < 1:
        return ["the approach is empty, though cells are free"]
    route, height_width = cells[:num], free.shape
    if (route < 0).any() or (route >= height_width).any() or (cells[num:] != -1).any():
        return [f"the approach must hold {num} cells of the map, and -1 after them"]
    problems = []
    for what, cell, place in (("begin", begin, 0), ("end", end, -1)):
        if tuple(route[place].tolist()) != cell:
            problems.append(f"the cells of the approach do not {what} in {cell}")
    problems += [f"approach: {found}" for found in illegal_move(free, route, 0, num - 1)]
    if not free[tuple(route[0])]:
        problems.append(f"the approach begins in {begin}, which is blocked")
    length = length_of(route)
    if not is_close(near.cost, length):
        problems.append(f"the approach is {length:.6f} long, not {near.cost}")
    return problems
