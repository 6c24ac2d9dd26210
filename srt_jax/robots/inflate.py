"""Obstacles grown by a robot's radius, so that on the map that comes out the robot is a point.

In whole numbers: radius and cell side are whole nanometres, and squares of distances are compared
as Python's integers. A run of an obstacle's cells in a row becomes a longer run in each of the rows
that the disc reaches; how polygons are covered (`geometry.scanlines`) merges them.
"""

import math
from typing import NamedTuple

import numpy as np

from srt_jax.engine.entrance import require_single
from srt_jax.geometry.layers import layered
from srt_jax.geometry.rings import UNITS_PER_METRE
from srt_jax.geometry.scanlines import Spans, cells_of
from srt_jax.types import FREE, OUTSIDE, Task

RULES = ("centre", "touch")
_MOST_SPANS = 1 << 22
"""Runs held in memory at once."""
_MOST_LABELS = 1 << 28
"""A GiB of labels."""
_MOST_PAIRS = 1 << 26
"""A GiB of pairs of an obstacle and a cell."""
_MOST_METRES = 1e9
"""Of a radius or a cell side, of which the nanometres fit into 64 bits."""


class _Runs(NamedTuple):
    """Runs of cells of one obstacle in a row, sorted by obstacle; int64 [N] each."""

    owner: np.ndarray
    row: np.ndarray
    first: np.ndarray
    last: np.ndarray


def inflate(task: Task, radius: float, *, cell_side: float = 1.0, rule: str = "centre") -> Task:
    """Returns the task of a robot with this radius: each obstacle is dilated by the exact disc;
    where the radius reaches no further cell the labels mean the same.

    Each obstacle is grown by itself, so a door beside a wall keeps its own cells, and what is left
    when it is destroyed is the opening that the robot fits through. A cell of several obstacles has
    them in as many layers, by ascending id: there are as few layers as can be. Flags, costs, start
    and goal stay; an end that comes to lie inside an obstacle is no error (`solve` answers with a
    status, or destroys what covers the goal). The border of the map is no obstacle.

    Radius and side are taken to the nearest nanometre, and so are distances between cells: 0.15 m
    on cells of 0.05 m reaches exactly three cells. On a cell wider than the robot (as in a `World`,
    whose cells exceed 2 R) neither rule changes anything.

    Args:
      task: one task; of a batch `unstack` the tasks first.
      radius: of the robot's disc, 0 or more, in the unit of `cell_side`.
      cell_side: the side of a cell in metres, if the radius is in metres; by default the radius is
        in cell sides.
      rule: "centre": a cell is covered where its centre lies within the radius of the centre of a
        cell of the obstacle, as a distance transform or the inflation of a costmap has it. "touch":
        where the open disc about its centre meets the inside of such a cell, taken as a square;
        this is up to 0.71 cell sides more careful, and what covers polygons in a `World`.

    Returns:
      Task of NumPy arrays.

    Raises:
      TypeError: no task, or a radius that is no number. ValueError: a batch, a radius or a side out
        of range, an unknown rule, or layers that exceed a GiB.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 9), bool)
      >>> free[:, 4] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 8))
      >>> wide = srt_jax.inflate(task, 0.12, cell_side=0.05)  # 2.4 cells
      >>> wide.labels[0, 0].tolist()
      [-1, -1, 0, 0, 0, 0, 0, -1, -1]
    """
    require_single("inflate", task)
    labels = np.asarray(task.labels)
    reach = reach_of_disc(radius, cell_side, rule, most=max(labels.shape[1:]))
    is_outside = (labels == OUTSIDE).any(axis=0)
    grown = _grown(labels, reach)
    grown[:, is_outside] = FREE
    grown[0, is_outside] = OUTSIDE
    return task.replace(
        labels=grown,
        destroyable=np.asarray(task.destroyable),
        removal_cost=np.asarray(task.removal_cost),
        start=np.asarray(task.start),
        goal=np.asarray(task.goal),
        size=np.asarray(task.size),
    )


