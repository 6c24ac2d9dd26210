"""Small tasks that are hard to add up: costs of any ratio, near ties and exact ones, overlaps,
pieces, several layers.
"""

from collections.abc import Callable

import numpy as np

from experiments.campaigns.inputs.labelled_maps import scattered, walled
from srt_jax import Task, make_task

MOST_OBSTACLES = 10
_SIDE = 32


def random_task(rng: np.random.Generator) -> Task:
    """Returns a task of at most 32 x 32 cells and MOST_OBSTACLES obstacles; in most the goal is
    cut off.
    """
    height, width = rng.integers(3, _SIDE + 1, 2)
    number = int(rng.integers(1, MOST_OBSTACLES + 1))
    make = _MAPS[int(rng.integers(len(_MAPS)))]
    labels = make(rng, height, width, number)
    free = np.argwhere((labels < 0).all(axis=0))
    ends = [
        free[rng.integers(len(free))] if len(free) else rng.integers(0, (height, width))
        for _ in range(2)
    ]
    if make in (_columns, _cut_up) and rng.random() < 0.9:  # from one side to the other
        ends = [free[free[:, 1].argmin()], free[free[:, 1].argmax()]] if len(free) else ends
    if rng.random() < 0.05:
        ends[int(rng.integers(2))] = rng.integers(0, (height, width))
    known = int(labels.max(initial=0)) + 1
    flags = rng.random(known) < (1.0 if rng.random() < 0.6 else 0.8)
    return make_task(labels, *ends, destroyable=flags, removal_cost=random_costs(rng, known))


def random_costs(rng: np.random.Generator, number: int) -> np.ndarray:
    """Returns costs float32 [number], all positive and finite."""
    kind = rng.integers(6)
    if kind == 0:  # over ten orders of magnitude
        costs = 10.0 ** rng.uniform(-5, 5, number)
    elif kind == 1:  # what float32 sums lose
        costs = rng.choice([1e8, 1.0, 16777216.0, 1e4, 1e-4, 1e-8, 0.1, 0.2, 0.3], number)
    elif kind == 2:  # near ties
        costs = 2.0 ** rng.integers(0, 3, number) * (1 + rng.integers(-2, 3, number) * 2.0**-23)
    elif kind == 3:  # sums of one another
        costs = np.cumsum(rng.integers(1, 4, number)) * rng.choice([1.0, 0.1, 1e-6, 1e9])
    elif kind == 4:  # from the least float32 to the greatest
        costs = 10.0 ** rng.uniform(-44.8, 38.5, number)
    else:
        costs = rng.integers(1, 6, number) / 2
    return np.clip(rng.permutation(costs), 1.5e-45, np.finfo(np.float32).max).astype(np.float32)


def _noise(rng: np.random.Generator, height: int, width: int, number: int) -> np.ndarray:
    """Each blocked cell belongs to any obstacle, in some maps to two."""
    layers = int(rng.integers(1, 3))
    labels = rng.integers(0, number, (layers, height, width))
    return np.where(rng.random(labels.shape) < rng.uniform(0.2, 0.7) / layers, labels, -1)


def _nearest(rng: np.random.Generator, height: int, width: int, number: int) -> np.ndarray:
    """Every cell belongs to the nearest of some centres, unless it lies beyond a distance:
    pieces that touch.
    """
    centres = rng.uniform(0, (height, width), (number, 2))
    cells = np.moveaxis(np.indices((height, width)), 0, -1)
    apart = np.abs(cells[:, :, None] - centres).sum(axis=-1)
    return np.where(apart.min(axis=-1) < rng.uniform(1, 8), apart.argmin(axis=-1), -1)[None]


def _columns(rng: np.random.Generator, height: int, width: int, number: int) -> np.ndarray:
    """Walls from edge to edge one after the other, some obstacles in several: sums of many
    costs.
    """
    labels = np.full((1, height, width), -1)
    columns = np.arange(1, width - 1, 2)
    for place, column in enumerate(rng.permutation(columns)[: number + 2]):
        labels[0, :, column] = place if place < number else rng.integers(number)
    return labels


def _cut_up(rng: np.random.Generator, height: int, width: int, number: int) -> np.ndarray:
    """Walls in stretches of several obstacles, in two or three layers."""
    labels = np.full((int(rng.integers(2, 4)), height, width), -1)
    for column in rng.permutation(np.arange(1, width - 1, 2))[: rng.integers(1, 5)]:
        for layer in range(len(labels)):
            cut = int(rng.integers(0, height + 1))
            for rows in (slice(0, cut), slice(cut, height)):
                if layer == 0 or rng.random() < 0.5:
                    labels[layer, rows, column] = rng.integers(number)
    return labels


def _across(rng: np.random.Generator, height: int, width: int, number: int) -> np.ndarray:
    return walled(rng, height, width, number, num_walls=int(rng.integers(1, 5)))


_MAPS: tuple[Callable[..., np.ndarray], ...] = (
    _noise,
    _nearest,
    _columns,
    _cut_up,
    _across,
    scattered,
)
