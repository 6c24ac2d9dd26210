"""Maps of ROS `map_server`: a YAML file beside a picture; its rules of occupancy, its units and its
corner.

A pixel's occupancy is p = (255 - shade) / 255, or shade / 255 where the file says `negate`. Above
`occupied_thresh` a cell is blocked, below `free_thresh` free, and else unknown, as are pixels that
are not opaque. Mode `scale` asks the same of a cell, as what lies between the thresholds is
neither; in mode `raw` the shade itself is the occupancy in percent, unknown above 100. The
picture's first row is the northern one, and `origin` the outer corner of the lower left pixel.
"""

import math
import pathlib
from typing import Any

import numpy as np

from srt_jax.formats.files import PathLike, needed, read_bytes, written
from srt_jax.formats.gridmap import GridMap, decided
from srt_jax.formats.notes import Notes
from srt_jax.formats.pictures import read_shades

MODES = ("trinary", "scale", "raw")
_REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205
"""The shades that map_server's own saver writes."""
_THRESHOLDS = {"occupied_thresh": 0.65, "free_thresh": 0.196}


def read_ros_map(
    path: PathLike, *, unknown_as: str = "blocked", notes: Notes | None = None
) -> GridMap:
    """Returns the map that a map_server YAML file describes; needs pyyaml and pillow.

    Args:
      unknown_as: what unknown cells count as, "blocked" or "free".
      notes: receives how many cells are unknown, which members are not known, and whether a turn
        was left out.

    Raises:
      ValueError: the file or its picture is missing or damaged, or a member is missing or wrong.
    """
    notes = Notes() if notes is None else notes
    fields = _fields(path, _document(path), notes)
    picture = pathlib.Path(path).parent / fields["image"]
    shade, is_clear = read_shades(picture, f"picture of the map {path}")
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
            f"the map's turn by {yaw:g} radians is left out: rows and columns are the picture's"
        )
    return GridMap(made.free, made.unknown, cell_side=fields["resolution"], corner=(x, y))


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
    with written(picture, "wb") as file:
        file.write(
            f"P5\n# CREATOR: srt-jax {grid_map.cell_side:.3f} m/pix\n{width} {height}\n255\n".encode()
        )
        file.write(shades.tobytes())
    x, y = grid_map.corner
    lines = [
        f"image: {picture.name}",
        f"resolution: {float(grid_map.cell_side)!r}",
        f"origin: [{x!r}, {y!r}, 0.0]",
        "negate: 0",
    ]
    lines += [f"{name}: {value}" for name, value in _THRESHOLDS.items()]
    with written(target) as file:
        file.write("\n".join(lines) + "\n")


def _document(path: PathLike) -> Any:
    yaml = needed("yaml", extra="ros", what="reading ROS maps")
    content = read_bytes(path, "ROS map")
    try:
        return yaml.safe_load(content)
    except (yaml.YAMLError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: no YAML: {' '.join(str(error).split())}") from error


def _fields(path: PathLike, document: Any, notes: Notes) -> dict[str, Any]:
    if not isinstance(document, dict):
        raise ValueError(f"{path}: no ROS map: a YAML file with {', '.join(_REQUIRED)}")
    unknown = [str(name) for name in document if name not in (*_REQUIRED, "mode")]
    for name in _REQUIRED:
        if name not in document:
            told = f"; {', '.join(unknown)} is not known" if unknown else ""
            raise ValueError(f"{path}: the map lacks {name!r}: it has {', '.join(_REQUIRED)}{told}")
    notes.add("members not known, passed over", len(unknown), example=", ".join(unknown))
    fields: dict[str, Any] = {"mode": "trinary"} | {
        name: document[name] for name in (*_REQUIRED, "mode") if name in document
    }
    if not isinstance(fields["image"], str):
        raise ValueError(f"{path}: image must be the name of a picture, got {fields['image']!r}")
    if fields["mode"] not in MODES:
        raise ValueError(f"{path}: mode must be one of {', '.join(MODES)}, got {fields['mode']!r}")
    if fields["negate"] not in (0, 1):
        raise ValueError(f"{path}: negate must be 0 or 1, got {fields['negate']!r}")
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


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{what} must be a finite number, got {value!r}")
    return float(value)
