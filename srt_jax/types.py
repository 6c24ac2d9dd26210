"""The records that travel between the stages, each array with its shape and dtype.

`...` stands for any number of batch dimensions, the same ones in every array of a record. H x W are
the cells of a map, L the layers of labels, M the obstacles, K the obstacles that may be destroyed,
N the cells a route may have, P the steps of a plan. A cell is (row, col), row 0 on top.
"""

import enum
import importlib
from typing import Any

import numpy as np

from sign_model.foundation.legible import counted
from sign_model.foundation.meanings import WithMeaning
from sign_model.foundation.records import Array, Record, outline, record, values_of

__all__ = [
    "FREE",
    "OUTSIDE",
    "Act",
    "Approach",
    "Array",
    "Cell",
    "Path",
    "Record",
    "Solution",
    "Status",
    "Task",
    "record",
]

FREE = -1
"""Label of a cell that no obstacle covers (in this layer)."""

OUTSIDE = -2
"""Label of padding: a blocked cell that belongs to no obstacle, hence can never be opened."""

Cell = tuple[int, int]
"""A cell on the host, (row, col), row 0 on top."""


class Status(WithMeaning):
    """How a task ended. The text says what it means for the person who set the task.

    Examples:
      >>> import srt_jax
      >>> srt_jax.Status(2).name, srt_jax.Status(2).meaning
      ('UNSOLVABLE', 'no path exists even with every destroyable obstacle gone')
    """

    PATH_EXISTS = 0, "nothing blocks: the route needs no destroying"
    SOLVED = 1, "no path existed; after the destroying named in the solution there is one"
    UNSOLVABLE = 2, "no path exists even with every destroyable obstacle gone"
    START_BLOCKED = 3, "the start lies outside the map or inside an obstacle"
    GOAL_BLOCKED = 4, "the goal lies outside the map or inside an obstacle that cannot be destroyed"
    BUDGET_SPENT = 5, "a limit was met before an answer: raise max_destroyed or max_cells"
    STOPPED_SHORT = (
        6,
        (
            "the paper's loop, read literally, met an indestructible obstacle in its way; modes"
            " paper and least find a way"
        ),
    )
    BROKE_THROUGH = (
        7,
        "a path exists, but with what the solution destroys length and tolls come to less",
    )

    @property
    def is_solved(self) -> bool:
        """Whether the solution holds a route to the goal."""
        return self in (Status.PATH_EXISTS, Status.SOLVED, Status.BROKE_THROUGH)


class Act(enum.IntEnum):
    """What the agent does in one step of a symbolic plan; the names are those of the planning
    domain's actions.
    """

    RELOCATE = 0
    PASS = 1
    APPROACH = 2
    DESTROY = 3


@record
class Task(Record):
    """One smart relocation task, or a batch of them padded to one shape (PY16 §2).

    Attributes:
      labels: int32 [..., L, H, W], id of the obstacle that covers the cell, FREE (-1) where none
        does, OUTSIDE (-2) on padding. Obstacles that overlap lie in different layers; a cell is
        free when every layer says FREE.
      destroyable: bool [..., M], whether the agent can destroy obstacle i; False on padding.
      removal_cost: float32 [..., M], positive; what destroying obstacle i costs.
      start, goal: int32 [..., 2], cells.
      size: int32 [..., 2], height and width before padding.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> task.labels.shape, task.labels[0, 0].tolist()
      ((1, 5, 7), [-1, -1, -1, 0, -1, -1, -1])
      >>> dearer = task.replace(removal_cost=task.removal_cost * 3)
      >>> dearer.removal_cost.tolist()
      [3.0]
    """

    labels: Array
    destroyable: Array
    removal_cost: Array
    start: Array
    goal: Array
    size: Array

    def __repr__(self) -> str:
        """What it is in a line: the map, the obstacles, the ends."""
        known = values_of(self.size, self.destroyable, self.start, self.goal)
        if known is None or np.ndim(self.size) < 1:
            return outline(self)
        size, destroyable, start, goal = known
        if size.ndim > 1:
            batch = " x ".join(map(str, size.shape[:-1]))
            *_, layers, height, width = np.shape(self.labels)
            return (
                f"Task(batch of {batch}, {height} x {width} cells, {counted(layers, 'layer')}, at"
                f" most {counted(destroyable.shape[-1], 'obstacle')})"
            )
        return (
            f"Task({size[0]} x {size[1]} cells, {counted(len(destroyable), 'obstacle')},"
            f" {int(destroyable.sum())} of them destroyable, start {tuple(start.tolist())}, goal"
            f" {tuple(goal.tolist())})"
        )

    def _repr_html_(self) -> str:
        """A picture, for notebooks."""
        return _for_notebooks().task_html(self)


