"""Worlds as JSON (docs/formats.md): polygons in metres, the agent's disc and the goal square."""

import json
from typing import Any

from sign_model.foundation.collector import paused_collector
from srt_jax.formats.containers.json_text import fields_of, is_version, read_json
from srt_jax.formats.shared.whole_files import PathLike, atomic_write
from srt_jax.geometry.rings import Parts, as_rings, conflicts
from srt_jax.geometry.world import Obstacle, World

FORMAT, VERSION = "srt-jax world", 1


@paused_collector()
def read_world(path: PathLike, *, repair: bool = False) -> World:
    """Returns the world in a JSON file.

    Args:
      repair: make valid polygons of rings that cross themselves (needs shapely) instead of refusing
        them.

    Raises:
      ValueError: the file is missing, no JSON, of another version, or breaks a rule of `World`; the
        message says where.
    """
    document = read_json(path, "world")
    try:
        return _world(document, repair)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}") from error


def write_world(path: PathLike, world: World) -> None:
    """Writes a world as JSON; it reads back equal."""
    head = {
        "format": FORMAT,
        "version": VERSION,
        "bounds": world.bounds,
        "agent": {"position": world.position, "radius": world.radius},
        "goal": world.goal,
    }
    lines = [f"  {json.dumps(name)}: {json.dumps(value)}" for name, value in head.items()]
    obstacles = ",\n    ".join(
        json.dumps(_as_json(obstacle), ensure_ascii=False) for obstacle in world.obstacles
    )
    lines.append('  "obstacles": [' + (f"\n    {obstacles}\n  ]" if obstacles else "]"))
    with atomic_write(path) as file:
        file.write("{\n" + ",\n".join(lines) + "\n}\n")


def _as_json(obstacle: Obstacle) -> dict[str, Any]:
    shape = (
        {"polygon": obstacle.parts[0]}
        if len(obstacle.parts) == 1
        else {"multipolygon": obstacle.parts}
    )
    return {
        "name": obstacle.name,
        "destroyable": obstacle.destroyable,
        "removal_cost": obstacle.removal_cost,
        **shape,
    }


def _world(document: object, repair: bool) -> World:
    fields = fields_of(
        "the file", document, "format", "version", "bounds", "agent", "goal", "obstacles"
    )
    if fields["format"] != FORMAT or not is_version(fields["version"], VERSION):
        raise ValueError(
            f"format {fields['format']!r} version {fields['version']!r} is not read, only"
            f" {FORMAT!r} version {VERSION}"
        )
    agent = fields_of("agent", fields["agent"], "position", "radius")
    goal = fields["goal"]
    if isinstance(goal, dict):
        goal = tuple(fields_of("goal", goal, "centre", "side").values())
    if not isinstance(fields["obstacles"], list):
        raise ValueError("obstacles must be a list")
    return World(
        bounds=fields["bounds"],
        obstacles=_obstacles(fields["obstacles"], repair),
        position=agent["position"],
        radius=agent["radius"],
        goal=goal,
    )


def _obstacles(items: list[Any], repair: bool) -> tuple[Obstacle, ...]:
    """Returns the obstacles, their polygons checked all at once; one by one only where something
    is odd.
    """
    shapes = [_parts_of(item) for item in items]
    checked = iter(as_rings([ring for parts in shapes for part in parts for ring in part]))
    whole = [tuple(tuple(next(checked) or () for _ in part) for part in parts) for parts in shapes]
    is_plain = [bool(parts) and all(part and all(part) for part in parts) for parts in whole]
    reasons = iter(conflicts([parts for parts, plain in zip(whole, is_plain) if plain]))
    made = []
    for index, (item, parts, plain) in enumerate(zip(items, whole, is_plain)):
        is_right = plain and not next(reasons)
        made.append(_obstacle(f"obstacles[{index}]", item, repair, parts if is_right else None))
    return tuple(made)


def _parts_of(item: Any) -> list[list[Any]]:
    """Returns an obstacle's polygons as lists of rings; [] where it has none of that form."""
    if not isinstance(item, dict):
        return []
    parts = item.get("multipolygon", [item.get("polygon")])
    is_nested = isinstance(parts, list) and all(isinstance(part, list) for part in parts)
    return parts if is_nested else []


def _obstacle(where: str, item: object, repair: bool, checked: Parts | None = None) -> Obstacle:
    """Returns one obstacle; `checked` are its polygons where they have been found right."""
    shape = "multipolygon" if isinstance(item, dict) and "multipolygon" in item else "polygon"
    fields = fields_of(where, item, shape, name="", destroyable=True, removal_cost=1.0)
    if not isinstance(fields["name"], str):
        raise ValueError(f"{where}: name must be a text, got {fields['name']!r}")
    parts = fields.pop(shape)
    try:
        if checked is not None:
            return Obstacle(parts=checked, checked=True, **fields)
        return Obstacle(
            parts=parts if shape == "multipolygon" else (parts,), repair=repair, **fields
        )
    except (ValueError, TypeError) as error:
        raise ValueError(f"{where}: {error}") from error
