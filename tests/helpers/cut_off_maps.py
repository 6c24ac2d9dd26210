"""Random maps with a start and a goal, the blockers of the paper drawn by hand, and what a search
on them must satisfy.
"""

from itertools import pairwise

import numpy as np


def random_maps(count: int, seed: int, *, largest: int = 24):
    """Yields (free, start, goal) of any size and density; the start is free, the goal need not
    be.
    """
    rng = np.random.default_rng(seed)
    while count:
        height, width = rng.integers(1, largest + 1, 2)
        free = rng.random((height, width)) >= rng.choice([0, 0.1, 0.2, 0.35, 0.5, 0.7])
        start, goal = (tuple(rng.integers(0, (height, width)).tolist()) for _ in range(2))
        if free[start]:
            count -= 1
            yield free, start, goal


def walks(free, path, start, goal):
    """Asserts that a path is legal, move by move."""
    assert path[0] == start and path[-1] == goal and all(free[cell] for cell in path)
    for (a, b), (c, d) in pairwise(path):
        assert max(abs(a - c), abs(b - d)) == 1 and free[a, d] and free[c, b]


def ring(side: int):
    free = np.ones((500, 500), bool)
    top, left = 250 - side // 2, 400 - side // 2
    free[top : top + side, left : left + side] = False
    free[top + 1 : top + side - 1, left + 1 : left + side - 1] = True
    return free, (250, 20), (250, 400)


def half():
    free = np.ones((500, 500), bool)
    free[:, 250] = False
    return free, (250, 20), (250, 450)


def quarter():
    free = np.ones((500, 500), bool)
    free[250:, 250] = free[250, 250:] = False
    return free, (20, 20), (450, 450)


def seed_of(closed, goal):
    """The cell of CLOSED with the least octile distance to the goal, the first in row order."""
    cells = np.argwhere(closed)
    apart = abs(cells - goal)
    return tuple(cells[(apart.max(axis=1) + (2**0.5 - 1) * apart.min(axis=1)).argmin()].tolist())
