"""Which rings bound a polygon: decided as shapely decides it, but exactly."""

import itertools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from srt_jax.geometry import rings

SQUARE = ((0, 0), (4, 0), (4, 4), (0, 4))


def ring(*points):
    return rings.as_ring("a ring", points)


def test_a_ring_drops_its_closing_point_and_repeated_points():
    assert ring((0, 0), (0, 0), (1, 0), (1, 1), (1, 1), (0, 0)) == ((0, 0), (1, 0), (1, 1))


def test_coordinates_are_taken_to_the_nearest_nanometre():
    assert rings.as_metres("x", [0.1 * 3, 2e-10, -0.0], (3,)).tolist() == [0.3, 0.0, 0.0]
    assert rings.as_units([0.3, -1.25]).tolist() == [300_000_000, -1_250_000_000]


@settings(deadline=None)
@given(st.floats(-1e9, 1e9))
def test_taking_to_the_nearest_nanometre_twice_changes_nothing(value):
    once = rings.as_metres("x", value, ())
    assert rings.as_metres("x", once, ()) == once and abs(once - value) <= 1e-9


@pytest.mark.parametrize(
    ("error", "message", "points"),
    [
        (ValueError, "2 different points", [(0, 0), (1, 1), (0, 0)]),
        (ValueError, "0 different points", np.zeros((0, 2))),
        (ValueError, "finite", [(0, 0), (1, np.nan), (1, 1)]),
        (ValueError, "1e9", [(0, 0), (1, 2e9), (1, 1)]),
        (ValueError, r"shape \[K, 2\], got \[3, 3\]", np.zeros((3, 3))),
        (ValueError, "differ in length", [(0, 0), (1,), (1, 1)]),
        (TypeError, "numbers", [("a", "b")] * 3),
    ],
)
def test_points_that_make_no_ring_are_refused(error, message, points):
    with pytest.raises(error, match=message):
        rings.as_ring("a ring", points)


@pytest.mark.parametrize(
    ("message", "parts"),
    [
        ("meets itself", [[((0, 0), (2, 2), (2, 0), (0, 2))]]),  # a bow-tie
        ("meets itself", [[((0, 0), (4, 0), (4, 4), (2, 0))]]),  # touches itself
        ("meets itself", [[((0, 0), (2, 0), (1, 0), (1, 2))]]),  # runs back over itself
        ("meets itself", [[((0, 0), (1, 1), (2, 2))]]),  # encloses nothing
        ("meets another ring", [[SQUARE, ((2, 2), (5, 2), (5, 3))]]),
        ("meets another ring", [[SQUARE, ((0, 1), (0, 2), (1, 2))]]),  # a hole along the border
        ("meets another ring", [[SQUARE], [SQUARE]]),
        ("outside its outer ring", [[SQUARE, ((5, 5), (6, 5), (6, 6))]]),
        (
            "inside another hole",
            [[SQUARE, ((1, 1), (3, 1), (3, 3), (1, 3)), ((1.5, 1.5), (2, 1.5), (2, 2))]],
        ),
        ("inside another polygon", [[SQUARE], [((1, 1), (2, 1), (2, 2))]]),
    ],
)
def test_rings_that_bound_no_polygon_are_distinguished(message, parts):
    assert message in rings.conflict(
        tuple(tuple(ring(*points) for points in part) for part in parts)
    )


@pytest.mark.parametrize(
    "parts",
    [
        [[SQUARE]],
        [[SQUARE[::-1], ((0, 2), (1, 1), (1, 3))]],  # the hole touches the border in a point
        # an island in a courtyard
        [[SQUARE, ((1, 1), (3, 1), (3, 3), (1, 3))], [((1.5, 1.5), (2, 1.5), (2, 2))]],
        [[SQUARE], [((4, 4), (5, 4), (5, 5))]],  # two polygons touch in a corner
    ],
)
def test_rings_may_touch_in_points(parts):
    assert rings.conflict(tuple(tuple(ring(*points) for points in part) for part in parts)) == ""


