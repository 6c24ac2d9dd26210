"""Worlds in metres: what is kept, and what is refused in one sentence."""

import numpy as np
import pytest

from srt_jax.geometry.world import Obstacle, World

SQUARE = [(1, 1), (3, 1), (3, 3), (1, 3)]
GOOD = {
    "bounds": (0, 0, 10, 8),
    "obstacles": (),
    "position": (1, 1),
    "radius": 0.4,
    "goal": ((8, 6), 1),
}


def test_a_world_is_kept_as_plain_numbers_and_compares_by_value():
    made = World(**GOOD | {"obstacles": [Obstacle.polygon(np.array(SQUARE), name="kiosk")]})
    again = World(**GOOD | {"obstacles": (Obstacle([[[*SQUARE, SQUARE[0]]]], name="kiosk"),)})
    assert made == again and hash(made) == hash(again)
    assert made.obstacles[0].parts == ((((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)),),)
    assert made.bounds == (0.0, 0.0, 10.0, 8.0) and made.position == (1.0, 1.0)


@pytest.mark.parametrize(
    "goal",
    [
        ((8, 6), 1),
        [(7.5, 5.5), (8.5, 5.5), (8.5, 6.5), (7.5, 6.5)],
        [(8.5, 6.5), (7.5, 5.5), (7.5, 6.5), (8.5, 5.5)],
        np.array([(8.5, 5.5), (7.5, 5.5), (7.5, 6.5), (8.5, 6.5)]),
    ],
)
def test_the_goal_square_may_be_given_by_its_centre_or_by_corners_in_any_order(goal):
    world = World(**GOOD | {"goal": goal})
    assert world.goal == ((7.5, 5.5), (8.5, 5.5), (8.5, 6.5), (7.5, 6.5))
    assert world.goal_side == 1.0 and world.goal_centre == (8.0, 6.0)


def test_the_goal_square_may_be_turned():
    world = World(**GOOD | {"goal": [(8, 5), (9, 6), (8, 7), (7, 6)]})
    assert world.goal_side == pytest.approx(2**0.5, abs=1e-9) and world.goal_centre == (8.0, 6.0)


@pytest.mark.parametrize(
    ("error", "message", "change"),
    [
        (ValueError, "enclose nothing", {"bounds": (0, 0, 0, 8)}),
        (ValueError, "finite", {"bounds": (0, 0, np.nan, 8)}),
        (ValueError, r"shape \[4\]", {"bounds": (0, 0, 8)}),
        (TypeError, r"obstacles\[0\] must be an Obstacle", {"obstacles": [SQUARE]}),
        (ValueError, "finite", {"position": (np.nan, 1)}),
        (ValueError, r"position \(11, 1\) lies outside the bounds", {"position": (11, 1)}),
        (ValueError, r"goal's centre \(8, 9\) lies outside", {"goal": ((8, 9), 1)}),
        (ValueError, r"must exceed 2 R = 1 m", {"radius": 0.5}),
        (ValueError, "must not be negative", {"radius": -1}),
        (ValueError, "radius is nan", {"radius": np.nan}),
        (TypeError, "radius must be a number", {"radius": "1"}),
        (ValueError, "no square", {"goal": [(7, 5), (9, 5), (9, 6), (7, 6)]}),
        (ValueError, "no square", {"goal": [(7, 5)] * 4}),
        (ValueError, "no square", {"goal": ((8, 6), 0)}),
        (ValueError, "goal's side is inf", {"goal": ((8, 6), np.inf)}),
        (ValueError, r"goal must have shape \[4, 2\]", {"goal": [(7, 5), (8, 5), (8, 6)]}),
    ],
)
def test_a_bad_world_is_refused_in_one_sentence(error, message, change):
    with pytest.raises(error, match=message) as caught:
        World(**GOOD | change)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("error", "message", "parts", "options"),
    [
        (ValueError, "obstacle 'wall' has 2 different points", [[SQUARE[:2]]], {}),
        (
            ValueError,
            "'wall' is no polygon: a ring meets itself",
            [[[(0, 0), (2, 2), (2, 0), (0, 2)]]],
            {},
        ),
        (ValueError, "has no polygon", [], {}),
        (ValueError, "without rings", [[]], {}),
        (TypeError, "sequence of polygons", 5, {}),
        (ValueError, "finite", [[[(0, 0), (np.inf, 2), (2, 0)]]], {}),
        (ValueError, r"shape \[K, 2\]", [SQUARE], {}),
        (ValueError, "removal_cost of obstacle 'wall' is 0", [[SQUARE]], {"removal_cost": 0}),
        (
            ValueError,
            "removal_cost of obstacle 'wall' is nan",
            [[SQUARE]],
            {"removal_cost": np.nan},
        ),
        (TypeError, "must be True or False", [[SQUARE]], {"destroyable": 1}),
        (ValueError, "enclose nothing", [[[(0, 0), (1, 1), (2, 2)]]], {"repair": True}),
    ],
)
def test_a_bad_obstacle_is_refused_in_one_sentence(error, message, parts, options):
    if "repair" in options:
        pytest.importorskip("shapely")
    with pytest.raises(error, match=message) as caught:
        Obstacle(parts, name="wall", **options)
    assert "\n" not in str(caught.value)


def test_a_ring_that_crosses_itself_is_repaired_on_request():
    pytest.importorskip("shapely")
    bow_tie = Obstacle.polygon([(0, 0), (2, 2), (2, 0), (0, 2)], repair=True)
    assert len(bow_tie.parts) == 2 and all(len(part[0]) == 3 for part in bow_tie.parts)


def test_repair_leaves_good_polygons_as_they_are():
    assert Obstacle.polygon(SQUARE, repair=True) == Obstacle.polygon(SQUARE)
