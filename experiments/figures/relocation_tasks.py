"""The worlds on which ways of choosing what to destroy are compared: cities, rooms, fences, rings,
NAMO scenes.
"""

import contextlib
import os
import pathlib
from collections.abc import Callable

import numpy as np

from srt_jax import Task, make_task
from srt_jax.data import helsinki
from srt_jax.formats import reading, task_files
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.instances import maps
from srt_jax.instances.generate import generate
from srt_jax.instances.paper_blockers import block, pick_start_goal
from srt_jax.types import FREE

SHARED = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data")) / "namo"
BUILDING, WALL = 1.0, 3.0
"""Removal costs in cities."""


def kinds(count: int, size: int, *, seed: int, log: Callable[[str], None]) -> dict[str, list[Task]]:
    """Returns `count` tasks of each kind; NAMO has as many as there are scenes, and is left out
    where they cannot be read.
    """
    found = {
        "cities": _cities(count, size, seed),
        "Helsinki": _helsinki(count, size, seed),
    }
    for kind in ("rooms", "fences", "rings"):
        found[kind] = [task for _, task, _ in generate(kind, count=count, size=size, seed=seed)]
    scenes = _namo(log)
    return found | ({"NAMO": scenes} if scenes else {})


def _cities(count: int, size: int, seed: int) -> list[Task]:
    """Made-up cities."""
    tasks = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        tasks.append(
            _add_walls(maps.city_buildings(size, size, seed=int(rng.integers(2**31)))[None], rng)
        )
    return tasks


def _helsinki(count: int, size: int, seed: int) -> list[Task]:
    """Windows of the shipped city, cells of 3 to 6 m; a window without room for the task is drawn
    again.
    """
    place, tasks = helsinki(), []
    x_min, y_min, x_max, y_max = place.bounds
    rng = np.random.default_rng([seed, count])
    for _ in range(20 * count):
        side = min(size * rng.uniform(3, 6), x_max - x_min, y_max - y_min)
        x, y = rng.uniform(x_min, x_max - side), rng.uniform(y_min, y_max - side)
        with contextlib.suppress(ValueError):
            tasks.append(
                _add_walls(
                    cover(place.obstacles, square_grid((x, y, x + side, y + side), size)), rng
                )
            )
        if len(tasks) == count:
            return tasks
    raise ValueError(
        f"only {len(tasks)} windows of Helsinki have room for a task: choose a larger --size than"
        f" {size}"
    )


def _add_walls(labels: np.ndarray, rng: np.random.Generator) -> Task:
    """A city cut by a wall from edge to edge that only fills the gaps between buildings: one may go
    through these.

    The wall and two buildings in three can be destroyed, the wall at the price of three buildings.
    """
    free = (labels == FREE).all(axis=0)
    for _ in range(50):
        try:
            start, goal = pick_start_goal(
                free, apart=3 * min(free.shape) // 5, seed=int(rng.integers(2**31))
            )
            blocked, wall = block(labels, start, goal, str(rng.choice(["half", "quarter"])))
        except ValueError:
            continue
        filled = np.where(
            free, np.where((blocked == wall).any(axis=0), wall, FREE), labels[0]
        ).astype(np.int32)
        layers = np.concatenate([filled[None], labels[1:]])
        cost = np.full(wall + 1, BUILDING, np.float32)
        cost[wall] = WALL
        flags = np.append(rng.random(wall) < 2 / 3, True)
        return make_task(layers, start, goal, destroyable=flags, removal_cost=cost)
    raise ValueError("no room for start, goal and wall")


def _namo(log: Callable[[str], None]) -> list[Task]:
    paths = sorted(SHARED.glob("*.svg"))
    if not paths or ".svg" not in reading.ENDINGS:
        log(
            "NAMO is left out:"
            f" {'this version reads no .svg scenes' if paths else f'no scenes in {SHARED}'}"
        )
        return []
    tasks = []
    for path in paths:
        try:
            tasks += [named.task for named in task_files.read_tasks(str(path))]
        except ValueError as error:
            log(f"{path.name} is left out: {error}")
    return tasks
