"""What files hold, as tasks, polygons and cells: the ending of a file's name decides who reads
it.
"""

import contextlib
import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from srt_jax.formats import geojson, osm, pictures
from srt_jax.formats.batch import read_batch
from srt_jax.formats.gridmap import GridMap, free_map
from srt_jax.formats.label_pictures import with_labels
from srt_jax.formats.movingai import read_map, read_scen
from srt_jax.formats.namo_svg import read_namo
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.tag_rules import read_rules
from srt_jax.formats.ros_map import read_ros_map
from srt_jax.formats.shared.scenarios import scenario_maps
from srt_jax.formats.shared.start_and_goal import (
    chosen_ends,
    named_ends,
    note_covered,
    require_free,
    with_free_start,
)
from srt_jax.formats.shared.whole_files import plain_reason, read_bytes, require_regular
from srt_jax.formats.world_json import read_world
from srt_jax.formats.xml_map import read_xml_map
from srt_jax.geometry.frame import Frame
from srt_jax.geometry.place import Place
from srt_jax.geometry.raster import Grid, cover, grid_over, rasterize, square_grid
from srt_jax.geometry.world import World
from srt_jax.robots.ends import Radius, Spot, radius_in
from srt_jax.robots.inflate import inflate
from srt_jax.task import NamedTask, make_task, unstack
from srt_jax.types import FREE, Array, Cell, Task

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
"""Of maps of which nothing is known in metres."""
SIZE = 500
"""Cells a side of a place where no number is given, as in the paper."""


