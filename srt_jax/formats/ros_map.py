"""Maps of ROS `map_server`: a YAML file beside a picture; its rules of occupancy, its units and its
corner.

A pixel's occupancy is p = (255 - shade) / 255, or shade / 255 where the file says `negate`. Above
`occupied_thresh` a cell is blocked, below `free_thresh` free, and else unknown, as are pixels that
are not opaque. Mode `scale` asks the same of a cell, as what lies between the thresholds is
neither; in mode `raw` the shade itself is the occupancy in percent, unknown above 100. The
picture's first row is the northern one, and `origin` the outer corner of the lower left pixel.

Every value is taken as text and read as map_server reads it, since the versions of YAML disagree:
in 1.1 "5e-2" is a text and "010" is 8, for map_server these are the numbers 0.05 and 10.
"""

import itertools
import math
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from srt_jax.formats.gridmap import GridMap, decided
from srt_jax.formats.notes import Notes
from srt_jax.formats.pictures import read_shades
from srt_jax.formats.shared.whole_files import (
    PathLike,
    atomic_write,
    plain_reason,
    read_bytes,
    require_module,
)

MODES = ("trinary", "scale", "raw")
_REQUIRED = ("image", "resolution", "origin")
_DEFAULTS = {"negate": "0", "occupied_thresh": "0.65", "free_thresh": "0.196"}
"""What map_server's own files hold, where a file lacks them."""
_KNOWN = (*_REQUIRED, *_DEFAULTS, "mode")
_YES, _NO = ("1", "true", "yes", "on", "y"), ("0", "false", "no", "off", "n")
_MOST_DEPTH = 20
"""Lists within lists; a map has one."""
_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205
"""The shades that map_server's own saver writes."""
_MOST_BYTES = 1 << 14
"""Of the YAML file, which has a few lines."""
_MOST_BRACKETS = 100
_MOST_VALUES = 1000
"""Of the YAML file, where one that is named and used again counts each time."""
_THRESHOLDS = {"occupied_thresh": 0.65, "free_thresh": 0.196}


def read_ros_map(
    path: PathLike, *, unknown_as: str = "blocked", notes: Notes | None = None
) -> GridMap:
    """Returns the map that a map_server YAML file describes; needs pyyaml and pillow.

    Args:
      unknown_as: what unknown cells count as, "blocked" or "free".
      notes: receives how many cells are unknown, which members are not known, and whether the map
        is turned.

    Raises:
      ValueError: the file or its picture is missing or damaged, or a member is missing or wrong.
    """
    notes = Notes() if notes is None else notes
    fields = _fields(path, _document(path), notes)
    picture = pathlib.Path(path).parent / fields["image"]
    shade, is_clear = read_shades(picture, f"picture of the map {path}", notes=notes)
    if fields["mode"] == "raw":
        occupancy, is_known = shade / 100.0, shade <= 100
    else:
        occupancy, is_known = (shade if fields["negate"] else 255.0 - shade) / 255.0, ~is_clear
    occupied = is_known & (occupancy > fields["occupied_thresh"])
    free = is_known & (occupancy < fields["free_thresh"])
    made = decided(occupied, free, unknown_as=unknown_as, notes=notes)
    x, y, yaw = fields["origin"]
    if yaw:
        notes.tell(
            f"the map is turned by {yaw:g} radians about its lower left corner: metres are turned"
            " with it, rows and columns are the picture's"
        )
    return GridMap(
        made.free,
        made.unknown,
        cell_side=fields["resolution"],
        corner=(x, y),
        yaw=yaw,
        has_metres=True,
    )


def write_ros_map(path: PathLike, grid_map: GridMap) -> None:
    """Writes a map as map_server's saver does: a YAML file, and a picture of the same name ending
    in .pgm.

    Cells that are unknown stay so. It reads back equal where unknown cells count as they did.
    """
    target = pathlib.Path(path)
    picture = target.with_suffix(".pgm")
    height, width = grid_map.free.shape
    shades = np.where(grid_map.unknown, _UNKNOWN, np.where(grid_map.free, _FREE, _OCCUPIED)).astype(
        np.uint8
    )
    with atomic_write(picture, "wb") as file:
        file.write(
            f"P5\n# CREATOR: srt-jax {grid_map.cell_side:.3f} m/pix\n"
            f"{width} {height}\n255\n".encode()
        )
        file.write(shades.tobytes())
    x, y = grid_map.corner
    lines = [
        f"image: {picture.name}",
        f"resolution: {float(grid_map.cell_side)!r}",
        f"origin: [{x!r}, {y!r}, {float(grid_map.yaw)!r}]",
        "negate: 0",
    ]
    lines += [f"{name}: {value}" for name, value in _THRESHOLDS.items()]
    with atomic_write(target) as file:
        file.write("\n".join(lines) + "\n")


