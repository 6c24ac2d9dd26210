"""GeoJSON and shapely geometries: polygons with holes, lines, units, odd rings; read back equal;
broken files refused.
"""

import json
import sys

import numpy as np
import pytest

from srt_jax.formats import geojson
from srt_jax.formats.geojson import read_geojson, write_geojson
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines import geometry
from srt_jax.formats.outlines.geometry import obstacles_of, place_of
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle
from tests.helpers.odd import refusals

shapely = pytest.importorskip("shapely")

SQUARE = [[0, 0], [400, 0], [400, 400], [0, 400], [0, 0]]
HOLE = [[100, 100], [200, 100], [200, 200], [100, 200], [100, 100]]


def feature(kind, coordinates, **properties):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def collection(*features, **members):
    return {"type": "FeatureCollection", "features": list(features)} | members


@pytest.fixture
def read(tmp_path):
    def reading(document, **options):
        path = tmp_path / "place.geojson"
        path.write_text(document if isinstance(document, str) else json.dumps(document))
        notes = Notes()
        return read_geojson(path, notes=notes, **options), {note.what: note.count for note in notes}

    return reading


def test_polygons_with_holes_keep_their_properties(read):
    place, notes = read(
        collection(
            feature("Polygon", [SQUARE, HOLE], name="yard", destroyable=False, removal_cost=2.5),
            feature(
                "MultiPolygon",
                [[[[500, 0], [600, 0], [600, 90]]], [[[700, 0], [800, 0], [800, 90]]]],
                building="yes",
            ),
            feature("Polygon", [[[900, 0], [950, 0], [950, 50, 7.5], [900, 0]]]),
        )
    )
    yard, sheds, kiosk = place.obstacles
    assert (yard.name, yard.destroyable, yard.removal_cost, len(yard.parts[0])) == (
        "yard",
        False,
        2.5,
        2,
    )
    assert len(sheds.parts) == 2 and not sheds.destroyable  # by the tag rules: a building
    assert kiosk == Obstacle.polygon([(900, 0), (950, 0), (950, 50)])
    assert place.bounds == (0, 0, 950, 400)
    assert notes[geometry.UNCLOSED] == 2 and any("metres" in what for what in notes)


def test_a_place_is_read_back_equal(tmp_path):
    obstacles = (
        Obstacle.polygon([(0.1, 0.2), (30, 0), (30, 1e-9 + 20)], name="Bäcker", removal_cost=0.3),
        Obstacle((((SQUARE), HOLE), ([(500, 1), (501, 1), (501, 2)],)), destroyable=False),  # type: ignore[arg-type]
    )
    place = Place((-1, -2.5, 1000, 1000.25), obstacles, attribution="(c) me")
    write_geojson(tmp_path / "own.geojson", place)
    notes = Notes()
    assert read_geojson(tmp_path / "own.geojson", notes=notes) == place
    assert len(notes) == 0
    write_geojson(tmp_path / "empty.geojson", Place((0, 0, 1, 1), ()))
    assert read_geojson(tmp_path / "empty.geojson") == Place((0, 0, 1, 1), ())


def test_what_is_written_is_what_shapely_reads(tmp_path):
    place = Place((0, 0, 400, 400), (Obstacle((((SQUARE), HOLE),)),))  # type: ignore[arg-type]
    write_geojson(tmp_path / "own.geojson", place)
    (shape,) = shapely.get_parts(shapely.from_geojson((tmp_path / "own.geojson").read_text()))
    assert shape.equals(shapely.Polygon(SQUARE, [HOLE]))


def test_units_are_what_the_file_says_or_the_numbers_allow(read):
    small = [[24.0, 60.0], [24.001, 60.0], [24.001, 60.001], [24.0, 60.001], [24.0, 60.0]]
    in_degrees, notes = read(feature("Polygon", [small]))
    assert any("longitude and latitude, as the standard has it" in what for what in notes)
    low, high = np.reshape(in_degrees.bounds, (2, 2))
    np.testing.assert_allclose(high - low, [55.8, 111.4], rtol=1e-3)
    assert read(feature("Polygon", [small]), units="metres")[0].bounds == (
        24.0,
        60.0,
        24.001,
        60.001,
    )
    for crs, is_metres in (("urn:ogc:def:crs:OGC:1.3:CRS84", False), ("EPSG:25832", True)):
        place, _ = read(
            collection(
                feature("Polygon", [small]), crs={"type": "name", "properties": {"name": crs}}
            )
        )
        assert (place.bounds[0] == 24.0) == is_metres
    with pytest.raises(ValueError, match=r"place\.geojson: longitude 200"):
        read(feature("Polygon", [SQUARE]), units="degrees")


def test_a_stated_box_bounds_the_place(read):
    outside = feature("Polygon", [[[5000, 0], [5001, 0], [5001, 1], [5000, 0]]])
    place, notes = read(
        collection(feature("Polygon", [SQUARE]), outside, bbox=[-10, -10, 0, 500, 500, 9])
    )
    assert place.bounds == (-10, -10, 500, 500) and len(place.obstacles) == 2
    assert notes["obstacles wholly outside the bounds, kept; they cover no cell"] == 1


