"""Tasks from any file that `srt-jax solve` reads; the ending of its name decides the format."""

import pathlib
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from srt_jax.formats.batch import read_batch
from srt_jax.formats.movingai import read_map, read_scen
from srt_jax.formats.world_json import read_world
from srt_jax.raster import rasterize
from srt_jax.task import make_task, unstack
from srt_jax.types import FREE, Task
from srt_jax.world import World

Cell = tuple[int, int]
ENDINGS = (".map", ".scen", ".npz", ".json")


class NamedTask(NamedTuple):
    """A task with the name it goes by in tables, files and pictures."""

    name: str
    task: Task


def read_tasks(
    path: str,
    *,
    start: Cell | None = None,
    goal: Cell | None = None,
    destroyable: str | None = None,
    repair: bool = False,
) -> list[NamedTask]:
    """Returns the tasks in a file: one of a .map (with `start` and `goal`) or .json world, each of a .scen or .npz.

    Args:
      destroyable: "all", "none" or ids such as "3,7"; None keeps what the file says (maps: all).
      repair: whether polygons of a .json world that cross themselves are made valid (by shapely) instead of refused.

    Raises:
      ValueError: the file cannot be read, or start or goal cannot be where they are.
    """
    ending = pathlib.Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"{path}: cannot tell the format from the ending {ending!r}: use one of {', '.join(ENDINGS)}")
    if ending != ".map" and (start or goal):
        raise ValueError(f"{path}: --start and --goal are for .map files; this file has its own")
    stem = pathlib.Path(path).stem
    if ending == ".map":
        tasks = [NamedTask(stem, _on_map(path, start, goal))]
    elif ending == ".scen":
        tasks = _of_scenario(path)
    elif ending == ".npz":
        batch = read_batch(path)
        tasks = [NamedTask(name, task) for name, task in zip(batch.names, unstack(batch.tasks))]
    else:
        tasks = [NamedTask(stem, _with_free_start(path, rasterize(_world(path, repair))))]
    return [named._replace(task=_with_flags(path, named.task, destroyable)) for named in tasks]


def read_scenario_map(scen_path: str, map_path: str | None) -> np.ndarray:
    """Returns the map, bool [H, W], that every row of a scenario is on; without `map_path` it is looked for beside it.

    Raises:
      ValueError: it is not there, or a row is for a map of another size, or starts or ends on no free cell.
    """
    rows = read_scen(scen_path)
    if map_path is None:
        map_path = str(pathlib.Path(scen_path).parent / rows[0].map_name) if rows else scen_path
    free = read_map(map_path)
    for number, row in enumerate(rows, start=2):
        if (row.height, row.width) != free.shape:
            raise ValueError(
                f"{scen_path}:{number}: the row is for a map {row.width} wide and {row.height} high, but {map_path} is "
                f"{free.shape[1]} wide and {free.shape[0]} high: give the map it was made for"
            )
        for what, cell in (("start", row.start), ("goal", row.goal)):
            _require_free(f"{scen_path}:{number}: {what}", free, cell)
    return free


def _on_map(path: str, start: Cell | None, goal: Cell | None) -> Task:
    if start is None or goal is None:
        raise ValueError(f"{path}: a map has no start and goal: give both, such as --start 3,5 --goal 40,12 (row, column)")
    free = read_map(path)
    _require_free(f"{path}: start", free, start)
    _require_free(f"{path}: goal", free, goal)
    return make_task(free, start, goal)


def _of_scenario(path: str) -> list[NamedTask]:
    rows = read_scen(path)
    free = read_scenario_map(path, None)
    stem = pathlib.Path(path).stem
    if not rows:
        return []
    on_map = make_task(free, rows[0].start, rows[0].goal)
    ends = [(np.array(row.start, np.int32), np.array(row.goal, np.int32)) for row in rows]
    return [NamedTask(f"{stem}-{i}", on_map.replace(start=start, goal=goal)) for i, (start, goal) in enumerate(ends)]


def _require_free(what: str, free: np.ndarray, cell: Cell) -> None:
    height, width = free.shape
    if not (0 <= cell[0] < height and 0 <= cell[1] < width):
        raise ValueError(f"{what} {cell} lies outside the map: rows are 0 to {height - 1}, columns 0 to {width - 1}")
    if not free[cell]:
        raise ValueError(
            f"{what} {cell} is on a wall: choose a free cell, or give the objects in a .json or .npz file, where a goal may "
            "lie inside one that can be destroyed"
        )


def _world(path: str, repair: bool) -> World:
    try:
        return read_world(path, repair=repair)
    except ValueError as error:
        raise ValueError(str(error).replace("ask for repair=True", "ask for --repair")) from error


def _with_free_start(path: str, task: Task) -> Task:
    row, col = task.start.tolist()
    owners = task.labels[:, row, col]
    if (owners != FREE).any():
        raise ValueError(
            f"{path}: the agent's cell ({row}, {col}) is covered by obstacle {int(owners.max())}: move the agent elsewhere"
        )
    return task


def _with_flags(path: str, task: Task, destroyable: str | None) -> Task:
    if destroyable is None:
        return task
    num_obstacles = len(task.destroyable)
    ids = {"all": range(num_obstacles), "none": ()}.get(destroyable)
    wanted = _ids(destroyable) if ids is None else ids
    wrong = [i for i in wanted if not 0 <= i < num_obstacles]
    if wrong:
        raise ValueError(f"{path}: --destroyable names obstacle {wrong[0]}, but the ids there are 0 to {num_obstacles - 1}")
    covers = np.isin(np.arange(num_obstacles), task.labels)
    return task.replace(destroyable=np.isin(np.arange(num_obstacles), list(wanted)) & covers)


def _ids(text: str) -> Collection[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"--destroyable must be all, none or ids such as 3,7, got {text!r}") from None
