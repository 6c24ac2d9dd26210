"""Rasterising: exact against slow twins in fractions and in shapely, and equal under turns,
mirrors, shifts and scales.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from srt_jax.geometry import scanlines
from srt_jax.geometry.raster import Grid, cover, grid_over, rasterize
from srt_jax.geometry.world import Obstacle, World
from srt_jax.types import FREE
from tests.helpers.pictures import drawn

GRID = Grid(origin=(0, 6), side=1, height=6, width=7)


def covered(obstacle: Obstacle, grid: Grid, rule: str = "touch") -> np.ndarray:
    return (cover([obstacle], grid, rule=rule) != FREE).any(axis=0)


def picture(text: str) -> np.ndarray:
    return ~drawn(text)[0]


# --- pictures


def test_running_along_cell_sides_is_not_meeting_them():
    wall = Obstacle.polygon([(1, 2), (3, 2), (3, 5), (1, 5)])
    expected = picture("""
        .......
        .@@....
        .@@....
        .@@....
        .......
        .......
    """)
    for rule in ("touch", "centre"):
        np.testing.assert_array_equal(covered(wall, GRID, rule), expected)


def test_a_sliver_blocks_every_cell_it_enters_by_the_touch_rule_and_none_by_the_centre_rule():
    sliver = Obstacle.polygon([(0.5, 0.2), (6.5, 5.2), (6.5, 5.2 + 1e-9)])
    np.testing.assert_array_equal(
        covered(sliver, GRID),
        picture("""
            ......@
            .....@@
            ...@@@.
            ..@@...
            .@@....
            @@.....
        """),
    )
    assert not covered(sliver, GRID, "centre").any()


def test_a_diagonal_through_corners_enters_no_neighbour():
    triangle = Obstacle.polygon([(1, 1), (5, 5), (1, 5)])
    np.testing.assert_array_equal(
        covered(triangle, GRID),
        picture("""
            .......
            .@@@@..
            .@@@...
            .@@....
            .@.....
            .......
        """),
    )


def test_a_courtyard_stays_free_and_an_island_in_it_does_not():
    block = [(0, 0), (7, 0), (7, 6), (0, 6)], [(1, 1), (6, 1), (6, 5), (1, 5)]
    island = ([(3, 3), (4, 3), (4, 4), (3, 4)],)
    np.testing.assert_array_equal(
        covered(Obstacle((block, island)), GRID),
        picture("""
            @@@@@@@
            @.....@
            @..@..@
            @.....@
            @.....@
            @@@@@@@
        """),
    )


def test_a_centre_on_the_border_counts_as_covered():
    touching = Obstacle.polygon([(1.5, 1.5), (3.5, 1.5), (3.5, 3.5)])
    expected = picture("""
        .......
        .......
        ...@...
        ..@@...
        .@@@...
        .......
    """)
    np.testing.assert_array_equal(covered(touching, GRID, "centre"), expected)


def test_what_lies_outside_the_grid_is_cut_off():
    around = Obstacle.polygon(
        [(-100, -100), (100, -100), (100, 100), (-100, 100)], [(2, 2), (200 / 3, 2), (4, 4), (2, 4)]
    )
    np.testing.assert_array_equal(
        covered(around, GRID, "centre"),
        picture("""
            @@@@@@@
            @@@@@@@
            @@.....
            @@.....
            @@@@@@@
            @@@@@@@
        """),
    )
    assert not covered(Obstacle.polygon([(20, 1), (22, 1), (22, 3)]), GRID).any()


def test_overlaps_keep_all_owners_in_as_many_layers_as_the_most_owners_of_a_cell():
    squares = [Obstacle.polygon([(x, 1), (x + 3, 1), (x + 3, 4), (x, 4)]) for x in (0, 4, 1, 3)]
    labels = cover(squares, GRID)
    assert labels.shape == (2, 6, 7) and labels.dtype == np.int32
    assert labels[:, 3].tolist() == [[0, 0, 0, 2, 1, 1, 1], [-1, 2, 2, 3, 3, 3, -1]]


def test_without_obstacles_everything_is_free_in_one_layer():
    for rule in ("touch", "centre"):
        np.testing.assert_array_equal(cover([], GRID, rule=rule), np.full((1, 6, 7), FREE))


# --- slow twins


def clipped_area(ring, box) -> Fraction:
    """Area of the part of a simple ring inside a box, by cutting it at one side after the other."""
    points = list(ring)
    for axis, limit, sign in ((0, box[0], 1), (0, box[1], -1), (1, box[2], 1), (1, box[3], -1)):
        kept = []
        for p, q in zip(points, points[1:] + points[:1]):
            a, b = sign * (p[axis] - limit), sign * (q[axis] - limit)
            if a >= 0:
                kept.append(p)
            if a * b < 0:
                share = a / (a - b)
                kept.append((p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])))
        points = kept
    return (
        abs(
            sum(
                (p[0] * q[1] - q[0] * p[1] for p, q in zip(points, points[1:] + points[:1])),
                Fraction(0),
            )
        )
        / 2
    )


def touched_in_fractions(obstacle: Obstacle, grid: Grid) -> np.ndarray:
    """An open set meets an open square exactly when they share area; numbers mean what they print
    as.
    """
    exact = [
        [[(Fraction(str(x)), Fraction(str(y))) for x, y in ring] for ring in part]
        for part in obstacle.parts
    ]
    (left, top), side = (Fraction(str(value)) for value in grid.origin), Fraction(str(grid.side))
    result = np.zeros((grid.height, grid.width), bool)
    for row, col in np.ndindex(result.shape):
        box = (left + col * side, left + (col + 1) * side, top - (row + 1) * side, top - row * side)
        areas = [
            clipped_area(part[0], box) - sum(clipped_area(hole, box) for hole in part[1:])
            for part in exact
        ]
        result[row, col] = any(area > 0 for area in areas)
    return result


def star(rng: np.random.Generator, centre, radius: float, num_points: int, digits: int):
    angle = np.sort(rng.uniform(0, 2 * np.pi, num_points))
    away = rng.uniform(0.4, 1, num_points) * radius
    return np.round(
        np.stack([centre[0] + away * np.cos(angle), centre[1] + away * np.sin(angle)], axis=1),
        digits,
    )


def random_polygon(seed: int, digits: int) -> Obstacle:
    """A star with a hole in it, at corners with few or many digits; few put many of them on the
    lattice.
    """
    rng = np.random.default_rng(seed)
    while True:
        centre = rng.uniform(0, 6, 2).round(digits)
        holes = [star(rng, centre, 1.2, 5, digits)] if rng.random() < 0.5 else []
        try:
            return Obstacle.polygon(star(rng, centre, rng.choice([1.0, 4.0]), 9, digits), *holes)
        except ValueError:
            continue


@pytest.mark.parametrize(
    ("digits", "side"), [(0, 1.0), (1, 1.0), (1, 0.7), (2, 1.3), (9, 1.0), (9, 1.123456789)]
)
def test_the_touch_rule_is_exact(digits, side):
    grid = Grid(origin=(0.1, 6.1), side=side, height=5, width=6)
    for seed in range(25):
        polygon = random_polygon(seed, digits)
        np.testing.assert_array_equal(
            covered(polygon, grid), touched_in_fractions(polygon, grid), err_msg=str(polygon)
        )


def as_shapely(obstacle: Obstacle):
    shapely = pytest.importorskip("shapely")
    return shapely.MultiPolygon([shapely.Polygon(part[0], part[1:]) for part in obstacle.parts])


def mixed_shape(seed: int, steps: int) -> Obstacle:
    """Boxes, triangles and stars united, or taken from each other, on a lattice of 1 / steps:
    holes, parts, shared corners.
    """
    shapely = pytest.importorskip("shapely")
    rng = np.random.default_rng(seed)
    shape = shapely.box(1, 1, 2, 3)
    for _ in range(rng.integers(1, 5)):
        points = rng.integers(-steps, 7 * steps, (rng.integers(3, 8), 2)) / steps
        low, high = points.min(axis=0), points.max(axis=0) + 1 / steps
        other = [
            shapely.box(*low, *high),
            shapely.Polygon(points[:3]),
            shapely.Polygon(points).buffer(0),
        ][rng.integers(3)]
        shape = shape.union(other) if rng.random() < 0.5 else shape.symmetric_difference(other)
    snapped = shapely.set_precision(shape, 1 / 64)
    polygons = [
        p for p in shapely.get_parts(snapped) if isinstance(p, shapely.Polygon) and not p.is_empty
    ]
    if not polygons:
        return Obstacle.polygon([(0, 0), (1, 0), (0, 1)])
    return Obstacle([[p.exterior.coords, *(hole.coords for hole in p.interiors)] for p in polygons])


@pytest.mark.parametrize("steps", [1, 2, 8, 64])
def test_both_rules_are_shapelys_cell_by_cell(steps):
    shapely = pytest.importorskip("shapely")
    for seed in range(100):
        obstacle, side = mixed_shape(seed, steps), (1.0, 0.5, 0.75)[seed % 3]
        grid = Grid(origin=(0, 6), side=side, height=7, width=6)
        shape = as_shapely(obstacle)
        rows, cols = np.indices((grid.height, grid.width))
        cells = shapely.box(cols * side, 6 - (rows + 1) * side, (cols + 1) * side, 6 - rows * side)
        np.testing.assert_array_equal(
            covered(obstacle, grid), shapely.relate_pattern(shape, cells, "T********")
        )
        centres = shapely.points((cols + 0.5) * side, 6 - (rows + 0.5) * side)
        np.testing.assert_array_equal(
            covered(obstacle, grid, "centre"), shapely.intersects(shape, centres)
        )


@pytest.mark.parametrize("rounding", [scanlines._ROUNDING, 1.0])
def test_floats_near_no_tie_python_integers_and_64_bits_give_the_same(monkeypatch, rounding):
    shapes = [random_polygon(seed, 1) for seed in range(20)]
    expected = [cover(shapes, GRID, rule=rule) for rule in ("touch", "centre")]
    monkeypatch.setattr(scanlines, "_FITS", 0)  # whatever the products: floats first
    monkeypatch.setattr(scanlines, "_ROUNDING", rounding)  # at 1 every quotient is a tie
    for rule, labels in zip(("touch", "centre"), expected):
        np.testing.assert_array_equal(cover(shapes, GRID, rule=rule), labels)


@pytest.mark.parametrize(("beyond", "num_cells"), [(0.0, 1), (1e-7, 2)])
def test_a_tip_just_beyond_a_far_line_between_cells_is_seen(beyond, num_cells):
    grid = Grid(origin=(0, 3e8), side=1e8, height=3, width=3)
    wedge = Obstacle.polygon([(0, 1e8), (1e8 + beyond, 1.5e8), (0, 2e8)])
    assert (cover([wedge], grid) == 0).sum() == num_cells


# --- metamorphic


def moved(obstacle: Obstacle, change) -> Obstacle:
    return Obstacle([[[change(x, y) for x, y in ring] for ring in part] for part in obstacle.parts])


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**20), rule=st.sampled_from(["touch", "centre"]))
def test_turning_mirroring_shifting_and_scaling_the_world_does_so_to_the_cells(seed, rule):
    polygon, grid = random_polygon(seed, 1), Grid(origin=(0, 6), side=1, height=6, width=6)
    cells = covered(polygon, grid, rule)
    changes = {
        "mirror": (lambda x, y: (6 - x, y), cells[:, ::-1]),
        "transpose": (lambda x, y: (6 - y, 6 - x), cells.T),
        "turn": (lambda x, y: (6 - y, x), np.rot90(cells)),
    }
    for name, (change, expected) in changes.items():
        np.testing.assert_array_equal(
            covered(moved(polygon, change), grid, rule), expected, err_msg=name
        )
    away = Grid(origin=(-400.123, 3000.7 + 6), side=1, height=6, width=6)
    shifted = moved(polygon, lambda x, y: (x - 400.123, y + 3000.7))
    np.testing.assert_array_equal(covered(shifted, away, rule), cells)
    large = Grid(origin=(0, 6e3 / 8), side=125, height=6, width=6)
    np.testing.assert_array_equal(
        covered(moved(polygon, lambda x, y: (x * 125, y * 125)), large, rule), cells
    )


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**20))
def test_what_the_centre_rule_covers_the_touch_rule_covers_and_a_larger_map_covers_the_same(seed):
    polygon = random_polygon(seed, 1)
    touch, centre = covered(polygon, GRID), covered(polygon, GRID, "centre")
    assert (touch | ~centre).all()
    padded = Grid(origin=(-2, 9), side=1, height=12, width=13)
    np.testing.assert_array_equal(covered(polygon, padded)[3:9, 2:9], touch)


# --- outside ground truth


@pytest.fixture(scope="module")
def arena(shared_data):
    """The free cells of a map, and the free space of the same map as convex polygons (y points down
    in the file).
    """
    lines = (shared_data / "polygons" / "arena.map").read_text().splitlines()
    rows = lines[lines.index("map") + 1 :]
    free = np.array([[sign in ".G" for sign in row] for row in rows])
    numbers = (shared_data / "polygons" / "v2_arena-merged.mesh").read_text().split()[2:]
    num_points, num_polygons, *rest = map(float, numbers)
    values = iter(rest)
    points = []
    for _ in range(int(num_points)):
        points.append((next(values), len(free) - next(values)))
        for _ in range(int(next(values))):
            next(values)
    polygons = []
    for _ in range(int(num_polygons)):
        size = int(next(values))
        polygons.append([points[int(next(values))] for _ in range(size)])
        for _ in range(size):
            next(values)
    return free, polygons


def test_the_polygons_of_free_space_cover_exactly_the_free_cells(arena):
    free, polygons = arena
    grid = grid_over((0, 0, free.shape[1], free.shape[0]), 1)
    assert free.sum() == 2054
    for rule in ("centre", "touch"):
        labels = cover([Obstacle.polygon(polygon) for polygon in polygons], grid, rule=rule)
        np.testing.assert_array_equal((labels != FREE).any(axis=0), free)


def test_obstacles_are_the_complement_of_free_space_by_both_rules(arena):
    shapely = pytest.importorskip("shapely")
    free, polygons = arena
    height, width = free.shape
    walls = shapely.box(0, 0, width, height).difference(
        shapely.union_all([shapely.Polygon(p) for p in polygons])
    )
    obstacles = [
        Obstacle.polygon(wall.exterior.coords, *(hole.coords for hole in wall.interiors))
        for wall in shapely.get_parts(walls)
    ]
    for rule in ("centre", "touch"):
        labels = cover(obstacles, grid_over((0, 0, width, height), 1), rule=rule)
        np.testing.assert_array_equal((labels == FREE).all(axis=0), free)
    # Half a cell aside the lattice no longer fits, and the touch rule leaves free what misses every
    # inside.
    shifted = Grid(origin=(0.5, height - 0.25), side=1, height=height - 1, width=width - 1)
    rows, cols = np.indices((height - 1, width - 1))
    cells = shapely.box(cols + 0.5, height - 1.25 - rows, cols + 1.5, height - 0.25 - rows)
    expected = ~shapely.relate_pattern(walls, cells, "T********")
    np.testing.assert_array_equal((cover(obstacles, shifted) == FREE).all(axis=0), expected)


# --- a whole world


def test_the_task_of_a_world_has_its_obstacles_start_goal_and_whole_cells():
    kiosk = Obstacle.polygon(
        [(2.5, 0.5), (4.5, 0.5), (4.5, 2.5), (2.5, 2.5)], destroyable=False, removal_cost=3
    )
    speck = Obstacle.polygon([(5.1, 3.1), (5.2, 3.1), (5.2, 3.2)])
    world = World(
        bounds=(0.5, 0.25, 7.2, 4.5),
        obstacles=(kiosk, speck),
        position=(0.6, 4.4),
        radius=0.2,
        goal=((6, 1), 1),
    )
    touch, centre = rasterize(world), rasterize(world, rule="centre")
    assert (
        touch.size.tolist() == [4, 6]
        and touch.start.tolist() == [0, 0]
        and touch.goal.tolist() == [3, 5]
    )
    assert touch.labels.tolist() == [
        [[-1] * 6, [-1] * 4 + [1, -1], [-1, -1, 0, 0, -1, -1], [-1, -1, 0, 0, -1, -1]]
    ]
    assert touch.destroyable.tolist() == centre.destroyable.tolist() == [False, True]
    assert touch.removal_cost.tolist() == [3, 1]
    assert 1 not in centre.labels


def test_a_start_beyond_the_last_whole_cell_is_refused():
    world = World(
        bounds=(0, 0, 5.5, 5), obstacles=(), position=(5.3, 1), radius=0.2, goal=((1, 1), 1)
    )
    with pytest.raises(ValueError, match="outside the grid of 5 x 5 whole cells"):
        rasterize(world)


def test_runs_of_cells_merge_where_they_overlap_and_never_across_rows():
    spans = scanlines.Spans(
        *np.array(
            [(0, 0, 2, 9), (0, 0, 0, 2), (0, 1, -3, 0), (1, 0, 1, 1), (0, 5, 0, 3), (0, 1, 3, 2)]
        ).T
    )
    owner, cell = scanlines.cells_of(spans, 2, 4)
    assert list(zip(owner.tolist(), cell.tolist())) == [
        (0, 0),
        (0, 1),
        (0, 2),
        (0, 3),
        (0, 4),
        (1, 1),
    ]
