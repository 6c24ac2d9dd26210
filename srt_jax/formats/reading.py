"""What files hold, as tasks, polygons and cells: the ending of a file's name decides who reads
it.
"""

import dataclasses
import os
import pathlib
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from srt_jax.formats import geojson, osm, pictures
from srt_jax.formats.batch import read_batch
from srt_jax.formats.files import plain_reason, read_bytes, require_regular
from srt_jax.formats.gridmap import GridMap, free_map
from srt_jax.formats.movingai import ScenRow, read_map, read_scen, scaled
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

Item = TypeVar("Item")
_FOREIGN = {
    '"elements":[': (
        "Overpass's own JSON, which is not read: ask it for [out:xml], or make GeoJSON of it by"
        " osmtogeojson"
    ),
    '"type":"Topology"': "TopoJSON, which is not read: make GeoJSON of it by topo2geo or ogr2ogr",
    '"esriGeometry': (
        "ArcGIS's own JSON, which is not read: ask the server for f=geojson, or make GeoJSON of it"
        " by ogr2ogr"
    ),
}
"""JSON of other programs, by a text near its beginning, with the remedy."""
SIZE = 500
"""Cells a side of a place where no number is given, as in the paper."""


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
    limit, rows: of the rows of a scenario or the tasks of a batch, the first so many; those from
      rows[0] on, before rows[1], counted from 0 as in the names of the tasks (None: from the first,
      to the last).
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
    limit: int | None = None
    rows: tuple[int | None, int | None] | None = None

    def chosen(self, path: str, items: Sequence[Item]) -> list[tuple[int, Item]]:
        """Returns the rows that are to be read, each with its number; ValueError where none is."""
        numbered = list(enumerate(items))
        if self.rows is not None:
            numbered = numbered[slice(*self.rows)]
            if not numbered and len(items):
                first, last = ("" if end is None else str(end) for end in self.rows)
                raise ValueError(
                    f"{path}: --rows {first}:{last} holds no row: they are numbered 0 to"
                    f" {len(items) - 1}"
                )
        return numbered[: self.limit]


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
    require_file(path)
    name = pathlib.Path(path).name.lower()
    ending = max((ending for ending in _READERS if name.endswith(ending)), key=len, default=None)
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
    try:
        return reader(path, how, notes)
    except RecursionError as error:
        raise ValueError(f"{path}: nested too deeply to be read: write it flatter") from error
    except OverflowError as error:
        raise ValueError(f"{path}: a number in it is too large ({plain_reason(error)})") from error


def require_file(path: str) -> None:
    """Raises ValueError where there is no such file, or it is a folder, a device or a pipe;
    opens nothing.
    """
    if os.path.isdir(path):
        raise ValueError(
            f"{path} is a folder: name the files in it, such as {pathlib.Path(path) / '*.map'}"
        )
    require_regular(path, what="map, place or task")


def scenario_maps(
    path: str, rows: Sequence[tuple[int, ScenRow]], map_path: str | None, notes: Notes
) -> list[np.ndarray]:
    """Returns for each row of a scenario the map, bool [H, W], that it is on; rows on one map share
    it.

    A map of another size than its row names is scaled to that, as the format has it, where the
    sides keep their ratio; where they do not it is another map.

    Args:
      rows: with their numbers, counted from 0.
      map_path: of the map, where it does not lie beside the scenario; where rows name several maps,
        for those rows that name this one.

    Raises:
      ValueError: a map is not there, or a row starts or ends on no free cell.
    """
    folder = pathlib.Path(path).parent
    is_single = len({row.map_name for _, row in rows}) == 1
    maps: dict[tuple[str, int, int], np.ndarray] = {}
    for number, row in rows:
        key = (row.map_name, row.height, row.width)
        if key not in maps:
            is_given = map_path is not None and (
                is_single or pathlib.Path(map_path).name == row.map_name
            )
            where = str(map_path) if is_given else str(folder / row.map_name)
            if not os.path.isfile(where):  # False for names that no file can have
                raise ValueError(
                    f"{path}:{number + 2}: the row is on the map {row.map_name}, and there is no"
                    f" such file as {where}: put the map beside the scenario"
                )
            free = read_map(where, notes=notes)
            _require_scale(f"{path}:{number + 2}", row, where, free)
            maps[key] = scaled(free, row.height, row.width)
            if maps[key].shape != free.shape:
                notes.tell(
                    f"{pathlib.Path(where).name}, {free.shape[1]} wide and {free.shape[0]} high, is"
                    f" scaled to {row.width} x {row.height} cells, as the rows have it"
                )
        for what, cell in (("start", row.start), ("goal", row.goal)):
            _require_free(f"{path}:{number + 2}: {what}", maps[key], cell)
    return [maps[row.map_name, row.height, row.width] for _, row in rows]


