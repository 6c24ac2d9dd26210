"""A route as a line in the world: the centres of its cells, in the map's own metres."""

import numpy as np

from srt_jax.engine.entrance import require_single
from srt_jax.geometry.frame import Frame
from srt_jax.types import Approach, Path, Solution, Task


def polyline(
    task: Task,
    route: Solution | Path | Approach,
    frame: Frame | None = None,
    *,
    turns_only: bool = False,
) -> np.ndarray:
    """Returns the centres of the cells of a route, start first; no point where there is no route.

    Point i is that of `route.cells[i]`, so `destroyed_at` and `plan_at` of a solution count here,
    too.

    Args:
      task: one task.
      route: its solution, or a path or an approach on its map.
      frame: where the map lies (`formats.reading.Source.frame`, `GridMap.frame`); without one the
        unit is the side of a cell, and (0, 0) the lower left corner of the map.
      turns_only: only the points where the route begins, turns and ends, and from which something
        is destroyed.

    Returns:
      float64 [K, 2], (x, y).

    Raises:
      ValueError: a batch was given, or a frame of another size than the map.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> task = srt_jax.make_task(np.ones((4, 6), bool), (3, 0), (0, 4))
      >>> frame = srt_jax.Frame.over((-1.0, 0.0), 0.5, height=4, width=6)
      >>> srt_jax.polyline(task, srt_jax.solve(task), frame, turns_only=True).tolist()
      [[-0.75, 0.25], [0.75, 1.75], [1.25, 1.75]]
    """
    require_single("polyline", task)
    if not hasattr(route, "num_cells"):
        raise TypeError(
            f"polyline takes a task and its route, got a {type(route).__name__} as the route: give"
            " a solution, a path or an approach"
        )
    if np.ndim(route.num_cells):
        raise ValueError(
            f"polyline takes one task and its route, got a batch of {len(route.num_cells)} routes:"
            " srt_jax.unstack takes a batch of solutions apart"
        )
    height, width = np.asarray(task.size).tolist()
    frame = Frame.of_cells(height, width) if frame is None else frame
    if (frame.grid.height, frame.grid.width) != (height, width):
        raise ValueError(
            f"the frame has {frame.grid.height} x {frame.grid.width} cells, the task's map"
            f" {height} x {width}: give the frame of that map"
        )
    cells = np.asarray(route.cells)
    cells = cells[: int((cells[:, 0] >= 0).sum())]
    if not len(cells):
        return np.zeros((0, 2))
    if turns_only:
        is_kept = at_turns(cells)
        if isinstance(route, Solution):
            stops = np.asarray(route.destroyed_at)
            is_kept[stops[stops >= 0]] = True
        cells = cells[is_kept]
    return frame.point_of(cells)


def at_turns(cells: np.ndarray) -> np.ndarray:
    """Returns where a route, int [n, 2], begins, turns and ends: bool [n]."""
    steps = np.diff(cells, axis=0)
    turns = np.ones(len(cells), bool)
    turns[1:-1] = (steps[1:] != steps[:-1]).any(axis=1)
    return turns
