"""GeoJSON: polygons made obstacles, and places written so that they read back equal.

The standard (RFC 7946) has longitude and latitude in degrees. What `write_geojson` writes is in
metres and says so in a member of its own, "srt-jax"; a "crs" of the older standard is believed too
(`coordinate_systems`). Where a file says nothing, coordinates that cannot be degrees are metres.
"""

import itertools
import json
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from sign_model.foundation.collector import paused_collector
from srt_jax.formats.containers.json_text import read_json
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.coordinate_systems import from_web_map, unit_of
from srt_jax.formats.outlines.geometry import (
    POINTLESS,
    UNCLOSED,
    Shape,
    box_around,
    count_outside,
    obstacles_of_shapes,
    wall_parts,
)
from srt_jax.formats.outlines.tag_rules import CachedRules, TagRule, default_rules
from srt_jax.formats.shared.whole_files import PathLike, atomic_write
from srt_jax.geometry.place import Place
from srt_jax.geometry.projection import Projection, joined_box, projection_over
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
NO_GEOMETRY = "features passed over: they have no geometry"
NO_PART = "parts of geometries passed over: they are empty"
NO_VALUE = "properties that are NaN or infinite, taken as missing"
NOT_IN_THE_WAY = "features passed over by a tag rule: they are in nobody's way"
_HSTORE = re.compile(r'"((?:[^"\\]|\\.)*)"\s*=>\s*(?:"((?:[^"\\]|\\.)*)"|NULL)')


class _Given(NamedTuple):
    """parts: polygons, or one line: rings as the file has them, or as arrays [K, 2]. properties: of
    its feature. called: its name in messages.
    """

    parts: list[list[Any]]
    is_line: bool
    properties: dict[str, Any]
    called: str


@paused_collector()
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
    document = read_json(path, "GeoJSON map", takes_nan=True)
    try:
        if units not in UNITS:
            raise ValueError(f"units {units!r} are unknown: take one of {', '.join(UNITS)}")
        if not isinstance(document, dict) or document.get("type") not in TYPES:
            raise ValueError(f"no GeoJSON: its 'type' must be one of {', '.join(TYPES)}")
        return _place(document, units, rules, notes)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}") from error
    except RecursionError as error:
        raise ValueError(
            f"{path}: its geometries are nested too deeply: give them one by one"
        ) from error


def write_geojson(path: PathLike, place: Place) -> None:
    """Writes a place in metres, one feature per obstacle; `read_geojson` reads it back equal."""
    own = {"units": "metres", "bounds": place.bounds, "attribution": place.attribution}
    if place.projection is not None:
        own["centre"] = [place.projection.longitude, place.projection.latitude]
    head = (
        f'{{"type": "FeatureCollection", "{_OWN}": {json.dumps(own, ensure_ascii=False)},'
        ' "features": ['
    )
    features = ",\n".join(
        json.dumps(_feature(obstacle), ensure_ascii=False) for obstacle in place.obstacles
    )
    with atomic_write(path) as file:
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


def _own_projection(own: dict[str, Any]) -> Projection | None:
    """Returns how the metres of a file that we wrote lie on the globe, where it says so."""
    centre = own.get("centre")
    if centre is None:
        return None
    is_pair = isinstance(centre, list) and len(centre) == 2
    if not is_pair or any(isinstance(n, bool) or not isinstance(n, int | float) for n in centre):
        raise ValueError(
            f"the centre of its {_OWN!r} must be [longitude, latitude], got {str(centre)[:40]}"
        )
    return Projection(float(centre[0]), float(centre[1]))


