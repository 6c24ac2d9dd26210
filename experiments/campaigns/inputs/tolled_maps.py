"""Random labelled maps on which it may be worth breaking through: convex obstacles apart from each
other, concave ones, and some that overlap or lie in pieces.
"""

import numpy as np

from experiments.campaigns.inputs.labelled_maps import connected, scattered, task_on
from srt_jax import Task

TOLLS = (0.0, 0.3, 1.0, 2.0, 5.0, 20.0)


def rectangles(rng, height, width, num_obstacles):
    """labels int32 [H, W]: rectangles that do not overlap; some touch."""
    labels = np.full((height, width), -1, np.int32)
    number = 0
    for _ in range(8 * num_obstacles):
        row, col = rng.integers(height), rng.integers(width)
        tall, wide = rng.integers(1, max(2, height // 2)), rng.integers(1, max(2, width // 2))
        if rng.random() < 0.5:  # a thin one
            tall, wide = (1, 2 * wide) if rng.random() < 0.5 else (2 * tall, 1)
        part = labels[row : row + tall, col : col + wide]
        if number < num_obstacles and (part < 0).all():
            part[:] = number
            number += 1
    return labels


def combs(rng, height, width, num_obstacles):
    """labels int32 [H, W]: U shapes, combs and frames in all directions, each from bars of one
    obstacle; later ones cut earlier ones.
    """
    labels = np.full((height, width), -1, np.int32)
    for number in range(num_obstacles):
        row, col = rng.integers(height), rng.integers(width)
        tall, wide = rng.integers(3, max(4, height)), rng.integers(3, max(4, width))
        shape = np.zeros((tall, wide), bool)
        shape[0] = True
        shape[:, :: rng.integers(2, 5)] = True
        if rng.random() < 0.3:
            shape[-1] = True
        shape = np.rot90(shape, rng.integers(4))
        part = labels[row : row + shape.shape[0], col : col + shape.shape[1]]
        part[shape[: part.shape[0], : part.shape[1]]] = number
    return labels


def mixed(rng, height, width, num_obstacles):
    """labels int32 [H, W]: rectangles, and behind them combs."""
    front = rectangles(rng, height, width, max(1, num_obstacles // 2))
    behind = combs(rng, height, width, max(1, num_obstacles - num_obstacles // 2))
    behind = np.where(behind >= 0, behind + front.max() + 1, -1).astype(np.int32)
    return np.where(front >= 0, front, behind)


KINDS = {
    "rectangles": rectangles,
    "connected": connected,
    "combs": combs,
    "scattered": scattered,
    "mixed": mixed,
}


def tolled_tasks(
    seed, count: int, kind: str, *, max_side: int = 12, max_obstacles: int = 7
) -> tuple[list[Task], np.ndarray]:
    """Returns tasks of one kind, and a toll for each, float32 [count]."""
    rng = np.random.default_rng(seed)
    tasks = []
    for _ in range(count):
        height, width = rng.integers(2, max_side + 1, 2)
        labels = KINDS[kind](rng, height, width, int(rng.integers(1, max_obstacles + 1)))
        number = max(1, int(labels.max()) + 1)
        tasks.append(task_on(rng, labels, can_destroy=0.9, num_obstacles=number))
    return tasks, rng.choice(TOLLS, count).astype(np.float32)
