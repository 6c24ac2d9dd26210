"""From metres to cells and back: the one place that knows both (PY16 §3.2).

The lattice is anchored at the north-west corner of the bounds; row 0 is on top, whole cells only.
All of it is decided in whole nanometres, without rounding.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from srt_jax.geometry.layers import layered
from srt_jax.geometry.rings import UNITS_PER_METRE, as_metres, as_units, points_of
from srt_jax.geometry.scanlines import Edges, cells_of, centred_spans, touched_spans
from srt_jax.geometry.world import Obstacle, World, as_bounds
from srt_jax.task import make_task
from srt_jax.types import Task

_MAX_EXTENT = 2e9
"""Metres from end to end of all allowed coordinates, of which twice the nanometres fit into 64
bits.
"""
_MAX_CELLS = 1 << 28
"""A GiB of labels per layer; more is a slip in a unit."""
_RULES = {"touch": touched_spans, "centre": centred_spans}


@dataclasses.dataclass(frozen=True)
class Grid:
    """Where the cells of a map lie.

    origin: (x_min, y_max), metres, the outer corner of cell (0, 0).
    side: of a cell, metres.
    height, width: number of rows and columns.
    """

    origin: tuple[float, float]
    side: float
    height: int
    width: int

    def __post_init__(self) -> None:
        x, y = as_metres("origin", self.origin, (2,)).tolist()
        side = as_metres("side", self.side, ()).item()
        if min(side, self.height, self.width) <= 0:
            raise ValueError(
                f"a grid of {self.height} x {self.width} cells with side {side:g} m is empty: all"
                " must be positive"
            )
        if (
            side * max(self.height, self.width) > _MAX_EXTENT
            or self.height * self.width > _MAX_CELLS
        ):
            raise ValueError(
                f"a grid of {self.height} x {self.width} cells with side {side:g} m is too large:"
                f" at most {_MAX_CELLS} cells and {_MAX_EXTENT:g} m; take a larger cell or smaller"
                " bounds"
            )
        object.__setattr__(self, "origin", (x, y))
        object.__setattr__(self, "side", side)


def grid_over(bounds: Sequence[float], side: float) -> Grid:
    """Returns the grid of all whole cells within the bounds, from the north-west corner; ValueError
    where not one fits.
    """
    x_min, y_min, x_max, y_max = as_bounds(bounds)
    step = int(as_units(as_metres("side", side, ())))
    extent = as_units((x_max, y_max)) - as_units((x_min, y_min))
    if not 0 < step <= extent.min():
        raise ValueError(
            f"no cell with side {side:g} m fits into the bounds {(x_min, y_min, x_max, y_max)}"
        )
    width, height = (extent // step).tolist()
    return Grid(origin=(x_min, y_max), side=side, height=height, width=width)


def square_grid(bounds: Sequence[float], num_cells: int) -> Grid:
    """Returns the grid of num_cells x num_cells cells over the largest square in the middle of the
    bounds.

    The side of a cell is whole nanometres, so the grid may fall short of the square by less than
    num_cells of them.
    """
    if num_cells < 1:
        raise ValueError(f"a grid needs at least one cell a side, got {num_cells}")
    low, high = as_units(as_bounds(bounds)).reshape(2, 2)
    step = int((high - low).min()) // num_cells
    x, y = ((low + high) // 2 + np.array([-1, 1]) * (step * num_cells // 2)).tolist()
    return Grid(
        (x / UNITS_PER_METRE, y / UNITS_PER_METRE), step / UNITS_PER_METRE, num_cells, num_cells
    )


def cell_of(grid: Grid, point: ArrayLike) -> np.ndarray:
    """Returns the cell (row, col) that holds `point`; a point on a line between cells belongs to
    the lower, right one.

    On the outer right and lower border it belongs to the last cell.

    Args:
      point: float [..., 2], (x, y) metres.

    Returns:
      int32 [..., 2].

    Raises:
      ValueError: a point outside the grid.
    """
    points = as_metres("point", point, (*np.shape(point)[:-1], 2))
    origin, step, size = (
        as_units(grid.origin),
        int(as_units(grid.side)),
        np.array([grid.height, grid.width]),
    )
    away = ((as_units(points) - origin) * np.array([1, -1]))[..., ::-1]
    is_outside = ((away < 0) | (away > size * step)).any(axis=-1)
    if is_outside.any():
        x, y = points[is_outside][0].tolist()
        raise ValueError(
            f"point ({x:g}, {y:g}) lies outside the grid of {grid.height} x {grid.width} whole"
            f" cells of {grid.side:g} m with its north-west corner at {grid.origin}"
        )
    return np.minimum(away // step, size - 1).astype(np.int32)


def point_of(grid: Grid, cell: ArrayLike) -> np.ndarray:
    """Returns the centre of `cell`, float64 [..., 2], (x, y) metres.

    Args:
      cell: integer [..., 2], (row, col), inside the grid.
    """
    cells = np.asarray(cell)
    if not np.issubdtype(cells.dtype, np.integer):
        raise TypeError(f"cell must hold integers (row, col), got {cells.dtype}")
    if (
        cells.shape[-1:] != (2,)
        or (cells < 0).any()
        or (cells >= np.array([grid.height, grid.width])).any()
    ):
        raise ValueError(
            f"cell must hold (row, col) inside the grid of {grid.height} x {grid.width} cells"
        )
    away = (
        (2 * cells.astype(np.int64) + 1)[..., ::-1]
        * np.array([1, -1])
        * (int(as_units(grid.side)) / 2 / UNITS_PER_METRE)
    )
    return np.array(grid.origin) + away


def rasterize(world: World, *, rule: str = "touch") -> Task:
    """Returns the task on the grid of the world's whole cells, cell side = side of the goal square
    (PY16 §3.2).

    Obstacle i of the world is obstacle i of the task, also where it covers no cell. Start and goal
    are the cells that hold the agent's position and the centre of the goal square.

    Args:
      rule: as in `cover`.

    Raises:
      ValueError: an unknown rule, no whole cell within the bounds, or start or goal in the strip
        beyond the last whole cell.

    Examples:
      >>> import srt_jax
      >>> wall = srt_jax.Obstacle.polygon([(3, 0), (4, 0), (4, 5), (3, 5)])
      >>> world = srt_jax.World(bounds=(0, 0, 7, 5), obstacles=(wall,), position=(0.5, 2.5),
      ...                       radius=0.4, goal=((6.5, 2.5), 1.0))
      >>> task = srt_jax.rasterize(world)
      >>> task.labels[0, 0].tolist(), task.goal.tolist()
      ([-1, -1, -1, 0, -1, -1, -1], [2, 6])
    """
    grid = grid_over(world.bounds, world.goal_side)
    return make_task(
        cover(world.obstacles, grid, rule=rule),
        cell_of(grid, world.position),
        cell_of(grid, world.goal_centre),
        destroyable=np.array([obstacle.destroyable for obstacle in world.obstacles], bool),
        removal_cost=np.array([obstacle.removal_cost for obstacle in world.obstacles], np.float64),
    )


def cover(obstacles: Sequence[Obstacle], grid: Grid, *, rule: str = "touch") -> np.ndarray:
    """Returns which obstacles cover each cell; one layer of -1 where there is none.

    The owners of a cell lie in layers 0, 1, ... by ascending id: there are only as many layers as
    the most owners of a cell.

    Args:
      obstacles: obstacle i has id i.
      rule: "touch": an obstacle covers the cells whose open square its interior meets, so that the
        agent's disc fits any free cell; running along a cell's side is not meeting. "centre": it
        covers the cells whose centre is in it or on its border.

    Returns:
      int32 [L, H, W].
    """
    if rule not in _RULES:
        raise ValueError(f"rule {rule!r} is unknown: take one of {', '.join(map(repr, _RULES))}")
    owner, cell = cells_of(_RULES[rule](_edges(obstacles, grid)), grid.height, grid.width)
    return layered(owner, cell, grid.height, grid.width)


def _edges(obstacles: Sequence[Obstacle], grid: Grid) -> Edges:
    """Returns the edges of all rings in the largest steps in which everything is whole."""
    rings = [
        (owner, ring)
        for owner, obstacle in enumerate(obstacles)
        for part in obstacle.parts
        for ring in part
    ]
    sizes = np.array([len(ring) for _, ring in rings], np.int64)
    owner = np.array([owner for owner, _ in rings], np.int64)
    points = points_of(ring for _, ring in rings)
    steps = 2 * (as_units(points) - as_units(grid.origin)) * np.array([1, -1])
    half_cell = int(as_units(grid.side))
    is_near = _reach_the_grid(steps, sizes, 2 * half_cell * np.array([grid.width, grid.height]))
    steps, sizes, owner = steps[np.repeat(is_near, sizes)], sizes[is_near], owner[is_near]
    unit = int(np.gcd.reduce(steps, axis=None, initial=half_cell))
    steps, cell = steps // unit, 2 * half_cell // unit
    successor = np.arange(1, len(steps) + 1)
    ends = np.cumsum(sizes)
    successor[ends - 1] = ends - sizes
    is_down = (steps[:, 1] <= steps[successor, 1])[:, None]
    tail, head = (
        np.where(is_down, steps, steps[successor]),
        np.where(is_down, steps[successor], steps),
    )
    return Edges(tail, head, np.repeat(owner, sizes), cell, grid.height, grid.width)


def _reach_the_grid(steps: np.ndarray, sizes: np.ndarray, extent: np.ndarray) -> np.ndarray:
    """Returns bool [rings], whether the box around a ring meets the grid; the others change
    nothing, not even as holes.
    """
    starts = np.cumsum(sizes) - sizes
    low, high = (
        extreme.reduceat(steps, starts, axis=0) if len(sizes) else steps
        for extreme in (np.minimum, np.maximum)
    )
    return np.all((high > 0) & (low < extent), axis=1)
