"""Obstacles dilated by the exact disc, against every pair of cells and against SciPy."""

from fractions import Fraction

import numpy as np
import pytest
from scipy import ndimage

import srt_jax
from srt_jax import inflate, make_task, stack
from srt_jax.geometry.raster import grid_over
from srt_jax.geometry.world import Obstacle
from srt_jax.robots import inflate as module
from tests.helpers.labelled import connected, scattered

RADII = [("0", "1"), ("0.49", "1"), ("0.5", "1"), ("1", "1"), ("1.42", "1"), ("2.5", "1")]
RADII += [("0.15", "0.05"), ("0.22", "0.05"), ("0.3", "0.1"), ("100", "1"), ("0.5", "0.1")]


def owners(labels: np.ndarray, row: int, col: int) -> list[int]:
    return [int(owner) for owner in labels[:, row, col] if owner >= 0]


def by_pairs(labels: np.ndarray, radius: str, side: str, rule: str) -> list[list[list[int]]]:
    """The owners of each cell, by looking at every pair of cells, in fractions."""
    _, height, width = labels.shape
    r, s = Fraction(radius), Fraction(side)
    filled = [(row, col) for row in range(height) for col in range(width)]
    result = [[[] for _ in range(width)] for _ in range(height)]
    for row, col in filled:
        found = set(owners(labels, row, col))
        for other_row, other_col in filled:
            apart = [abs(row - other_row), abs(col - other_col)]
            if rule == "touch":
                near = [max(Fraction(0), step - Fraction(1, 2)) * s for step in apart]
                is_met = near[0] ** 2 + near[1] ** 2 < r**2
            else:
                is_met = (apart[0] ** 2 + apart[1] ** 2) * s**2 <= r**2
            if is_met:
                found |= set(owners(labels, other_row, other_col))
        result[row][col] = sorted(found)
    return result


@pytest.mark.parametrize("rule", ["centre", "touch"])
def test_every_cell_has_the_obstacles_within_the_radius_and_no_other(rule):
    rng = np.random.default_rng(3)
    for number, (radius, side) in enumerate(RADII):
        labels = (scattered if number % 2 else connected)(rng, 9, 11, 5)
        labels = labels.reshape(-1, 9, 11)
        small = make_task(labels, (0, 0), (1, 1))
        grown = inflate(small, float(radius), cell_side=float(side), rule=rule)
        expected = by_pairs(labels, radius, side, rule)
        height, width = labels.shape[1:]
        found = [[owners(grown.labels, r, c) for c in range(width)] for r in range(height)]
        assert found == expected, (number, radius, side)
        # few layers: as many as the most owners of one cell
        most = max(len(cell) for row in expected for cell in row)
        assert len(grown.labels) == max(1, most)


def test_the_free_space_is_that_of_a_distance_transform_cell_by_cell():
    rng = np.random.default_rng(5)
    for side, radius in ((0.05, 0.22), (0.05, 0.25), (0.025, 0.1), (1.0, 7.0), (1.0, 2**0.5)):
        free = ndimage.gaussian_filter(rng.random((90, 130)), 2.0) > 0.475
        task = make_task(free, (0, 0), (1, 1))
        grown = inflate(task, radius, cell_side=side)
        away = ndimage.distance_transform_edt(free, sampling=side)
        assert np.array_equal((grown.labels == -1).all(axis=0), away > radius + 1e-9)
        # and each obstacle by itself
        for obstacle in range(len(task.destroyable)):
            its = np.asarray(ndimage.distance_transform_edt(task.labels[0] != obstacle))
            covered = (grown.labels == obstacle).any(axis=0)
            assert np.array_equal(covered, its * side <= radius + 1e-9)


def test_a_cell_wider_than_the_robot_changes_nothing_as_in_a_world():
    wall = Obstacle.polygon([(3, 0), (4, 0), (4, 5), (3, 5)])
    world = srt_jax.World(
        bounds=(0, 0, 7, 5),
        obstacles=(wall,),
        position=(0.5, 2.5),
        radius=0.4,
        goal=((6.5, 2.5), 1.0),
    )
    task = srt_jax.rasterize(world)
    assert grid_over(world.bounds, world.goal_side).side == 1.0
    for rule in module.RULES:
        grown = inflate(task, world.radius, cell_side=1.0, rule=rule)
        assert np.array_equal(grown.labels, task.labels)


def test_a_door_beside_its_wall_keeps_its_own_cells_and_padding_stays():
    labels = np.full((7, 9), -1, np.int32)
    labels[:, 4] = 1
    labels[2:5, 4] = 0  # the door
    task = make_task(labels, (3, 0), (3, 8), destroyable=[True, False])
    grown = inflate(task, 1.0)
    # the wall reaches one cell into the opening, so that one row of it is left
    assert [owners(grown.labels, row, 4) for row in range(7)] == [
        [1],
        [0, 1],
        [0, 1],
        [0],
        [0, 1],
        [0, 1],
        [1],
    ]
    assert srt_jax.solve(grown).status == srt_jax.Status.SOLVED
    assert srt_jax.solve(inflate(task, 2.0)).status == srt_jax.Status.UNSOLVABLE
    padded = stack([task, make_task(np.ones((9, 9), bool), (0, 0), (1, 1))])
    first = type(task)(**{name: getattr(padded, name)[0] for name in vars(task)})
    inside = inflate(first, 1.0)
    assert np.array_equal(inside.labels[:, :7], grown.labels)
    assert (inside.labels[0, 7:] == -2).all() and (inside.labels[1:, 7:] == -1).all()


def test_many_obstacles_go_in_parts_and_come_out_the_same(monkeypatch):
    free = np.random.default_rng(1).random((40, 50)) > 0.3
    task = make_task(free, (0, 0), (1, 1))
    whole = inflate(task, 2.3)
    monkeypatch.setattr(module, "_MOST_SPANS", 40)
    assert np.array_equal(inflate(task, 2.3).labels, whole.labels)


@pytest.mark.parametrize(
    ("radius", "options", "message"),
    [
        (-0.1, {}, "a radius must not be negative"),
        (float("nan"), {}, "radius is nan: it must be finite"),
        (float("inf"), {}, "radius is inf: it must be finite"),
        (1, {"cell_side": 0.0}, "a side must be positive"),
        (1, {"cell_side": float("nan")}, "cell_side is nan"),
        (1, {"rule": "square"}, "rule 'square' is unknown: take one of 'centre', 'touch'"),
    ],
)
def test_what_is_no_radius_is_refused_in_one_sentence(radius, options, message):
    task = make_task(np.ones((3, 3), bool), (0, 0), (1, 1))
    with pytest.raises(ValueError, match=message):
        inflate(task, radius, **options)


def test_what_is_no_task_or_no_number_is_a_type_error(monkeypatch):
    task = make_task(np.ones((3, 3), bool), (0, 0), (1, 1))
    with pytest.raises(ValueError, match="unstack takes a batch"):
        inflate(stack([task]), 1.0)
    for wrong in ("1", True, None):
        with pytest.raises(TypeError, match="radius must be a number"):
            inflate(task, wrong)  # type: ignore[arg-type]
    monkeypatch.setattr(module, "_MOST_LABELS", 8)
    free = np.ones((3, 3), bool)
    free[0, 0] = False
    with pytest.raises(ValueError, match="too many layers"):
        inflate(make_task(free, (0, 1), (1, 1)), 1.0)
