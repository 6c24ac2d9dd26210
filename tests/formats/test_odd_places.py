"""Places as other programs write them: each file with its right result
(tests/odd_inputs/places).
"""

import json
import pathlib

import numpy as np
import pytest

from srt_jax.cli import run
from srt_jax.formats import geojson, osm
from srt_jax.formats.geojson import read_geojson
from srt_jax.formats.movingai import read_map
from srt_jax.formats.notes import Notes
from srt_jax.formats.osm import read_osm
from srt_jax.formats.outlines.coordinate_systems import unit_of

pytest.importorskip("osmium")
shapely = pytest.importorskip("shapely")

PLACES = pathlib.Path(__file__).resolve().parents[1] / "odd_inputs" / "places"
ON_OSM = "--cell-side 4 --start 13,1 --goal 13,26"
ON_METRES = "--units metres --cell-side 1 --start 5,0 --goal 5,9"

SOLVED_CASES = [
    ("ways_before_nodes.osm", ON_OSM, "UNSOLVABLE", None),
    ("fence_lost_nodes.osm", ON_OSM, "UNSOLVABLE", osm.LOST_NODES),
    ("way_without_nodes.osm", ON_OSM, "UNSOLVABLE", osm.NO_NODES),
    ("josm_new_objects.osm", ON_OSM, "UNSOLVABLE", None),
    ("two_bounds.osm", ON_OSM, "UNSOLVABLE", "27 x 27 cells of 4.000 m"),
    ("underground.osm", ON_OSM, "PATH_EXISTS", osm.NOT_IN_THE_WAY),
    ("wall_area_relation.osm", ON_OSM, "SOLVED", None),
    (
        "held_river.osm",
        "--size 50 --start 25,0 --goal 25,49",
        "UNSOLVABLE",
        "1 obstacles by the tag natural, 1 of them indestructible",
    ),
    ("null_attributes.geojson", ON_METRES, "SOLVED", None),
    ("null_in_collection.geojson", ON_METRES, "SOLVED", geojson.NO_PART),
    ("empty_ring.geojson", ON_METRES, "SOLVED", geojson.NO_PART),
    ("nan_attribute.geojson", ON_METRES, "SOLVED", geojson.NO_VALUE),
    ("etrs89_degrees.geojson", ON_OSM, "SOLVED", "27 x 27 cells of 4.000 m"),
    ("web_mercator.geojson", "--cell-side 10", "PATH_EXISTS", "10 x 10 cells of 10.000 m"),
]


@pytest.mark.parametrize(("name", "options", "status", "noted"), SOLVED_CASES)
def test_an_odd_place_has_its_right_answer(monkeypatch, capsys, name, options, status, noted):
    monkeypatch.chdir(PLACES)
    code = run(["solve", name, *options.split(), "--json"])
    answer = json.loads(capsys.readouterr().out)
    (task,) = answer["tasks"]
    assert (task["status"], code) == (status, int(status == "UNSOLVABLE"))
    assert len(task["destroyed"]) == (status == "SOLVED")
    notes = {note["what"]: note["count"] for note in answer["notes"]}
    assert noted is None or noted in notes
    assert not [what for what in notes if "missing" in what and what != noted]


REFUSED_CASES = [
    (
        "break_long_integer.geojson",
        "coordinates must be finite: one is infinite, or has so many digits",
    ),
    (
        "break_geometries_number.geojson",
        r"features[0]: the geometries of a GeometryCollection must be a list",
    ),
]


