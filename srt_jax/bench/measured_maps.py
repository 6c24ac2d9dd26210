"""The maps that are measured: streets, noise, rooms, mazes; free [B, H, W] and a start in the
largest part of each.
"""

import os
import pathlib

import numpy as np

from srt_jax.types import Array

KINDS = ("street", "noise 20 %", "noise 35 %", "rooms", "maze 8", "maze 1")


def maps_of(kind: str, size: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns bool [count, size, size] and int32 [count, 2].

    Streets are MovingAI's (folder street/ in the directory that SRT_SHARED_DATA names) where they
    are at hand in this size, else made up.
    """
    maps = np.stack([_one(kind, size, np.random.default_rng(seed), seed) for seed in range(count)])
    return maps, np.stack([_start(free, seed) for seed, free in enumerate(maps)])


def _one(kind: str, size: int, rng: np.random.Generator, which: int) -> np.ndarray:
    if kind == "street":
        folder = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data")) / "street"
        paths = sorted(folder.glob(f"*_{size}.map"))
        return _read(paths[which % len(paths)]) if paths else _town(rng, size)
    if kind.startswith("noise"):
        return rng.random((size, size)) >= int(kind.split()[1]) / 100
    return _rooms(rng, size) if kind == "rooms" else _maze(rng, size, int(kind.split()[1]))


def _read(path: pathlib.Path) -> np.ndarray:
    from srt_jax.formats.movingai import read_map

    return np.asarray(read_map(path))


def _town(rng: np.random.Generator, size: int) -> np.ndarray:
    """Streets on a grid that is turned by a random angle, houses of random size between them."""
    angle, pitch = rng.uniform(0, np.pi / 2), 32
    y, x = np.mgrid[:size, :size]
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    lot = (
        np.floor(u / pitch).astype(int) * 7919 + np.floor(v / pitch).astype(int) * 104_729
    ) % 4096
    wide, deep = rng.integers(12, pitch - 4, 4096)[lot], rng.integers(12, pitch - 4, 4096)[lot]
    return ~((u % pitch < wide) & (v % pitch < deep))


def _rooms(rng: np.random.Generator, size: int, side: int = 16) -> np.ndarray:
    free = np.ones((size, size), bool)
    free[::side] = free[:, ::side] = False
    for row in range(0, size, side):
        for col in range(0, size, side):
            if rng.random() < 0.8:
                free[row, min(col + 1 + rng.integers(side - 1), size - 1)] = True
            if rng.random() < 0.8:
                free[min(row + 1 + rng.integers(side - 1), size - 1), col] = True
    return free


def _maze(rng: np.random.Generator, size: int, corridor: int) -> np.ndarray:
    """Depth-first; corridors and walls are `corridor` cells wide."""
    side = size // corridor
    free = np.zeros((side, side), bool)
    free[1, 1] = True
    stack = [(1, 1)]
    while stack:
        row, col = stack[-1]
        steps = [
            (r, c)
            for r, c in ((-2, 0), (2, 0), (0, -2), (0, 2))
            if 0 < row + r < side - 1 and 0 < col + c < side - 1
        ]
        steps = [(r, c) for r, c in steps if not free[row + r, col + c]]
        if not steps:
            stack.pop()
            continue
        r, c = steps[rng.integers(len(steps))]
        free[row + r // 2, col + c // 2] = free[row + r, col + c] = True
        stack.append((row + r, col + c))
    return np.kron(free, np.ones((corridor, corridor), bool))


def _start(free: Array, seed: int) -> np.ndarray:
    """Of a few random free cells the one that reaches most."""
    from srt_jax.paths.reach import reach

    cells = np.argwhere(free)
    few = cells[np.random.default_rng(seed).integers(len(cells), size=8)].astype(np.int32)
    reached = np.asarray(reach(np.broadcast_to(free, (8, *free.shape)), few))
    return few[reached.sum((1, 2)).argmax()]