def reach_of_disc(radius: float, cell_side: float, rule: str, *, most: int) -> list[int]:
    """Returns how many columns to each side the disc reaches 0, 1, 2, ... rows away; it always
    reaches its own cell.

    Args:
      most: no more rows or columns than that.
    """
    if rule not in RULES:
        raise ValueError(f"rule {rule!r} is unknown: take one of {', '.join(map(repr, RULES))}")
    far, side = _units("radius", radius), _units("cell_side", cell_side)
    if far < 0 or side <= 0:
        raise ValueError(
            f"the radius is {radius:g} and the side of a cell {cell_side:g}: a radius must not be"
            " negative, a side must be positive"
        )
    # A distance, to the nearest nanometre, is within the radius up to half a nanometre beyond it.
    # All is squared, in halves of nanometres.
    within, beyond = (2 * far + 1) ** 2, (2 * far) ** 2
    reach = []
    for row in range(most + 1):
        if rule == "centre":
            rest = (within - 1) // (2 * side) ** 2 - row * row
            columns = math.isqrt(rest) if rest >= 0 else -1
        else:
            # To the near edge of a square it is half a side less; the inside is met beyond it.
            rest = (beyond - 1) // side**2 - max(2 * row - 1, 0) ** 2
            columns = (math.isqrt(rest) + 1) // 2 if rest >= 0 else -1
        if columns < 0:
            break
        reach.append(min(columns, most))
    return reach or [0]


def _units(name: str, value: float) -> int:
    """Returns a length as whole nanometres (of a cell side: its billionth parts)."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    if isinstance(value, bool | np.bool_) or not is_number:
        raise TypeError(f"{name} must be a number, got {value!r}")
    if not abs(value) <= _MOST_METRES:
        raise ValueError(f"{name} is {value}: it must be finite and at most {_MOST_METRES:g}")
    return round(float(value) * UNITS_PER_METRE)


def _grown(labels: np.ndarray, reach: list[int]) -> np.ndarray:
    """Returns the labels, int32 [L, H, W], with every obstacle dilated."""
    height, width = labels.shape[1:]
    runs = _runs_of(labels)
    owners, cells, num_pairs = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], 0
    for part in _parts(runs, 2 * len(reach) - 1):
        owner, cell = cells_of(_widened(part, reach), height, width)
        num_pairs += len(cell)
        if num_pairs > _MOST_PAIRS:
            raise ValueError(
                f"the obstacles so grown cover more than {_MOST_PAIRS} cells, counted once for"
                " each: take a smaller radius, or a coarser map"
            )
        owners.append(owner)
        cells.append(cell)
    cell = np.concatenate(cells)
    num_layers = int(np.bincount(cell, minlength=1).max())
    if num_layers * height * width > _MOST_LABELS:
        raise ValueError(
            f"up to {num_layers} obstacles so grown cover one cell, which is too many layers for a"
            f" map of {height} x {width} cells: take a smaller radius, or a coarser map"
        )
    return layered(np.concatenate(owners), cell, height, width)


def _runs_of(labels: np.ndarray) -> _Runs:
    """Returns the runs of equal labels in the rows of all layers, those of obstacles."""
    _, height, width = labels.shape
    # a free cell at the end of each row: no run continues in the next
    flat = np.pad(labels, ((0, 0), (0, 0), (0, 1)), constant_values=FREE).ravel()
    begins = np.flatnonzero(np.diff(flat, prepend=np.int32(FREE - 2)))
    ends = np.append(begins[1:], len(flat)) - 1
    is_owned = flat[begins] >= 0
    begins, ends = begins[is_owned], ends[is_owned]
    order = np.argsort(flat[begins], kind="stable")
    begins, ends = begins[order], ends[order]
    row, first = np.divmod(begins, width + 1)
    return _Runs(flat[begins].astype(np.int64), row % height, first, first + ends - begins)


def _parts(runs: _Runs, num_rows: int):
    """Yields the runs in parts of whole obstacles, each of few enough once they are widened."""
    ends = np.append(np.flatnonzero(np.diff(runs.owner)) + 1, len(runs.owner))
    first = 0
    while first < len(runs.owner):
        most = first + max(1, _MOST_SPANS // num_rows)
        place = int(np.searchsorted(ends, most, side="right"))
        last = int(ends[place - 1]) if place and ends[place - 1] > first else 0
        last = last or int(ends[np.searchsorted(ends, first, side="right")])
        yield _Runs(*(field[first:last] for field in runs))
        first = last


def _widened(runs: _Runs, reach: list[int]) -> Spans:
    """Returns the runs of the dilated obstacles; they may overlap and lie outside the map."""
    down = np.arange(1 - len(reach), len(reach))[:, None]
    across = np.array(reach)[abs(down)]
    fields = (runs.owner, runs.row + down, runs.first - across, runs.last + across)
    shape = (len(down), len(runs.owner))
    return Spans(*(np.broadcast_to(field, shape).reshape(-1) for field in fields))
