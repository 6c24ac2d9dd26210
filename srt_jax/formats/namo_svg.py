"""NAMO scenes of namosim as SVG: walls stand firm, movable boxes can be destroyed; robot and goal
are outlines.

One unit of the drawing is a centimetre, y points down in the file and to the north here. The
robot's disc is the smallest round its middle that holds its outline; the goal square lies round the
middle of the goal's outline.
"""

from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from srt_jax.formats.files import PathLike
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.geometry import Shape, count_outside, obstacles_of_shapes
from srt_jax.formats.outlines.svg_path import filled, outlines, transform_of
from srt_jax.formats.xml_text import plain, read_xml
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import World

_CM = 100.0
_ROOM = 1.001
"""How much wider than the robot a cell is where nobody asks for more: it must be wider, and need
not be much.
"""
_KINDS = {"wall": False, "movable": True}
"""Types of things, and whether they can be destroyed."""


def read_namo(
    path: PathLike, *, cell_side: float | None = None, notes: Notes | None = None
) -> World:
    """Returns the scene's first robot with its first goal; boxes that are movable there can be
    destroyed here.

    Args:
      cell_side: metres, more than the robot is wide; without it hardly more than that.
      notes: receives what was passed over: further robots and goals, drawings of no known type, and
        odd rings.

    Raises:
      ValueError: the file is missing, no SVG or no scene, lacks robot or goal, or a path cannot be
        read.
    """
    notes = Notes() if notes is None else notes
    root = read_xml(path, "NAMO scene")
    try:
        return _world(root, cell_side, notes)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _world(root: Element, cell_side: float | None, notes: Notes) -> World:
    if plain(root.tag) != "svg":
        raise ValueError(f"no SVG: its root is <{plain(root.tag)}>")
    left, top, width, height = _view_box(root)
    drawn = {
        name: (element, matrix)
        for element, matrix in _paths(root, np.eye(3))
        if (name := element.get("id"))
    }
    robot, goal = _chosen(root, drawn, notes)
    middle, radius = _disc(_rings(robot, *drawn[robot], top + height))
    if radius == 0:
        raise ValueError(f"the robot {robot!r} has no size: draw its outline")
    made = obstacles_of_shapes(list(_shapes(drawn, (robot, goal), top + height, notes)), notes)
    place = Place(
        bounds=(left / _CM, 0.0, (left + width) / _CM, height / _CM),
        obstacles=tuple(obstacle for obstacle in made if obstacle is not None),
    )
    count_outside(place, notes)
    side = round(2 * radius * _ROOM, 6) if cell_side is None else cell_side
    target, _ = _disc(_rings(goal, *drawn[goal], top + height))
    return World(
        bounds=place.bounds,
        obstacles=place.obstacles,
        position=middle,
        radius=radius,
        goal=(target, side),
    )  # type: ignore[arg-type]


def _view_box(root: Element) -> tuple[float, ...]:
    try:
        box = tuple(float(number) for number in root.get("viewBox", "").replace(",", " ").split())
    except ValueError:
        box = ()
    if len(box) != 4 or not np.isfinite(box).all() or min(box[2:]) <= 0:
        raise ValueError(
            "the viewBox must hold x, y, width and height in centimetres, got"
            f" {root.get('viewBox')!r}"
        )
    return box


def _paths(element: Element, matrix: np.ndarray) -> Iterator[tuple[Element, np.ndarray]]:
    """Yields every path that is drawn, with the transform of its groups and its own."""
    if plain(element.tag) in ("defs", "clipPath", "symbol", "metadata"):
        return
    matrix = matrix @ transform_of(element.get("transform", ""))
    if plain(element.tag) == "path":
        yield element, matrix
    for child in element:
        yield from _paths(child, matrix)


def _chosen(root: Element, drawn: dict[str, Any], notes: Notes) -> tuple[str, str]:
    """Returns the names of the first robot and its first goal."""
    agents = [element for element in root.iter() if plain(element.tag) == "agent"]
    if not agents:
        raise ValueError("no NAMO scene: it has no <namo_config> with an <agent>")
    goals = [element for element in agents[0].iter() if plain(element.tag) == "goal"]
    if not goals:
        raise ValueError(
            "its robot has no <goal>: give it one, with a goal_id and a path of that id"
        )
    notes.add(
        "robots after the first, passed over",
        len(agents) - 1,
        example=agents[-1].get("agent_id", ""),
    )
    notes.add(
        "goals after the first, passed over", len(goals) - 1, example=goals[-1].get("goal_id", "")
    )
    names = agents[0].get("agent_id", ""), goals[0].get("goal_id", "")
    for what, name in zip(("robot", "goal"), names):
        if name not in drawn:
            raise ValueError(f"the {what} {name!r} is not drawn: there is no path of that id")
    return names


def _shapes(
    drawn: dict[str, Any], ends: tuple[str, str], bottom: float, notes: Notes
) -> Iterator[Shape]:
    for name, (element, matrix) in drawn.items():
        kind = element.get("type", "")
        if name in ends or kind not in _KINDS:
            notes.add(
                "drawings passed over: neither wall nor movable",
                int(name not in ends),
                example=name,
            )
            continue
        is_even_odd = (
            "fill-rule:evenodd" in element.get("style", "").replace(" ", "")
            or element.get("fill-rule") == "evenodd"
        )
        parts = filled(_rings(name, element, matrix, bottom), is_even_odd=is_even_odd)
        yield Shape(parts, name, {"name": name, "destroyable": _KINDS[kind]})


def _rings(name: str, element: Element, matrix: np.ndarray, bottom: float) -> list[np.ndarray]:
    """Returns the outlines of a path in metres, y to the north."""
    try:
        lines = outlines(element.get("d", ""))
    except ValueError as error:
        raise ValueError(f"the path {name!r}: {error}") from error
    if not lines:
        raise ValueError(f"the path {name!r} is empty")
    turned = [line @ matrix[:2, :2].T + matrix[:2, 2] for line in lines]
    return [np.round((line * (1, -1) + (0, bottom)) / _CM, 6) for line in turned]


def _disc(rings: list[np.ndarray]) -> tuple[tuple[float, float], float]:
    """Returns the middle of the box round the outlines, and how far they reach from there."""
    points = np.concatenate(rings)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y = middle.tolist()
    return (x, y), float(np.hypot(*(points - middle).T).max())
