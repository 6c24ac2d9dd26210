"""A smart relocation task in metres: polygons, the agent's disc and the goal square, checked when
made (PY16 §2).

Points are (x, y) in metres, x to the east and y to the north; they are taken to the nearest
nanometre, so that 0.1 * 3 and 0.3 are one number. An obstacle is one or more polygons with holes.
"""

import dataclasses
import importlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sign_model.foundation.legible import counted
from srt_jax.geometry.rings import (
    UNITS_PER_METRE,
    Parts,
    as_metres,
    as_ring,
    as_units,
    conflict,
    repaired,
)

Point = tuple[float, float]
_SQUARE_TOLERANCE = 1e-6
"""How far, relative to the side, corners typed as decimals may be from a true square."""


@dataclasses.dataclass(frozen=True)
class Obstacle:
    """One object that blocks the way.

    Attributes:
      parts: its polygons, each a sequence of rings, the outer one first and then the holes; a ring
        is [K, 2] points, K >= 3, in either direction, closed or not. Rings of one obstacle may
        touch in points, not cross. Kept as tuples.
      destroyable: whether the agent can destroy it.
      removal_cost: what destroying it costs; positive and finite.
      name: for people; may be empty.
      repair: make valid polygons of rings that cross (`rings.repaired`, needs shapely) instead of
        raising ValueError.
      checked: the parts are what `rings.as_ring` returns, and `rings.conflicts` found nothing: they
        are taken as they are.

    Examples:
      >>> from srt_jax import Obstacle
      >>> wall = Obstacle.polygon([(3, 0), (4, 0), (4, 5), (3, 5)], name="wall", removal_cost=2.0)
      >>> wall.parts
      ((((3.0, 0.0), (4.0, 0.0), (4.0, 5.0), (3.0, 5.0)),),)
    """

    parts: Parts
    destroyable: bool = True
    removal_cost: float = 1.0
    name: str = ""
    repair: dataclasses.InitVar[bool] = False
    checked: dataclasses.InitVar[bool] = False

    def __post_init__(self, repair: bool, checked: bool) -> None:
        called = f"obstacle {self.name!r}" if self.name else "an obstacle"
        if not checked:
            _set(self, parts=_as_parts(called, self.parts, repair))
        if not isinstance(self.destroyable, bool | np.bool_):
            raise TypeError(
                f"destroyable of {called} must be True or False, got {self.destroyable!r}"
            )
        cost = _as_number(f"removal_cost of {called}", self.removal_cost)
        if cost <= 0:
            raise ValueError(f"removal_cost of {called} is {cost}: it must be positive and finite")
        _set(self, destroyable=bool(self.destroyable), removal_cost=cost)

    def __repr__(self) -> str:
        """What it is in a line; `parts` holds the outlines."""
        called = f"{self.name!r}, " if self.name else ""
        kind = f"removal cost {self.removal_cost:g}" if self.destroyable else "indestructible"
        points = sum(len(ring) for part in self.parts for ring in part)
        return (
            f"Obstacle({called}{kind}, {counted(len(self.parts), 'polygon')} of"
            f" {counted(points, 'point')})"
        )

    @classmethod
    def polygon(cls, outer: Any, *holes: Any, **options: Any) -> "Obstacle":
        """Returns the obstacle made of one polygon; options as in the class."""
        return cls(((outer, *holes),), **options)


