"""MovingAI benchmark files: `.map` (octile grids) and `.scen` (start, goal and optimal length).

Signs of a map: '.' and 'G' (ground) and 'S' (swamp) are free; '@' and 'O' (out of bounds), 'T'
(trees) and 'W' (water) are blocked. By the benchmark's rules swamp can be entered from ground and
water cannot; our agent moves on the ground. In the files x is the column and y the row; here a cell
is (row, col) as everywhere.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from srt_jax.formats.gridmap import MOST_DIGITS, require_size
from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.whole_files import PathLike, atomic_write, read_lines

FREE_SIGNS = ".GS"
BLOCKED_SIGNS = "@OTW"
_SCEN_FIELDS = (
    "bucket",
    "map",
    "width",
    "height",
    "start x",
    "start y",
    "goal x",
    "goal y",
    "optimal length",
)


class ScenRow(NamedTuple):
    """A row of a scenario.

    bucket: int, groups rows by length. map_name: the map's file name without folders. width,
      height: of that map.
    start, goal: (row, col). length: of a shortest path, cell sides, where a diagonal needs both
      side cells free.
    """

    bucket: int
    map_name: str
    width: int
    height: int
    start: tuple[int, int]
    goal: tuple[int, int]
    length: float


def read_map(path: PathLike, *, notes: Notes | None = None) -> np.ndarray:
    """Returns the free cells of a `.map` file, bool [H, W].

    Args:
      notes: receives how many cells are swamp (free) or water (blocked), which some moving agents
        see otherwise.

    Raises:
      ValueError: with file and line, where the file is missing, no octile map, or not what its
        header says.
    """
    lines = read_lines(path, "MovingAI map")
    height, width, first = _map_header(path, lines)
    rows = lines[first:]
    while len(rows) > height and not rows[-1].strip():
        rows.pop()
    if len(rows) != height:
        raise ValueError(
            f"{path}:{min(len(lines), first + height)}: the header says {height} rows, the file"
            f" holds {len(rows)}: it is cut off or its header is wrong"
        )
    for index, row in enumerate(rows):
        if len(row) != width:
            raise ValueError(
                f"{path}:{first + index + 1}: the header says {width} columns, this row has"
                f" {len(row)}"
            )
    signs = np.array(rows).reshape(height, 1).view("U1").reshape(height, width)
    free = np.isin(signs, list(FREE_SIGNS))
    unknown = np.argwhere(~free & ~np.isin(signs, list(BLOCKED_SIGNS)))
    if len(unknown):
        row, col = unknown[0].tolist()
        raise ValueError(
            f"{path}:{first + row + 1}: column {col + 1} holds {str(signs[row, col])!r}, which is"
            f" no MovingAI sign: free are {', '.join(FREE_SIGNS)}, blocked are"
            f" {', '.join(BLOCKED_SIGNS)}"
        )
    if notes is not None:
        notes.add("swamp cells, taken as free", int((signs == "S").sum()))
        notes.add("water cells, taken as blocked", int((signs == "W").sum()))
    return free


def scaled(free: np.ndarray, height: int, width: int) -> np.ndarray:
    """Returns a map, bool [H, W], of another size: each cell is the old one at its place, from the
    upper left corner.

    Where a row of a scenario has another width or height than its map, the format requires this.
    """
    if free.shape == (height, width):
        return free
    rows, cols = (np.arange(new) * old // new for new, old in zip((height, width), free.shape))
    return free[np.ix_(rows, cols)]


def write_map(path: PathLike, free: np.ndarray) -> None:
    """Writes bool [H, W] as a `.map` file: '.' where free, '@' where not."""
    free = np.asarray(free)
    if free.dtype != bool:
        raise TypeError(
            f"free must be bool (True where the agent fits), got {free.dtype}: write"
            " free.astype(bool)"
        )
    if free.ndim != 2 or 0 in free.shape:
        raise ValueError(f"free must have shape [H, W] with no empty side, got {list(free.shape)}")
    height, width = free.shape
    rows = "\n".join("".join(row) for row in np.where(free, ".", "@").tolist())
    with atomic_write(path) as file:
        file.write(f"type octile\nheight {height}\nwidth {width}\nmap\n{rows}\n")


def read_scen(path: PathLike) -> list[ScenRow]:
    """Returns the rows of a `.scen` file in order; [] where it has none.

    Raises:
      ValueError: with file and line, where the file is missing, of another version, or a row is
        wrong.
    """
    lines = read_lines(path, "MovingAI scenario")
    words = lines[0].split() if lines else []
    if len(words) != 2 or words[0] != "version" or words[1] not in ("1", "1.0"):
        raise ValueError(f"{path}:1: a scenario starts with 'version 1', got {lines[0][:40]!r}")
    return [
        _scen_row(f"{path}:{number}", line)
        for number, line in enumerate(lines[1:], 2)
        if line.strip()
    ]


def write_scen(path: PathLike, rows: Iterable[ScenRow]) -> None:
    """Writes rows as a `.scen` file, lengths with all their digits."""
    with atomic_write(path) as file:
        file.write("version 1\n")
        for row in rows:
            places = (row.start[1], row.start[0], row.goal[1], row.goal[0])
            fields = (row.bucket, row.map_name, row.width, row.height, *places, float(row.length))
            file.write("\t".join(map(str, fields)) + "\n")


def _map_header(path: PathLike, lines: list[str]) -> tuple[int, int, int]:
    """Returns height, width, and the index of the first row of cells."""
    found = {}
    for index, line in enumerate(lines[:10]):
        words = line.split()
        if words == ["map"]:
            missing = {"type", "height", "width"} - found.keys()
            if missing:
                raise ValueError(
                    f"{path}:{index + 1}: the header ends without {', '.join(sorted(missing))}"
                )
            require_size(f"{path}:{index + 1}", found["height"], found["width"])
            return found["height"], found["width"], index + 1
        if len(words) != 2 or words[0] not in ("type", "height", "width") or words[0] in found:
            break
        found[words[0]] = _header_value(f"{path}:{index + 1}", *words)
    else:
        index, line = len(lines), ""
        raise ValueError(
            f"{path}:{index}: the file ends within its header: 'type octile', 'height H', 'width"
            " W', 'map'"
        )
    raise ValueError(
        f"{path}:{index + 1}: a map starts with 'type octile', 'height H', 'width W', 'map', one a"
        f" line, got {line[:40]!r}"
    )


def _header_value(where: str, name: str, value: str) -> int | str:
    if name == "type":
        if value != "octile":
            raise ValueError(
                f"{where}: maps of type {value!r} are not read, only 'octile', on which moves go in"
                " eight directions"
            )
        return value
    if not _is_whole(value) or int(value) == 0:
        limit = (
            f", which has more than {MOST_DIGITS} digits"
            if value.isdigit() and len(value) > MOST_DIGITS
            else ""
        )
        raise ValueError(
            f"{where}: the {name} must be a positive whole number, got {value[:20]!r}{limit}"
        )
    return int(value)


def _is_whole(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS


def _scen_row(where: str, line: str) -> ScenRow:
    fields = line.split("\t") if "\t" in line else line.split()
    if len(fields) != len(_SCEN_FIELDS):
        raise ValueError(
            f"{where}: a row has {len(_SCEN_FIELDS)} fields ({', '.join(_SCEN_FIELDS)}), got"
            f" {len(fields)}"
        )
    numbers = _scen_numbers(where, fields)
    try:
        length = float(fields[8])
    except ValueError:
        length = np.nan
    if not 0 <= length < np.inf:
        raise ValueError(
            f"{where}: the optimal length must be a number, not negative, got {fields[8][:20]!r}"
        )
    return ScenRow(
        bucket=numbers["bucket"],
        map_name=fields[1].strip().replace("\\", "/").rsplit("/", 1)[-1],
        width=numbers["width"],
        height=numbers["height"],
        start=(numbers["start y"], numbers["start x"]),
        goal=(numbers["goal y"], numbers["goal x"]),
        length=length,
    )


def _scen_numbers(where: str, fields: list[str]) -> dict[str, int]:
    """Returns the whole numbers of a row by the names of its fields; start and goal lie inside the
    map.
    """
    numbers = {}
    for name, field in zip(_SCEN_FIELDS, fields):
        if name not in ("map", "optimal length"):
            if not _is_whole(field.strip()):
                raise ValueError(
                    f"{where}: {name} must be a whole number, not negative, of at most"
                    f" {MOST_DIGITS} digits, got {field[:20]!r}"
                )
            numbers[name] = int(field)
    for name, side in (
        ("start x", "width"),
        ("start y", "height"),
        ("goal x", "width"),
        ("goal y", "height"),
    ):
        if numbers[name] >= numbers[side]:
            raise ValueError(
                f"{where}: {name} is {numbers[name]}, outside a map of {side} {numbers[side]}"
            )
    return numbers
