"""What there is to show of a task and its solution, as plain arrays, whatever draws it."""

import itertools
from typing import NamedTuple

import numpy as np

from sign_model.foundation.legible import counted
from srt_jax.components import regions
from srt_jax.draw.parts.colours import Kind
from srt_jax.engine import entrance
from srt_jax.geometry.frame import Frame
from srt_jax.paths.approach import approach as approach_of
from srt_jax.types import FREE, Approach, Array, Cell, Solution, Status, Task

_MOST_IDS = 6
"""Of obstacles destroyed, in the line above a picture."""


class Removal(NamedTuple):
    """One obstacle that is destroyed.

    number: from 1, in order. at: the index into the route, `standing`: the cell, from which it is
      done. cells: int [n, 2].
    """

    number: int
    obstacle: int
    at: int
    standing: Cell
    cells: np.ndarray


class Scene(NamedTuple):
    """kinds: uint8 [H, W] of `Kind`. legs: of the route, each int [n, 2], n >= 2, one ending where
    the next begins. status: None where the task is shown without a solution. approach: int [n, 2],
    the way as near as one gets, of an unsolved task. frame: where the map lies in metres, where
    that is known.
    """

    kinds: np.ndarray
    start: Cell
    goal: Cell
    seed: Cell | None
    legs: list[np.ndarray]
    removals: list[Removal]
    status: Status | None
    headline: str
    approach: np.ndarray | None = None
    frame: Frame | None = None


def scene_of(
    task: Task,
    solution: Solution | None,
    *,
    frame: Frame | None = None,
    approach: Approach | None = None,
) -> Scene:
    """Returns what a picture of one task shows; without a solution the map and the ends.

    Args:
      frame: where the map lies, for lengths in metres. approach: of an unsolved task, where it is
        known; else it is found.

    Raises:
      ValueError: a batch was given, or the solution is another task's.
    """
    require_single(task, solution)
    kinds = cell_kinds(task)
    if solution is None:
        start, goal = _cell(task.start), _cell(task.goal)
        return Scene(kinds, start, goal, None, [], [], None, "")
    removals = removals_in(task, solution)
    # what stands under another obstacle does not open
    opens = free_without(task, np.isin(np.arange(len(task.destroyable)), solution.destroyed))
    for removal in removals:
        kinds[tuple(removal.cells[opens[tuple(removal.cells.T)]].T)] = Kind.DESTROYED
    contour = np.asarray(solution.contour)[: kinds.shape[0], : kinds.shape[1]]
    kinds[contour] = Kind.CONTOUR
    seed, status, near = _cell(solution.seed), Status(int(solution.status)), None
    if not status.is_solved:
        near = approach_of(task) if approach is None else approach
    frame = frame if frame is not None and frame.has_metres else None
    return Scene(
        kinds=kinds,
        start=_cell(task.start),
        goal=_cell(task.goal),
        seed=seed if seed[0] >= 0 else None,
        legs=legs_of(solution),
        removals=removals,
        status=status,
        headline=headline(solution, frame, near),
        approach=None if near is None else np.asarray(near.cells)[: int(near.num_cells)],
        frame=frame,
    )


def require_single(task: Task, solution: Solution | None) -> None:
    """Raises ValueError for a batch, or where the solution does not belong to a task of this
    size.
    """
    if solution is None:
        entrance.require_single("a picture", task)
    else:
        entrance.require_one_answer("a picture", task, solution)


