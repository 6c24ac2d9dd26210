"""Fences and rings between start and goal, made of obstacles in segments, in parts and overlapping;
and the proven optimum.

Every barrier is one cell thick and closed, and the free cells between two barriers are connected.
So a way to the goal crosses a cell of each barrier, one cell of each suffices, and the least
removal is the cheapest union of owners over a choice of one cell a barrier.
"""

from math import fsum
from typing import NamedTuple

import numpy as np

COSTS = (1.0, 1.0, 1.0, 0.5, 2.0, 3.0)
"""What destroying an obstacle may cost: sums of these are exact in float32."""


class Barrier(NamedTuple):
    """Cells of a barrier in order, and which can be crossed: not the corners of a ring, as no
    straight move leads there.
    """

    rows: np.ndarray
    cols: np.ndarray
    crossable: np.ndarray


class Objects:
    """The obstacles laid so far: their flags and costs, by id."""

    def __init__(self, rng: np.random.Generator):
        self.destroyable: list[bool] = []
        self.cost: list[float] = []
        self._rng = rng
        self._is_unit = rng.random() < 0.5

    def add(self, *, destroyable: bool) -> int:
        """Returns the id of a new obstacle; in half of the tasks all cost 1, else one of COSTS."""
        self.destroyable.append(destroyable)
        self.cost.append(1.0 if self._is_unit else float(self._rng.choice(COSTS)))
        return len(self.cost) - 1


def fence(row: int, width: int) -> Barrier:
    """Returns the barrier of all cells of a row."""
    return Barrier(np.full(width, row), np.arange(width), np.ones(width, bool))


def ring(centre: tuple[int, int], radius: int) -> Barrier:
    """Returns the barrier of all cells `radius` rows or columns from the centre, clockwise from the
    upper left corner.
    """
    side = np.arange(-radius, radius)
    edge = np.full(2 * radius, radius)
    rows, cols = (
        np.concatenate([-edge, side, edge, -side]),
        np.concatenate([side, edge, -side, -edge]),
    )
    return Barrier(rows + centre[0], cols + centre[1], abs(rows) != abs(cols))


def lay_whole(labels: np.ndarray, barrier: Barrier, objects: Objects) -> None:
    """Lays one destroyable obstacle all along the barrier."""
    labels[0, barrier.rows, barrier.cols] = objects.add(destroyable=True)


def lay_segments(
    labels: np.ndarray, barrier: Barrier, objects: Objects, rng: np.random.Generator
) -> None:
    """Lays obstacles along the barrier: new ones, fixed ones, further parts of earlier ones, seldom
    a gap; and one over others.

    Args:
      labels: int32 [2, H, W], written to; what lies over others goes to the second layer.
    """
    length = len(barrier.rows)
    cuts = np.sort(rng.integers(0, length, rng.integers(0, 6)))
    for first, last in zip([0, *cuts], [*cuts, length], strict=True):
        cells = barrier.rows[first:last], barrier.cols[first:last]
        choice = rng.random()
        if choice < 0.55 or (choice < 0.7 and not objects.cost):
            labels[0][cells] = objects.add(destroyable=True)
        elif choice < 0.7:
            labels[0][cells] = rng.integers(len(objects.cost))
        elif choice < 0.97:
            labels[0][cells] = objects.add(destroyable=False)
    if rng.random() < 0.4:
        first, last = np.sort(rng.integers(0, length + 1, 2))
        over = objects.add(destroyable=bool(rng.random() < 0.8))
        labels[1, barrier.rows[first:last], barrier.cols[first:last]] = over


def least_over(labels: np.ndarray, barriers: list[Barrier], objects: Objects) -> float:
    """Returns the least total cost of obstacles whose removal opens every barrier; inf where one of
    them cannot be opened.
    """
    unions = {frozenset[int]()}
    for rows, cols, crossable in barriers:
        columns = np.unique(labels[:, rows[crossable], cols[crossable]], axis=1).T.tolist()
        owners = {frozenset(column) - {-1} for column in columns}
        pieces = [piece for piece in owners if all(objects.destroyable[i] for i in piece)]
        unions = {union | piece for union in unions for piece in pieces}
    return min((fsum(objects.cost[i] for i in union) for union in unions), default=float("inf"))