def _place(document: dict[str, Any], units: str, rules: Sequence[TagRule], notes: Notes) -> Place:
    # All points in one array: a call of numpy for each ring would take most of the time.
    given = list(_all_given(document, notes))
    points, ends = _all_points(given, notes)
    own = _own(document)
    box = _box(own.get("bounds", document.get("bbox")))
    corners = np.reshape(box, (2, 2)) if box else np.zeros((0, 2))
    unit = _units(document, own, units, np.concatenate([points, corners]), notes)
    # Whatever the coordinates are, metres from here on.
    projection = _own_projection(own) if unit == "metres" else None
    if unit == "web":
        points, corners = from_web_map(points), from_web_map(corners)
    if unit != "metres" and len(points) + len(corners):
        boxes = [np.tile(points, 2), np.reshape(corners, (-1, 4))]
        projection = projection_over(*joined_box(np.concatenate(boxes)))
        notes.tell(
            f"metres east and north of longitude {projection.longitude:.7f}, latitude"
            f" {projection.latitude:.7f}"
        )
        points, corners = projection.to_metres(points), projection.to_metres(corners)
    # One shape of each polygon or line; then the obstacles, checked all at once.
    rings = iter([points[first:end] for first, end in itertools.pairwise([0, *ends])])
    cached = CachedRules(rules)
    shapes = []
    for one in given:
        whole = one._replace(parts=[[next(rings) for _ in part] for part in one.parts])
        shape = _shape(whole, cached, notes)
        shapes += [shape] if shape is not None else []
    made = [obstacle for obstacle in obstacles_of_shapes(shapes, notes) if obstacle is not None]
    bounds = tuple(corners.ravel().tolist()) if box else box_around(made)
    place = Place(bounds, tuple(made), str(own.get("attribution", "")), projection)  # type: ignore[arg-type]
    count_outside(place, notes)
    return place


def _units(
    document: dict[str, Any], own: dict[str, Any], units: str, points: np.ndarray, notes: Notes
) -> str:
    """Returns what the coordinates are: "degrees", "metres", or "web" for those of a web map."""
    if units != "auto":
        return units
    if own.get("units") in UNITS[1:]:
        return own["units"]
    if document.get("crs") is not None:
        unit, name = unit_of(document["crs"])
        if unit == "metres":
            notes.tell(f"coordinates taken as metres, x east, y north, as {name} has it")
        elif unit == "web":
            notes.tell(f"coordinates of a web map ({name}) made metres on the ground")
        return unit
    fits = not len(points) or (np.abs(points).max(axis=0) <= (180, 90)).all()
    notes.tell(
        "coordinates taken as longitude and latitude, as the standard has it"
        if fits
        else "coordinates taken as metres: they cannot be longitude and latitude"
    )
    return "degrees" if fits else "metres"


def _shape(given: _Given, rules: CachedRules, notes: Notes) -> Shape | None:
    """Returns what is to be an obstacle; None where a tag rule says that it is none."""
    properties = given.properties
    rule, is_passed_over = rules.decide(_tags(properties))
    if "destroyable" not in properties and is_passed_over:
        notes.add(NOT_IN_THE_WAY, example=given.called)
        return None
    destroyable = properties.get("destroyable", rule.destroyable if rule else True)
    options = {
        # Columns of true and false come as 1 and 0 from formats that have no such type.
        "destroyable": bool(destroyable) if destroyable in (0, 1) else destroyable,
        "removal_cost": properties.get("removal_cost", rule.removal_cost if rule else 1.0),
        "name": str(properties.get("name", "")),
    }
    if not given.is_line:
        return Shape(given.parts, given.called, options)
    width = (rule.width if rule else None) or _LINE_WIDTH
    return Shape(
        wall_parts(given.parts[0][0], width, called=given.called, notes=notes),
        given.called,
        options,
    )


def _tags(properties: dict[str, Any]) -> dict[str, Any]:
    """Returns the tags among a feature's properties.

    Besides plain properties these are an object "tags" (osmtogeojson) and a text "other_tags" of
    "key"=>"value" pairs (ogr2ogr).
    """
    tags = {
        key: value
        for key, value in properties.items()
        if isinstance(value, str | int | float) and value != ""
    }
    if isinstance(properties.get("tags"), dict):
        tags = {
            key: value for key, value in properties["tags"].items() if isinstance(value, str)
        } | tags
    if isinstance(properties.get("other_tags"), str):
        tags = dict(_HSTORE.findall(properties["other_tags"])) | tags
    return tags