def _document(path: PathLike) -> Any:
    """Returns the values in a YAML file as texts, lists, objects, and None for null."""
    yaml = require_module("yaml", extra="ros", what="reading ROS maps")
    content = read_bytes(path, "ROS map", most=_MOST_BYTES)
    # its reader takes time by the square of their number
    if content.count(b"[") + content.count(b"{") > _MOST_BRACKETS:
        raise ValueError(
            f"{path}: no YAML of a ROS map: nested too deeply, more than {_MOST_BRACKETS} brackets"
            " are in it"
        )
    try:
        node = yaml.compose(content, Loader=yaml.SafeLoader)
        return _value(yaml, node, 0, itertools.count(1))
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no YAML: {plain_reason(error)}") from error


def _value(yaml: Any, node: Any, depth: int, numbers: Iterator[int]) -> Any:
    """Returns a value of the file; every value within it takes one of the numbers."""
    if next(numbers) > _MOST_VALUES:
        raise ValueError(f"more than {_MOST_VALUES} values are in it: a map has a few")
    if node is not None and not node.tag.startswith("tag:yaml.org,2002:"):
        raise ValueError(f"the tag {node.tag!r} is not read: maps hold plain values")
    if node is not None and (
        node.tag.startswith("tag:yaml.org,2002:python") or depth > _MOST_DEPTH
    ):
        raise ValueError("maps hold plain values, not objects or lists within lists")
    if node is None or node.tag == "tag:yaml.org,2002:null":
        return None
    if isinstance(node, yaml.ScalarNode):
        return node.value
    if isinstance(node, yaml.SequenceNode):
        return [_value(yaml, item, depth + 1, numbers) for item in node.value]
    names = [str(_value(yaml, name, depth + 1, numbers)) for name, _ in node.value]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"the member {name!r} is given twice")
    return dict(zip(names, (_value(yaml, item, depth + 1, numbers) for _, item in node.value)))


def _fields(path: PathLike, document: Any, notes: Notes) -> dict[str, Any]:
    """Returns every member by its name, each of its kind and within its range."""
    fields = _members(path, document, notes)
    if not isinstance(fields["image"], str) or not fields["image"].strip():
        raise ValueError(f"{path}: image must be the name of a picture, got {fields['image']!r}")
    mode = fields["mode"]
    fields["mode"] = mode.strip().lower() if isinstance(mode, str) else mode
    if fields["mode"] not in MODES:
        raise ValueError(f"{path}: mode must be one of {', '.join(MODES)}, got {mode!r}")
    fields["negate"] = _flag(path, fields["negate"])
    if not (isinstance(fields["origin"], list) and len(fields["origin"]) == 3):
        raise ValueError(
            f"{path}: origin must be [x, y, yaw] of the lower left pixel, got {fields['origin']!r}"
        )
    fields["origin"] = [_number(f"{path}: a number of origin", value) for value in fields["origin"]]
    for name in ("resolution", "occupied_thresh", "free_thresh"):
        fields[name] = _number(f"{path}: {name}", fields[name])
    if fields["resolution"] <= 0:
        raise ValueError(
            f"{path}: resolution is {fields['resolution']:g}: it must be positive, metres per pixel"
        )
    if not 0 <= fields["free_thresh"] <= fields["occupied_thresh"] <= 1:
        raise ValueError(
            f"{path}: thresholds must be 0 <= free_thresh <= occupied_thresh <= 1, got"
            f" {fields['free_thresh']:g} and {fields['occupied_thresh']:g}"
        )
    return fields


def _members(path: PathLike, document: Any, notes: Notes) -> dict[str, Any]:
    """Returns the members as they are written, with the defaults of those that are not there."""
    if not isinstance(document, dict):
        raise ValueError(
            f"{path}: no ROS map: a YAML file with {', '.join((*_REQUIRED, *_DEFAULTS))}"
        )
    unknown = [name for name in document if name not in _KNOWN]
    given = {name: value for name, value in document.items() if value is not None}
    for name in _REQUIRED:
        if name not in given:
            others = f"; {', '.join(unknown)} is not known" if unknown else ""
            raise ValueError(
                f"{path}: the map lacks {name!r}: it needs {', '.join(_REQUIRED)}{others}"
            )
    notes.add("members not known, passed over", len(unknown), example=", ".join(unknown))
    for name, value in _DEFAULTS.items():
        if name not in given:
            notes.tell(f"the map lacks {name}: taken as {value}")
    return {"mode": "trinary"} | _DEFAULTS | {name: given[name] for name in _KNOWN if name in given}


def _flag(path: PathLike, value: Any) -> bool:
    text = value.strip().lower() if isinstance(value, str) else ""
    text = {"0.0": "0", "1.0": "1"}.get(text, text)
    if text not in (*_YES, *_NO):
        raise ValueError(f"{path}: negate must be 0 or 1, got {value!r}")
    return text in _YES


def _number(what: str, value: Any) -> float:
    try:
        number = float(value) if isinstance(value, str) and "_" not in value else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{what} must be a finite number, got {value!r}")
    return number
