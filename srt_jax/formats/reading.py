"""What files hold, as tasks, polygons and cells: the ending of a file's name decides who reads
it.
"""

import dataclasses
import pathlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from srt_jax.formats import geojson, osm, pictures
from srt_jax.formats.batch import read_batch
from srt_jax.formats.files import read_bytes
from srt_jax.formats.gridmap import GridMap, free_map
from srt_jax.formats.movingai import read_map, read_scen
from srt_jax.formats.namo_svg import read_namo
from srt_jax.formats.notes import Notes
from srt_jax.formats.opposite_cells import opposite_cells
from srt_jax.formats.outlines.tag_rules import read_rules
from srt_jax.formats.ros_map import read_ros_map
from srt_jax.formats.world_json import read_world
from srt_jax.formats.xml_map import read_xml_map
from srt_jax.geometry.place import Place
from srt_jax.geometry.raster import Grid, cover, grid_over, rasterize, square_grid
from srt_jax.geometry.world import World
from srt_jax.task import NamedTask, make_task, unstack
from srt_jax.types import FREE, Cell, Task

SIZE = 500
"""Cells a side of a place where nobody asks for others, as in the paper."""


@dataclasses.dataclass(frozen=True)
class Reading:
    """How files are read; each format takes what concerns it.

    start, goal: cells (row, col), for maps and places, which have none of their own.
    size: cells a side of the largest square in the middle of a place. cell_side: metres; then the
      whole place is covered, and scenes get cells of that side. Not both; without either SIZE
      cells.
    rule: of covering, "touch" or "centre" (`raster.cover`).
    tags: a file of tag rules for places (`tag_rules.read_rules`).
    units: of GeoJSON coordinates. free_pixels, threshold: of pictures. unknown: what unknown cells
      of ROS maps count as.
    block: a way to cut the goal off (`blockage.block`), added to every task as one more obstacle,
      which can be destroyed.
    repair: whether polygons of a .json world that cross themselves are made valid (by shapely)
      instead of refused.
    chooses: whether start and goal are chosen on a .map, too, where nobody names them; other maps
      and places do so anyway.
    """

    start: Cell | None = None
    goal: Cell | None = None
    size: int | None = None
    cell_side: float | None = None
    rule: str = "touch"
    tags: str | None = None
    units: str = "auto"
    free_pixels: str = "light"
    threshold: float = 128.0
    unknown: str = "blocked"
    block: str | None = None
    repair: bool = False
    chooses: bool = False


class Source(NamedTuple):
    """What a file holds.

    place: its polygons, where it has some. world: the same with agent and goal. grid: where the
      cells of its one map lie, in
    metres. map: those cells, where they are what the file holds.
    """

    tasks: list[NamedTask]
    place: Place | None = None
    grid: Grid | None = None
    map: GridMap | None = None
    world: World | None = None


def read_source(path: str, how: Reading, notes: Notes) -> Source:
    """Returns what a file holds, by the ending of its name; errors as for
    `task_files.read_tasks`.
    """
    name = pathlib.Path(path).name.lower()
    ending = max((ending for ending in _READERS if name.endswith(ending)), key=len, default=None)
    if pathlib.Path(path).is_dir():
        raise ValueError(
            f"{path} is a folder: name the files in it, such as {pathlib.Path(path) / '*.map'}"
        )
    if ending is None:
        raise ValueError(
            f"{path}: cannot tell the format from the ending {pathlib.Path(path).suffix!r}: use one"
            f" of {', '.join(_READERS)}"
        )
    if how.size is not None and how.cell_side is not None:
        raise ValueError("--size and --cell-side both say how large a cell is: give one of them")
    if ending == ".json" and _is_geojson(path):
        ending = ".geojson"
    reader, has_ends = _READERS[ending]
    if has_ends and (how.start or how.goal):
        raise ValueError(
            f"{path}: --start and --goal are for maps and places; this file has its own"
        )
    return reader(path, how, notes)