def _all_given(document: dict[str, Any], notes: Notes) -> Iterator[_Given]:
    for called, feature in _features(document, "features"):
        if feature is None:
            notes.add(NO_GEOMETRY, example=called)
            continue
        if not isinstance(feature, dict):
            raise ValueError(f"{called} must be an object, got {type(feature).__name__}")
        properties = _properties(feature.get("properties") or {}, called, notes)
        geometry = feature.get("geometry")
        if geometry is None or geometry == {}:
            notes.add(NO_GEOMETRY, example=called)
            continue
        polygons, lines = _parts_of(geometry, called, notes)
        if polygons:
            yield _Given(polygons, False, properties, called)
        yield from (_Given([[line]], True, properties, called) for line in lines)


def _features(document: dict[str, Any], where: str) -> Iterator[tuple[str, Any]]:
    """Yields each feature with its name in messages; a collection among them is opened."""
    if document["type"] != "FeatureCollection":
        yield f"{where}[0]", document if document["type"] == "Feature" else {"geometry": document}
        return
    features = document.get("features")
    if not isinstance(features, list):
        raise ValueError("a FeatureCollection has a list of features")
    for index, feature in enumerate(features):
        called = f"{where}[{index}]"
        if isinstance(feature, dict) and feature.get("type") == "FeatureCollection":
            yield from _features(feature, f"{called}.features")
        elif (
            isinstance(feature, dict)
            and feature.get("type") in TYPES
            and feature["type"] != "Feature"
        ):
            yield called, {"geometry": feature}  # a bare geometry in the place of a feature
        else:
            yield called, feature


def _properties(properties: Any, called: str, notes: Notes) -> dict[str, Any]:
    """Returns the properties that have a value: null is none, and NaN is what some programs
    write for it.
    """
    if not isinstance(properties, dict):
        raise ValueError(f"{called}: properties must be an object, got {type(properties).__name__}")
    odd = [
        name
        for name, value in properties.items()
        if isinstance(value, float) and not math.isfinite(value)
    ]
    notes.add(NO_VALUE, len(odd), example=f"{called}: {odd[0]}" if odd else "")
    return {
        name: value for name, value in properties.items() if value is not None and name not in odd
    }


def _parts_of(geometry: Any, called: str, notes: Notes) -> tuple[list[list[Any]], list[Any]]:
    """Returns the polygons and the lines of a geometry, their points as the file has them."""
    if not isinstance(geometry, dict) or not isinstance(geometry.get("type"), str):
        raise ValueError(f"{called}: a geometry must be an object with a type")
    kind, coordinates = geometry["type"], geometry.get("coordinates")
    if kind == "GeometryCollection":
        return _parts_of_all(geometry.get("geometries"), called, notes)
    if kind in ("Point", "MultiPoint"):
        notes.add(POINTLESS, example=called)
        return [], []
    if kind not in TYPES:
        raise ValueError(f"{called}: a geometry of type {kind!r} is not known")
    if coordinates is not None and not isinstance(coordinates, list):
        raise ValueError(f"{called}: the coordinates of a {kind} must be a list")
    parts = [coordinates] if kind in ("Polygon", "LineString") else coordinates or [None]
    # An empty list, like null, stands for nothing; a polygon without its outer ring has no holes
    # either.
    there = [
        part
        for part in parts
        if part and not (kind.endswith("Polygon") and isinstance(part, list) and not part[0])
    ]
    notes.add(NO_PART, len(parts) - len(there), example=called)
    if kind.endswith("LineString"):
        return [], there
    polygons = []
    for part in there:
        if not isinstance(part, list):
            raise ValueError(f"{called}: a polygon must be a list of rings")
        rings = [ring for ring in part if ring not in (None, [])]
        notes.add(NO_PART, len(part) - len(rings), example=called)
        polygons.append(rings)
    return polygons, []


def _parts_of_all(geometries: Any, called: str, notes: Notes) -> tuple[list[list[Any]], list[Any]]:
    """Returns the polygons and the lines of a collection of geometries."""
    if geometries is not None and not isinstance(geometries, list):
        raise ValueError(
            f"{called}: the geometries of a GeometryCollection must be a list, got {geometries!r}"
        )
    there = [one for one in geometries or [] if one is not None and one != {}]
    num_empty = len(geometries) - len(there) if geometries else 1
    notes.add(NO_PART, num_empty, example=called)
    apart = [_parts_of(one, called, notes) for one in there]
    return [polygon for polygons, _ in apart for polygon in polygons], [
        line for _, lines in apart for line in lines
    ]


