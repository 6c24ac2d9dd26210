"""The paper's five ways to cut a goal off (PY16 §4): Half, Quarter, and square rings of side 100,
50 and 10, the Bagels.

The blocker is one new obstacle, a solid line of cells from edge to edge or round the goal. Where it
crosses obstacles it overlaps them, in a layer of its own. So every way to the goal crosses a cell
that the blocker owns: it is on every list of what must go, and where start and goal were connected
before, it alone suffices. The least removal is the blocker, whatever all else costs.
"""

import numpy as np

from srt_jax.components import largest_region
from srt_jax.types import FREE, Cell

BLOCKAGES = ("half", "quarter", "bagel-100", "bagel-50", "bagel-10")
"""The five of the paper; any other ring is bagel-K with a side of K cells, 3 or more."""


def block(labels: np.ndarray, start: Cell, goal: Cell, kind: str) -> tuple[np.ndarray, int]:
    """Returns the map with a blocker between start and goal, and the blocker's id: the next one
    that is not in use.

    PY16 §4. "half": a line across the middle of the map, moved as far as it must to part start and
    goal. "quarter": two perpendicular lines round the quarter of the goal. "bagel-K": a square ring
    of side K with the goal in its centre, cut off at the edge of the map. What it encloses, itself
    included, is the goal's share: a half, a quarter, K x K cells.

    Args:
      labels: int32 [H, W] or [L, H, W], -1 where free.
      start, goal: (row, col).
      kind: one of BLOCKAGES, or another bagel-K.

    Returns:
      labels int32 [L, H, W], with one layer more where the blocker crosses obstacles; the id.

    Raises:
      ValueError: an unknown kind; start or goal outside the map; no such blocker fits between them.
    """
    layers = np.array(labels, np.int32).reshape(-1, *np.shape(labels)[-2:])
    size = layers.shape[1:]
    for name, cell in (("start", start), ("goal", goal)):
        if not all(0 <= place < length for place, length in zip(cell, size, strict=True)):
            raise ValueError(
                f"{name} {_cell_text(cell)} lies outside the map of {size[0]} x {size[1]} cells"
            )
    rows, cols = _box(kind, start, goal, size)
    if _is_in(start, rows, cols):
        raise ValueError(
            f"{kind}: start {_cell_text(start)} lies inside the blocker around goal"
            f" {_cell_text(goal)}: move them apart"
        )
    line = _rim(rows, cols, size)
    blocker = int(layers.max()) + 1
    unused = [layer for layer in layers if (layer[line] == FREE).all()]
    if not unused:
        layers = np.concatenate([layers, np.full((1, *size), FREE, np.int32)])
        unused = [layers[-1]]
    unused[0][line] = blocker
    return layers, blocker


def require_kind(kind: str) -> None:
    """Raises ValueError where there is no such blockage."""
    if kind not in ("half", "quarter"):
        _ring_side(kind)