@dataclasses.dataclass(frozen=True)
class World:
    """A task in metres (PY16 §2).

    Attributes:
      bounds: (x_min, y_min, x_max, y_max); what lies outside does not exist for the agent,
        obstacles may reach across.
      obstacles: in the order of their ids.
      position: where the agent's centre starts; inside the bounds.
      radius: of the agent's disc, R >= 0.
      goal: the goal square: its four corners in any order, or (centre, side). Its side, more than 2
        R, becomes the side of a cell, and its centre lies inside the bounds. Kept as four corners,
        counterclockwise.

    Examples:
      >>> from srt_jax import World
      >>> world = World(bounds=(0, 0, 7, 5), obstacles=(), position=(0.5, 2.5), radius=0.4,
      ...               goal=((6.5, 2.5), 1.0))
      >>> world.goal_side
      1.0
    """

    bounds: tuple[float, float, float, float]
    obstacles: tuple[Obstacle, ...]
    position: Point
    radius: float
    goal: tuple[Point, Point, Point, Point]

    def __post_init__(self) -> None:
        bounds = as_bounds(self.bounds)
        obstacles = tuple(self.obstacles)
        for index, obstacle in enumerate(obstacles):
            if not isinstance(obstacle, Obstacle):
                raise TypeError(
                    f"obstacles[{index}] must be an Obstacle, got {type(obstacle).__name__}"
                )
        x, y = as_metres("position", self.position, (2,)).tolist()
        radius = _as_number("radius", self.radius)
        _set(
            self,
            bounds=bounds,
            obstacles=obstacles,
            position=(x, y),
            radius=radius,
            goal=_as_square(self.goal),
        )
        if radius < 0:
            raise ValueError(f"the agent's radius is {radius} m: it must not be negative")
        if self.goal_side <= 2 * radius:
            raise ValueError(
                f"the goal square's side, {self.goal_side:g} m, is the side of a cell and must"
                f" exceed 2 R = {2 * radius:g} m, so that the agent fits into a cell: enlarge the"
                " square"
            )
        for name, (x, y) in (
            ("the agent's position", self.position),
            ("the goal's centre", self.goal_centre),
        ):
            if not (bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]):
                raise ValueError(
                    f"{name} ({x:g}, {y:g}) lies outside the bounds {bounds}: move it inside"
                )

    def __repr__(self) -> str:
        """What it is in a line; `obstacles` holds the outlines."""
        x_min, y_min, x_max, y_max = self.bounds
        num, gone = len(self.obstacles), sum(one.destroyable for one in self.obstacles)
        return (
            f"World({x_max - x_min:g} x {y_max - y_min:g} m, {counted(num, 'obstacle')},"
            f" {gone} of them destroyable, agent of radius {self.radius:g} m at"
            f" {self.position}, goal square of {self.goal_side:g} m around {self.goal_centre})"
        )

    def _repr_html_(self) -> str:
        """A picture, for notebooks: made far above this module, and loaded only there."""
        return importlib.import_module("srt_jax.draw.notebook").world_html(self)

    @property
    def goal_centre(self) -> Point:
        """The middle of the goal square."""
        x, y = as_metres("goal", np.mean(self.goal, axis=0), (2,)).tolist()
        return x, y

    @property
    def goal_side(self) -> float:
        """The side of the goal square, hence of a cell, in metres."""
        corners = as_units(self.goal)
        dx, dy = (corners[1] - corners[0]).tolist()
        return round(math.hypot(dx, dy)) / UNITS_PER_METRE


def as_bounds(bounds: ArrayLike) -> tuple[float, float, float, float]:
    """Returns (x_min, y_min, x_max, y_max); ValueError where they enclose nothing."""
    x_min, y_min, x_max, y_max = as_metres("bounds", bounds, (4,)).tolist()
    if not (x_min < x_max and y_min < y_max):
        raise ValueError(
            f"bounds {(x_min, y_min, x_max, y_max)} enclose nothing: write (x_min, y_min, x_max,"
            " y_max)"
        )
    return x_min, y_min, x_max, y_max


def _as_parts(called: str, parts: Any, repair: bool) -> Parts:
    try:
        rings = [list(part) for part in parts]
    except TypeError as error:
        raise TypeError(
            f"{called} must be a sequence of polygons, each a sequence of rings, outer ring first"
        ) from error
    if not rings or not all(rings):
        raise ValueError(
            f"{called} has {'a polygon without rings' if rings else 'no polygon'}: give at least"
            " one outer ring"
        )
    checked = tuple(tuple(as_ring(f"a ring of {called}", ring) for ring in part) for part in rings)
    reason = conflict(checked)
    if reason and repair:
        checked = repaired(checked)
        reason = conflict(checked) if checked else "its rings enclose nothing"
    if reason:
        raise ValueError(f"{called} is no polygon: {reason}; redraw it, or ask for repair=True")
    return checked


def _as_square(goal: Any) -> tuple[Point, ...]:
    """Returns the corners counterclockwise, the one most to the south-west first."""
    if isinstance(goal, Sequence) and len(goal) == 2:
        centre, side = (
            as_metres("the goal's centre", goal[0], (2,)),
            _as_number("the goal's side", goal[1]),
        )
        corners = centre + np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]) * side
    else:
        corners = as_metres("goal", goal, (4, 2))
        apart = corners - corners.mean(axis=0)
        corners = corners[np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))]
    corners = as_metres(
        "goal", np.roll(corners, -int(np.argmin(corners.sum(axis=1))), axis=0), (4, 2)
    )
    edges = np.roll(corners, -1, axis=0) - corners
    side = float(np.hypot(*edges[0]))
    turned = np.roll(edges, -1, axis=0) - np.stack([-edges[:, 1], edges[:, 0]], axis=1)
    if side == 0 or np.abs(turned).max() > _SQUARE_TOLERANCE * side:
        raise ValueError(
            f"the goal {corners.tolist()} is no square: give its four corners, or (centre, side)"
        )
    return tuple((x, y) for x, y in corners.tolist())


def _as_number(name: str, value: object) -> float:
    if isinstance(value, bool | np.bool_) or not isinstance(
        value, int | float | np.integer | np.floating
    ):
        raise TypeError(f"{name} must be a number, got {value!r}")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}: it must be finite")
    return float(value)


def _set(record: object, **fields: object) -> None:
    """Fills fields of a frozen record while it is being made."""
    for name, value in fields.items():
        object.__setattr__(record, name, value)