def _all_points(given: Sequence[_Given], notes: Notes) -> tuple[np.ndarray, list[int]]:
    """Returns the points of all rings and lines one after the other, float64 [K, 2], and where
    each of them ends; rings that are not closed are counted.
    """
    rings = [ring for one in given for part in one.parts for ring in part]
    points, sizes = _plain_points(rings)
    if points is None:  # something is odd: ring by ring, so that the message names the feature
        called = [one.called for one in given for part in one.parts for _ in part]
        arrays = [_points(ring, name) for ring, name in zip(rings, called)]
        sizes = [len(array) for array in arrays]
        points = np.concatenate(arrays) if arrays else np.zeros((0, 2))
    ends = np.cumsum(sizes, dtype=np.int64)
    is_open = (points[ends - np.array(sizes, np.int64)] != points[ends - 1]).any(axis=1)
    if is_open.any():
        owners = [one for one in given for part in one.parts for _ in part]
        for index in np.flatnonzero(is_open).tolist():
            notes.add(UNCLOSED, int(not owners[index].is_line), example=owners[index].called)
    return points, ends.tolist()


def _plain_points(rings: list[Any]) -> tuple[np.ndarray | None, list[int]]:
    """Returns the points of all rings, float64 [K, 2], and the size of each ring; None where a
    ring is not simply a list of points with finite numbers.
    """
    if set(map(type, rings)) != {list} or not all(rings):
        return None, []
    pairs = list(itertools.chain.from_iterable(rings))
    if set(map(type, pairs)) != {list}:
        return None, []
    lengths = set(map(len, pairs))
    if lengths != {2}:  # what follows, such as the height, is left out
        if min(lengths) < 2:
            return None, []
        pairs = [pair[:2] for pair in pairs]
    numbers = list(itertools.chain.from_iterable(pairs))
    if not set(map(type, numbers)) <= {int, float}:
        return None, []
    try:
        points = np.array(numbers, np.float64).reshape(-1, 2)
    except OverflowError:
        return None, []
    return (points if np.isfinite(points).all() else None), list(map(len, rings))


def _points(line: Any, called: str) -> np.ndarray:
    """Returns float64 [K, 2]; what follows the first two numbers of a point, such as its height,
    is left out.
    """
    try:
        points = np.array([[_number(number, called) for number in point[:2]] for point in line])
    except TypeError as error:
        raise ValueError(f"{called}: a point must be a list of numbers [x, y]") from error
    except ValueError as error:
        if str(error).startswith(called):
            raise
        raise ValueError(f"{called}: a point must be a list of numbers [x, y]") from error
    if points.ndim != 2 or points.shape[1:] != (2,):
        raise ValueError(
            f"{called}: a ring or line must be a list of points [x, y], with one point at least"
        )
    return points


def _number(value: Any, called: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError("no number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if math.isnan(number):
        raise ValueError(f"{called}: NaN is no coordinate: numbers must be finite")
    if math.isinf(number):
        raise ValueError(
            f"{called}: coordinates must be finite: one is infinite, or has so many digits that it"
            " counts as infinite"
        )
    return number


def _own(document: dict[str, Any]) -> dict[str, Any]:
    """Returns what `write_geojson` adds; {} where another wrote the file."""
    own = document.get(_OWN, {})
    if not isinstance(own, dict):
        raise ValueError(f"the member {_OWN!r} must be an object, got {type(own).__name__}")
    return own


def _box(box: Any) -> list[float] | None:
    """Returns the box a file states, (x_min, y_min, x_max, y_max), without heights; None where it
    states none.
    """
    if box is None:
        return None
    if not (isinstance(box, list) and len(box) in (4, 6)):
        raise ValueError(f"a bbox holds 4 or 6 numbers, got {str(box)[:60]}")
    half = len(box) // 2
    try:
        return [_number(number, "bbox") for number in (*box[:2], *box[half : half + 2])]
    except TypeError as error:
        raise ValueError(f"a bbox holds 4 or 6 numbers, got {str(box)[:60]}") from error