def test_lines_points_and_collections(read):
    fence = feature("LineString", [[500, 0], [600, 0]], barrier="wall")
    mixed = {
        "type": "GeometryCollection",
        "geometries": [
            feature("Polygon", [SQUARE])["geometry"],
            {"type": "Point", "coordinates": [1, 2]},
        ],
    }
    place, notes = read(
        collection(
            {"type": "Feature", "properties": None, "geometry": mixed},
            fence,
            {"type": "Feature", "geometry": None},
        )
    )
    square, wall = place.obstacles
    assert square == Obstacle.polygon(SQUARE) and (wall.removal_cost, wall.destroyable) == (3, True)
    assert wall.parts[0][0] and shapely.Polygon(wall.parts[0][0]).equals(
        shapely.box(499.8, -0.2, 600.2, 0.2)
    )
    assert (
        notes[geometry.POINTLESS] == 1 and notes["features passed over: they have no geometry"] == 1
    )


def test_odd_rings_are_mended_and_counted(read):
    bow_tie = [[0, 0], [200, 200], [200, 0], [0, 200], [0, 0]]
    sliver = [[500, 0], [600, 0], [500, 0]]
    spike = [[700, 0], [800, 0], [900, 0], [700, 0]]
    place, notes = read(
        collection(
            *(feature("Polygon", [ring]) for ring in (bow_tie, sliver, spike)),
            feature("Polygon", [SQUARE, sliver]),
        )
    )
    assert [len(obstacle.parts) for obstacle in place.obstacles] == [2, 1]
    assert (notes[geometry.CROSSING], notes[geometry.FLAT], notes[geometry.EMPTY]) == (2, 2, 2)


BAD = {
    "no JSON": ("{", "no whole JSON"),
    "NaN": (
        '{"type": "Polygon", "coordinates": [[[0, 0], [1, NaN], [1, 1], [0, 0]]]}',
        "NaN is no coordinate",
    ),
    "too large a number": (
        '{"type": "Polygon", "coordinates": [[[0, 0], [1e999, 0], [1, 1], [0, 0]]]}',
        "finite",
    ),
    "another kind of JSON": ('{"format": "srt-jax world"}', "no GeoJSON"),
    "a list": ("[]", "no GeoJSON"),
    "features that are none": (
        '{"type": "FeatureCollection", "features": 3}',
        "a list of features",
    ),
    "a geometry that is not known": (
        json.dumps(feature("Circle", [1, 2])),
        r"features\[0\]: a geometry of type 'Circle'",
    ),
    "a point that is none": (
        json.dumps(feature("Polygon", [[1, 2, 3]])),
        r"features\[0\]: a point must be",
    ),
    "coordinates that are none": (json.dumps(feature("Polygon", "x")), "must be a list"),
    "a removal cost below zero": (
        json.dumps(feature("Polygon", [SQUARE], removal_cost=-1)),
        "must be positive",
    ),
    "a flag that is none": (
        json.dumps(feature("Polygon", [SQUARE], destroyable="no")),
        "must be True or False",
    ),
    "nothing in it": ('{"type": "FeatureCollection", "features": []}', "no obstacle in it"),
    "a box that is none": (json.dumps(collection(bbox=[1, 2])), "4 or 6 numbers"),
    "a member twice": ('{"type": "Point", "type": "Point"}', "twice"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused_with_the_place(read, case):
    text, message = BAD[case]
    with pytest.raises(ValueError, match=message) as caught:
        read(text)
    assert "place.geojson" in str(caught.value) and "\n" not in str(caught.value)


def test_damaged_files_are_refused_in_one_line(tmp_path):
    text = json.dumps(
        collection(
            feature("Polygon", [SQUARE, HOLE], name="x"), feature("LineString", [[0, 0], [9, 9]])
        )
    )
    assert refusals(read_geojson, tmp_path / "place.geojson", text.encode(), count=100) > 50


def test_any_shapely_geometry_is_a_place():
    shapes = [
        shapely.box(0, 0, 4, 3),
        shapely.Point(9, 9).buffer(1),
        shapely.LineString([(0, 5), (5, 5)]),
        shapely.Point(1, 1),
    ]
    notes = Notes()
    place = place_of(
        [shapely.GeometryCollection(shapes)], notes=notes, destroyable=False, width=0.5
    )
    assert (
        len(place.obstacles) == 2
        and len(place.obstacles[0].parts) == 2
        and notes.count(geometry.POINTLESS) == 1
    )
    assert shapely.Polygon(place.obstacles[1].parts[0][0]).equals(
        shapely.box(-0.25, 4.75, 5.25, 5.25)
    )
    assert not any(obstacle.destroyable for obstacle in place.obstacles)
    assert place_of(shapes[:1], bounds=(0, 0, 9, 9)).bounds == (0, 0, 9, 9)
    assert obstacles_of(shapely.Polygon(), called="nothing", notes=notes) == []
    with pytest.raises(ValueError, match="give bounds"):
        place_of([])


def test_without_shapely_lines_name_the_command(read, monkeypatch):
    monkeypatch.setitem(sys.modules, "shapely", None)
    assert len(read(feature("Polygon", [SQUARE]))[0].obstacles) == 1
    with pytest.raises(ImportError, match=r"pip install '?shapely"):
        read(feature("LineString", [[500, 0], [600, 0]]))


def test_points_read_all_at_once_are_those_read_ring_by_ring():
    rings = [[[0, 0], [1.5, 0, 7], [1, 1]], [[-2, 3.25], [4, 5]], [[0.1, 0.2, 0.3, 0.4]]]
    points, sizes = geojson._plain_points(rings)
    assert sizes == [3, 2, 1]
    np.testing.assert_array_equal(
        points, np.concatenate([geojson._points(ring, "a ring") for ring in rings])
    )
    for odd in (
        [[0, True]],
        [[0, "1"]],
        [[0]],
        [],
        None,
        "ab",
        [[0, float("nan")]],
        [[0, 10**400]],
    ):
        assert geojson._plain_points([rings[0], odd])[0] is None