@pytest.mark.parametrize(("name", "message"), REFUSED_CASES)
def test_a_faulty_place_is_refused_in_one_line(monkeypatch, capsys, name, message):
    monkeypatch.chdir(PLACES)
    assert run(["solve", name]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and message in err


def test_a_hole_outside_its_shell_takes_away_nothing_and_adds_nothing(
    monkeypatch, tmp_path, capsys
):
    monkeypatch.chdir(PLACES)
    target = tmp_path / "hole_outside.map"
    assert (
        run(
            [
                "convert",
                "hole_outside.geojson",
                str(target),
                "--units",
                "metres",
                "--cell-side",
                "1",
            ]
        )
        == 0
    )
    np.testing.assert_array_equal(~read_map(target), np.tile(np.arange(10) == 4, (10, 1)))


# --- OpenStreetMap of JOSM, Overpass, osmium, osmosis

CORNERS = {1: (11.0, 48.0), 2: (11.001, 48.0), 3: (11.001, 48.001), 4: (11.0, 48.001)}
BOX = '<bounds minlat="47.99" minlon="10.99" maxlat="48.01" maxlon="11.01"/>'


def node(number, place=None, **more):
    lon, lat = place or CORNERS[number]
    return f'<node id="{number}" {given(more)} lon="{lon}" lat="{lat}"/>'


def given(attributes):
    return " ".join(f'{key}="{value}"' for key, value in attributes.items())


def way(number, refs, tags="building=yes", **more):
    inside = "".join(f'<nd ref="{ref}"/>' for ref in refs) + tagged(tags)
    return f'<way id="{number}" {given(more)}>{inside}</way>'


def relation(number, members, tags="building=yes;type=multipolygon", **more):
    inside = "".join(f'<member type="way" ref="{ref}" role="{role}"/>' for ref, role in members)
    return f'<relation id="{number}" {given(more)}>{inside}{tagged(tags)}</relation>'


def tagged(tags):
    pairs = [pair.split("=") for pair in tags.split(";") if pair]
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in pairs)


def osm_text(*parts, box=BOX):
    return f"<?xml version='1.0' encoding='UTF-8'?><osm version='0.6'>{box}{''.join(parts)}</osm>"


NODES = "".join(node(number) for number in CORNERS)
RING = [1, 2, 3, 4, 1]


@pytest.fixture
def read(tmp_path):
    def reading(text, name="town.osm", **options):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        notes = Notes()
        reader = read_geojson if "json" in name.lower() else read_osm
        return reader(tmp_path / name, notes=notes, **options), notes

    return reading


def areas(place):
    shapes = [
        shapely.union_all([shapely.Polygon(part[0], part[1:]) for part in one.parts])
        for one in place.obstacles
    ]
    return [shape.area for shape in shapes]


def whole_area(read):
    (area,) = areas(read(osm_text(NODES, way(1, RING)))[0])
    return area


