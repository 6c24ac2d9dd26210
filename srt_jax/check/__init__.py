"""The judge: replays a solution on the host and says what is wrong with it.

Written to be believed, so it shares nothing with the kernels it judges: of ours it imports only the
records, it floods over runs of cells where they sweep, and it decides again what the status, the
seed, the contour and the blocking obstacles must be.
"""

from types import SimpleNamespace

import numpy as np

from srt_jax.check.approach import approach_problems
from srt_jax.check.bound import bound_problems, needless_problems
from srt_jax.check.connection import check_connection as check_connection
from srt_jax.check.floods import cell_ahead, dilate, free_cells, holds_at, nearest_cell, piece_of
from srt_jax.check.total import presence_problems, total_problems
from srt_jax.check.walk import destroyed_problems, plan_problems, route_problems
from srt_jax.types import OUTSIDE, Approach, Solution, Status, Task

_TASK_FORM = {
    "labels": ("int32", "LHW"),
    "destroyable": ("bool", "M"),
    "removal_cost": ("float32", "M"),
    "start": ("int32", "2"),
    "goal": ("int32", "2"),
    "size": ("int32", "2"),
}
_SOLUTION_FORM = {
    "status": ("int32", ""),
    "cost": ("float32", ""),
    "cells": ("int32", "N2"),
    "num_cells": ("int32", ""),
    "destroyed": ("int32", "K"),
    "num_destroyed": ("int32", ""),
    "destroyed_at": ("int32", "K"),
    "removal_cost": ("float32", ""),
    "removal_bound": ("float32", ""),
    "total": ("float32", ""),
    "total_bound": ("float32", ""),
    "seed": ("int32", "2"),
    "contour": ("bool", "HW"),
    "blocking": ("int32", "M"),
    "plan": ("int32", "P2"),
    "plan_at": ("int32", "P"),
    "separating": ("int32", "M"),
}
_APPROACH_FORM = {
    "cells": ("int32", "A2"),
    "num_cells": ("int32", ""),
    "cost": ("float32", ""),
    "begin": ("int32", "2"),
    "end": ("int32", "2"),
    "gap": ("float32", ""),
}


def check(
    task: Task,
    solution: Solution,
    *,
    mode: str | None = None,
    toll: float | np.ndarray = 1.0,
    approach: Approach | None = None,
) -> list[str]:
    """Returns what is wrong with `solution` as an answer to `task`, a sentence each; an empty list
    when all is well.

    Checked are the form of every array; the status, by a flood of its own; the route, move by move
    on the map as it then stands (an obstacle destroyed at index i is gone for the move from cell i
    to cell i + 1); that each destroyed obstacle could be destroyed and was beside the agent; the
    sums, exactly; the report of the first blockage (PY16 §3.2); that the symbolic plan tells the
    same story as the route; and the proof, `separating`: with all obstacles but these gone, start
    and goal are still apart. `removal_bound` must be no more than what the answer costs, nor than
    any set of obstacles that opens a way and is found within some floods: in small tasks all sets.
    With mode "shortest" `total` must be the route's length and the tolls of what it destroys, and
    `total_bound` no more than that, nor than any route found within some searches.
    Not checked: that the route is the shortest and the removal or the total the least, where the
    floods and searches do not suffice.

    Args:
      task: one task or a batch.
      solution: the answers, with the same batch dimensions.
      mode: of `solve`, how the answers were found, where it is known. Those of mode "least" may
        destroy nothing needless, and say which limit they met; mode "shortest" may destroy though a
        path exists; the loop of the other modes destroys what it meets before it knows the rest of
        the way.
      toll: of `solve`, where the mode is "shortest": a number, or float [...], one for each task.
      approach: of the same tasks, which is walked as well: that it begins and ends where it must,
        move by move, with its sums.

    Returns:
      list of str; for a batch each begins with the task's index: "task 3: ".

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> srt_jax.check(task, solution)
      []
    """
    for record, name, fields in (
        (task, "Task", _TASK_FORM),
        (solution, "Solution", _SOLUTION_FORM),
    ):
        if not hasattr(record, next(iter(fields))):
            return [
                f"a {name} must be given, or a batch of them (srt_jax.stack), got"
                f" {type(record).__name__}"
            ]
    sides: dict[str, int] = {}
    tasks, problems = _arrays("task", task, _TASK_FORM, sides)
    solutions, more = _arrays("solution", solution, _SOLUTION_FORM, sides)
    approaches: dict[str, np.ndarray] = {}
    if approach is not None:
        approaches, last = _arrays("approach", approach, _APPROACH_FORM, sides)
        more += last
    if problems or more:
        return problems + more
    batch = tasks["start"].shape[:-1]
    known = (*tasks.items(), *solutions.items(), *approaches.items())
    if any(array.shape[: len(batch)] != batch for _, array in known):
        shapes = {name: list(array.shape) for name, array in known}
        return [f"all fields must have the same batch dimensions, got shapes {shapes}"]
    tolls = np.broadcast_to(np.asarray(toll, float), batch)
    for index in np.ndindex(batch):
        one_task = SimpleNamespace(**{name: array[index] for name, array in tasks.items()})
        one_solution = SimpleNamespace(**{name: array[index] for name, array in solutions.items()})
        name = "" if not batch else f"task {index[0] if len(batch) == 1 else index}: "
        found = _task_problems(one_task)
        if not found:
            found = _check_one(one_task, one_solution, mode, float(tolls[index]))
            if approach is not None:
                near = SimpleNamespace(**{name: array[index] for name, array in approaches.items()})
                found += approach_problems(one_task, one_solution, near)
        problems += [name + problem for problem in found]
    return problems


