"""Fuzzy directions, distances and relocations: the table, regions and their sectors, and the signs
recognised by their images.
"""

import dataclasses
import json
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.signs.recognition import recognise
from sign_model.signs.world_model import from_signs
from sign_model.space.fuzzy import (
    direction_membership,
    direction_of,
    distance_membership,
    distance_of,
    region_names,
    region_of,
    regions_touched,
    relocation_of,
    sector_of,
)
from sign_model.space.fuzzy_table import (
    DEFAULT_TABLE,
    Direction,
    Distance,
    FuzzyTable,
    Relocation,
    load_table,
    save_table,
)
from sign_model.space.polar import (
    Sector,
    from_polar,
    in_sector,
    in_square,
    square_of_sector,
    to_polar,
    wrap,
)
from sign_model.space.spatial_signs import path_features, point_features, spatial_signs

COARSE = FuzzyTable(
    directions=(Direction("front", -100.0, 80.0), Direction("back", 80.0, 260.0)),
    distances=(Distance("here", 0.0, 3.0), Distance("there", 3.0, 8.0)),
    relocations=(
        Relocation("dash", "there", 1.0),
        Relocation("stroll", "there", 5.0),
        Relocation("step", "here", math.inf),
    ),
)
TABLES = pytest.mark.parametrize("table", [DEFAULT_TABLE, COARSE])


def points_of_regions(table, count):
    """Returns points (r, phi) strictly inside each region, [count, regions, 2]."""
    rng = np.random.default_rng(3)
    sector = sector_of(np.arange(table.num_regions), table)
    share = rng.uniform(1e-6, 1 - 1e-6, (2, count, table.num_regions))
    return np.stack(
        [
            sector.near + share[0] * (sector.far - sector.near),
            wrap(sector.start + share[1] * sector.width),
        ],
        axis=-1,
    )


@TABLES
def test_every_point_of_the_sector_of_a_region_lies_in_that_region(table):
    polar = points_of_regions(table, 500)
    origin, heading = np.array([13.0, -4.0]), np.array(2.5)
    again = to_polar(from_polar(polar, origin, heading), origin, heading)
    assert (region_of(again, table) == np.arange(table.num_regions)).all()


@TABLES
def test_every_point_lies_in_exactly_one_sector(table):
    rng = np.random.default_rng(4)
    farthest = table.distances[-1].end
    polar = np.stack(
        [rng.uniform(0, farthest, 4000), rng.uniform(-math.pi, math.pi, 4000)], axis=-1
    )
    holds = in_sector(polar[:, None], sector_of(np.arange(table.num_regions), table))
    assert (holds.sum(axis=1) == 1).all() and (
        holds.argmax(axis=1) == region_of(polar, table)
    ).all()


@TABLES
def test_the_square_of_the_sector_of_a_region_contains_its_points(table):
    polar, origin, heading = points_of_regions(table, 200), np.array([5.0, 6.0]), np.array(0.3)
    centre, side = square_of_sector(
        sector_of(np.arange(table.num_regions), table), origin, heading[None]
    )
    assert in_square(from_polar(polar, origin, heading), centre, side).all()


@TABLES
def test_the_term_of_greatest_degree_names_the_point_and_borders_have_degree_half(table):
    rng = np.random.default_rng(5)
    phi, r = rng.uniform(-math.pi, math.pi, 2000), rng.uniform(0, 2 * table.distances[-1].end, 2000)
    directions, distances = direction_membership(phi, table), distance_membership(r, table)
    assert (directions.argmax(axis=-1) == direction_of(phi, table)).all()
    assert (distances.argmax(axis=-1) == distance_of(r, table)).all()
    assert ((directions >= 0) & (directions <= 1)).all() and distance_membership(
        np.array(0.0), table
    )[0] == 1
    border = np.radians(table.directions[0].end)
    assert np.allclose(direction_membership(np.array(border), table)[:2], 0.5)
    assert np.allclose(distance_membership(np.array(table.distances[0].end), table)[:2], 0.5)


