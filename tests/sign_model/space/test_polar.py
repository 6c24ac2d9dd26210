"""The agent's polar frame: conversion both ways, sectors, squares that contain them, corridors."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.space.polar import (
    FULL_TURN,
    Sector,
    distance_to_link,
    from_polar,
    in_corridor,
    in_sector,
    in_square,
    path_deviation,
    path_link,
    sector_corners,
    sector_of_points,
    sector_of_square,
    square_of_sector,
    to_polar,
    wrap,
)


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def scenes(rng, count):
    """Returns origins, headings and sectors of all kinds: with near 0 or not, from narrow to a full
    turn.
    """
    origin = rng.uniform(-50, 50, (count, 2))
    heading = rng.uniform(-7, 7, count)
    near = rng.uniform(0, 30, count) * (rng.random(count) < 0.8)
    sector = Sector(
        near=near,
        far=near + rng.uniform(0.1, 40, count),
        start=rng.uniform(-math.pi, math.pi, count),
        width=np.where(rng.random(count) < 0.1, FULL_TURN, rng.uniform(0.01, FULL_TURN, count)),
    )
    return origin, heading, sector


def sample_points(rng, sector, count):
    """Returns `count` points (r, phi) of each sector, including its corners and the middles of its
    sides.
    """
    share = rng.random((2, count, len(sector.near)))
    share[:, :9] = np.array(
        [[0, 0], [0, 1], [1, 0], [1, 1], [0.5, 0], [0.5, 1], [0, 0.5], [1, 0.5], [0.5, 0.5]]
    ).T[:, :, None]
    return np.stack(
        [
            sector.near + share[0] * (sector.far - sector.near),
            wrap(sector.start + share[1] * sector.width),
        ],
        axis=-1,
    )


def test_directions_are_wrapped_into_the_half_open_turn():
    angles = np.array([0, math.pi, -math.pi, 3 * math.pi, -1e-17, math.pi + 1e-9, 7.0])
    phi = wrap(angles)
    assert ((phi > -math.pi) & (phi <= math.pi)).all()
    assert np.allclose(np.exp(1j * phi), np.exp(1j * angles)) and phi[1] == phi[2] == math.pi


@pytest.mark.parametrize(
    "point, polar",
    [
        ((2, 1), (1, 0)),
        ((1, 3), (2, math.pi / 2)),
        ((0, 1), (1, math.pi)),
        ((1, 0), (1, -math.pi / 2)),
        ((1, 1), (0, 0)),
    ],
)
def test_ahead_is_zero_and_leftward_is_positive(point, polar):
    assert np.allclose(to_polar(np.array(point, float), np.array([1.0, 1.0]), np.array(0.0)), polar)


def test_a_turn_of_the_agent_turns_the_points_of_its_frame_the_other_way():
    point, origin = np.array([3.0, 4.0]), np.array([0.0, 0.0])
    assert np.isclose(to_polar(point, origin, np.array(math.atan2(4, 3)))[1], 0)
    assert np.allclose(to_polar(point, origin, np.array(math.atan2(4, 3) - 1.0)), [5, 1])


def test_points_are_unchanged_by_conversion_both_ways(rng):
    points, origin, heading = (
        rng.uniform(-100, 100, (200, 2)),
        rng.uniform(-100, 100, (200, 2)),
        rng.uniform(-9, 9, 200),
    )
    assert np.allclose(from_polar(to_polar(points, origin, heading), origin, heading), points)


def test_the_corners_of_a_sector_lie_in_it(rng):
    _, _, sector = scenes(rng, 50)
    slack = Sector(
        near=sector.near - 1e-9,
        far=sector.far + 1e-9,
        start=sector.start - 1e-9,
        width=sector.width + 2e-9,
    )
    assert sector_corners(sector).shape == (50, 4, 2)
    assert in_sector(np.swapaxes(sector_corners(sector), 0, 1), slack).all()


def test_a_point_is_in_a_sector_if_its_distance_and_direction_are():
    sector = Sector(near=np.array(1.0), far=np.array(2.0), start=np.array(3.0), width=np.array(0.5))
    points = np.array(
        [[1.5, 3.1], [1.5, -3.1], [1.5, 2.9], [1.5, -2.7], [0.9, 3.1], [2.1, 3.1], [1.0, 3.0]]
    )
    assert in_sector(points, sector).tolist() == [True, True, False, False, False, False, True]


def test_the_square_of_a_sector_is_the_smallest_that_contains_it(rng):
    origin, heading, sector = scenes(rng, 300)
    points = from_polar(sample_points(rng, sector, 400), origin, heading)
    centre, side = square_of_sector(sector, origin, heading)
    assert in_square(points, centre, side * (1 + 1e-9)).all()
    # Points sampled along the arcs and sides come close to the border of the smallest square.
    arcs = np.linspace(0, 1, 4001)[:, None]
    dense = np.concatenate(
        [
            np.stack(
                [np.broadcast_to(r, (len(arcs), 300)), wrap(sector.start + arcs * sector.width)],
                axis=-1,
            )
            for r in (sector.near, sector.far)
        ]
    )
    extent = np.ptp(from_polar(dense, origin, heading), axis=0).max(axis=-1)
    assert (extent <= side * (1 + 1e-9)).all() and np.allclose(extent, side, rtol=1e-4)


def test_the_sector_of_a_square_is_the_smallest_that_contains_it(rng):
    count = 300
    centre, side = rng.uniform(-30, 30, (count, 2)), rng.uniform(0.1, 20, count)
    origin, heading = rng.uniform(-30, 30, (count, 2)), rng.uniform(-7, 7, count)
    sector = sector_of_square(centre, side, origin, heading)
    border = np.linspace(-0.5, 0.5, 401)
    edges = np.concatenate(
        [
            np.stack(pair, -1)
            for end in (-0.5, 0.5)
            for pair in ((border, 0 * border + end), (0 * border + end, border))
        ]
    )
    polar = to_polar(centre + side[:, None] * edges[:, None], origin, heading)
    slack = Sector(
        near=sector.near - 1e-9,
        far=sector.far + 1e-9,
        start=sector.start - 1e-9,
        width=sector.width + 2e-9,
    )
    assert in_sector(polar, slack).all()
    is_outside = sector.near > 0
    assert (
        is_outside.any() and (~is_outside).any() and (sector.width[~is_outside] == FULL_TURN).all()
    )
    assert np.allclose(polar[..., 0].min(axis=0)[is_outside], sector.near[is_outside], atol=0.05)
    assert np.allclose(polar[..., 0].max(axis=0), sector.far)
    swept = (polar[..., 1] - (sector.start - 1e-9)) % FULL_TURN
    assert np.allclose(np.ptp(swept, axis=0)[is_outside], sector.width[is_outside])


def test_the_sector_of_points_is_the_narrowest_that_contains_them(rng):
    count, most = 200, 7
    origin, heading = rng.uniform(-5, 5, (count, 2)), rng.uniform(-7, 7, count)
    points, is_point = rng.uniform(-9, 9, (count, most, 2)), rng.random((count, most)) < 0.6
    is_point[:3] = False
    sector = sector_of_points(points, is_point, origin, heading)
    polar = to_polar(points, origin[:, None], heading[:, None])
    slack = [
        part[:, None]
        for part in (
            sector.near - 1e-9,
            sector.far + 1e-9,
            sector.start - 1e-9,
            sector.width + 2e-9,
        )
    ]
    assert (
        in_sector(polar, Sector(**dict(zip(("near", "far", "start", "width"), slack)))) | ~is_point
    ).all()
    for i in np.flatnonzero(is_point.any(axis=1)):
        r, phi = polar[i, is_point[i]].T
        arcs = [((phi - start) % FULL_TURN).max() for start in phi]
        assert (
            np.isclose(sector.width[i], min(arcs))
            and np.isclose(sector.near[i], r.min())
            and np.isclose(sector.far[i], r.max())
        )
    empty = ~is_point.any(axis=1)
    assert not any(
        part[empty].any() for part in (sector.near, sector.far, sector.start, sector.width)
    )


def test_a_point_at_the_agents_position_sets_near_to_0_and_has_no_direction():
    points = np.array([[0.0, 0.0], [0.0, 2.0], [-2.0, 0.0]])
    sector = sector_of_points(points, np.array([True, True, True]), np.zeros(2), np.array(0.0))
    assert (
        sector.near == 0
        and sector.far == 2
        and np.allclose([sector.start, sector.width], [math.pi / 2, math.pi / 2])
    )


def test_the_square_of_the_sector_of_a_square_contains_it(rng):
    centre, side = rng.uniform(-30, 30, (100, 2)), rng.uniform(0.1, 20, 100)
    origin, heading = rng.uniform(-30, 30, (100, 2)), rng.uniform(-7, 7, 100)
    corners = centre + side[:, None] / 2 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])[:, None]
    wider, its_side = square_of_sector(
        sector_of_square(centre, side, origin, heading), origin, heading
    )
    assert in_square(corners, wider, its_side * (1 + 1e-9)).all()


def test_the_corridor_agrees_with_brute_force(rng):
    start, goal = rng.uniform(-10, 10, (40, 1, 2)), rng.uniform(-10, 10, (40, 1, 2))
    start[0] = goal[0]
    points, deviation = rng.uniform(-15, 15, (40, 60, 2)), rng.uniform(0, 8, (40, 1))
    share = np.linspace(0, 1, 2001)[:, None, None, None]
    nearest = np.linalg.norm(points - (start + share * (goal - start)), axis=-1).min(axis=0)
    assert np.allclose(distance_to_link(points, start, goal), nearest, atol=1e-2)
    is_clear = abs(nearest - deviation) > 1e-2
    assert (in_corridor(points, start, goal, deviation) == (nearest <= deviation))[
        is_clear
    ].all() and is_clear.mean() > 0.9


def test_the_deviation_of_a_path_is_the_greatest_of_its_points():
    path = np.array([[0, 0], [1, 2], [5, -3], [10, 0], [99, 99]], float)
    assert path_deviation(path, np.array(4)) == 3 and path_link(path, np.array(4)) == 10
    assert path_deviation(path, np.array(1)) == path_deviation(path, np.array(0)) == 0
    assert path_deviation(np.stack([path, path]), np.array([4, 2])).tolist() == [3, 0]


def test_jax_arrays_give_the_same_answers_jitted_and_in_a_batch(rng):
    origin, heading, sector = scenes(rng, 20)
    points = rng.uniform(-60, 60, (20, 2))
    single = [
        jax.tree.map(lambda part: jnp.asarray(part, jnp.float32), part)
        for part in (points, origin, heading, sector)
    ]

    @jax.jit
    def all_of_it(points, origin, heading, sector):
        polar = to_polar(points, origin, heading)
        centre, side = square_of_sector(sector, origin, heading)
        area_of_square = sector_of_square(centre, side, origin, heading)
        path = jnp.stack([origin, points, centre], axis=-2)
        deviation = path_deviation(path, jnp.full(path.shape[:-2], 3, jnp.int32))
        crowd = jnp.stack([points, points + 5, points[..., ::-1]], axis=-2)
        area = sector_of_points(crowd, jnp.ones(crowd.shape[:-1], bool), origin, heading)
        return (
            from_polar(polar, origin, heading),
            centre,
            side,
            area_of_square,
            deviation,
            in_sector(polar, sector),
            area,
        )

    whole = all_of_it(*single)
    ours, centre, side, area_of_square, deviation, inside, area = whole
    truth = square_of_sector(sector, origin, heading)
    assert np.allclose(ours, points, atol=1e-3) and np.allclose(centre, truth[0], atol=1e-3)
    assert (
        np.allclose(side, truth[1], atol=1e-3)
        and ours.dtype == side.dtype == area_of_square.near.dtype == deviation.dtype == jnp.float32
    )
    assert (np.asarray(inside) == in_sector(to_polar(points, origin, heading), sector)).all()
    crowd = np.stack([points, points + 5, points[..., ::-1]], axis=-2)
    assert np.allclose(
        area.width,
        sector_of_points(crowd, np.ones((20, 3), bool), origin, heading).width,
        atol=1e-3,
    )
    one = all_of_it(*jax.tree.map(lambda part: part[3], single))
    assert all(
        np.allclose(a[3], b, atol=1e-3)
        for a, b in zip(jax.tree.leaves(whole), jax.tree.leaves(one))
    )