SAME = {
    "relations, ways, nodes": (
        osm_text(relation(9, [(1, "outer")]), way(1, RING, ""), NODES),
        "relation 9",
    ),
    "each way after its nodes": (
        osm_text(node(2), way(1, RING), node(1), node(4), node(3)),
        "way 1",
    ),
    "a newer version first": (
        osm_text(way(1, RING, version=3), way(1, RING, "", version=2), NODES),
        "way 1",
    ),
    "two versions of a node": (
        osm_text(
            node(1, version=2),
            node(1, (10.9, 47.9), version=1),
            *map(node, (2, 3, 4)),
            way(1, RING),
        ),
        "way 1",
    ),
    "ids below 0 and above": (
        osm_text(NODES.replace('id="3"', 'id="-3"'), way(-7, [1, 2, -3, 4, 1])),
        "way -7",
    ),
    "a way closed by a second node at the same place": (
        osm_text(NODES, node(5, CORNERS[1]), way(1, [1, 2, 3, 4, 5])),
        "way 1",
    ),
    "corners written inside the way, as 'out geom' does": (
        osm_text(
            '<way id="1"><bounds minlat="1" minlon="1" maxlat="2" maxlon="2"/><center lat="48"'
            ' lon="11"/>'
            + "".join(f'<nd ref="{n}" lon="{CORNERS[n][0]}" lat="{CORNERS[n][1]}"/>' for n in RING)
            + '<tag k="building" v="yes"/></way>'
        ),
        "way 1",
    ),
    "notes of the server": (
        osm_text(
            "<note>The data is under ODbL</note><meta osm_base='2024-01-01T00:00:00Z'/>",
            NODES,
            way(1, RING),
        ),
        "way 1",
    ),
    "deleted objects still in the file (JOSM)": (
        osm_text(
            NODES,
            way(1, RING),
            way(2, [1, 2, 3, 1], action="delete"),
            node(8, (12, 49), action="delete"),
        ),
        "way 1",
    ),
    "deleted objects without a place (a history)": (
        osm_text(
            NODES,
            '<node id="8" visible="false" version="2"/>',
            way(1, RING),
            way(2, [], visible="false", version="4"),
        ),
        "way 1",
    ),
    "the deletion is the newest version": (
        osm_text(
            NODES, way(1, RING), way(2, RING, version=1), way(2, [], "", version=2, visible="false")
        ),
        "way 1",
    ),
    "changed objects (JOSM)": (
        osm_text(NODES, way(1, RING, action="modify", visible="true")),
        "way 1",
    ),
    "an outer ring of two ways, one turned round": (
        osm_text(
            NODES,
            way(1, [1, 2, 3], ""),
            way(2, [1, 4, 3], ""),
            relation(9, [(1, "outer"), (2, "outer")]),
        ),
        "relation 9",
    ),
    "members without roles": (
        osm_text(NODES, way(1, RING, ""), relation(9, [(1, "")])),
        "relation 9",
    ),
    "a member twice": (
        osm_text(NODES, way(1, RING, ""), relation(9, [(1, "outer"), (1, "outer")])),
        "relation 9",
    ),
    "an inner ring that is missing": (
        osm_text(NODES, way(1, RING, ""), relation(9, [(1, "outer"), (77, "inner")])),
        "relation 9",
    ),
    "the bounds of osmosis": (
        osm_text(
            NODES, way(1, RING), box='<bound box="47.99,10.99,48.01,11.01" origin="osmosis"/>'
        ),
        "way 1",
    ),
    "bounds at the end": (osm_text(NODES, way(1, RING), BOX, box=""), "way 1"),
    "an empty box beside the right one": (
        osm_text(
            NODES, way(1, RING), box=BOX + '<bounds minlat="0" minlon="0" maxlat="0" maxlon="0"/>'
        ),
        "way 1",
    ),
}


@pytest.mark.parametrize("case", SAME)
def test_however_a_square_is_written_it_is_the_same_square(read, case):
    text, called = SAME[case]
    place, _ = read(text)
    assert [obstacle.name for obstacle in place.obstacles] == [f"building {called}"]
    assert areas(place)[0] == pytest.approx(whole_area(read), rel=1e-4)
    size = np.subtract(place.bounds[2:], place.bounds[:2])
    assert size == pytest.approx([0.02 * 74625, 0.02 * 111200], rel=1e-2)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "iso-8859-1"])
def test_xml_may_be_written_in_any_encoding(read, encoding):
    text = osm_text(NODES, way(1, RING, "building=yes;name=Bäckerei")).replace(
        "UTF-8", encoding.replace("-sig", "")
    )
    place, _ = read(text.encode(encoding))
    assert [obstacle.name for obstacle in place.obstacles] == ["Bäckerei"]


def test_entities_are_refused_in_every_encoding(read):
    text = (
        '<!DOCTYPE osm [<!ENTITY a "building">]>'
        + osm_text(NODES, way(1, RING, "building=ENTITY").replace("ENTITY", "&a;")).split("?>")[1]
    )
    for encoding in ("utf-8", "utf-16"):
        with pytest.raises(ValueError, match="defines entities of its own"):
            read(text.encode(encoding))


