"""Routes as files for those who drive them: GeoJSON, or a path of ROS as JSON.

`.geojson` holds a LineString in degrees where the map lies on the globe, else in the map's metres,
and a Point for each place from which something is destroyed. `.json` is one message nav_msgs/Path:
poses a cell apart that look along the route.
"""

import json
import math
import pathlib
from typing import Any

import numpy as np

from sign_model.foundation.files import PathLike, atomic_write, require_folder_of
from srt_jax.engine.entrance import require_one_answer
from srt_jax.geometry.frame import Frame
from srt_jax.paths.approach import approach as approach_of
from srt_jax.robots.polyline import polyline
from srt_jax.types import Approach, Solution, Status, Task

ENDINGS = (".geojson", ".json")
_DIGITS = {"degrees": 9, "m": 6, "cells": 6}
"""Of coordinates: a tenth of a millimetre or finer."""


def write_path(
    path: PathLike,
    task: Task,
    solution: Solution,
    frame: Frame | None = None,
    *,
    approach: Approach | None = None,
    name: str = "",
) -> None:
    """Writes the route of one task; of an unsolved one the way as near to the goal as one gets.

    Args:
      path: ends in .geojson, or in .json for a message nav_msgs/Path.
      frame: as in `polyline`.
      approach: of an unsolved task, where it is known; else it is found.

    Raises:
      ValueError: another ending, no such folder, a batch, a frame of another map, a message of a
        map without metres, or no route at all.

    Examples:
      >>> import json, os, tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> task = srt_jax.make_task(np.ones((4, 6), bool), (3, 0), (0, 4))
      >>> path = os.path.join(tempfile.mkdtemp(), "route.json")
      >>> frame = srt_jax.Frame.over((-1.0, 0.0), 0.5, height=4, width=6)
      >>> srt_jax.write_path(path, task, srt_jax.solve(task), frame)
      >>> json.load(open(path))["poses"][0]["pose"]["position"]
      {'x': -0.75, 'y': 0.25, 'z': 0.0}
    """
    require_path_name(path)
    require_one_answer("write_path", task, solution)
    status = Status(int(solution.status))
    route: Solution | Approach = solution
    if not status.is_solved:
        route = approach_of(task) if approach is None else approach
    height, width = np.asarray(task.size).tolist()
    frame = Frame.of_cells(height, width) if frame is None else frame
    require_metres(path, frame)
    points = polyline(task, route, frame)
    if not len(points):
        raise ValueError(f"{path}: there is no route to write: {status.meaning}")
    if pathlib.Path(path).suffix.lower() == ".json":
        document = _message(points)
    else:
        document = _collection(name, task, solution, route, frame, points)
    with atomic_write(path) as file:
        json.dump(document, file, allow_nan=False)
        file.write("\n")


def require_path_name(path: PathLike) -> None:
    """Raises ValueError, before anything is solved, where a route could not be written to
    `path`.
    """
    if pathlib.Path(path).suffix.lower() not in ENDINGS:
        raise ValueError(
            f"{path}: a route is written as .geojson, or as .json (nav_msgs/Path): end the name so"
        )
    require_folder_of(path)


def require_metres(path: PathLike, frame: Frame | None) -> None:
    """Raises ValueError where a message would hold metres, and the map does not say how large a
    cell is.
    """
    has_metres = frame is not None and frame.has_metres
    if pathlib.Path(path).suffix.lower() == ".json" and not has_metres:
        raise ValueError(
            f"{path}: a nav_msgs/Path is in metres, and the map does not say how large a cell is:"
            " give it (--cell-side, or frame=), or write .geojson, in cells"
        )


def _message(points: np.ndarray) -> dict[str, Any]:
    """Returns nav_msgs/Path with its members alone, as `ros2 topic pub` takes it."""
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    steps = np.diff(points, axis=0)
    turns = np.arctan2(steps[:, 1], steps[:, 0]).tolist() or [0.0]
    turns.append(turns[-1])  # the last pose looks as the one before
    poses = [
        {
            "header": header,
            "pose": {
                "position": {"x": round(x, 6), "y": round(y, 6), "z": 0.0},
                "orientation": {
                    "x": 0.0,
                    "y": 0.0,
                    "z": math.sin(turn / 2),
                    "w": math.cos(turn / 2),
                },
            },
        }
        for (x, y), turn in zip(points.tolist(), turns)
    ]
    return {"header": header, "poses": poses}


def _collection(
    name: str,
    task: Task,
    solution: Solution,
    route: Solution | Approach,
    frame: Frame,
    points: np.ndarray,
) -> dict[str, Any]:
    """Returns a FeatureCollection: the route, and where something is destroyed."""
    units = "degrees" if frame.projection is not None else frame.unit
    line = _placed(polyline(task, route, frame, turns_only=True), frame, units)
    properties: dict[str, Any] = {
        "name": name,
        "status": Status(int(solution.status)).name,
        "what": "route" if route is solution else "approach",
        "length": round(float(route.cost) * frame.side, 6),
        "unit": frame.unit,
    }
    if isinstance(route, Approach):
        properties["gap"] = round(float(route.gap) * frame.side, 6)
    # a line has two points at least
    features = [_feature("LineString", line if len(line) > 1 else line * 2, properties)]
    if route is solution:
        pairs = zip(np.asarray(solution.destroyed).tolist(), np.asarray(solution.destroyed_at))
        for order, (obstacle, at) in enumerate(pairs):
            if obstacle >= 0:
                (spot,) = _placed(points[at][None], frame, units)
                stop = {"what": "destroys", "obstacle": obstacle, "order": order + 1}
                features.append(_feature("Point", spot, stop))
    head: dict[str, Any] = {"type": "FeatureCollection"}
    if units != "degrees":
        head["srt-jax"] = {"units": "metres" if units == "m" else units}
    return head | {"features": features}


def _feature(kind: str, coordinates: list, properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _placed(points: np.ndarray, frame: Frame, units: str) -> list[list[float]]:
    """Returns the coordinates of points in the units of the file."""
    if frame.projection is not None:
        points = frame.projection.to_degrees(points)
    return np.round(points, _DIGITS[units]).tolist()
