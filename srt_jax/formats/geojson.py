"""GeoJSON: polygons made obstacles, and places written so that they read back equal.

The standard (RFC 7946) has longitude and latitude in degrees. What `write_geojson` writes is in
metres and says so in a member of its own, "srt-jax"; a "crs" of the older standard is believed too.
Where a file says nothing, coordinates that cannot be degrees are metres.
"""

import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.files import PathLike, written
from srt_jax.formats.json_text import read_json
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.geometry import (
    POINTLESS,
    UNCLOSED,
    Shape,
    box_around,
    count_outside,
    obstacles_of_shapes,
    wall_parts,
)
from srt_jax.formats.outlines.projection import projection_over
from srt_jax.formats.outlines.tag_rules import TagRule, default_rules, matching
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle

TYPES = (
    "FeatureCollection",
    "Feature",
    "Polygon",
    "MultiPolygon",
    "LineString",
    "MultiLineString",
    "GeometryCollection",
)
UNITS = ("auto", "degrees", "metres")
_OWN = "srt-jax"
_LINE_WIDTH = 0.2
"""Metres; of a line to which no tag rule gives another width."""


class _Given(NamedTuple):
    """parts: polygons, or one line, as arrays in the file's units. properties: of its feature.
    called: its name in messages.
    """

    parts: list[list[np.ndarray]]
    is_line: bool
    properties: dict[str, Any]
    called: str


def read_geojson(
    path: PathLike,
    *,
    units: str = "auto",
    rules: Sequence[TagRule] | None = None,
    notes: Notes | None = None,
) -> Place:
    """Returns the obstacles in a GeoJSON file: one of each feature with polygons, and one of each
    line.

    A feature's properties `destroyable`, `removal_cost`, `name` count; without them the tag rules,
    which look at its properties too; else it can be destroyed at cost 1. Lines get the rule's
    width, or 0.2 m.

    Args:
      units: of the coordinates, one of UNITS.
      notes: receives what was odd and how often: rings not closed or crossing, points, features
        without a geometry.

    Raises:
      ValueError: the file is missing or no GeoJSON, or a coordinate or property is wrong; the
        message says where.
    """
    notes = Notes() if notes is None else notes
    rules = default_rules() if rules is None else tuple(rules)
    document = read_json(path, "GeoJSON map")
    try:
        if units not in UNITS:
            raise ValueError(f"units {units!r} are unknown: take one of {', '.join(UNITS)}")
        if not isinstance(document, dict) or document.get("type") not in TYPES:
            raise ValueError(f"no GeoJSON: its 'type' must be one of {', '.join(TYPES)}")
        return _place(document, units, rules, notes)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}") from error


def write_geojson(path: PathLike, place: Place) -> None:
    """Writes a place in metres, one feature per obstacle; `read_geojson` reads it back equal."""
    own = {"units": "metres", "bounds": place.bounds, "attribution": place.attribution}
    head = (
        f'{{"type": "FeatureCollection", "{_OWN}": {json.dumps(own, ensure_ascii=False)},'
        ' "features": ['
    )
    features = ",\n".join(
        json.dumps(_feature(obstacle), ensure_ascii=False) for obstacle in place.obstacles
    )
    with written(path) as file:
        file.write(f"{head}\n{features}\n]}}\n")


def _feature(obstacle: Obstacle) -> dict[str, Any]:
    parts = [[(*ring, ring[0]) for ring in part] for part in obstacle.parts]
    single = len(parts) == 1
    geometry = {
        "type": "Polygon" if single else "MultiPolygon",
        "coordinates": parts[0] if single else parts,
    }
    properties = {name: getattr(obstacle, name) for name in ("name", "destroyable", "removal_cost")}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _place(document: dict[str, Any], units: str, rules: Sequence[TagRule], notes: Notes) -> Place:
    given = list(_all_given(document, notes))
    own = _own(document)
    box = _box(own.get("bounds", document.get("bbox")))
    points = [ring for one in given for part in one.parts for ring in part] + (
        [np.reshape(box, (2, 2))] if box else []
    )
    all_points = np.concatenate(points) if points else np.zeros((0, 2))
    if _units(document, own, units, all_points, notes) == "degrees" and len(all_points):
        projection = projection_over(all_points.min(axis=0), all_points.max(axis=0))
        notes.tell(
            f"metres east and north of longitude {projection.longitude:.7f}, latitude"
            f" {projection.latitude:.7f}"
        )
        given = [
            one._replace(parts=[[projection.to_metres(r) for r in part] for part in one.parts])
            for one in given
        ]
        box = projection.to_metres(np.reshape(box, (2, 2))).ravel().tolist() if box else None
    shapes = [_shape(one, rules, notes) for one in given]
    made = [obstacle for obstacle in obstacles_of_shapes(shapes, notes) if obstacle is not None]
    bounds = box_around(made) if box is None else tuple(box)
    place = Place(bounds, tuple(made), str(own.get("attribution", "")))  # type: ignore[arg-type]
    count_outside(place, notes)
    return place