@pytest.mark.parametrize(
    "name", ["TOWN.OSM", "Town.Osm", "x.OSM.GZ", "x.osm.BZ2", "x.Osm.Pbf", "x.PBF"]
)
def test_endings_count_in_any_case(tmp_path, read, name):
    import bz2
    import gzip

    osmium = pytest.importorskip("osmium")
    text = osm_text(NODES, way(1, RING)).encode()
    if name.lower().endswith("pbf"):
        (tmp_path / "plain.osm").write_bytes(text)
        with osmium.SimpleWriter(str(tmp_path / "plain.osm.pbf")) as writer:
            for item in osmium.FileProcessor(str(tmp_path / "plain.osm")):
                writer.add(item)
        text = (tmp_path / "plain.osm.pbf").read_bytes()
    pack = {"gz": gzip.compress, "bz2": bz2.compress}.get(name.lower().rsplit(".", 1)[-1], bytes)
    place, _ = read(pack(text), name)
    assert areas(place)[0] == pytest.approx(whole_area(read), rel=1e-4)


def test_a_pbf_in_any_order_with_ids_below_0_is_read(tmp_path, read):
    osmium = pytest.importorskip("osmium")
    text = osm_text(
        way(-5, [-1, 2, 3, -4, -1]), NODES.replace('id="1"', 'id="-1"').replace('id="4"', 'id="-4"')
    )
    (tmp_path / "plain.osm").write_text(text)
    with osmium.SimpleWriter(str(tmp_path / "plain.osm.pbf")) as writer:
        for item in osmium.FileProcessor(str(tmp_path / "plain.osm")):
            writer.add(item)
    place, _ = read((tmp_path / "plain.osm.pbf").read_bytes(), "town.osm.pbf")
    assert [obstacle.name for obstacle in place.obstacles] == ["building way -5"]
    assert areas(place)[0] == pytest.approx(whole_area(read), rel=1e-4)


def test_what_is_cut_off_is_kept_as_far_as_it_is_there_and_counted(read):
    place, notes = read(
        osm_text(NODES, way(1, [1, 2, 3, 99, 1]), way(2, [98, 2, 3, 4, 98]), way(3, [1, 99, 2, 1]))
    )
    half = whole_area(read) / 2
    assert areas(place) == pytest.approx([half, half], rel=1e-6)
    assert (notes.count(osm.CUT_WAYS), notes.count(osm.LOST_NODES)) == (2, 1)
    place, notes = read(
        osm_text(NODES, way(1, [1, 99, 2], "barrier=fence"), way(2, [3], "barrier=fence"))
    )
    assert len(place.obstacles) == 1 and notes.count(osm.SHORTENED) == 1
    assert notes.count("lines left out: fewer than two different points") == 1


def test_a_river_cut_off_by_the_border_keeps_its_water(read):
    """Its two banks are there; the ways that join them lie beyond the border of the extract."""
    banks = [way(1, [1, 4], ""), way(2, [3, 2], "")]
    members = [(1, "outer"), (77, "outer"), (2, "outer"), (78, "outer")]
    place, notes = read(
        osm_text(NODES, *banks, relation(9, members, "natural=water;type=multipolygon"))
    )
    assert (
        areas(place) == pytest.approx([whole_area(read)], rel=1e-6)
        and not place.obstacles[0].destroyable
    )
    assert notes.count(osm.CUT_RELATIONS) == 1
    gone, notes = read(osm_text(NODES, way(1, RING), relation(9, [(77, "outer")])))
    assert len(gone.obstacles) == 1 and notes.count(osm.LOST_MEMBERS) == 1


def test_rings_that_close_stay_where_others_do_not(read):
    inside = {5: (11.0002, 48.0002), 6: (11.0008, 48.0002), 7: (11.0008, 48.0008)}
    more = "".join(node(number, place) for number, place in inside.items())
    ways = [way(1, RING, ""), way(2, [5, 6, 7, 5], ""), way(3, [5, 6, 7], "")]
    for role in ("inner", "outer", ""):
        place, notes = read(osm_text(NODES, more, *ways, relation(9, [(1, "outer"), (2, role)])))
        assert len(place.obstacles[0].parts[0]) == 2 and areas(place)[0] == pytest.approx(
            0.82 * whole_area(read), rel=1e-3
        )
        assert not [note for note in notes if "made valid" in note.what or "left out" in note.what]
    place, notes = read(osm_text(NODES, more, *ways, relation(9, [(1, "outer"), (3, "outer")])))
    assert (
        areas(place)[0] == pytest.approx(whole_area(read), rel=1e-6)
        and notes.count(osm.BROKEN_RELATIONS) == 1
    )


