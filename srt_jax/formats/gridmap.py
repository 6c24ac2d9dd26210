"""A map that comes as cells, and the one place where shades, signs and numbers become `free`.

In every such file the first row is the top one (north), so nothing is turned: row 0 here is the
first row there. Where a file writes x and y, x is the column and y the row.
"""

import dataclasses
import importlib

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.geometry.frame import Frame
from srt_jax.geometry.raster import Grid

UNKNOWN_AS = ("blocked", "free")
MOST_CELLS = 1 << 26
"""Of a map that is read, 8192 x 8192; the larger ones take more memory to solve than common
machines have.
"""
MOST_DIGITS = 9
"""Of a number of rows, columns or cells."""


@dataclasses.dataclass(frozen=True)
class GridMap:
    """One map of cells.

    free: bool [H, W], True where the agent fits.
    unknown: bool [H, W], the cells of which the file does not say; what they count as is decided in
      `free`.
    cell_side: metres.
    corner: (x, y), metres, the outer corner of the lower left cell.
    yaw: by how much the map is turned about that corner, radians counter-clockwise.
    has_metres: whether the file says how large a cell is.
    start, goal: (row, col), where the file names them.
    """

    free: np.ndarray
    unknown: np.ndarray
    cell_side: float = 1.0
    corner: tuple[float, float] = (0.0, 0.0)
    start: tuple[int, int] | None = None
    goal: tuple[int, int] | None = None
    yaw: float = 0.0
    has_metres: bool = False

    def __repr__(self) -> str:
        """What it is in a line; `free` and `unknown` hold the cells."""
        height, width = self.free.shape
        parts = [f"{height} x {width} cells"]
        if self.has_metres:
            parts[0] += f" of {self.cell_side:g} m"
        parts.append(f"{int(self.free.sum())} of them free")
        if num := int(self.unknown.sum()):
            parts.append(f"{num} unknown")
        for name in ("start", "goal"):
            if (cell := getattr(self, name)) is not None:
                parts.append(f"{name} {tuple(map(int, cell))}")
        return f"GridMap({', '.join(parts)})"

    def _repr_html_(self) -> str:
        """A picture, for notebooks: made far above this module, and loaded only there."""
        return importlib.import_module("srt_jax.draw.notebook").grid_map_html(self)

    @property
    def frame(self) -> Frame:
        """Where the cells lie in the world: `frame.cell_of(point)`, `frame.point_of(cell)`."""
        return Frame(self.grid, self.yaw, has_metres=self.has_metres)

    @property
    def grid(self) -> Grid:
        """Where the cells lie in metres."""
        height, width = self.free.shape
        return Grid(
            (self.corner[0], self.corner[1] + height * self.cell_side),
            self.cell_side,
            height,
            width,
        )


class TooLargeError(ValueError):
    """A map with more cells than are read."""


def require_size(where: str, height: int, width: int) -> None:
    """Raises TooLargeError where a map of so many cells is too large to be read."""
    if height * width > MOST_CELLS:
        raise TooLargeError(
            f"{where}: {height} x {width} are {height * width} cells, and at most {MOST_CELLS} are"
            " read: scale the map down or cut it into parts"
        )


def free_map(free: np.ndarray) -> GridMap:
    """Returns the map of a mask, bool [H, W], that is known everywhere."""
    free = np.asarray(free)
    if free.dtype != bool:
        raise TypeError(
            f"free must be bool (True where the agent fits), got {free.dtype}: write"
            " free.astype(bool)"
        )
    if free.ndim != 2 or 0 in free.shape:
        raise ValueError(f"free must have shape [H, W] with no empty side, got {list(free.shape)}")
    return GridMap(free, np.zeros_like(free))


def decided(occupied: np.ndarray, free: np.ndarray, *, unknown_as: str, notes: Notes) -> GridMap:
    """Returns the map where cells are `occupied`, `free` (bool [H, W]), or neither: unknown, which
    is noted.

    Args:
      unknown_as: "blocked" or "free".
    """
    if unknown_as not in UNKNOWN_AS:
        raise ValueError(
            f"unknown cells can count as {' or '.join(UNKNOWN_AS)}, not as {unknown_as!r}"
        )
    unknown = ~occupied & ~free
    notes.add(f"unknown cells, taken as {unknown_as}", int(unknown.sum()))
    return GridMap(free | unknown if unknown_as == "free" else free, unknown)