def _units(
    document: dict[str, Any], own: dict[str, Any], units: str, points: np.ndarray, notes: Notes
) -> str:
    """Returns "degrees" or "metres": what is asked for, else what the file says, else what the
    numbers allow.
    """
    if units != "auto":
        return units
    if own.get("units") in UNITS[1:]:
        return own["units"]
    crs = json.dumps(document.get("crs") or "")
    if "CRS84" in crs or "4326" in crs:
        return "degrees"
    if "crs" in document and document["crs"] is not None:
        notes.tell(
            "the file names a coordinate system that is not longitude and latitude: taken as"
            " metres, x east, y north"
        )
        return "metres"
    fits = not len(points) or (np.abs(points).max(axis=0) <= (180, 90)).all()
    notes.tell(
        "coordinates taken as longitude and latitude, as the standard has it"
        if fits
        else "coordinates taken as metres: they cannot be longitude and latitude"
    )
    return "degrees" if fits else "metres"


def _shape(given: _Given, rules: Sequence[TagRule], notes: Notes) -> Shape:
    properties, rule = given.properties, matching(rules, given.properties)
    options = {
        "destroyable": properties.get("destroyable", rule.destroyable if rule else True),
        "removal_cost": properties.get("removal_cost", rule.removal_cost if rule else 1.0),
        "name": str(properties.get("name") or ""),
    }
    if not given.is_line:
        return Shape(given.parts, given.called, options)
    width = (rule.width if rule else None) or _LINE_WIDTH
    return Shape(
        wall_parts(given.parts[0][0], width, called=given.called, notes=notes),
        given.called,
        options,
    )


def _all_given(document: dict[str, Any], notes: Notes) -> Iterator[_Given]:
    if document["type"] == "FeatureCollection":
        features = document.get("features")
        if not isinstance(features, list):
            raise ValueError("a FeatureCollection has a list of features")
    else:
        features = [document if document["type"] == "Feature" else {"geometry": document}]
    for index, feature in enumerate(features):
        called = f"features[{index}]"
        if not isinstance(feature, dict):
            raise ValueError(f"{called} must be an object, got {type(feature).__name__}")
        properties = feature.get("properties") or {}
        if not isinstance(properties, dict):
            raise ValueError(
                f"{called}: properties must be an object, got {type(properties).__name__}"
            )
        if feature.get("geometry") is None:
            notes.add("features passed over: they have no geometry", example=called)
            continue
        polygons, lines = _taken_apart(feature["geometry"], called, notes)
        if polygons:
            yield _Given(polygons, False, properties, called)
        yield from (_Given([[line]], True, properties, called) for line in lines)


def _taken_apart(
    geometry: Any, called: str, notes: Notes
) -> tuple[list[list[np.ndarray]], list[np.ndarray]]:
    """Returns the polygons and the lines of a geometry."""
    if not isinstance(geometry, dict) or not isinstance(geometry.get("type"), str):
        raise ValueError(f"{called}: a geometry must be an object with a type")
    kind, coordinates = geometry["type"], geometry.get("coordinates", [])
    if kind == "GeometryCollection":
        apart = [_taken_apart(one, called, notes) for one in geometry.get("geometries", [])]
        return [polygon for polygons, _ in apart for polygon in polygons], [
            line for _, lines in apart for line in lines
        ]
    if kind in ("Point", "MultiPoint"):
        notes.add(POINTLESS, example=called)
        return [], []
    if not isinstance(coordinates, list):
        raise ValueError(f"{called}: the coordinates of a {kind} must be a list")
    if kind in ("Polygon", "MultiPolygon"):
        parts = [coordinates] if kind == "Polygon" else coordinates
        return [[_ring(ring, called, notes) for ring in part] for part in parts if part], []
    if kind in ("LineString", "MultiLineString"):
        return [], [
            _points(line, called)
            for line in ([coordinates] if kind == "LineString" else coordinates)
        ]
    raise ValueError(f"{called}: a geometry of type {kind!r} is not known")


def _ring(ring: Any, called: str, notes: Notes) -> np.ndarray:
    points = _points(ring, called)
    notes.add(UNCLOSED, int((points[0] != points[-1]).any()), example=called)
    return points


def _points(line: Any, called: str) -> np.ndarray:
    """Returns float64 [K, 2]; a third number of a point, its height, is left out."""
    try:
        points = np.array([[float(number) for number in point[:2]] for point in line])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{called}: a point must be a list of numbers [x, y]") from error
    if points.ndim != 2 or points.shape[1:] != (2,):
        raise ValueError(
            f"{called}: a ring or line must be a list of points [x, y], with one point at least"
        )
    if not np.isfinite(points).all():
        raise ValueError(f"{called}: coordinates must be finite")
    return points


def _own(document: dict[str, Any]) -> dict[str, Any]:
    """Returns what `write_geojson` adds; {} where another wrote the file."""
    own = document.get(_OWN, {})
    if not isinstance(own, dict):
        raise ValueError(f"the member {_OWN!r} must be an object, got {type(own).__name__}")
    return own


def _box(box: Any) -> list[float] | None:
    """Returns the box a file states, (x_min, y_min, x_max, y_max), without heights; None where
    it states none.
    """
    if box is None:
        return None
    if not (
        isinstance(box, list)
        and len(box) in (4, 6)
        and all(isinstance(number, int | float) for number in box)
    ):
        raise ValueError(f"a bbox holds 4 or 6 numbers, got {box!r}")
    half = len(box) // 2
    return [*box[:2], *box[half : half + 2]]