@record
class Path(Record):
    """A shortest path, start first.

    Attributes:
      cells: int32 [..., N, 2], -1 after the last cell; all -1 where there is no path or it has more
        than N cells.
      num_cells: int32 [...], the true number of cells, 0 where there is no path. More than N: retry
        with a larger N.
      cost: float32 [...], length in cell sides, inf where there is no path.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> cost = srt_jax.cost_to_come(free, (2, 0))
      >>> path = srt_jax.trace_path(cost, (0, 2), max_cells=8)
      >>> path.cells[: int(path.num_cells)].tolist()
      [[2, 0], [1, 1], [0, 2]]
    """

    cells: Array
    num_cells: Array
    cost: Array


@record
class Approach(Record):
    """The way as near to the goal as one gets with nothing destroyed (`srt_jax.approach`).

    Attributes:
      cells: int32 [..., N, 2], the route, -1 after its end; all -1 where there is none or it has
        more than N cells.
      num_cells: int32 [...], the true number of cells, 0 where no cell is free.
      cost: float32 [...], length in cell sides; inf without a route.
      begin: int32 [..., 2], where it begins: the start, or the free cell nearest to it where that
        is blocked or outside the map; (-1, -1) without a route.
      end: int32 [..., 2], the reachable cell nearest the goal; (-1, -1) without a route.
      gap: float32 [...], octile distance from `end` to the goal in cell sides; 0 where the goal is
        reached, inf without a route.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> near = srt_jax.approach(srt_jax.make_task(free, (2, 3), (2, 6)))
      >>> near.begin.tolist()  # the start is blocked: the free cell nearest to it
      [2, 2]
    """

    cells: Array
    num_cells: Array
    cost: Array
    begin: Array
    end: Array
    gap: Array


class _KnowsTask(Record):
    """What a solution knows beside its fields; copies, `items` and the pytree do not hold it."""

    __slots__ = ("_near", "_task")