@pytest.mark.parametrize(
    "r, degrees, name",
    [
        (10, 0, "close, ahead"),
        (60, 45, "midway, ahead-left"),
        (500, 90, "afar, leftward"),
        (5000, 180, "afar, behind"),
        (50, -180, "midway, behind"),
        (49.9, -90, "close, rightward"),
        (1, 22.5, "close, ahead-left"),
        (1, -22.5, "close, ahead"),
    ],
)
def test_the_default_table_names_regions_in_plain_words(r, degrees, name):
    region = region_of(np.array([r, math.radians(degrees)]), DEFAULT_TABLE)
    assert region_names(DEFAULT_TABLE)[region] == name


@TABLES
def test_an_area_touches_exactly_the_regions_of_its_points(table):
    rng = np.random.default_rng(6)
    near = rng.uniform(0, table.distances[-1].end, 60)
    areas = Sector(
        near=near,
        far=near + rng.uniform(0, table.distances[-1].end, 60),
        start=rng.uniform(-math.pi, math.pi, 60),
        width=rng.uniform(0, 2 * math.pi, 60),
    )
    share = np.stack(
        np.meshgrid(np.linspace(0, 1, 120), np.linspace(0, 1, 400), indexing="ij")
    ).reshape(2, -1, 1)
    polar = np.stack(
        [
            areas.near + share[0] * (areas.far - areas.near),
            wrap(areas.start + share[1] * areas.width),
        ],
        axis=-1,
    )
    region = region_of(polar, table)
    has_point = (region[..., None] == np.arange(table.num_regions)).any(axis=0)
    touched = regions_touched(areas, table)
    assert (touched | ~has_point).all()
    # A fine mesh of points may miss a thin part of an area.
    assert (touched & ~has_point).mean() < 0.01


def test_an_area_beyond_the_table_belongs_to_the_last_distance():
    area = Sector(
        near=np.array(5000.0), far=np.array(6000.0), start=np.array(-0.1), width=np.array(0.2)
    )
    assert np.flatnonzero(regions_touched(area, DEFAULT_TABLE)).tolist() == [
        region_names(DEFAULT_TABLE).index("afar, ahead")
    ]


STRAIGHT = [[0, 0], [3, 0], [6, 0]]
BOW = [[0, 0], [3, 4], [6, 0]]
LOOP = [[0, 0], [3, 7], [6, 0]]
HOP = [[0, 0], [1, 9], [2, 0]]


@pytest.mark.parametrize(
    "path, name", [(STRAIGHT, "dash"), (BOW, "stroll"), (LOOP, None), (HOP, "step")]
)
def test_a_path_is_an_instance_of_the_narrowest_relocation_that_permits_it(path, name):
    found = int(relocation_of(np.array(path, float), np.array(3), COARSE))
    assert (COARSE.relocations[found].name if found >= 0 else None) == name


def test_a_path_without_points_is_no_relocation():
    path = np.array([STRAIGHT, BOW], float)
    assert relocation_of(path, np.array([0, 3]), COARSE).tolist() == [-1, 1]
    far = np.array([[0, 0], [300, 50], [600, 0]], float)
    assert (
        DEFAULT_TABLE.relocations[int(relocation_of(far, np.array(3), DEFAULT_TABLE))].name
        == "moving afar on a curve"
    )


def test_among_equally_narrow_relocations_the_earlier_row_is_chosen():
    twins = dataclasses.replace(
        COARSE, relocations=(*COARSE.relocations, Relocation("glide", "there", 1.0))
    )
    assert int(relocation_of(np.array(STRAIGHT, float), np.array(3), twins)) == 0


@TABLES
def test_a_point_is_recognised_as_its_region_by_the_images_of_the_signs(table):
    model = from_signs(spatial_signs(table))
    polar = points_of_regions(table, 4).reshape(-1, 2)
    flow = point_features(model, table, polar)[:, None]
    found = np.asarray(recognise(model.matrices, flow, levels=3).recognised)
    regions = [model.index(name) for name in region_names(table)]
    assert (found[:, regions].sum(axis=1) == 1).all()
    assert (found[:, regions].argmax(axis=1) == region_of(polar, table)).all()