def test_barriers_drawn_as_areas_are_areas(read):
    tags = "barrier=wall"
    for text in (
        osm_text(NODES, way(1, RING, tags + ";area=yes")),
        osm_text(NODES, way(1, RING, ""), relation(9, [(1, "outer")], tags + ";type=multipolygon")),
    ):
        place, _ = read(text)
        assert (
            areas(place) == pytest.approx([whole_area(read)], rel=1e-6)
            and place.obstacles[0].destroyable
        )
    place, _ = read(osm_text(NODES, way(1, RING, tags)))  # a wall round a yard
    assert areas(place)[0] < 0.05 * whole_area(read)


@pytest.mark.parametrize("box", [True, False])
def test_a_place_across_the_meridian_of_180_degrees_lies_in_one_piece(read, box):
    east = {1: (179.9995, 0.0), 2: (-179.9995, 0.0), 3: (-179.9995, 0.001), 4: (179.9995, 0.001)}
    nodes = "".join(node(number, place) for number, place in east.items())
    bounds = (
        '<bounds minlat="-0.001" minlon="179.99" maxlat="0.002" maxlon="-179.99"/>' if box else ""
    )
    place, _ = read(osm_text(nodes, way(1, RING), box=bounds))
    assert areas(place) == pytest.approx([111.3 * 110.6], rel=1e-2)
    assert place.bounds[2] - place.bounds[0] == pytest.approx(2226 if box else 111.3, rel=1e-2)
    halves = [
        '<bounds minlat="-0.001" minlon="179.99" maxlat="0.002" maxlon="180"/>',
        '<bounds minlat="-0.001" minlon="-180" maxlat="0.002" maxlon="-179.99"/>',
    ]
    place, _ = read(osm_text(nodes, way(1, RING), box="".join(halves)))
    assert place.bounds[2] - place.bounds[0] == pytest.approx(2226, rel=1e-2)


def test_the_server_that_ran_out_of_time_is_quoted(read):
    text = osm_text(
        NODES, way(1, RING), "<remark> runtime error: Query timed out in 25 seconds. </remark>"
    )
    assert any("Query timed out" in str(note) for note in read(text)[1])


REFUSED_OSM = {
    "another kind of file": ("<osmChange version='0.6'/>", "its first element is <osmChange>"),
    "a web page": ("<html><body>busy</body></html>", "its first element is <html>"),
    "cut off": (osm_text(NODES, way(1, RING))[:-20], "no whole OpenStreetMap extract"),
    "a node off the globe": (osm_text(node(1, (11, 480))), "lie on no globe"),
    "a node without a latitude": (osm_text('<node id="1" lon="11"/>'), "an element lacks 'lat'"),
    "bounds upside down": (
        osm_text(box='<bounds minlat="9" minlon="1" maxlat="8" maxlon="2"/>'),
        "are no box",
    ),
    "JSON of Overpass": ('{"version": 0.6, "elements": []}', "no whole OpenStreetMap extract"),
    "an id of more than 64 bits": (
        osm_text(node(10**25, (11, 48))),
        "line 1: an id has more than 64 bits",
    ),
    "a reference that is none": (osm_text(NODES, way(1, [1.5])), "line 1: invalid literal"),
    "nothing": ("", "no whole OpenStreetMap extract"),
}


@pytest.mark.parametrize("case", REFUSED_OSM)
def test_what_is_no_extract_is_refused_in_one_line(read, case):
    text, message = REFUSED_OSM[case]
    with pytest.raises(ValueError, match=message) as caught:
        read(text)
    assert "\n" not in str(caught.value) and "town.osm" in str(caught.value)


# --- GeoJSON of QGIS, ogr2ogr, geojson.io, GeoPandas, osmtogeojson

SQUARE = [[0, 0], [400, 0], [400, 300], [0, 300], [0, 0]]


