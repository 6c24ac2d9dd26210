"""The XML maps of the paper's authors (their program AStar-JPS-ThetaStar): a grid of 0 and 1 with
start and goal.

`<root><map>` holds width, height, cellsize, startx, starty, finishx, finishy and `<grid>` with a
`<row>` a line; 0 is free, anything else blocked; x is the column, y the row, from the upper left.
`<algorithm>` says how their program is to search.
"""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np

from srt_jax.formats.containers.xml_text import read_xml
from srt_jax.formats.gridmap import MOST_DIGITS, GridMap, decided, require_size
from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.whole_files import PathLike, atomic_write

_OURS = {"allowdiagonal": "true", "cutcorners": "false", "allowsqueeze": "false"}
"""Our moves in their words; these are their defaults, too."""


def read_xml_map(path: PathLike, *, notes: Notes | None = None) -> GridMap:
    """Returns the map in a file, with start and goal where it names both.

    Args:
      notes: receives whether the file requests moves other than ours, and how many cells are
        neither 0 nor 1.

    Raises:
      ValueError: the file is missing or no XML, has no grid, or the grid is not what width and
        height say.
    """
    notes = Notes() if notes is None else notes
    root = read_xml(path, "XML map")
    element = root if root.tag == "map" else root.find("map")
    if element is None:
        raise ValueError(
            f"{path}: no map in it: a <root> holds a <map> with width, height and grid"
        )
    height, width = (_whole(path, element, name, least=1) for name in ("height", "width"))
    require_size(str(path), int(height or 0), int(width or 0))
    numbers = _grid(path, element, int(height or 0), int(width or 0))
    notes.add(
        "cells that are neither 0 nor 1, blocked", int(((numbers != "0") & (numbers != "1")).sum())
    )
    made = decided(numbers != "0", numbers == "0", unknown_as="blocked", notes=notes)
    ends = [_cell(path, element, name, made.free.shape) for name in ("start", "finish")]
    for name, ours in _OURS.items():
        theirs = (root.findtext(f"algorithm/{name}") or ours).strip().lower()
        if {"1": "true", "0": "false"}.get(theirs, theirs) != ours:
            notes.tell(
                f"the file requests {name} = {theirs}; moves here go in eight directions and cut no"
                " corner"
            )
    return GridMap(
        made.free,
        made.unknown,
        cell_side=_cell_side(path, element),
        start=ends[0],
        goal=ends[1],
        has_metres=element.find("cellsize") is not None,
    )


def write_xml_map(path: PathLike, grid_map: GridMap) -> None:
    """Writes a map with its start and goal, and an `<algorithm>` that moves as we do: A*, no corner
    cut.
    """
    if grid_map.start is None or grid_map.goal is None:
        raise ValueError(f"{path}: an XML map names a start and a goal: give both")
    height, width = grid_map.free.shape
    (start_y, start_x), (goal_y, goal_x) = grid_map.start, grid_map.goal
    side = float(grid_map.cell_side)
    values = {
        "width": width,
        "height": height,
        "cellsize": int(side) if side.is_integer() else repr(side),
    }
    values |= {"startx": start_x, "starty": start_y, "finishx": goal_x, "finishy": goal_y}
    algorithm = {
        "searchtype": "astar",
        "metrictype": "diagonal",
        "breakingties": "g-max",
        "hweight": 1,
    } | _OURS
    head = [f"        <{name}>{value}</{name}>" for name, value in values.items()]
    rows = [
        f"            <row>{' '.join(row)}</row>"
        for row in np.where(grid_map.free, "0", "1").tolist()
    ]
    search = [f"        <{name}>{value}</{name}>" for name, value in algorithm.items()]
    lines = ["    <map>", *head, "        <grid>", *rows, "        </grid>", "    </map>"]
    with atomic_write(path) as file:
        file.write('<?xml version="1.0" encoding="UTF-8" ?>\n<root>\n')
        file.write(
            "\n".join([*lines, "    <algorithm>", *search, "    </algorithm>", "</root>"]) + "\n"
        )


def _grid(path: PathLike, element: ElementTree.Element, height: int, width: int) -> np.ndarray:
    """Returns the cells as texts, [H, W]."""
    grid = element.find("grid")
    if grid is None:
        raise ValueError(f"{path}: the map has no <grid>: a <row> for each of its {height} rows")
    rows = [(row.text or "").split() for row in grid.findall("row")]
    if len(rows) != height:
        raise ValueError(
            f"{path}: the map says {height} rows, its grid has {len(rows)}: it is cut off, or its"
            " height is wrong"
        )
    for number, row in enumerate(rows):
        if len(row) != width:
            raise ValueError(
                f"{path}: the map says {width} columns, row {number} (counted from 0) has"
                f" {len(row)}"
            )
    return np.array(rows)


def _cell(
    path: PathLike, element: ElementTree.Element, name: str, shape: tuple[int, ...]
) -> tuple[int, int] | None:
    x, y = (_whole(path, element, f"{name}{axis}", least=0, optional=True) for axis in "xy")
    if x is None and y is None:
        return None
    if x is None or y is None:
        raise ValueError(f"{path}: of {name}x and {name}y one is missing: give both")
    if not (y < shape[0] and x < shape[1]):
        raise ValueError(
            f"{path}: {name} ({x}, {y}) lies outside the map, {shape[1]} wide and {shape[0]} high"
        )
    return y, x


def _whole(
    path: PathLike, element: ElementTree.Element, name: str, *, least: int, optional: bool = False
) -> int | None:
    text = element.findtext(name)
    if text is None and optional:
        return None
    digits = (text or "").strip()
    if (
        text is None
        or not (digits.isascii() and digits.isdigit() and len(digits) <= MOST_DIGITS)
        or int(digits) < least
    ):
        got = "it is missing" if text is None else f"got {text.strip()[:20]!r}"
        raise ValueError(
            f"{path}: <{name}> must be a whole number from {least} with at most {MOST_DIGITS}"
            f" digits: {got}"
        )
    return int(digits)


def _cell_side(path: PathLike, element: ElementTree.Element) -> float:
    text = element.findtext("cellsize")
    try:
        side = 1.0 if text is None else float(text)
    except ValueError:
        side = math.nan
    if not (side > 0 and math.isfinite(side)):
        raise ValueError(
            f"{path}: <cellsize> must be a positive number, got {(text or '').strip()[:20]!r}"
        )
    return side