def test_a_path_is_recognised_as_every_relocation_that_permits_it():
    model = from_signs(spatial_signs(COARSE))
    paths = np.array([STRAIGHT, BOW, LOOP, HOP], float)
    flow = path_features(model, COARSE, paths, np.full(4, 3))[:, None]
    found = np.asarray(recognise(model.matrices, flow, levels=2).recognised)
    names = [row.name for row in COARSE.relocations]
    recognised = [[name for name in names if row[model.index(name)]] for row in found]
    assert recognised == [["dash", "stroll"], ["stroll"], [], ["step"]]


def test_jax_arrays_give_the_same_answers_jitted():
    polar = points_of_regions(DEFAULT_TABLE, 20)
    ours = jax.jit(lambda points: region_of(points, DEFAULT_TABLE))(jnp.asarray(polar, jnp.float32))
    assert ours.dtype == jnp.int32 and (np.asarray(ours) == region_of(polar, DEFAULT_TABLE)).all()
    region = jnp.arange(DEFAULT_TABLE.num_regions)
    sector = jax.jit(lambda region: sector_of(region, DEFAULT_TABLE))(region)
    assert np.allclose(sector.start, sector_of(np.asarray(region), DEFAULT_TABLE).start)
    assert jax.jit(lambda area: regions_touched(area, DEFAULT_TABLE))(sector).shape == (24, 24)
    paths = np.array([STRAIGHT, BOW, LOOP, HOP], np.float32)
    relocations = jax.jit(lambda path, count: relocation_of(path, count, COARSE))(
        jnp.asarray(paths), jnp.full(4, 3, jnp.int32)
    )
    assert relocations.tolist() == relocation_of(paths, np.full(4, 3, np.int32), COARSE).tolist()
    model = from_signs(spatial_signs(COARSE))
    flow = jax.jit(lambda path, count: path_features(model, COARSE, path, count))(
        jnp.asarray(paths), jnp.full(4, 3, jnp.int32)
    )
    assert np.array_equal(flow, path_features(model, COARSE, paths, np.full(4, 3)))
    assert jnp.asarray(direction_membership(jnp.float32(0.1), DEFAULT_TABLE)).dtype == jnp.float32


@TABLES
def test_a_table_is_saved_and_loaded_without_loss(tmp_path, table):
    save_table(table, tmp_path / "table.json")
    assert load_table(tmp_path / "table.json") == table
    assert json.loads((tmp_path / "table.json").read_text())["relocations"][-1][2] is None


@pytest.mark.parametrize(
    "part, value, message",
    [
        (
            "directions",
            [["a", 0, 90], ["b", 100, 360]],
            "direction 'b' must start at 90.0, where 'a' ends",
        ),
        ("directions", [["a", 0, 90]], "must close the circle"),
        ("directions", [["a", 0, 0], ["b", 0, 360]], "direction 'a' must end after it starts"),
        ("directions", [], "at least one direction"),
        ("distances", [["c", 1, 2]], "the first distance, 'c', must start at 0 metres"),
        ("distances", [["front", 0, 2]], "the name 'front' occurs twice"),
        ("distances", [["c", 0]], "each row needs a name and two values"),
        ("relocations", [["m", "nowhere", 1]], "has the distance 'nowhere', which is no row"),
        ("relocations", [["m", "here", -1]], "must permit a deviation of 0 metres or more"),
        ("soft_degrees", 0, "must be positive"),
        ("colours", [], "not a table of fuzzy terms"),
    ],
)
def test_an_error_in_a_table_file_names_the_file_and_the_rule(tmp_path, part, value, message):
    path = tmp_path / "table.json"
    save_table(COARSE, path)
    path.write_text(json.dumps({**json.loads(path.read_text()), part: value}))
    with pytest.raises(ValueError, match=message) as caught:
        load_table(path)
    assert str(path) in str(caught.value)


def test_a_file_that_is_not_a_table_is_refused(tmp_path):
    (tmp_path / "table.json").write_text("{")
    with pytest.raises(ValueError, match="not JSON"):
        load_table(tmp_path / "table.json")