def feature(properties=None, coordinates=(SQUARE,), kind="Polygon"):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": kind, "coordinates": coordinates},
    }


def collection(*features, **members):
    return json.dumps({"type": "FeatureCollection", "features": list(features)} | members)


PROPERTIES = [
    ({"building": None}, True),
    ({"building": "yes"}, False),
    ({"building": True}, False),
    ({"building": "no"}, True),
    ({"building": False}, True),
    ({"building": ""}, True),
    ({"osm_id": "1", "other_tags": '"building"=>"yes","height"=>"3"'}, False),
    ({"other_tags": None, "building": None}, True),
    ({"tags": {"building": "yes"}, "id": 1}, False),
    ({"destroyable": 0}, False),
    ({"destroyable": 1, "building": "yes"}, True),
    ({"destroyable": None, "removal_cost": None, "building": "yes"}, False),
    ({"natural": "water"}, False),
    ([], True),
    (None, True),
]


@pytest.mark.parametrize(("properties", "destroyable"), PROPERTIES, ids=lambda value: str(value))
def test_properties_are_read_as_programs_write_them(read, properties, destroyable):
    place, _ = read(collection(feature(properties)), "town.geojson")
    assert [obstacle.destroyable for obstacle in place.obstacles] == [destroyable]
    assert [obstacle.removal_cost for obstacle in place.obstacles] == [1.0]


def test_names_and_ids_may_be_numbers_of_any_length(read):
    place, _ = read(
        collection(feature({"name": 0, "id": 10**60}), feature({"name": 17})), "town.geojson"
    )
    assert [obstacle.name for obstacle in place.obstacles] == ["0", "17"]


def test_what_is_in_nobodys_way_is_left_out_and_counted(read):
    features = [feature({"building": "yes", "layer": layer}) for layer in (-1, "-1", 0, None, "2")]
    place, notes = read(collection(*features), "town.geojson")
    assert len(place.obstacles) == 3 and notes.count(geojson.NOT_IN_THE_WAY) == 2


ODD_GEOMETRIES = [
    (None, geojson.NO_GEOMETRY),
    ({}, geojson.NO_GEOMETRY),
    ({"type": "Polygon", "coordinates": []}, geojson.NO_PART),
    ({"type": "Polygon", "coordinates": None}, geojson.NO_PART),
    ({"type": "Polygon"}, geojson.NO_PART),
    ({"type": "Polygon", "coordinates": [[]]}, geojson.NO_PART),
    ({"type": "Polygon", "coordinates": [None]}, geojson.NO_PART),
    ({"type": "Polygon", "coordinates": [[], SQUARE]}, geojson.NO_PART),
    ({"type": "MultiPolygon", "coordinates": []}, geojson.NO_PART),
    ({"type": "MultiPolygon", "coordinates": [[]]}, geojson.NO_PART),
    ({"type": "MultiPolygon", "coordinates": [[[]]]}, geojson.NO_PART),
    ({"type": "MultiLineString", "coordinates": [[]]}, geojson.NO_PART),
    ({"type": "LineString", "coordinates": None}, geojson.NO_PART),
    (
        {"type": "LineString", "coordinates": [[1, 2]]},
        "lines left out: fewer than two different points",
    ),
    ({"type": "GeometryCollection", "geometries": []}, geojson.NO_PART),
    ({"type": "GeometryCollection", "geometries": None}, geojson.NO_PART),
    ({"type": "GeometryCollection", "geometries": [None, {}]}, geojson.NO_PART),
    (
        {
            "type": "GeometryCollection",
            "geometries": [{"type": "GeometryCollection", "geometries": [None]}],
        },
        geojson.NO_PART,
    ),
]


@pytest.mark.parametrize(("geometry", "noted"), ODD_GEOMETRIES, ids=lambda value: str(value))
def test_geometries_of_nothing_are_left_out_and_counted(read, geometry, noted):
    odd = {"type": "Feature", "properties": {}, "geometry": geometry}
    place, notes = read(collection(odd, feature()), "town.geojson")
    assert areas(place) == [400 * 300] and notes.count(noted) > 0


