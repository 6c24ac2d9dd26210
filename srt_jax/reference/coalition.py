"""What a coalition can reach, and its least removal by trying every set of obstacles: slow and
obvious, exact for overlaps, obstacles in parts, corner contacts, any costs.

Cells are the bits of one long binary number, with two blocked bits at the end of each row, so that
a shift never wraps round.
"""

from itertools import combinations
from math import fsum
from typing import NamedTuple

import numpy as np

MAX_DESTROYABLE = 16
"""Twice as many sets with every obstacle more: beyond this it takes minutes."""


class Reach(NamedTuple):
    """What the agents can do when all that can be destroyed is.

    reached: bool [A, H, W], the cells that each agent reaches, all False where its start is
      blocked.
    destroys: bool [A, M], what each agent is able to destroy and stands beside at some time.
    firm: bool [M], what no agent ever destroys.
    """

    reached: np.ndarray
    destroys: np.ndarray
    firm: np.ndarray


class Removal(NamedTuple):
    """The least removal.

    cost: 0 where nothing has to be destroyed, inf where no set suffices.
    sets: every set of obstacles of that cost that suffices, ascending ids, in order.
    """

    cost: float
    sets: list[tuple[int, ...]]


class _Grid:
    """The layers of one map as binary numbers."""

    def __init__(self, labels: np.ndarray, num_obstacles: int) -> None:
        layers = np.asarray(labels).reshape(-1, *np.shape(labels)[-2:])
        self.height, self.width = layers.shape[1:]
        self.stride = self.width + 2
        self.free = self.number((layers == -1).all(axis=0))
        # the cells that each obstacle covers in each layer, and those that it leaves open
        self.layers = [
            ([self.number(layer == i) for i in range(num_obstacles)], self.number(layer == -1))
            for layer in layers
        ]
        self.beside = [
            self.around(self.number((layers == i).any(axis=0))) for i in range(num_obstacles)
        ]

    def number(self, mask: np.ndarray) -> int:
        rows = ["".join("1" if cell else "0" for cell in row) + "00" for row in mask.tolist()]
        return int("".join(rows)[::-1] or "0", 2)

    def around(self, cells: int) -> int:
        """The cells and their eight neighbours."""
        wide = cells | cells << 1 | cells >> 1
        return wide | wide << self.stride | wide >> self.stride

    def opened(self, gone: tuple[int, ...]) -> int:
        whole = -1
        for covered, free in self.layers:
            for obstacle in gone:
                free |= covered[obstacle]
            whole &= free
        return whole

    def flood(self, cell: int, is_open: int) -> int:
        reached, before = cell & is_open, 0
        while reached != before:
            before = reached
            near = reached << 1 | reached >> 1 | reached << self.stride | reached >> self.stride
            reached |= near & is_open
        return reached

    def bit(self, cell: tuple[int, int]) -> int:
        row, col = int(cell[0]), int(cell[1])
        is_inside = 0 <= row < self.height and 0 <= col < self.width
        return 1 << row * self.stride + col if is_inside else 0

    def mask(self, cells: int) -> np.ndarray:
        bits = np.array([c == "1" for c in f"{cells:b}"[::-1]], bool)
        bits = np.pad(bits, (0, self.height * self.stride - len(bits)))
        return bits.reshape(self.height, self.stride)[:, : self.width]


def coalition_reach(
    labels: np.ndarray, able: np.ndarray, start: np.ndarray, allowed: np.ndarray | None = None
) -> Reach:
    """Returns what the agents reach together: everything that an able agent stands beside is
    destroyed, until nothing changes.

    Args:
      labels: int32 [L, H, W] or [H, W], ids, negative where free; -2 can never be opened.
      able: bool [A, M]. start: int [A, 2]; an agent on an obstacle or outside the map does nothing.
      allowed: bool [M], what may be destroyed; by default everything.
    """
    grid = _Grid(labels, able.shape[1])
    may = able if allowed is None else able & np.asarray(allowed)
    floods, destroys = _fixpoint(grid, may, start)
    firm = np.logical_not(np.any(destroys, axis=0, keepdims=True))[0]
    return Reach(np.stack([grid.mask(cells) for cells in floods]), destroys, firm)


def coalition_removal(
    labels: np.ndarray,
    able: np.ndarray,
    removal_cost: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
) -> Removal:
    """Returns the least total cost of obstacles after which every agent with a goal reaches it.

    Args:
      labels, able, start: as in `coalition_reach`. removal_cost: float [M], positive.
      goal: int [A, 2]; (-1, -1) for an agent without a goal.

    Raises:
      ValueError: more than MAX_DESTROYABLE obstacles can be destroyed.
    """
    ids = np.flatnonzero(able.any(axis=0)).tolist()
    if len(ids) > MAX_DESTROYABLE:
        raise ValueError(
            f"{len(ids)} obstacles are destroyable, brute force takes at most {MAX_DESTROYABLE}"
        )
    grid, costs = _Grid(labels, able.shape[1]), np.asarray(removal_cost, np.float64)
    sets = (chosen for number in range(len(ids) + 1) for chosen in combinations(ids, number))
    least, least_cost = [], float("inf")
    for cost, chosen in sorted((fsum(costs[list(chosen)]), chosen) for chosen in sets):
        if cost > least_cost:
            break
        allowed = np.isin(np.arange(able.shape[1]), chosen)
        floods, destroys = _fixpoint(grid, able & allowed, start)
        is_done = destroys[:, list(chosen)].any(axis=0).all()
        for cells, end in zip(floods, np.asarray(goal).tolist()):
            is_done &= end == [-1, -1] or bool(cells & grid.bit(tuple(end)))
        if is_done:
            least, least_cost = [*least, chosen], cost
    return Removal(least_cost, least)


def _fixpoint(grid: _Grid, able: np.ndarray, start: np.ndarray) -> tuple[list[int], np.ndarray]:
    """The cells that each agent floods, and what each is able to destroy beside them."""
    cells = [grid.bit(tuple(cell)) & grid.free for cell in np.asarray(start).tolist()]
    gone: tuple[int, ...] = ()
    while True:
        is_open = grid.opened(gone)
        cells = [grid.flood(cell, is_open) for cell in cells]
        meets = np.array([[bool(cell & beside) for beside in grid.beside] for cell in cells])
        destroys = able & meets.reshape(able.shape)
        now_gone = tuple(np.flatnonzero(destroys.any(axis=0)).tolist())
        if now_gone == gone:
            return cells, destroys
        gone = now_gone
