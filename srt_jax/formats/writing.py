"""What files hold, written in another format: polygons as polygons, cells as cells."""

import dataclasses
import pathlib
from collections.abc import Callable

import numpy as np

from srt_jax.formats import pictures
from srt_jax.formats.batch import write_batch
from srt_jax.formats.geojson import write_geojson
from srt_jax.formats.gridmap import GridMap
from srt_jax.formats.movingai import write_map
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Source
from srt_jax.formats.ros_map import write_ros_map
from srt_jax.formats.world_json import write_world
from srt_jax.formats.xml_map import write_xml_map
from srt_jax.geometry.frame import Frame
from srt_jax.geometry.place import Place
from srt_jax.geometry.raster import Grid, point_of
from srt_jax.geometry.world import World
from srt_jax.task import stack
from srt_jax.types import FREE, Task

_SHARE = 0.45
"""Of a cell's side: the radius of an agent of which nothing else is known; it must be less than a
half.
"""


def write_source(path: str, source: Source, notes: Notes) -> None:
    """Writes what a file held, in the format that the ending of `path` names.

    Args:
      notes: receives what the format has no room for.

    Raises:
      ValueError: an unknown ending; cells where polygons are needed; several tasks where the format
        has room for one.
    """
    ending = pathlib.Path(path).suffix.lower()
    if ending not in _WRITERS:
        raise ValueError(
            f"{path}: cannot write the ending {ending!r}: use one of {', '.join(_WRITERS)}"
        )
    _WRITERS[ending](path, source, notes)


def with_flags_of_task(source: Source) -> Source:
    """Returns the source with polygons that can be destroyed where its one task says so."""
    if source.place is None:
        return source
    flags = np.asarray(_only_task("", source).destroyable).tolist()
    obstacles = tuple(
        dataclasses.replace(obstacle, destroyable=flag)
        for obstacle, flag in zip(source.place.obstacles, flags)
    )
    world = None if source.world is None else dataclasses.replace(source.world, obstacles=obstacles)
    return source._replace(
        place=dataclasses.replace(source.place, obstacles=obstacles), world=world
    )


def _tell_of_metres(source: Source, notes: Notes) -> None:
    """Notes that the format has no room for where the map lies and how large its cells are."""
    frame = source.frame
    if frame is not None and frame.has_metres:
        notes.tell(
            f"the side of a cell, {frame.side:g} m, and the place of the map are not written: give"
            " --cell-side when the file is read"
        )


def _write_batch(path: str, source: Source, notes: Notes) -> None:
    _tell_of_metres(source, notes)
    write_batch(
        path,
        stack([named.task for named in source.tasks]),
        names=[named.name for named in source.tasks],
    )


def _write_geojson(path: str, source: Source, notes: Notes) -> None:
    write_geojson(path, _polygons(path, source))
    notes.tell("start and goal are not written: GeoJSON holds the place alone")


def _write_world(path: str, source: Source, notes: Notes) -> None:
    if source.world is not None:
        write_world(path, source.world)
        return
    place, task = _polygons(path, source), _only_task(path, source)
    grid: Grid = source.grid  # type: ignore[assignment]
    x_min, y_max = grid.origin
    (x, y), goal = point_of(grid, task.start).tolist(), point_of(grid, task.goal).tolist()
    bounds = (x_min, y_max - grid.height * grid.side, x_min + grid.width * grid.side, y_max)
    radius = _SHARE * grid.side
    notes.tell(f"the agent's radius is set to {radius:g} m, {_SHARE:g} of a cell's side")
    square = (tuple(goal), grid.side)
    write_world(path, World(bounds, place.obstacles, position=(x, y), radius=radius, goal=square))  # type: ignore[arg-type]


def _write_map(path: str, source: Source, notes: Notes) -> None:
    write_map(path, _cells(path, source, notes).free)
    notes.tell("start and goal are not written: a .map holds cells alone")
    _tell_of_metres(source, notes)


def _write_ros(path: str, source: Source, notes: Notes) -> None:
    write_ros_map(path, _cells(path, source, notes))
    notes.tell("start and goal are not written: a ROS map holds cells alone")


def _write_xml(path: str, source: Source, notes: Notes) -> None:
    write_xml_map(path, _cells(path, source, notes))


def _write_image(path: str, source: Source, notes: Notes) -> None:
    pictures.write_image(path, _cells(path, source, notes).free)
    notes.tell("start and goal are not written: a picture holds cells alone")
    _tell_of_metres(source, notes)


_WRITERS: dict[str, Callable[[str, Source, Notes], None]] = {
    ".map": _write_map,
    ".npz": _write_batch,
    ".json": _write_world,
    ".geojson": _write_geojson,
    ".xml": _write_xml,
    **dict.fromkeys((".yaml", ".yml"), _write_ros),
    **dict.fromkeys((".png", ".pgm", ".bmp", ".tif"), _write_image),
}
ENDINGS = tuple(_WRITERS)


def _polygons(path: str, source: Source) -> Place:
    if source.place is None:
        raise ValueError(
            f"{path}: this format holds polygons, and the input has none, only cells: write .map,"
            " .npz, .xml or .yaml"
        )
    return source.place


def _only_task(path: str, source: Source) -> Task:
    if len(source.tasks) != 1:
        raise ValueError(
            f"{path}: this format holds one map, and the input has {len(source.tasks)} tasks: write"
            " .npz"
        )
    return source.tasks[0].task


def _cells(path: str, source: Source, notes: Notes) -> GridMap:
    """Returns the one map as cells: free, or not; which obstacle is where is lost."""
    task = _only_task(path, source)
    start, goal = ((int(row), int(col)) for row, col in (task.start, task.goal))
    if source.map is not None:
        return dataclasses.replace(source.map, start=start, goal=goal)
    free = (np.asarray(task.labels) == FREE).all(axis=0)
    notes.tell(
        "written are cells that are free or not: which obstacle covers them, and what it costs, is"
        " left out"
    )
    if source.grid is None:
        return GridMap(free, np.zeros_like(free), start=start, goal=goal)
    frame: Frame = source.frame  # type: ignore[assignment]
    return GridMap(
        free,
        np.zeros_like(free),
        frame.side,
        frame.corner,
        start,
        goal,
        frame.yaw,
        frame.has_metres,
    )
