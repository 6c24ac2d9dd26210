"""Maps for tests, free [H, W]: noise, mazes, snakes, cities; and batches of unequal ones, each
with a start.
"""

import pathlib

import numpy as np


def noise(rng: np.random.Generator, height: int, width: int, density: float) -> np.ndarray:
    return rng.random((height, width)) >= density


def maze(rng: np.random.Generator, height: int, width: int, corridor: int = 1) -> np.ndarray:
    """A depth-first maze; corridors and walls are `corridor` cells wide."""
    rows, cols = max(3, height // corridor), max(3, width // corridor)
    free = np.zeros((rows, cols), bool)
    free[1, 1] = True
    stack = [(1, 1)]
    while stack:
        r, c = stack[-1]
        steps = [
            (a, b)
            for a, b in ((-2, 0), (2, 0), (0, -2), (0, 2))
            if 0 < r + a < rows - 1 and 0 < c + b < cols - 1
        ]
        steps = [(a, b) for a, b in steps if not free[r + a, c + b]]
        if not steps:
            stack.pop()
            continue
        a, b = steps[rng.integers(len(steps))]
        free[r + a // 2, c + b // 2] = free[r + a, c + b] = True
        stack.append((r + a, c + b))
    wide = np.kron(free, np.ones((corridor, corridor), bool))[:height, :width]
    return np.pad(wide, ((0, height - wide.shape[0]), (0, width - wide.shape[1])))


def snake(height: int, width: int) -> np.ndarray:
    """One corridor through every other row: the longest shortest paths."""
    free = np.zeros((height, width), bool)
    free[::2] = True
    free[1::4, -1] = True
    free[3::4, 0] = True
    return free


def rooms(rng: np.random.Generator, height: int, width: int, size: int = 8) -> np.ndarray:
    """Square rooms, most neighbours joined by a door one cell wide."""
    free = np.ones((height, width), bool)
    free[::size] = free[:, ::size] = False
    for r in range(0, height, size):
        for c in range(0, width, size):
            if rng.random() < 0.8:
                free[r, min(c + 1 + rng.integers(size - 1), width - 1)] = True
            if rng.random() < 0.8:
                free[min(r + 1 + rng.integers(size - 1), height - 1), c] = True
    return free


def city(rng: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Blocks of houses of random size between streets."""
    free = np.ones((height, width), bool)
    for r in range(0, height, 24):
        for c in range(0, width, 24):
            tall, wide = rng.integers(6, 22, 2)
            free[r + 1 : r + 1 + tall, c + 1 : c + 1 + wide] = False
    return free


def any_start(rng: np.random.Generator, free: np.ndarray) -> np.ndarray:
    """A random free cell, (0, 0) where there is none; int32 [2]."""
    cells = np.argwhere(free)
    return (cells[rng.integers(len(cells))] if len(cells) else np.zeros(2)).astype(np.int32)


def random_maps(
    seed: int, count: int, height: int, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Maps of sizes from 1x1 to height x width in one padded batch, of density 0 to 100 %, mazes
    and rooms among them.

    Returns free [count, height, width], starts int32 [count, 2], most of them free, and the sizes
    int32 [count, 2].
    """
    rng = np.random.default_rng(seed)
    free = np.zeros((count, height, width), bool)
    starts, sizes = np.zeros((count, 2), np.int32), np.zeros((count, 2), np.int32)
    for i in range(count):
        tall, wide = (int(rng.integers(1, side + 1)) for side in (height, width))
        kind = i % 8
        if kind == 6 and min(tall, wide) > 4:
            one = maze(rng, tall, wide, int(rng.integers(1, 4)))
        elif kind == 7:
            one = rooms(rng, tall, wide)
        else:
            one = noise(rng, tall, wide, float(rng.choice([0, 0.05, 0.2, 0.35, 0.4, 0.5, 0.8, 1])))
        free[i, :tall, :wide] = one
        starts[i] = any_start(rng, one) if i % 11 else rng.integers(0, [tall, wide])
        sizes[i] = tall, wide
    return free, starts, sizes


def read_map(path: pathlib.Path) -> np.ndarray:
    """A MovingAI `.map` as free [H, W]."""
    lines = path.read_text().split("\n")
    height, width = int(lines[1].split()[1]), int(lines[2].split()[1])
    return np.array(
        [[sign in ".G" for sign in line.rstrip("\r")[:width]] for line in lines[4 : 4 + height]]
    )
