"""Random labelled maps: connected obstacles, some that overlap, or lie in pieces. For
tests and campaigns.
"""

from itertools import pairwise

import numpy as np

from srt_jax import Task, make_task


def connected(rng, height, width, num_obstacles, *, blocked=0.6):
    """labels int32 [H, W]: disjoint obstacles, each connected by sides, from random
    cells on.
    """
    labels = np.full((height, width), -1, np.int32)
    seeds = rng.permutation(height * width)[:num_obstacles]
    labels.flat[seeds] = np.arange(len(seeds))
    for _ in range(4 * height * width):
        if (labels >= 0).mean() >= blocked:
            break
        row, col = rng.integers(height), rng.integers(width)
        near = [
            labels[r, c]
            for r, c in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1))
            if 0 <= r < height and 0 <= c < width
        ]
        owners = [owner for owner in near if owner >= 0]
        if labels[row, col] < 0 and owners:
            labels[row, col] = owners[rng.integers(len(owners))]
    return labels


def scattered(rng, height, width, num_obstacles):
    """labels int32 [2, H, W]: rectangles that overlap, one or two of each obstacle."""
    labels = np.full((2, height, width), -1, np.int32)
    for index in range(num_obstacles):
        for _ in range(rng.integers(1, 3)):
            row, col = rng.integers(height), rng.integers(width)
            tall, wide = (
                rng.integers(1, max(2, height // 2 + 1)),
                rng.integers(1, max(2, width // 2 + 1)),
            )
            part = labels[index % 2, row : row + tall, col : col + wide]
            part[part < 0] = index
    return labels


def walled(rng, height, width, num_obstacles, *, num_walls=6):
    """labels int32 [2, H, W]: walls right across the map, each in segments; every obstacle owns
    several, some lie under two.

    Each wall must be crossed and each obstacle owns pieces of many: which few open all of them is a
    set cover.
    """
    labels = np.full((2, height, width), -1, np.int32)
    for row in np.sort(
        rng.choice(np.arange(1, height - 1, 2), min(num_walls, (height - 1) // 2), replace=False)
    ):
        cuts = [
            0,
            *np.sort(rng.choice(np.arange(1, width), min(4, width - 1), replace=False)),
            width,
        ]
        for first, last in pairwise(cuts):
            labels[0, row, first:last] = rng.integers(num_obstacles)
            if rng.random() < 0.7:
                labels[1, row, first:last] = rng.integers(num_obstacles)
    labels[1][labels[1] == labels[0]] = -1
    return labels


def task_on(rng, labels, *, unit_costs=False, can_destroy=0.75, num_obstacles=None) -> Task:
    """A task with random ends (mostly free), flags and costs."""
    layers = labels.reshape(-1, *labels.shape[-2:])
    free = np.argwhere((layers < 0).all(axis=0))
    anywhere = np.argwhere(np.ones(layers.shape[1:], bool))
    start, goal = ((free if len(free) and rng.random() < 0.9 else anywhere) for _ in range(2))
    num_obstacles = int(layers.max()) + 1 if num_obstacles is None else num_obstacles
    costs = np.ones(num_obstacles) if unit_costs else rng.integers(1, 6, num_obstacles) / 2
    return make_task(
        labels,
        start[rng.integers(len(start))],
        goal[rng.integers(len(goal))],
        destroyable=rng.random(num_obstacles) < can_destroy,
        removal_cost=costs.astype(np.float32),
    )


def random_tasks(seed, count, *, overlap, max_side=16, max_obstacles=7, **options) -> list[Task]:
    rng = np.random.default_rng(seed)
    tasks = []
    for _ in range(count):
        height, width, num = (
            rng.integers(1, max_side + 1),
            rng.integers(1, max_side + 1),
            rng.integers(1, max_obstacles + 1),
        )
        tasks.append(
            task_on(rng, (scattered if overlap else connected)(rng, height, width, num), **options)
        )
    return tasks


def walled_tasks(seed, count, *, side=24, num_obstacles=16, num_walls=6) -> list[Task]:
    """Tasks across walls, from the first row to the last."""
    rng = np.random.default_rng(seed)
    tasks = []
    for _ in range(count):
        labels = walled(rng, side, side, num_obstacles, num_walls=num_walls)
        task = task_on(rng, labels, can_destroy=0.9, num_obstacles=num_obstacles)
        ends = (np.array([row, rng.integers(side)], np.int32) for row in (0, side - 1))
        tasks.append(task.replace(start=next(ends), goal=next(ends)))
    return tasks