def _arrays(what: str, record: object, form: dict[str, tuple[str, str]], sides: dict[str, int]):
    """Returns the fields of a record as NumPy arrays, and what is wrong with them; `sides` learns
    how long each side is.
    """
    arrays, problems = {}, []
    for name, (dtype, core) in form.items():
        try:
            array = np.asarray(getattr(record, name))
        except (AttributeError, TypeError, ValueError) as error:
            problems.append(f"{what}.{name} is no array: {error}")
            continue
        known = {side: 2 if side == "2" else sides.get(side) for side in core}
        batch_rank = sides.get("...", max(0, array.ndim - len(core)))
        actual = dict(zip(core, array.shape[batch_rank:], strict=False))
        has_rank = array.ndim == batch_rank + len(core)
        if (
            array.dtype != dtype
            or not has_rank
            or any(known[side] not in (None, actual[side]) for side in core)
        ):
            wanted = ", ".join(
                ["..."] * (batch_rank > 0) + [str(known[side] or side) for side in core]
            )
            problems.append(
                f"{what}.{name} must be {dtype} [{wanted}], got {array.dtype} {list(array.shape)}"
            )
            continue
        sides["..."] = batch_rank
        sides.update(actual)
        arrays[name] = array
    return arrays, problems


def _check_one(
    task: SimpleNamespace, solution: SimpleNamespace, mode: str | None, toll: float
) -> list[str]:
    height, width = task.size
    labels, start, goal = (
        task.labels[:, :height, :width],
        tuple(task.start.tolist()),
        tuple(task.goal.tolist()),
    )
    free = free_cells(labels, np.zeros_like(task.destroyable))
    reached = piece_of(free, start)
    if int(solution.status) not in list(Status):
        return [
            f"status {solution.status} is none of"
            f" {', '.join(f'{s.name} ({s.value})' for s in Status)}"
        ]
    status = Status(int(solution.status))
    truth = _true_status(task, labels, free, reached, start, goal)
    problems = _status_problems(status, solution, truth, mode)
    problems += _blockage_problems(solution, labels, free, reached, goal)
    problems += _proof_problems(status, task, solution, labels, start, goal)
    if truth is Status.SOLVED and solution.removal_bound > 0:
        problems += bound_problems(task, solution, labels, start, goal)
    problems += presence_problems(solution, start, goal, mode, has_route=status.is_solved)
    if not status.is_solved:
        return problems + _no_route_problems(status, solution)
    if mode == "shortest":
        problems += total_problems(task, solution, labels, start, goal, toll)
    if mode == "least":
        problems += needless_problems(task, solution, labels, start, goal)
    walk = route_problems(task, solution, labels, start, goal) + destroyed_problems(task, solution)
    # a plan is compared with a route that can be walked
    return problems + (walk or plan_problems(solution, labels))


def _task_problems(task: SimpleNamespace) -> list[str]:
    height, width = task.size
    if not (0 < height <= task.labels.shape[1] and 0 < width <= task.labels.shape[2]):
        return [
            f"task.size {task.size.tolist()} does not fit labels of {list(task.labels.shape[1:])}"
            " cells"
        ]
    lowest, highest, known = task.labels.min(), task.labels.max(), len(task.destroyable)
    if lowest < OUTSIDE or highest >= known:
        return [
            f"task.labels hold {lowest} to {highest}, but must lie between {OUTSIDE} and"
            f" {known - 1}, the last id"
        ]
    wrong = np.flatnonzero(
        task.destroyable & ~(np.isfinite(task.removal_cost) & (task.removal_cost >= 0))
    )
    if len(wrong):
        return [
            f"task.removal_cost of obstacle {wrong[0]} is {task.removal_cost[wrong[0]]}: it must be"
            " finite, not negative"
        ]
    return []


def _true_status(task, labels, free, reached, start, goal) -> Status:
    """Returns how the task ends for one who has no limits."""
    if not holds_at(free, start):
        return Status.START_BLOCKED
    open_at_most = free_cells(labels, task.destroyable)
    if not holds_at(open_at_most, goal):
        return Status.GOAL_BLOCKED
    if holds_at(reached, goal):
        return Status.PATH_EXISTS
    return Status.SOLVED if holds_at(piece_of(open_at_most, start), goal) else Status.UNSOLVABLE