def read_scenario_map(scen_path: str, map_path: str | None) -> np.ndarray:
    """Returns the map, bool [H, W], that every row of a scenario is on; without `map_path` it is
    looked for beside it.

    Raises:
      ValueError: it is not there, or a row is for a map of another size, or starts or ends on no
        free cell.
    """
    rows = read_scen(scen_path)
    if map_path is None:
        map_path = str(pathlib.Path(scen_path).parent / rows[0].map_name) if rows else scen_path
    free = read_map(map_path)
    for number, row in enumerate(rows, start=2):
        if (row.height, row.width) != free.shape:
            raise ValueError(
                f"{scen_path}:{number}: the row is for a map {row.width} wide and {row.height}"
                f" high, but {map_path} is {free.shape[1]} wide and {free.shape[0]} high: give the"
                " map it was made for"
            )
        for what, cell in (("start", row.start), ("goal", row.goal)):
            _require_free(f"{scen_path}:{number}: {what}", free, cell)
    return free


def _read_map(path: str, how: Reading, notes: Notes) -> Source:
    if not how.chooses and (how.start is None or how.goal is None):
        raise ValueError(
            f"{path}: a map has no start and goal: give both, such as --start 3,5 --goal 40,12"
            " (row, column)"
        )
    return _on_cells(path, free_map(read_map(path, notes=notes)), how, notes)


def _read_scen(path: str, how: Reading, notes: Notes) -> Source:
    rows = read_scen(path)
    free = read_scenario_map(path, None)
    if not rows:
        return Source([])
    on_map = make_task(free, rows[0].start, rows[0].goal)
    ends = [(np.array(row.start, np.int32), np.array(row.goal, np.int32)) for row in rows]
    tasks = [on_map.replace(start=start, goal=goal) for start, goal in ends]
    return Source([NamedTask(f"{_stem(path)}-{index}", task) for index, task in enumerate(tasks)])


def _read_batch(path: str, how: Reading, notes: Notes) -> Source:
    batch = read_batch(path)
    return Source([NamedTask(name, task) for name, task in zip(batch.names, unstack(batch.tasks))])


def _read_world(path: str, how: Reading, notes: Notes) -> Source:
    try:
        world = read_world(path, repair=how.repair)
    except ValueError as error:
        raise ValueError(str(error).replace("ask for repair=True", "ask for --repair")) from error
    return _of_world(path, world, how)


def _read_namo(path: str, how: Reading, notes: Notes) -> Source:
    return _of_world(path, read_namo(path, cell_side=how.cell_side, notes=notes), how)


def _read_xml(path: str, how: Reading, notes: Notes) -> Source:
    grid_map = read_xml_map(path, notes=notes)
    if grid_map.start is not None and (how.start or how.goal):
        raise ValueError(
            f"{path}: --start and --goal are for maps and places; this file has its own"
        )
    return _on_cells(
        path,
        grid_map,
        dataclasses.replace(how, start=grid_map.start or how.start, goal=grid_map.goal or how.goal),
        notes,
    )


def _read_ros(path: str, how: Reading, notes: Notes) -> Source:
    return _on_cells(path, read_ros_map(path, unknown_as=how.unknown, notes=notes), how, notes)


def _read_image(path: str, how: Reading, notes: Notes) -> Source:
    return _on_cells(
        path,
        pictures.read_image(path, free=how.free_pixels, threshold=how.threshold, notes=notes),
        how,
        notes,
    )


def _read_osm(path: str, how: Reading, notes: Notes) -> Source:
    rules = None if how.tags is None else read_rules(how.tags)
    return _on_place(path, osm.read_osm(path, rules=rules, notes=notes), how, notes)


def _read_geojson(path: str, how: Reading, notes: Notes) -> Source:
    rules = None if how.tags is None else read_rules(how.tags)
    return _on_place(
        path, geojson.read_geojson(path, units=how.units, rules=rules, notes=notes), how, notes
    )


_READERS: dict[str, tuple[Callable[[str, Reading, Notes], Source], bool]] = {
    ".map": (_read_map, False),
    ".scen": (_read_scen, True),
    ".npz": (_read_batch, True),
    ".json": (_read_world, True),
    ".geojson": (_read_geojson, False),
    **dict.fromkeys(osm.ENDINGS, (_read_osm, False)),
    **dict.fromkeys((".yaml", ".yml"), (_read_ros, False)),
    ".xml": (_read_xml, False),
    ".svg": (_read_namo, True),
    **dict.fromkeys(pictures.ENDINGS, (_read_image, False)),
}
"""The reader of each ending, and whether such files have starts and goals of their own."""