def _require_scale(where: str, row: ScenRow, map_path: str, free: np.ndarray) -> None:
    """Raises ValueError where a map cannot be the one that a row was made for, at whatever
    scale.
    """
    height, width = free.shape
    away = (
        abs(row.height - height * row.width / width),
        abs(row.width - width * row.height / height),
    )
    if min(away) > 0.5:  # a side is rounded to whole cells
        raise ValueError(
            f"{where}: the row is for a map {row.width} wide and {row.height} high, but {map_path}"
            f" is {width} wide and {height} high, and no scale makes them equal: give the map it"
            " was made for"
        )


def _read_map(path: str, how: Reading, notes: Notes) -> Source:
    if not how.chooses and (how.start is None or how.goal is None):
        raise ValueError(
            f"{path}: a map has no start and goal: give both, such as --start 3,5 --goal 40,12"
            " (row, column)"
        )
    return _on_cells(path, free_map(read_map(path, notes=notes)), how, notes)


def _read_scen(path: str, how: Reading, notes: Notes) -> Source:
    rows = how.chosen(path, read_scen(path))
    if not rows:
        raise ValueError(f"{path}: the scenario has no row")
    on_map: dict[int, Task] = {}
    tasks = []
    for (number, row), free in zip(rows, scenario_maps(path, rows, None, notes)):
        if id(free) not in on_map:  # the labels of a map are made once
            on_map[id(free)] = make_task(free, row.start, row.goal)
        start, goal = np.array(row.start, np.int32), np.array(row.goal, np.int32)
        tasks.append(
            NamedTask(f"{_stem(path)}-{number}", on_map[id(free)].replace(start=start, goal=goal))
        )
    return Source(tasks)


def _read_batch(path: str, how: Reading, notes: Notes) -> Source:
    batch = read_batch(path)
    named = [NamedTask(name, task) for name, task in zip(batch.names, unstack(batch.tasks))]
    return Source([task for _, task in how.chosen(path, named)])


def _read_world(path: str, how: Reading, notes: Notes) -> Source:
    try:
        world = read_world(path, repair=how.repair)
    except ValueError as error:
        foreign = next((program for sign, program in _FOREIGN.items() if sign in _head(path)), None)
        if foreign:
            raise ValueError(f"{path}: this is {foreign}") from error
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
    for what, cell in (("start", start), ("goal", goal)):
        _require_free(f"{path}: {what}", grid_map.free, cell, grid_map.unknown)
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


def _require_free(
    what: str, free: np.ndarray, cell: Cell, unknown: np.ndarray | None = None
) -> None:
    height, width = free.shape
    if not (0 <= cell[0] < height and 0 <= cell[1] < width):
        raise ValueError(
            f"{what} {cell} lies outside the map: rows are 0 to {height - 1}, columns 0 to"
            f" {width - 1}"
        )
    if not free[cell] and unknown is not None and unknown[cell]:
        raise ValueError(
            f"{what} {cell} is an unknown cell, and such cells count as blocked: choose a free"
            " cell, or let them count as free by --unknown free"
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
    head = _head(path)
    is_other = "srt-jaxworld" in head or any(sign in head for sign in _FOREIGN)
    return any(f'"type":"{kind}"' in head for kind in geojson.TYPES) and not is_other


def _head(path: str) -> str:
    """Returns how a file begins, without blanks."""
    return "".join(read_bytes(path, "world")[:4096].decode("utf-8", errors="replace").split())


def _stem(path: str) -> str:
    name = pathlib.Path(path).name
    ending = max((ending for ending in _READERS if name.lower().endswith(ending)), key=len)
    return name[: -len(ending)].removesuffix(".osm")