def cell_kinds(task: Task, gone: np.ndarray | None = None, start: Cell | None = None) -> np.ndarray:
    """Returns the kind of every cell of the map, without contour: uint8 [H, W].

    Args:
      gone: bool [M], obstacles that are there no more.
      start: where the reached region starts; by default the task's start. Where that is blocked
        nothing is reached.
    """
    labels, destroyable = own_labels(task), np.asarray(task.destroyable)
    free = free_without(task, gone)
    kinds = np.full(free.shape, Kind.UNREACHED, np.uint8)
    row, col = _cell(task.start if start is None else start)
    if free[row, col]:
        pieces = regions(
            free
        )  # on the host: a kernel would be compiled again for every size of map
        kinds[pieces == pieces[row, col]] = Kind.REACHED
    can_go = np.asarray(
        np.where(labels >= 0, destroyable[labels.clip(0)], labels == FREE).all(axis=0)
    )
    kinds[~free] = np.where(can_go[~free], Kind.DESTROYABLE, Kind.INDESTRUCTIBLE)
    return kinds


def free_without(task: Task, gone: np.ndarray | None = None) -> np.ndarray:
    """Returns which cells are free once the obstacles `gone` (bool [M]) are: bool [H, W]."""
    labels = own_labels(task)
    is_open = labels == FREE
    if gone is not None:
        is_open = is_open | ((labels >= 0) & gone[labels.clip(0)])
    return np.asarray(is_open.all(axis=0))


def own_labels(task: Task) -> np.ndarray:
    """Returns the labels without padding, int32 [L, H, W]."""
    height, width = np.asarray(task.size).tolist()
    return np.asarray(task.labels)[:, :height, :width]


def removals_in(task: Task, solution: Solution) -> list[Removal]:
    """Returns what is destroyed, in order."""
    labels, route = own_labels(task), np.asarray(solution.cells)
    found = []
    for place in range(int((np.asarray(solution.destroyed) >= 0).sum())):
        obstacle, at = int(solution.destroyed[place]), int(solution.destroyed_at[place])
        cells = np.argwhere((labels == obstacle).any(axis=0))
        found.append(Removal(place + 1, obstacle, at, _cell(route[at]), cells))
    return found


def legs_of(solution: Solution) -> list[np.ndarray]:
    """Returns the route cut where something is destroyed; no leg where there is no route or it has
    one cell.
    """
    if not Status(int(solution.status)).is_solved:
        return []
    route = np.asarray(solution.cells)[: int(solution.num_cells)]
    stops = np.asarray(solution.destroyed_at)[: int(solution.num_destroyed)].tolist()
    ends = sorted({0, *stops, len(route) - 1})
    return [route[first : last + 1] for first, last in itertools.pairwise(ends)]


def headline(solution: Solution, frame: Frame | None = None, near: Approach | None = None) -> str:
    """Returns the outcome in one line; lengths in metres where a frame is given."""
    status = Status(int(solution.status))

    def length(cells: Array) -> str:
        return length_in(cells, frame)

    if not status.is_solved:
        has_gap = near is not None and 0 < float(near.gap) < np.inf
        gets = f"; one gets within {length(near.gap)} of the goal" if near and has_gap else ""
        return f"{status.name}: {status.meaning}{gets}"
    destroyed = np.asarray(solution.destroyed)[: int(solution.num_destroyed)].tolist()
    what = f"{counted(len(destroyed), 'obstacle')} destroyed" if destroyed else "nothing destroyed"
    if destroyed:
        more = ", ..." if len(destroyed) > _MOST_IDS else ""
        what += f" ({', '.join(map(str, destroyed[:_MOST_IDS]))}{more})"
    # Only mode "shortest" has totals.
    total = f"; {length(solution.total)} with tolls" if 0 < solution.total < np.inf else ""
    return f"{status.name}: route of {length(solution.cost)}, {what}{total}"


def length_in(cells: Array | float, frame: Frame | None) -> str:
    """Returns a length, given in cell sides: in metres where the frame has them."""
    if frame is None or not frame.has_metres:
        return f"{float(cells):.1f} cell sides"
    return _metres(cells, frame)


def _metres(cells: Array | float, frame: Frame) -> str:
    return f"{float(cells) * frame.side:.2f} m"


def _cell(cell) -> Cell:
    row, col = np.asarray(cell).tolist()
    return row, col