ENDINGS = tuple(_READERS)


def _on_cells(path: str, grid_map: GridMap, how: Reading, notes: Notes) -> Source:
    """Returns the task on a map of cells: its obstacles are the 8-connected pieces of what is not
    free.
    """
    start, goal = _ends(path, grid_map.free, how, notes)
    _require_free(f"{path}: start", grid_map.free, start)
    _require_free(f"{path}: goal", grid_map.free, goal)
    task = make_task(grid_map.free, start, goal)
    try:
        grid = grid_map.grid
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return Source(
        [NamedTask(_stem(path), task)],
        grid=grid,
        map=dataclasses.replace(grid_map, start=start, goal=goal),
    )


def _on_place(path: str, place: Place, how: Reading, notes: Notes) -> Source:
    if how.cell_side is not None:
        grid = grid_over(place.bounds, how.cell_side)
    else:
        grid = square_grid(place.bounds, SIZE if how.size is None else how.size)
    labels = cover(place.obstacles, grid, rule=how.rule)
    notes.tell(f"{grid.height} x {grid.width} cells of {grid.side:.3f} m")
    start, goal = _ends(path, (labels == FREE).all(axis=0), how, notes)
    task = make_task(
        labels,
        start,
        goal,
        destroyable=np.array([obstacle.destroyable for obstacle in place.obstacles], bool),
        removal_cost=np.array([obstacle.removal_cost for obstacle in place.obstacles], np.float64),
    )
    return Source([NamedTask(_stem(path), _with_free_start(path, task))], place, grid)


def _of_world(path: str, world: World, how: Reading) -> Source:
    task = _with_free_start(path, rasterize(world, rule=how.rule))
    grid = grid_over(world.bounds, world.goal_side)
    return Source(
        [NamedTask(_stem(path), task)], Place(world.bounds, world.obstacles), grid, world=world
    )


def _ends(path: str, free: np.ndarray, how: Reading, notes: Notes) -> tuple[Cell, Cell]:
    if (how.start is None) != (how.goal is None):
        raise ValueError(
            f"{path}: of --start and --goal one is missing: give both, or none and they are chosen"
        )
    if how.start is not None and how.goal is not None:
        return how.start, how.goal
    try:
        start, goal = opposite_cells(free)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    notes.tell(
        f"start {start[0]},{start[1]} and goal {goal[0]},{goal[1]} chosen, on opposite sides of the"
        " largest free region"
    )
    return start, goal


def _require_free(what: str, free: np.ndarray, cell: Cell) -> None:
    height, width = free.shape
    if not (0 <= cell[0] < height and 0 <= cell[1] < width):
        raise ValueError(
            f"{what} {cell} lies outside the map: rows are 0 to {height - 1}, columns 0 to"
            f" {width - 1}"
        )
    if not free[cell]:
        raise ValueError(
            f"{what} {cell} is on a wall: choose a free cell, or give the objects in a .json or"
            " .npz file, where a goal may lie inside one that can be destroyed"
        )


def _with_free_start(path: str, task: Task) -> Task:
    row, col = task.start.tolist()
    owners = task.labels[:, row, col]
    if (owners != FREE).any():
        raise ValueError(
            f"{path}: the agent's cell ({row}, {col}) is covered by obstacle {int(owners.max())}:"
            " move the agent elsewhere"
        )
    return task


def _is_geojson(path: str) -> bool:
    """Whether a .json file looks like GeoJSON: the first "type" in it is one of GeoJSON's."""
    head = read_bytes(path, "world")[:4096].decode("utf-8", errors="replace")
    return (
        any(f'"type":"{kind}"' in "".join(head.split()) for kind in geojson.TYPES)
        and "srt-jax world" not in head
    )


def _stem(path: str) -> str:
    name = pathlib.Path(path).name
    ending = max((ending for ending in _READERS if name.lower().endswith(ending)), key=len)
    return name[: -len(ending)].removesuffix(".osm")