def test_collections_within_collections_and_bare_geometries_are_opened(read):
    polygon = feature()["geometry"]
    deep = {"type": "GeometryCollection", "geometries": [polygon]}
    deep = {"type": "GeometryCollection", "geometries": [deep]}
    inner = {"type": "FeatureCollection", "features": [feature(), None]}
    text = collection({"type": "Feature", "properties": {}, "geometry": deep}, inner, polygon)
    place, notes = read(text, "town.geojson")
    assert areas(place) == [120000] * 3 and notes.count(geojson.NO_GEOMETRY) == 1


@pytest.mark.parametrize("more", [[7.5], [None], [7.5, 1.0], [float("nan")]])
def test_heights_are_left_out(read, more):
    place, _ = read(
        collection(feature(coordinates=[[[*point, *more] for point in SQUARE]])), "town.geojson"
    )
    assert areas(place) == [400 * 300]


def test_a_hole_takes_away_what_it_shares_with_its_polygon(read):
    hole = [[300, 100], [500, 100], [500, 200], [300, 200], [300, 100]]
    place, _ = read(collection(feature(coordinates=[SQUARE, hole])), "town.geojson")
    assert areas(place) == [400 * 300 - 100 * 100]
    twice = [[[50, 50], [100, 50], [100, 100], [50, 100]]] * 2
    place, _ = read(collection(feature(coordinates=[SQUARE, *twice])), "town.geojson")
    assert areas(place) == [400 * 300 - 50 * 50]


DEGREES = [[24.0, 60.0], [24.001, 60.0], [24.001, 60.001], [24.0, 60.001], [24.0, 60.0]]


def named(crs):
    return {"type": "name", "properties": {"name": crs}}


@pytest.mark.parametrize(
    ("crs", "unit"),
    [
        (named("urn:ogc:def:crs:OGC:1.3:CRS84"), "degrees"),
        (named("urn:ogc:def:crs:EPSG::4258"), "degrees"),
        (named("urn:ogc:def:crs:EPSG::4269"), "degrees"),
        (named("urn:ogc:def:crs:EPSG:6.3:4326"), "degrees"),
        (named("EPSG:4326"), "degrees"),
        (named("epsg:4283"), "degrees"),
        (named("http://www.opengis.net/def/crs/EPSG/0/4326"), "degrees"),
        (named("http://www.opengis.net/def/crs/OGC/1.3/CRS84"), "degrees"),
        (named("WGS 84"), "degrees"),
        ({"type": "EPSG", "properties": {"code": 4326}}, "degrees"),
        ("EPSG:4326", "degrees"),
        (
            {"type": "GeographicCRS", "name": "ETRS89", "id": {"authority": "EPSG", "code": 4258}},
            "degrees",
        ),
        (named("urn:ogc:def:crs:EPSG::3857"), "web"),
        (named("EPSG:900913"), "web"),
        (named("WGS 84 / Pseudo-Mercator"), "web"),
        (named("urn:ogc:def:crs:EPSG::32633"), "metres"),
        (named("urn:ogc:def:crs:EPSG::25832"), "metres"),
        (named("EPSG:3035"), "metres"),
        (named("EPSG:27700"), "metres"),
        (named("EPSG:3879"), "metres"),
        (named("WGS 84 / UTM zone 33N"), "metres"),
    ],
)
def test_a_named_coordinate_system_has_its_units(crs, unit):
    assert unit_of(crs)[0] == unit


@pytest.mark.parametrize(
    "crs", [named("EPSG:2263"), named("EPSG:4807"), named("local grid"), {"type": "link"}, 7, [1]]
)
def test_a_coordinate_system_that_is_not_known_is_refused_with_the_remedy(read, crs):
    text = collection(feature(), crs=crs)
    with pytest.raises(ValueError, match=r"coordinate system|'crs' must be"):
        read(text, "town.geojson")
    place, _ = read(text, "town.geojson", units="metres")
    assert areas(place) == [400 * 300]


