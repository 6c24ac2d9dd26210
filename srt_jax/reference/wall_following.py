"""Bug-like wall following: the contour of an obstacle, walked with a hand on the wall (PY16
§3.2).
"""

import numpy as np

from srt_jax.types import Cell


def follow_wall(free: np.ndarray, seed: Cell, goal: Cell) -> list[Cell]:
    """Returns the contour of the obstacle ahead of `seed`, its cells in the order of the walk;
    empty where nothing is ahead.

    PY16 §3.2. Each cell is beside the one before it. With the wall on the left the walker goes
    round until it is back where it began; at the edge of the map it turns back to the seed and goes
    the other way, the wall on the right. Cells in a narrow place come twice. As a set they are the
    reached cells that touch the obstacle by a side or a corner.

    Args:
      free: bool [H, W], True where the agent fits.
      seed: (row, col), the reached cell nearest the goal.
      goal: (row, col), not reached.
    """
    ahead = _ahead(free, seed, goal)
    if ahead is None:
        return []
    leftward, is_round = _walk(free, seed, ahead, hand=1)
    if is_round:
        return leftward
    rightward, _ = _walk(free, seed, ahead, hand=-1)
    return rightward[:0:-1] + leftward


def _walk(free: np.ndarray, first: Cell, wall: Cell, *, hand: int) -> tuple[list[Cell], bool]:
    """Returns the cells passed with the wall on the left (hand 1) or right (-1), and whether the
    walk came round to its begin.

    If it did not, the edge of the map ended it. One of the two happens, as no two states lead to
    the same next one.
    """
    start = state = first, _turn((wall[0] - first[0], wall[1] - first[1]), -hand)
    passed = [first]
    while True:
        cell, facing = state
        side = _turn(facing, hand)
        at_side, at_front = (_neighbour(free, cell, direction) for direction in (side, facing))
        if at_side is None or (at_front is None and not free[at_side]):
            return passed, False
        if free[at_side]:
            state = at_side, side
        elif at_front is not None and free[at_front]:
            state = at_front, facing
        else:
            state = cell, _turn(facing, -hand)
        if state[0] != cell:
            passed.append(state[0])
        if state == start:
            return passed, True


def _ahead(free: np.ndarray, seed: Cell, goal: Cell) -> Cell | None:
    """Returns the cell beside the seed on the longer way to the goal: the obstacle's, else it were
    reached, and nearer.
    """
    rows, cols = goal[0] - seed[0], goal[1] - seed[1]
    direction = (int(np.sign(rows)), 0) if abs(rows) >= abs(cols) else (0, int(np.sign(cols)))
    cell = _neighbour(free, seed, direction)
    return None if cell is None or free[cell] else cell


def _turn(direction: Cell, hand: int) -> Cell:
    """Returns the direction after a quarter turn to the left (hand 1) or right (-1), rows counted
    downwards.
    """
    return -hand * direction[1], hand * direction[0]


def _neighbour(free: np.ndarray, cell: Cell, direction: Cell) -> Cell | None:
    """Returns the cell one step on, None beyond the edge of the map."""
    row, col = cell[0] + direction[0], cell[1] + direction[1]
    return (row, col) if 0 <= row < free.shape[0] and 0 <= col < free.shape[1] else None
