"""Obstacles from rings, lines and shapely geometries of other programs; odd input is repaired,
counted and reported.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.geometry.place import Place
from srt_jax.geometry.rings import Parts, Ring, as_metres, as_ring, as_rings, conflicts, repaired
from srt_jax.geometry.world import Obstacle

CROSSING = "polygons whose rings cross, made valid"
FLAT = "rings left out: fewer than three different points"
EMPTY = "objects left out: they enclose nothing"
UNCLOSED = "rings not closed by their first point, closed"
POINTLESS = "geometries passed over: points are no obstacles"


class Shape(NamedTuple):
    """One thing to be made an obstacle.

    parts: polygons, each a sequence of rings [K, 2], metres, the outer one first. called: its name
      in the notes, such as
    "way 17". options: as in `Obstacle`.
    """

    parts: Sequence[Sequence[Any]]
    called: str
    options: dict[str, Any]


def obstacles_of_shapes(shapes: Sequence[Shape], notes: Notes) -> list[Obstacle | None]:
    """Returns the obstacle of each shape; None where nothing is left of it.

    Rings with fewer than three different points are left out, with their holes where they are outer
    ones; rings that cross are made valid (`rings.repaired`). Both are counted.

    Raises:
      ValueError: a coordinate is NaN or too large, or an option is wrong; the message begins with
        what the shape is called.
    """
    checked = iter(as_rings([ring for shape in shapes for part in shape.parts for ring in part]))
    rings = [_rings(shape, checked, notes) for shape in shapes]
    is_crossing = [bool(reason) for reason in conflicts(rings)]
    # What crosses is repaired, and the repaired are checked again, all at once.
    rings = [repaired(one) if crosses else one for one, crosses in zip(rings, is_crossing)]
    again = iter(conflicts(list(itertools.compress(rings, is_crossing))))
    is_valid = [not (crosses and next(again)) for crosses in is_crossing]
    return [_obstacle(*each, notes) for each in zip(shapes, rings, is_crossing, is_valid)]


def wall_parts(line: Any, width: float, *, called: str, notes: Notes) -> list[list[np.ndarray]]:
    """Returns the polygons a line makes, `width` metres wide, half of that beyond its ends; []
    where it has no length.
    """
    shapely = require_module(
        "shapely", extra="world", what="making a line, such as a fence, an obstacle"
    )
    points = as_metres(f"a point of {called}", line, (-1, 2))
    if len(np.unique(points, axis=0)) < 2:
        notes.add("lines left out: fewer than two different points", example=called)
        return []
    return list(
        _polygons(
            shapely.LineString(points).buffer(width / 2, cap_style="square", join_style="mitre")
        )
    )


def obstacles_of(
    shape: Any, *, called: str, notes: Notes, width: float = 0.2, **options: Any
) -> list[Obstacle]:
    """Returns the obstacles in a shapely geometry: one of all its polygons, and one of each line,
    `width` metres wide.

    Points are passed over and counted.
    """
    shapely = require_module("shapely", extra="world", what="reading shapely geometries")
    polygons: list[list[np.ndarray]] = []
    shapes = [Shape(polygons, called, options)]
    for one in _leaves(shapely, shape):
        if isinstance(one, shapely.Polygon):
            polygons += _polygons(one)
        elif isinstance(one, shapely.LineString):
            parts = wall_parts(shapely.get_coordinates(one), width, called=called, notes=notes)
            shapes.append(Shape(parts, called, options))
        else:
            notes.add(POINTLESS, example=called)
    made = obstacles_of_shapes([shape for shape in shapes if shape.parts], notes)
    return [obstacle for obstacle in made if obstacle is not None]


def place_of(
    shapes: Iterable[Any],
    *,
    bounds: Sequence[float] | None = None,
    notes: Notes | None = None,
    **options: Any,
) -> Place:
    """Returns the place whose obstacles are shapely geometries in metres.

    Args:
      bounds: (x_min, y_min, x_max, y_max); without them the box around all.
      options: for all, as in `obstacles_of` and `Obstacle`.

    Raises:
      ValueError: nothing with an area or a length, and no bounds.
    """
    notes = Notes() if notes is None else notes
    made = [
        obstacle
        for index, shape in enumerate(shapes)
        for obstacle in obstacles_of(shape, called=f"geometry {index}", notes=notes, **options)
    ]
    return Place(box_around(made) if bounds is None else tuple(map(float, bounds)), tuple(made))  # type: ignore[arg-type]


def box_around(obstacles: Sequence[Obstacle]) -> tuple[float, float, float, float]:
    """Returns (x_min, y_min, x_max, y_max) of all; ValueError where there is none."""
    if not obstacles:
        raise ValueError(
            "there is no obstacle in it, and nothing says how far it reaches: give bounds"
        )
    points = np.array(
        [point for obstacle in obstacles for part in obstacle.parts for point in part[0]]
    )
    (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x_min, y_min, x_max, y_max


def count_outside(place: Place, notes: Notes) -> None:
    """Notes how many obstacles lie wholly beyond the bounds; they keep their ids and cover no
    cell.
    """
    if not place.obstacles:
        return
    x_min, y_min, x_max, y_max = place.bounds
    outer = [
        [point for part in obstacle.parts for point in part[0]] for obstacle in place.obstacles
    ]
    starts = np.cumsum([0, *map(len, outer[:-1])])
    points = np.array([point for one in outer for point in one])
    low, high = (extreme.reduceat(points, starts, axis=0) for extreme in (np.minimum, np.maximum))
    is_outside = (high <= (x_min, y_min)).any(axis=1) | (low >= (x_max, y_max)).any(axis=1)
    for index in np.flatnonzero(is_outside).tolist():
        notes.add(
            "obstacles wholly outside the bounds, kept; they cover no cell",
            example=place.obstacles[index].name,
        )


def _rings(shape: Shape, checked: Iterator[Ring | None], notes: Notes) -> Parts:
    """Returns the rings of a shape that have at least three different points; `checked`
    continues with `as_rings` of them.
    """
    kept = []
    for part in shape.parts:
        rings = [next(checked) or _ring(ring, shape.called, notes) for ring in part]
        if rings and rings[0]:
            kept.append(tuple(ring for ring in rings if ring))
    return tuple(kept)


def _ring(points: Any, called: str, notes: Notes) -> Ring:
    try:
        return as_ring(f"a ring of {called}", points)
    except ValueError:
        num_different = len(np.unique(as_metres(f"a ring of {called}", points, (-1, 2)), axis=0))
        if num_different >= 3:
            raise
    notes.add(FLAT, example=called)
    return ()


def _obstacle(
    shape: Shape, rings: Parts, was_crossing: bool, is_valid: bool, notes: Notes
) -> Obstacle | None:
    notes.add(CROSSING, int(was_crossing), example=shape.called)
    if not rings:
        notes.add(EMPTY, int(bool(shape.parts)), example=shape.called)
        return None
    try:
        return Obstacle(rings, **shape.options, checked=is_valid)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{shape.called}: {error}") from error


def _leaves(shapely: Any, shape: Any) -> Iterable[Any]:
    for one in shapely.get_parts(shape).tolist():
        if hasattr(one, "geoms"):
            yield from _leaves(shapely, one)
        elif not one.is_empty:
            yield one


def _polygons(shape: Any) -> Iterable[list[np.ndarray]]:
    for polygon in getattr(shape, "geoms", [shape]):
        yield [np.asarray(ring.coords)[:, :2] for ring in (polygon.exterior, *polygon.interiors)]
