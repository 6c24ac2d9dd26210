"""Places as people type them: a cell `3,5`, metres `1.5m,-2m`, degrees `24.94E,60.17N`; and a
radius, `0.22m` or `3` cells.
"""

import math
import re
from typing import NamedTuple

from srt_jax.geometry.frame import Frame
from srt_jax.types import Cell

FORMS = "row,column such as 3,5, or metres x,y such as 1.5m,-2m, or degrees such as 24.94E,60.17N"
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_METRES = re.compile(rf"\s*({_NUMBER})\s*m\s*,\s*({_NUMBER})\s*m\s*")
_CELL = re.compile(r"\s*([+-]?\d{1,9})\s*,\s*([+-]?\d{1,9})\s*")
_DEGREES = re.compile(r"\s*((?:\d+\.?\d*|\.\d+))\s*°?\s*([EWNS])\s*", re.IGNORECASE)
_RADIUS = re.compile(rf"\s*({_NUMBER})\s*(m?)\s*")


class Spot(NamedTuple):
    """A place in the world, which becomes a cell once the map is known.

    point: (x, y) in metres, or (longitude, latitude) in degrees. text: as it was typed.
    """

    point: tuple[float, float]
    is_degrees: bool
    text: str


class Radius(NamedTuple):
    """Of a robot's disc; in metres, or in cell sides."""

    length: float
    is_metres: bool


def as_end(option: str, text: str) -> Cell | Spot:
    """Returns what was typed after --start or --goal; ValueError that names the forms where it is
    none of them.
    """
    if match := _CELL.fullmatch(text):
        return int(match[1]), int(match[2])
    if match := _METRES.fullmatch(text):
        point = float(match[1]), float(match[2])
        if not all(map(math.isfinite, point)):
            raise ValueError(f"{option} {text!r} is too far away: write metres such as 1.5m,-2m")
        return Spot(point, is_degrees=False, text=text.strip())
    parts = [_DEGREES.fullmatch(part) for part in text.split(",")]
    if len(parts) == 2 and parts[0] and parts[1]:
        named = {match[2].upper(): float(match[1]) for match in parts if match}
        east = named.get("E", -named["W"] if "W" in named else None)
        north = named.get("N", -named["S"] if "S" in named else None)
        if east is not None and north is not None:
            if abs(east) > 180 or abs(north) > 90:
                raise ValueError(
                    f"{option} {text!r} is no place on the globe: longitudes go to 180 E and W,"
                    " latitudes to 90 N and S"
                )
            return Spot((east, north), is_degrees=True, text=text.strip())
    raise ValueError(f"{option} {text!r} is no cell and no place: write {FORMS}")


def as_radius(option: str, text: str) -> Radius:
    """Returns the radius typed: metres with an m, else cell sides; ValueError for anything else."""
    match = _RADIUS.fullmatch(text)
    length = float(match[1]) if match else math.nan
    if not (math.isfinite(length) and length >= 0):
        raise ValueError(
            f"{option} {text!r} is no radius: write metres such as 0.22m, or cells such as 3, not"
            " negative"
        )
    return Radius(length, is_metres=bool(match and match[2]))


def cell_in(frame: Frame, end: Cell | Spot, what: str) -> Cell:
    """Returns the cell of an end; a cell is taken as it is, wherever it lies.

    Args:
      what: what to call it in an error, such as "city.yaml: start".

    Raises:
      ValueError: metres on a map without a resolution, degrees on one without a projection, or a
        place outside the map.
    """
    if not isinstance(end, Spot):
        return end
    if not (end.is_degrees or frame.has_metres):
        raise ValueError(
            f"{what} {end.text} is in metres, and the map does not say how large a cell is: give a"
            " cell (row,column), or the side of a cell by --cell-side"
        )
    try:
        cell = frame.cell_at(end.point) if end.is_degrees else frame.cell_of(end.point)
    except ValueError as error:
        raise ValueError(f"{what} {end.text}: {error}") from error
    row, col = cell.tolist()
    return row, col


def radius_in(frame: Frame, radius: Radius, what: str) -> tuple[float, float]:
    """Returns the radius and the side of a cell in one unit, as `inflate` takes them.

    Raises:
      ValueError: metres on a map without a resolution.
    """
    if radius.is_metres and not frame.has_metres:
        raise ValueError(
            f"{what}: --radius {radius.length:g}m is in metres, and the map does not say how large"
            " a cell is: give it in cells, such as --radius 3, or the side of a cell by --cell-side"
        )
    return radius.length, frame.side if radius.is_metres else 1.0