@record
class Solution(_KnowsTask):
    """The answer to a task, or to each task of a batch.

    Attributes:
      status: int32 [...], a `Status`.
      cost: float32 [...], length of the route in cell sides; inf without a route.
      cells: int32 [..., N, 2], the whole route, start first, -1 after its end.
      num_cells: int32 [...], cells of the route, 0 without one; more than N (status BUDGET_SPENT):
        the route did not fit.
      destroyed: int32 [..., K], ids of the obstacles destroyed, in order, -1 after the last.
      num_destroyed: int32 [...], 0 without a route; more than K (status BUDGET_SPENT): the least
        removal needs so many.
      destroyed_at: int32 [..., K], index into `cells` of the cell from which each is destroyed, an
        8-neighbour of it; -1 padded.
      removal_cost: float32 [...], total removal cost of `destroyed`, the exact sum rounded down;
        inf without a route.
      removal_bound: float32 [...], proven lower bound on the total removal cost of any solution,
        the exact one rounded down; inf where none exists. Equal to `removal_cost`: no set is
        cheaper by a step of float32.
      total: float32 [...], mode "shortest": the length of the route and the tolls, `toll` times the
        removal cost of each obstacle destroyed; inf without a route. 0 in the other modes, which
        look at no tolls.
      total_bound: float32 [...], mode "shortest": proven lower bound on the total of any route; inf
        where none exists. Equal to `total`: no route has a lesser total. 0 in the other modes.
      seed: int32 [..., 2], reached cell next to the first blockage; (-1, -1) where nothing blocks.
      contour: bool [..., H, W], the reached cells that touch the first blocking obstacle; all False
        where nothing blocks.
      blocking: int32 [..., M], ascending ids of the obstacles on the contour, -1 after the last.
      plan: int32 [..., P, 2], the steps of the plan that the route carries out, in order: (`Act`,
        obstacle or -1); P is 3 K + 1, and (-1, -1) stands after the last. No step where start and
        goal are one cell, or without a route.
      plan_at: int32 [..., P], index into `cells` at which each step ends, -1 after the last.
      separating: int32 [..., M], the proof where status is UNSOLVABLE or GOAL_BLOCKED: ascending
        ids of indestructible obstacles that keep start and goal apart whatever else is gone, -1
        after the last. Empty elsewhere, and where the goal lies outside the map.
      approach, num_approach: int32 [..., N, 2] and [...], of answers without a route the way as
        near to the goal as one gets: found when they are first asked for, no part of the pytree.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> solution.cells[: int(solution.num_cells)].tolist()
      [[2, 0], [2, 1], [2, 2], [2, 3], [2, 4], [2, 5], [2, 6]]
      >>> solution.destroyed[: int(solution.num_destroyed)].tolist()
      [0]
      >>> solution.destroyed_at[0].item()  # destroyed from cells[2]
      2
      >>> solution.removal_cost.item() == solution.removal_bound.item()  # proven least
      True
    """

    status: Array
    cost: Array
    cells: Array
    num_cells: Array
    destroyed: Array
    num_destroyed: Array
    destroyed_at: Array
    removal_cost: Array
    removal_bound: Array
    total: Array
    total_bound: Array
    seed: Array
    contour: Array
    blocking: Array
    plan: Array
    plan_at: Array
    separating: Array

    @property
    def approach(self) -> np.ndarray:
        """int32 [..., N, 2]: of an answer without a route, the way as near to the goal as one gets,
        as `srt_jax.approach` finds it when it is first asked for; -1 after its end, and where there
        is a route.

        A copy, or an answer that came out of `jit`, `vmap` or a function of pytrees, does not know
        its task: then this is an AttributeError, and `srt_jax.approach(task)` gives the same.
        """
        return self._nearest()[0]

    @property
    def num_approach(self) -> np.ndarray:
        """int32 [...], the cells of `approach`; 0 where there is a route, or no cell is free."""
        return self._nearest()[1]

    def _nearest(self) -> tuple[np.ndarray, np.ndarray]:
        known = getattr(self, "_near", None)
        if known is None:
            known = _approaches(self, getattr(self, "_task", None))
            object.__setattr__(self, "_near", known)
        return known

    def __repr__(self) -> str:
        """What it says in a line."""
        known = values_of(self.status, self.cost, self.removal_cost, self.removal_bound)
        if known is None:
            return outline(self)
        status, cost, removal, bound = known
        if status.ndim:
            numbers = [(one, int((status == one).sum())) for one in Status]
            batch = " x ".join(map(str, status.shape))
            told = ", ".join(f"{number} {one.name}" for one, number in numbers if number)
            return f"Solution(batch of {batch}: {told})"
        if not Status(int(status)).is_solved:
            return f"Solution({Status(int(status)).name}, removal_bound={float(bound):g})"
        gone = np.asarray(self.destroyed)[: int(self.num_destroyed)].tolist()
        proven = ", proven least" if removal == bound else f", at least {float(bound):g}"
        total, total_bound = float(np.asarray(self.total)), float(np.asarray(self.total_bound))
        if total > 0:  # mode "shortest", whose measure is the total
            least = "proven least" if total == total_bound else f"at least {total_bound:g}"
            proven = f", total {total:g}, {least}"
        return (
            f"Solution({Status(int(status)).name}, length {float(cost):.2f}, {int(self.num_cells)}"
            f" cells, destroyed {gone}, removal cost {float(removal):g}{proven})"
        )

    def _repr_html_(self) -> str:
        """A table of what it says, for notebooks."""
        return _for_notebooks().solution_html(self)


def of_task(solution: Solution, task: Task) -> Solution:
    """Returns a solution that can be asked for its `approach`: the same one, which now knows its
    task.
    """
    object.__setattr__(solution, "_task", task)  # the record is frozen
    return solution


def _is_solved(status: Array) -> np.ndarray:
    """Whether each answer holds a route: int32 [...] -> bool [...]."""
    solved = [one.value for one in Status if one.is_solved]
    return np.isin(np.asarray(status), solved)


def _approaches(solution: Solution, task: Task | None) -> tuple[np.ndarray, np.ndarray]:
    """The values of `Solution.approach` and `Solution.num_approach`."""
    known = values_of(solution.status)
    if known is None or (task is None and not _is_solved(known[0]).all()):
        raise AttributeError(
            "this solution does not know its task, since it is a copy or came out of jit, vmap or"
            " a function of pytrees: call srt_jax.approach(task)"
        )
    is_solved = _is_solved(known[0])
    if task is None:
        return np.full((*is_solved.shape, 1, 2), -1, np.int32), np.zeros(is_solved.shape, np.int32)
    # far above this module, and loaded only where it is asked for
    near = importlib.import_module("srt_jax.paths.approach").approach(task)
    cells = np.where(is_solved[..., None, None], np.int32(-1), np.asarray(near.cells))
    return cells, np.where(is_solved, np.int32(0), np.asarray(near.num_cells))


def _for_notebooks() -> Any:
    """Returns the module that makes pages of records: far above this one, and loaded only where a
    notebook asks.
    """
    return importlib.import_module("srt_jax.draw.notebook")
