"""NAMO scenes of namosim as SVG: walls are indestructible, movable boxes can be destroyed; robot
and goal are outlines.

One unit of the drawing is a centimetre, y points down in the file and to the north here. The
robot's disc is the smallest round its middle that holds its outline; the goal square lies round the
middle of the goal's outline.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from srt_jax.formats.containers.xml_text import plain, read_xml
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.geometry import Shape, count_outside, obstacles_of_shapes
from srt_jax.formats.outlines.svg_path import filled, outlines, transform_of
from srt_jax.formats.shared.whole_files import PathLike
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import World

_CM = 100.0
_ROOM = 1.001
"""How much wider than the robot a cell is where no other width is given: it must be wider, and need
not be much.
"""
_KINDS = {"wall": False, "movable": True}
"""Types of things, and whether they can be destroyed."""


class _Drawing(NamedTuple):
    """A shape that is drawn. name: its id, or that of its group. kind: its type, or that of its
    group.

    groups: the ids of the groups round it. matrix: what all transforms do to it, [3, 3].
    """

    name: str
    kind: str
    groups: tuple[str, ...]
    element: Element
    matrix: np.ndarray


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
    except RecursionError as error:
        raise ValueError(
            f"{path}: its groups are nested too deeply: ungroup what is drawn"
        ) from error


def _world(root: Element, cell_side: float | None, notes: Notes) -> World:
    if plain(root.tag) != "svg":
        raise ValueError(f"no SVG: its root is <{plain(root.tag)}>")
    left, top, width, height = _view_box(root)
    drawn = list(_drawings(root, _Drawing("", "", (), root, np.eye(3)), notes))
    robot, goal = _chosen(root, drawn, notes)
    middle, radius = _disc(_rings(robot, top + height))
    if radius == 0:
        raise ValueError(f"the robot {robot.name!r} has no size: draw its outline")
    made = obstacles_of_shapes(list(_shapes(drawn, (robot, goal), top + height, notes)), notes)
    place = Place(
        bounds=(left / _CM, 0.0, (left + width) / _CM, height / _CM),
        obstacles=tuple(obstacle for obstacle in made if obstacle is not None),
    )
    count_outside(place, notes)
    side = round(2 * radius * _ROOM, 6) if cell_side is None else cell_side
    target, _ = _disc(_rings(goal, top + height))
    return World(
        bounds=place.bounds,
        obstacles=place.obstacles,
        position=middle,
        radius=radius,
        goal=(target, side),  # type: ignore[arg-type]
    )


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


def _drawings(element: Element, inside: _Drawing, notes: Notes) -> Iterator[_Drawing]:
    """Yields every shape that is drawn, with what the groups round it say of it."""
    tag, own = plain(element.tag), element.get("id", "")
    if tag in ("defs", "clipPath", "symbol", "metadata", "namo_config"):
        return
    notes.add("copies passed over: draw the shape itself", int(tag == "use"), example=own or tag)
    kind = element.get("type", "")
    # Within a movable thing the path of type "shape" is its outline, others are marks.
    is_outline = kind in ("", "shape") and inside.kind in _KINDS
    here = _Drawing(
        name=inside.name if is_outline else own or inside.name,
        kind=inside.kind if is_outline else kind,
        groups=inside.groups,
        element=element,
        matrix=inside.matrix @ transform_of(element.get("transform", "")),
    )
    if tag in _OUTLINES:
        yield here._replace(name=here.name or f"a {tag} without an id")
    elif own:
        here = here._replace(groups=(*inside.groups, own))
    for child in element:
        yield from _drawings(child, here, notes)


def _chosen(root: Element, drawn: Sequence[_Drawing], notes: Notes) -> tuple[_Drawing, _Drawing]:
    """Returns the outlines of the first robot and its first goal."""
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
    robot = _outline_of("robot", agents[0].get("agent_id", ""), drawn)
    return robot, _outline_of("goal", goals[0].get("goal_id", ""), drawn)


def _outline_of(what: str, name: str, drawn: Sequence[_Drawing]) -> _Drawing:
    """Returns the shape of that id, or the one of type "shape" in the group of that id."""
    itself = [drawing for drawing in drawn if drawing.element.get("id") == name]
    grouped = [drawing for drawing in drawn if name in drawing.groups]
    shapes = [drawing for drawing in grouped if drawing.element.get("type") == "shape"]
    found = itself or shapes or (grouped if len(grouped) == 1 else [])
    if name and found:
        return found[0]._replace(name=name)
    if grouped:
        raise ValueError(
            f"the {what} {name!r} is a group of {len(grouped)} drawings: give its outline the type"
            ' "shape"'
        )
    raise ValueError(f"the {what} {name!r} is not drawn: there is no path of that id")


def _shapes(
    drawn: Sequence[_Drawing], ends: tuple[_Drawing, _Drawing], bottom: float, notes: Notes
) -> Iterator[Shape]:
    names = {end.name for end in ends}
    for drawing in drawn:
        name, element = drawing.name, drawing.element
        if names.intersection((*drawing.groups, element.get("id"))):
            continue
        if drawing.kind not in _KINDS:
            notes.add("drawings passed over: neither wall nor movable", example=name)
            continue
        is_even_odd = (
            "fill-rule:evenodd" in element.get("style", "").replace(" ", "")
            or element.get("fill-rule") == "evenodd"
        )
        parts = filled(_rings(drawing, bottom), is_even_odd=is_even_odd)
        yield Shape(parts, name, {"name": name, "destroyable": _KINDS[drawing.kind]})


def _rings(drawing: _Drawing, bottom: float) -> list[np.ndarray]:
    """Returns the outlines of a shape in metres, y to the north."""
    try:
        lines = outlines(_OUTLINES[plain(drawing.element.tag)](drawing.element))
    except ValueError as error:
        raise ValueError(f"the path {drawing.name!r}: {error}") from error
    if not lines:
        raise ValueError(f"the path {drawing.name!r} is empty")
    turned = [line @ drawing.matrix[:2, :2].T + drawing.matrix[:2, 2] for line in lines]
    return [np.round((line * (1, -1) + (0, bottom)) / _CM, 6) for line in turned]


def _numbers(element: Element, *names: str) -> list[float]:
    """Returns attributes that are lengths without a unit; 0 for one that is missing."""
    try:
        return [float((element.get(name) or "0").removesuffix("px")) for name in names]
    except ValueError as error:
        raise ValueError(f"{', '.join(names)} must be numbers without a unit") from error


def _rectangle(element: Element) -> str:
    x, y, width, height = _numbers(element, "x", "y", "width", "height")
    return f"M {x},{y} h {width} v {height} h {-width} z"


def _circle(element: Element) -> str:
    x, y, r = _numbers(element, "cx", "cy", "r")
    return _ellipse_round(x, y, r, r)


def _ellipse(element: Element) -> str:
    return _ellipse_round(*_numbers(element, "cx", "cy", "rx", "ry"))


def _ellipse_round(x: float, y: float, rx: float, ry: float) -> str:
    return f"M {x - rx},{y} a {rx},{ry} 0 1 0 {2 * rx},0 a {rx},{ry} 0 1 0 {-2 * rx},0 z"


_OUTLINES = {
    "path": lambda element: element.get("d", ""),
    "polygon": lambda element: f"M {element.get('points', '')} z" if element.get("points") else "",
    "rect": _rectangle,
    "circle": _circle,
    "ellipse": _ellipse,
}
"""The path that draws the same as each of these elements."""


def _disc(rings: list[np.ndarray]) -> tuple[tuple[float, float], float]:
    """Returns the middle of the box round the outlines, and how far they reach from there."""
    points = np.concatenate(rings)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y = middle.tolist()
    return (x, y), float(np.hypot(*(points - middle).T).max())