def pick_start_goal(free: np.ndarray, *, apart: int, seed: int) -> tuple[Cell, Cell]:
    """Returns two cells on opposite sides of the largest free region, at least `apart` rows or
    columns from each other.

    PY16 §4 has them more than 400 of 500 apart. The larger region wins, the first in row order
    among equals; which sides, and which cells there, is drawn by `seed`.

    Args:
      free: bool [H, W], True where the agent fits.
      apart: 0 or more.

    Raises:
      ValueError: the region is too narrow, or nothing is free.
    """
    rng = np.random.default_rng(seed)
    cells = np.argwhere(largest_region(np.asarray(free, bool)))
    spans = np.ptp(cells, axis=0) if len(cells) else np.array([-1, -1])
    if spans.max() < apart:
        raise ValueError(
            f"no two cells lie {apart} rows or columns apart: "
            f"the largest free region spans {spans[0] + 1} x {spans[1] + 1} cells"
        )
    axis = rng.choice(np.flatnonzero(spans >= apart))
    place = cells[:, axis]
    low, high = int(place.min()), int(place.max())
    start = cells[rng.choice(np.flatnonzero(place <= min(high - apart, (low + high) // 2)))]
    goal = cells[
        rng.choice(np.flatnonzero(place >= max(start[axis] + apart, (low + high + 1) // 2)))
    ]
    ends = [(int(row), int(col)) for row, col in (start, goal)]
    return tuple(ends[:: rng.choice([-1, 1])])  # type: ignore[return-value]


def _box(kind: str, start: Cell, goal: Cell, size: tuple[int, ...]) -> tuple[range, range]:
    """Returns the rows and columns of the rectangle whose rim is the blocker; they may run past the
    edge of the map.
    """
    sides = [range(-1, length + 1) for length in size]
    if kind == "half":
        axis = _axis_of_half(start, goal, size)
        sides[axis] = _beyond(_middle(start[axis], goal[axis], size[axis]), goal[axis], size[axis])
        return sides[0], sides[1]
    if kind == "quarter":
        for axis in (0, 1):
            if size[axis] < 4:
                raise ValueError(
                    f"quarter: a map of {size[0]} x {size[1]} cells is too small: 4 x 4 is the"
                    " least"
                )
            # the edge on the other side
            away = size[axis] - 1 if goal[axis] * 2 < size[axis] else 0
            sides[axis] = _beyond(_middle(away, goal[axis], size[axis]), goal[axis], size[axis])
        return sides[0], sides[1]
    side = _ring_side(kind)
    top, left = (place - side // 2 for place in goal)
    return range(top, top + side), range(left, left + side)


def _ring_side(kind: str) -> int:
    name, _, side = kind.partition("-")
    if name != "bagel" or not side.isascii() or not side.isdigit():
        raise ValueError(
            f"unknown blockage {kind!r}: choose half, quarter, or bagel-K such as"
            f" {', '.join(BLOCKAGES[2:])}"
        )
    if int(side) < 3:
        raise ValueError(f"{kind}: a ring of side {int(side)} has no inside: K must be at least 3")
    return int(side)


def _axis_of_half(start: Cell, goal: Cell, size: tuple[int, ...]) -> int:
    """Returns the axis along which a line that parts start and goal is nearest the middle; on ties
    the longer way.
    """
    gaps = [abs(a - b) for a, b in zip(start, goal, strict=True)]
    axes = [axis for axis in (0, 1) if gaps[axis] >= 2]
    if not axes:
        raise ValueError(
            f"half: no line fits between start {_cell_text(start)} and goal {_cell_text(goal)}:"
            " they need a cell between them"
        )

    def moved(axis: int) -> tuple[float, int]:
        line = _middle(start[axis], goal[axis], size[axis])
        return abs(line + 0.5 - size[axis] / 2) / size[axis], -gaps[axis]

    return min(axes, key=moved)


def _middle(start: int, goal: int, length: int) -> int:
    """Returns the row or column between two others that is nearest the middle, on the goal's side
    of it.
    """
    line = length // 2 if goal > start else (length - 1) // 2
    return min(max(line, min(start, goal) + 1), max(start, goal) - 1)


def _beyond(line: int, goal: int, length: int) -> range:
    """Returns the rows from `line` past the edge of the map on the goal's side."""
    return range(line, length + 1) if goal > line else range(-1, line + 1)


def _is_in(cell: Cell, rows: range, cols: range) -> bool:
    return cell[0] in rows and cell[1] in cols


def _rim(rows: range, cols: range, size: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the cells on the rim of a rectangle, as far as they lie on the map."""
    row, col = np.mgrid[
        max(0, rows.start) : min(size[0], rows.stop), max(0, cols.start) : min(size[1], cols.stop)
    ]
    is_rim = (row == rows[0]) | (row == rows[-1]) | (col == cols[0]) | (col == cols[-1])
    return row[is_rim], col[is_rim]


def _cell_text(cell: Cell) -> str:
    return f"({cell[0]}, {cell[1]})"
