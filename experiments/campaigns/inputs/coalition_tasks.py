"""Random tasks of coalitions: small maps with overlaps, obstacles in parts, corner contacts,
blocked starts, goals out of reach.
"""

import numpy as np

from srt_jax.coalition import CoalitionTask, make_coalition


def random_coalition(
    rng: np.random.Generator,
    *,
    max_side: int = 9,
    max_agents: int = 4,
    min_agents: int = 1,
    max_obstacles: int = 8,
    max_layers: int = 2,
) -> CoalitionTask:
    """Returns one random task."""
    height, width = rng.integers(3, max_side + 1, 2)
    num_obstacles = int(rng.integers(1, max_obstacles + 1))
    labels = np.full((int(rng.integers(1, max_layers + 1)), height, width), -1, np.int32)
    for layer in labels:
        covered = rng.random((height, width)) < rng.uniform(0.1, 0.8)
        layer[covered] = rng.integers(0, num_obstacles, covered.sum())
    num_agents = int(rng.integers(min_agents, max_agents + 1))
    able = rng.random((num_agents, num_obstacles)) < rng.uniform(0.1, 0.9)
    able[:, rng.random(num_obstacles) < 0.15] = False
    start = np.stack([rng.integers(0, height, num_agents), rng.integers(0, width, num_agents)], 1)
    if rng.random() < 0.95:  # else some may stand on obstacles
        labels[:, start[:, 0], start[:, 1]] = -1
    goal = [
        None if rng.random() < 0.3 else (int(rng.integers(height)), int(rng.integers(width)))
        for _ in range(num_agents)
    ]
    if (labels < 0).all():
        labels[0, 0, 0] = 0
    costs = rng.integers(1, 10, num_obstacles).astype(np.float32)
    return make_coalition(labels, start, goal, able=able, removal_cost=costs)


def lone_coalition(
    rng: np.random.Generator, *, max_side: int = 9, max_obstacles: int = 8
) -> CoalitionTask:
    """Returns one random task of one agent with a goal, obstacles disjoint and in rectangles."""
    height, width = rng.integers(4, max_side + 1, 2)
    labels = np.full((height, width), -1, np.int32)
    num_obstacles = int(rng.integers(1, max_obstacles + 1))
    for obstacle in range(num_obstacles):
        row, col = int(rng.integers(height)), int(rng.integers(width))
        if rng.random() < 0.5:
            block = labels[row : row + int(rng.integers(1, 3)), : int(rng.integers(1, width + 1))]
        else:
            block = labels[: int(rng.integers(1, height + 1)), col : col + int(rng.integers(1, 3))]
        block[block < 0] = obstacle
    start, goal = ((int(rng.integers(height)), int(rng.integers(width))) for _ in range(2))
    labels[start] = -1
    able = [np.flatnonzero(rng.random(num_obstacles) < 0.8).tolist()]
    labels[labels < 0] = -1
    costs = rng.integers(1, 10, num_obstacles).astype(np.float32)
    return make_coalition(labels, [start], [goal], able=able, removal_cost=costs)
