"""Worlds as JSON (docs/formats.md): polygons in metres, the agent's disc and the goal square."""

import json
from typing import Any, NoReturn

from srt_jax.formats.files import PathLike, read_bytes, written
from srt_jax.world import Obstacle, World

FORMAT, VERSION = "srt-jax world", 1


def read_world(path: PathLike, *, repair: bool = False) -> World:
    """Returns the world in a JSON file.

    Args:
      repair: make valid polygons of rings that cross themselves (needs shapely) instead of refusing them.

    Raises:
      ValueError: the file is missing, no JSON, of another version, or breaks a rule of `World`; the message says where.
    """
    content = read_bytes(path, "world")
    try:
        document = json.loads(content, parse_constant=_refuse_constant, object_pairs_hook=_without_repeats)
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}:{error.lineno}: no whole JSON file: {error.msg} at column {error.colno}") from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: no JSON text in UTF-8, or nested too deeply") from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
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
    obstacles = ",\n    ".join(json.dumps(_written(obstacle), ensure_ascii=False) for obstacle in world.obstacles)
    lines.append('  "obstacles": [' + (f"\n    {obstacles}\n  ]" if obstacles else "]"))
    with written(path) as file:
        file.write("{\n" + ",\n".join(lines) + "\n}\n")


def _written(obstacle: Obstacle) -> dict[str, Any]:
    shape = {"polygon": obstacle.parts[0]} if len(obstacle.parts) == 1 else {"multipolygon": obstacle.parts}
    return {"name": obstacle.name, "destroyable": obstacle.destroyable, "removal_cost": obstacle.removal_cost, **shape}


def _world(document: object, repair: bool) -> World:
    fields = _fields("the file", document, "format", "version", "bounds", "agent", "goal", "obstacles")
    if (fields["format"], fields["version"]) != (FORMAT, VERSION):
        raise ValueError(
            f"format {fields['format']!r} version {fields['version']!r} is not read, only {FORMAT!r} version {VERSION}"
        )
    agent = _fields("agent", fields["agent"], "position", "radius")
    goal = fields["goal"]
    if isinstance(goal, dict):
        goal = tuple(_fields("goal", goal, "centre", "side").values())
    if not isinstance(fields["obstacles"], list):
        raise ValueError("obstacles must be a list")
    return World(
        bounds=fields["bounds"],
        obstacles=tuple(_obstacle(f"obstacles[{index}]", item, repair) for index, item in enumerate(fields["obstacles"])),
        position=agent["position"],
        radius=agent["radius"],
        goal=goal,
    )


def _obstacle(where: str, item: object, repair: bool) -> Obstacle:
    shape = "multipolygon" if isinstance(item, dict) and "multipolygon" in item else "polygon"
    fields = _fields(where, item, shape, name="", destroyable=True, removal_cost=1.0)
    if not isinstance(fields["name"], str):
        raise ValueError(f"{where}: name must be a text, got {fields['name']!r}")
    parts = fields.pop(shape)
    try:
        return Obstacle(parts=parts if shape == "multipolygon" else (parts,), repair=repair, **fields)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{where}: {error}") from error


def _fields(where: str, value: object, *required: str, **defaults: object) -> dict[str, Any]:
    """Returns the members of a JSON object in the order asked for; ValueError for one that is missing or not known."""
    if not isinstance(value, dict):
        raise ValueError(f"{where} must be an object with {', '.join(required)}, got {type(value).__name__}")
    names = (*required, *defaults)
    for name in required:
        if name not in value:
            raise ValueError(f"{where} lacks {name!r}: it has {', '.join(names)}")
    for name in value:
        if name not in names:
            raise ValueError(f"{where} has the unknown member {name!r}: known are {', '.join(names)}")
    return {name: value.get(name, defaults.get(name)) for name in names}


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no coordinate: numbers must be finite")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the member {max(names, key=names.count)!r} stands twice in one object")
    return members