def test_web_maps_are_brought_to_metres_on_the_ground(read):
    """The same square in degrees and in the metres of a web map (pyproj gives these numbers)."""
    web = [
        [2671667.78, 8399737.89],
        [2671779.10, 8399737.89],
        [2671779.10, 8399960.54],
        [2671667.78, 8399960.54],
    ]
    one, _ = read(collection(feature(coordinates=[web]), crs=named("EPSG:3857")), "town.geojson")
    other, _ = read(collection(feature(coordinates=[DEGREES])), "town.geojson")
    assert areas(one) == pytest.approx(areas(other), rel=1e-3)


def test_geojson_across_the_meridian_of_180_degrees_lies_in_one_piece(read):
    halves = [
        [[[179.9995, 0], [180, 0], [180, 0.001], [179.9995, 0.001], [179.9995, 0]]],
        [[[-180, 0], [-179.9995, 0], [-179.9995, 0.001], [-180, 0.001], [-180, 0]]],
    ]
    text = collection(
        feature(coordinates=halves, kind="MultiPolygon"), bbox=[179.999, -0.001, -179.999, 0.002]
    )
    place, _ = read(text, "town.geojson")
    assert areas(place) == pytest.approx([111.3 * 110.6], rel=1e-2)
    assert place.bounds[2] - place.bounds[0] == pytest.approx(222.6, rel=1e-2)


REFUSED_GEOJSON = {
    "NaN": (
        collection(feature(coordinates=[[[0, 0], [float("nan"), 0], [1, 1]]])),
        r"features\[0\]: NaN is no coordinate",
    ),
    "infinite": (
        collection(feature(coordinates=[[[0, 0], [float("inf"), 0], [1, 1]]])),
        "must be finite",
    ),
    "a text": (
        collection(feature(coordinates=[[["0", "0"], [1, 0], [1, 1]]])),
        "a list of numbers",
    ),
    "true": (collection(feature(coordinates=[[[True, 0], [1, 0], [1, 1]]])), "a list of numbers"),
    "null": (collection(feature(coordinates=[[[0, None], [1, 0], [1, 1]]])), "a list of numbers"),
    "a depth too few": (collection(feature(coordinates=SQUARE)), r"features\[0\]"),
    "a box of NaN": (collection(feature(), bbox=[0, 0, float("nan"), 1]), "bbox: NaN"),
    "a box of texts": (collection(feature(), bbox=["0", "0", "1", "1"]), "4 or 6 numbers"),
    "geometries": (
        collection(
            {"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": {}}}
        ),
        "geometries of a GeometryCollection must be a list",
    ),
}


@pytest.mark.parametrize("case", REFUSED_GEOJSON)
def test_what_is_no_geojson_is_refused_with_the_feature(read, case):
    text, message = REFUSED_GEOJSON[case]
    with pytest.raises(ValueError, match=message) as caught:
        read(text, "town.geojson")
    assert "\n" not in str(caught.value) and "town.geojson" in str(caught.value)


@pytest.mark.parametrize("name", ["town.GeoJSON", "TOWN.GEOJSON", "Town.Json"])
def test_geojson_ends_in_any_case(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    pathlib.Path(name).write_text((PLACES / "null_attributes.geojson").read_text())
    assert run(["solve", name, *ON_METRES.split(), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tasks"][0]["status"] == "SOLVED"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"version": 0.6, "elements": [{"type": "node", "id": 1}]}', "Overpass's own JSON"),
        ('{"type": "Topology", "objects": {"a": {"type": "Polygon"}}}', "TopoJSON"),
        (
            '{"displayFieldName": "", "geometryType": "esriGeometryPolygon", "features": []}',
            "ArcGIS's own JSON",
        ),
    ],
)
def test_json_of_other_kinds_is_named_with_the_remedy(tmp_path, monkeypatch, capsys, text, message):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("place.json").write_text(text)
    assert run(["solve", "place.json"]) == 2
    assert f"place.json: this is {message}" in capsys.readouterr().err