def _status_problems(
    status: Status, solution: SimpleNamespace, truth: Status, mode: str | None
) -> list[str]:
    is_too_long = solution.num_cells > len(solution.cells)
    limit_met = truth in (Status.SOLVED, Status.UNSOLVABLE) or (
        truth is Status.PATH_EXISTS and is_too_long
    )
    if mode == "shortest":
        limit_met |= truth is Status.PATH_EXISTS
    if mode in ("least", "shortest"):  # says which limit was met
        limit_met &= is_too_long or solution.num_destroyed > len(solution.destroyed)
    if status is truth or (status is Status.BUDGET_SPENT and limit_met):
        return []
    breaks = mode in (None, "shortest") and solution.num_destroyed > 0
    if status is Status.BROKE_THROUGH and truth is Status.PATH_EXISTS and breaks:
        return []
    if status is Status.STOPPED_SHORT and truth is Status.SOLVED and mode in (None, "literal"):
        return []
    return [f"status is {status.name}, but the truth is {truth.name}: {truth.meaning}"]


def _blockage_problems(solution, labels, free, reached, goal) -> list[str]:
    """The seed, contour and blocking ids against their definitions; all must be empty where nothing
    blocks.
    """
    # The definitions of PY16 §3.2, on a flood of our own.
    seed, contour, blocking = (-1, -1), np.zeros_like(free), np.zeros(0, np.int32)
    if reached.any() and not holds_at(reached, goal):
        seed = nearest_cell(reached, goal)
        blob = piece_of(~free, cell_ahead(free, seed, goal), by_corners=True)
        contour = reached & dilate(blob)
        met = labels[:, blob & dilate(contour)]
        blocking = np.unique(met[met >= 0])
    problems = []
    # What the solution says instead.
    if tuple(solution.seed.tolist()) != seed:
        problems.append(f"seed is {tuple(solution.seed.tolist())}, but must be {seed}")
    padding = [
        (0, whole - own) for whole, own in zip(solution.contour.shape, contour.shape, strict=True)
    ]
    wrong = np.argwhere(solution.contour != np.pad(contour, padding))
    if len(wrong):
        what = "should not be on it" if solution.contour[tuple(wrong[0])] else "is missing"
        problems.append(
            f"contour is wrong in {len(wrong)} cells: {tuple(wrong[0].tolist())} {what}"
        )
    expected = np.pad(blocking, (0, len(solution.blocking) - len(blocking)), constant_values=-1)
    if (solution.blocking != expected).any():
        given = solution.blocking[solution.blocking != -1].tolist()
        problems.append(
            f"blocking is {given} (then -1 to the end), but must be {blocking.tolist()}"
        )
    return problems


def _proof_problems(status: Status, task, solution, labels, start, goal) -> list[str]:
    """The indestructible obstacles that are said to separate start and goal, against a flood of the
    map that holds them alone.
    """
    number = int((solution.separating >= 0).sum())
    ids = solution.separating[:number].tolist()
    if (
        ids != sorted(set(ids))
        or (solution.separating[number:] != -1).any()
        or any(i >= len(task.destroyable) for i in ids)
    ):
        return [f"separating must hold ids, ascending, and then -1: {solution.separating.tolist()}"]
    if status not in (Status.UNSOLVABLE, Status.GOAL_BLOCKED):
        return (
            [f"separating names {ids}, but proves nothing where status is {status.name}"]
            if ids
            else []
        )
    problems = [
        f"obstacle {i} is said to separate, but is destroyable" for i in ids if task.destroyable[i]
    ]
    gone = np.ones_like(task.destroyable)
    gone[ids] = False
    if holds_at(piece_of(free_cells(labels, gone), start), goal):
        problems.append(
            f"separating names {ids}, but with these alone standing start and goal are not apart"
        )
    return problems


def _no_route_problems(status: Status, solution: SimpleNamespace) -> list[str]:
    """What a solution without a route must hold; one that met a limit may say how long the route
    would have been.
    """
    is_too_long = status is Status.BUDGET_SPENT and solution.num_cells > len(solution.cells)
    are_too_many = status is Status.BUDGET_SPENT and solution.num_destroyed > len(
        solution.destroyed
    )
    may_be_solvable = status in (Status.BUDGET_SPENT, Status.STOPPED_SHORT)
    wanted = {
        "cells": (solution.cells == -1).all(),
        "num_cells": solution.num_cells == 0 or is_too_long,
        "cost": solution.cost == np.inf,
        "destroyed": (solution.destroyed == -1).all(),
        "num_destroyed": solution.num_destroyed == 0 or are_too_many,
        "destroyed_at": (solution.destroyed_at == -1).all(),
        "removal_cost": solution.removal_cost == np.inf,
        "removal_bound": (
            solution.removal_bound >= 0 if may_be_solvable else solution.removal_bound == np.inf
        ),
        "plan": (solution.plan == -1).all(),
        "plan_at": (solution.plan_at == -1).all(),
    }
    wrong = [name for name, is_right in wanted.items() if not is_right]
    return [f"{name} must be empty, 0 or inf where status is {status.name}" for name in wrong]