@dataclasses.dataclass(frozen=True)
class Reading:
    """How files are read; each format takes what concerns it.

    start, goal: cells (row, col) or places in the world, for maps and places, which have none of
      their own.
    radius: of the robot, by which every obstacle is dilated (`inflate`); not for worlds.
    labels: a picture that names the obstacles of a map of cells (`label_pictures`).
    size: cells a side of the largest square in the middle of a place. cell_side: metres; then the
      whole place is covered, scenes get cells of that side, and so long are the cells of a map that
      does not say it. Not both; without either SIZE cells.
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
    tells_choice: whether it is noted which were chosen; for those to whom they do not matter.
    limit, rows: of the rows of a scenario or the tasks of a batch, the first so many; those from
      rows[0] on, before rows[1], counted from 0 as in the names of the tasks (None: from the first,
      to the last).
    """

    start: Cell | Spot | None = None
    goal: Cell | Spot | None = None
    radius: Radius | None = None
    labels: str | None = None
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
    tells_choice: bool = True
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

    place: its polygons, where it has some. world: the same with agent and goal. frame: where the
      cells of its one map lie in the world. map: those cells, where they are what the file holds.
    """

    tasks: list[NamedTask]
    place: Place | None = None
    frame: Frame | None = None
    map: GridMap | None = None
    world: World | None = None

    @property
    def grid(self) -> Grid | None:
        """The cells of its one map in metres, before they are turned."""
        return None if self.frame is None else self.frame.grid


def read_source(path: str, how: Reading | None = None, notes: Notes | None = None) -> Source:
    """Returns what a file holds, by the ending of its name; errors as for
    `task_files.read_tasks`.

    Args:
      how: what the options of the commands say; None for their defaults.
      notes: receives what was odd.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> path = os.path.join(tempfile.mkdtemp(), "open.map")
      >>> srt_jax.formats.movingai.write_map(path, np.ones((3, 4), bool))
      >>> how = srt_jax.formats.reading.Reading(start=(0, 0), goal=(2, 3))
      >>> srt_jax.formats.reading.read_source(path, how).map
      GridMap(3 x 4 cells, 12 of them free, start (0, 0), goal (2, 3))
    """
    how = Reading() if how is None else how
    notes = Notes() if notes is None else notes
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
    if how.cell_side is not None and not 0 < how.cell_side < math.inf:
        raise ValueError(
            f"{path}: --cell-side {how.cell_side:g}: the side of a cell is a positive number of"
            " metres"
        )
    if ending == ".json" and _is_geojson(path):
        ending = ".geojson"
    reader, has_ends = _READERS[ending]
    if has_ends and (how.start or how.goal):
        raise ValueError(
            f"{path}: --start and --goal are for maps and places; this file has its own"
        )
    if how.labels is not None and ending not in _ON_CELLS:
        raise ValueError(
            f"{path}: --labels names the obstacles of a map of cells ({', '.join(_ON_CELLS)}); this"
            " file has its own"
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
            frame = _frame_over(free.shape, how)
            on_map[id(free)] = _of_robot(
                path, make_task(free, row.start, row.goal), how, frame, notes
            )
        start, goal = np.array(row.start, np.int32), np.array(row.goal, np.int32)
        tasks.append(
            NamedTask(f"{_stem(path)}-{number}", on_map[id(free)].replace(start=start, goal=goal))
        )
    return Source(tasks, frame=_common_frame(tasks, how))


def _read_batch(path: str, how: Reading, notes: Notes) -> Source:
    batch = read_batch(path)
    named = [NamedTask(name, task) for name, task in zip(batch.names, unstack(batch.tasks))]
    chosen = [task for _, task in how.chosen(path, named)]
    tasks = [
        one._replace(task=_of_robot(path, one.task, how, _frame_over(one.task.size, how), notes))
        for one in chosen
    ]
    return Source(tasks, frame=_common_frame(tasks, how))


def _frame_over(size: Sequence[int] | Array, how: Reading) -> Frame:
    """Returns the frame of a map whose file says nothing of metres: (0, 0) is its lower left
    corner, and the cells have the side that was given, if one was.
    """
    height, width = (int(side) for side in size)
    if how.cell_side is None:
        return Frame.of_cells(height, width)
    return Frame.over((0.0, 0.0), how.cell_side, height=height, width=width)


def _common_frame(tasks: Sequence[NamedTask], how: Reading) -> Frame | None:
    """Returns the frame of all the maps, where the side of a cell was given and they are of one
    size.
    """
    sizes = {tuple(np.asarray(one.task.size).tolist()) for one in tasks}
    if how.cell_side is None or len(sizes) != 1:
        return None
    return _frame_over(sizes.pop(), how)


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
_ON_CELLS = (".map", ".yaml", ".yml", ".xml", *pictures.ENDINGS)
"""Of files that hold cells, free or not, and name no obstacle."""


def _on_cells(path: str, grid_map: GridMap, how: Reading, notes: Notes) -> Source:
    """Returns the task on a map of cells: its obstacles are the 8-connected pieces of what is not
    free, or what a second picture names.
    """
    try:
        grid_map = _measured(grid_map, how, notes)
        frame = grid_map.frame
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    free, obstacles, flags = grid_map.free, grid_map.free, True
    may_end = free
    if how.labels is not None:
        obstacles, flags = with_labels(how.labels, free, pathlib.Path(path).name, notes)
        free = obstacles < 0
        may_end = obstacles < int(flags.sum())  # a goal behind a door, or in it
    ends = named_ends(path, how.start, how.goal, frame)
    if ends is not None:
        for what, cell, where in (("start", ends[0], free), ("goal", ends[1], may_end)):
            require_free(f"{path}: {what}", where, cell, grid_map.unknown)
    task = make_task(obstacles, *(ends or ((0, 0), (0, 0))), destroyable=flags)
    task = _of_robot(path, task, how, frame, notes)
    if ends is None:
        task = _between(path, task, _chosen(path, task, how, notes))
    note_covered(task, notes)
    start, goal = ((int(row), int(col)) for row, col in (task.start, task.goal))
    return Source(
        [NamedTask(_stem(path), task)],
        frame=frame,
        map=dataclasses.replace(grid_map, start=start, goal=goal),
    )


def _measured(grid_map: GridMap, how: Reading, notes: Notes) -> GridMap:
    """Returns the map with the side of a cell as it was given, where the file does not say it."""
    if how.cell_side is None:
        return grid_map
    if grid_map.has_metres:
        notes.tell(f"the map itself says that its cells are {grid_map.cell_side:g} m a side")
        return grid_map
    return dataclasses.replace(grid_map, cell_side=how.cell_side, has_metres=True)


def _of_robot(path: str, task: Task, how: Reading, frame: Frame, notes: Notes) -> Task:
    """Returns the task with the obstacles dilated by the radius, where one is given."""
    if how.radius is None:
        return task
    radius, side = radius_in(frame, how.radius, path)
    try:
        grown = inflate(task, radius, cell_side=side)
    except ValueError as error:
        raise ValueError(f"{path}: --radius: {error}") from error
    if radius and grown.labels.shape == task.labels.shape and (grown.labels == task.labels).all():
        is_metres = how.radius.is_metres
        hint = f": for metres write {radius:g}m" if frame.has_metres and not is_metres else ""
        notes.tell(
            f"--radius {radius:g} {'m' if is_metres else 'cells'} reaches no further cell, so no"
            f" obstacle grows{hint}"
        )
    return grown


def _chosen(path: str, task: Task, how: Reading, notes: Notes) -> tuple[Cell, Cell]:
    free = (task.labels == FREE).all(axis=0)
    return chosen_ends(path, free, notes if how.tells_choice else Notes())


def _between(path: str, task: Task, ends: tuple[Cell, Cell]) -> Task:
    start, goal = (np.array(cell, np.int32) for cell in ends)
    return task.replace(start=start, goal=goal)


def _on_place(path: str, place: Place, how: Reading, notes: Notes) -> Source:
    with _naming(path):
        if how.cell_side is not None:
            grid = grid_over(place.bounds, how.cell_side)
        else:
            grid = square_grid(place.bounds, SIZE if how.size is None else how.size)
        labels = cover(place.obstacles, grid, rule=how.rule)
    notes.tell(f"{grid.height} x {grid.width} cells of {grid.side:.3f} m")
    frame = Frame(grid, projection=place.projection)
    ends = named_ends(path, how.start, how.goal, frame)
    obstacles = place.obstacles
    with _naming(path):
        task = make_task(
            labels,
            *(ends or ((0, 0), (0, 0))),
            destroyable=np.array([obstacle.destroyable for obstacle in obstacles], bool),
            removal_cost=np.array([obstacle.removal_cost for obstacle in obstacles], np.float64),
        )
    task = _of_robot(path, task if ends is None else with_free_start(path, task), how, frame, notes)
    if ends is None:
        task = _between(path, task, _chosen(path, task, how, notes))
    if how.radius is not None:
        note_covered(task, notes)
    return Source([NamedTask(_stem(path), task)], place, frame)


def _of_world(path: str, world: World, how: Reading) -> Source:
    if how.radius is not None:
        raise ValueError(
            f"{path}: --radius is for maps and places; the robot of this file has a radius of"
            f" {world.radius:g} m"
        )
    with _naming(path):
        task = rasterize(world, rule=how.rule)
        frame = Frame(grid_over(world.bounds, world.goal_side))
    task = with_free_start(path, task)
    return Source(
        [NamedTask(_stem(path), task)], Place(world.bounds, world.obstacles), frame, world=world
    )


@contextlib.contextmanager
def _naming(path: str) -> Iterator[None]:
    """Puts the file's name before what is wrong with the grid or the task that is made of it."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


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
