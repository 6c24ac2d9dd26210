"""Where a task starts and ends on a map or a place: as somebody said, or chosen; and what is wrong
with that.
"""

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.opposite_cells import opposite_cells
from srt_jax.geometry.frame import Frame
from srt_jax.robots.ends import Spot, cell_in
from srt_jax.types import FREE, Cell, Task

End = Cell | Spot


def named_ends(
    path: str, start: End | None, goal: End | None, frame: Frame
) -> tuple[Cell, Cell] | None:
    """Returns the cells of start and goal as they were given; None where none was.

    Raises:
      ValueError: one of them is missing, or it is no place on this map.
    """
    if start is None and goal is None:
        return None
    if start is None or goal is None:
        raise ValueError(
            f"{path}: of --start and --goal one is missing: give both, or none and they are chosen"
        )
    return cell_in(frame, start, f"{path}: start"), cell_in(frame, goal, f"{path}: goal")


def chosen_ends(path: str, free: np.ndarray, notes: Notes) -> tuple[Cell, Cell]:
    """Returns two cells on opposite sides of the largest free region, and notes them."""
    try:
        start, goal = opposite_cells(free)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    notes.tell(
        f"start {start[0]},{start[1]} and goal {goal[0]},{goal[1]} chosen, on opposite sides of the"
        " largest free region"
    )
    return start, goal


def require_free(
    what: str, free: np.ndarray, cell: Cell, unknown: np.ndarray | None = None
) -> None:
    """Raises ValueError where a cell lies outside the map or is not free."""
    height, width = free.shape
    if not (0 <= cell[0] < height and 0 <= cell[1] < width):
        raise ValueError(
            f"{what} {cell} lies outside the map: rows are 0 to {height - 1}, columns 0 to"
            f" {width - 1}"
        )
    if not free[cell] and unknown is not None and unknown[cell]:
        raise ValueError(
            f"{what} {cell} is an unknown cell, and such cells count as blocked: choose a free"
            " cell, or let them count as free by --unknown free"
        )
    if not free[cell]:
        raise ValueError(
            f"{what} {cell} is on a wall: choose a free cell; name obstacles by --labels, since a"
            " goal may lie inside one that can be destroyed; or, where a picture shows what is"
            " blocked in white, give --free-pixels dark"
        )


def with_free_start(path: str, task: Task) -> Task:
    """Returns the task; ValueError where an obstacle covers the agent's cell."""
    row, col = task.start.tolist()
    owners = task.labels[:, row, col]
    if (owners != FREE).any():
        raise ValueError(
            f"{path}: the agent's cell ({row}, {col}) is covered by obstacle {int(owners.max())}:"
            " move the agent elsewhere"
        )
    return task


def note_covered(task: Task, notes: Notes) -> None:
    """Notes which end lies within the robot's radius of an obstacle."""
    for what, cell in (("start", task.start), ("goal", task.goal)):
        row, col = np.asarray(cell).tolist()
        owners = sorted(owner for owner in task.labels[:, row, col].tolist() if owner >= 0)
        if owners:
            named = ", ".join(map(str, owners[:6])) + (" and more" if owners[6:] else "")
            plural = "s" if owners[1:] else ""
            notes.tell(
                f"the {what} {row},{col} lies within the radius of obstacle{plural} {named}: the"
                " robot does not fit there"
            )