@pytest.mark.parametrize("scale", [1.0, 123456.789012345])  # the second needs more than 64 bits
@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_the_verdict_is_shapelys(scale, data):
    shapely = pytest.importorskip("shapely")
    points = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=6)
    part = data.draw(st.lists(points, min_size=1, max_size=3))
    assume(all(len(set(ring)) >= 3 for ring in part))
    polygon = shapely.Polygon(part[0], part[1:])
    checked = tuple(rings.as_ring("a ring", np.array(points) * scale) for points in part)
    is_valid = rings.conflict((checked,)) == ""
    # Holes that touch in a chain cut the inside in two: no polygon to shapely, but well-defined for
    # covering cells. Shapely names but one of several reasons, so the rest is checked one by one.
    is_in_two = "disconnected" in shapely.is_valid_reason(polygon) and is_sound_but_for_that(
        shapely, part
    )
    assert is_valid == (shapely.is_valid(polygon) or is_in_two)


def is_sound_but_for_that(shapely, part) -> bool:
    """Each ring a polygon, the holes in the outer one, and no two of them sharing area or a stretch
    of border.
    """
    outer, *holes = (shapely.Polygon(ring) for ring in part)
    if not all(shapely.is_valid(polygon) for polygon in (outer, *holes)):
        return False
    pairs = list(itertools.combinations((outer, *holes), 2))
    apart = all(a.intersection(b).area == 0 for a, b in pairs if a is not outer)
    return (
        apart
        and all(outer.covers(hole) for hole in holes)
        and all(a.boundary.intersection(b.boundary).length == 0 for a, b in pairs)
    )


def test_many_edges_are_checked_in_blocks(monkeypatch):
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    crossing = circle.copy()
    crossing[[70, 71]] = crossing[[71, 70]]
    monkeypatch.setattr(rings, "_MAX_PAIRS", 50)
    assert rings.conflict(((rings.as_ring("a ring", circle),),)) == ""
    assert "meets itself" in rings.conflict(((rings.as_ring("a ring", crossing),),))


def test_repair_makes_two_triangles_of_a_bow_tie_and_nothing_of_a_line():
    pytest.importorskip("shapely")
    parts = rings.repaired(((ring((0, 0), (2, 2), (2, 0), (0, 2)),),))
    assert sorted(sorted(part[0]) for part in parts) == [
        [(0, 0), (0, 2), (1, 1)],
        [(1, 1), (2, 0), (2, 2)],
    ]
    assert rings.repaired(((ring((0, 0), (1, 1), (2, 2)),),)) == ()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**20))
def test_what_repair_returns_is_valid_whatever_came_in(seed):
    pytest.importorskip("shapely")
    points = np.random.default_rng(seed).uniform(-1000, 1000, (12, 2))
    parts = rings.repaired(((rings.as_ring("a ring", points),),))
    assert parts and rings.conflict(parts) == ""


def test_many_obstacles_at_once_get_the_verdicts_they_get_alone():
    rng = np.random.default_rng(7)
    many = []
    for _ in range(300):
        away = rng.choice([0, 5, 10**6])
        drawn = [
            rng.integers(0, 6, (rng.integers(4, 8), 2)) + away for _ in range(rng.integers(1, 3))
        ]
        if all(len(np.unique(points, axis=0)) >= 3 for points in drawn):
            many.append((tuple(ring(*points.tolist()) for points in drawn),))
    alone = [rings.conflict(parts) for parts in many]
    assert rings.conflicts(many) == alone
    assert 20 < alone.count("") < len(many) - 20
    assert rings.conflicts([]) == []


def test_the_side_of_a_line_is_exact_where_floats_cannot_tell():
    rng = np.random.default_rng(0)
    head, times = rng.integers(1, 10**9, (200, 2)), rng.integers(-(10**9), 10**9, (200, 1))
    point = head * times + rng.integers(-1, 2, (200, 2))  # on the line, or next to it
    point[::4] = (head * times)[::4]
    expected = [
        (hx * py > hy * px) - (hx * py < hy * px)
        for (hx, hy), (px, py) in zip(head.tolist(), point.tolist())
    ]
    assert rings._side(np.zeros_like(head), head, point).tolist() == expected
    assert {-1, 0, 1} == set(expected)
