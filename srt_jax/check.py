"""The judge: replays a solution on the host and says what is wrong with it.

Written to be believed, so it shares nothing with the kernels it judges: of ours it imports only the records, it floods over
runs of cells where they sweep, and it decides anew what the status, the seed, the contour and the blocking obstacles must be.
"""

from types import SimpleNamespace

import numpy as np

from srt_jax.types import OUTSIDE, Solution, Status, Task

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
    "seed": ("int32", "2"),
    "contour": ("bool", "HW"),
    "blocking": ("int32", "M"),
}
_TOLERANCE = 1e-5
"""Relative error allowed to a float32 sum."""


def check(task: Task, solution: Solution) -> list[str]:
    """Returns what is wrong with `solution` as an answer to `task`, a sentence each; an empty list when all is well.

    Checked are the form of every array; the status, by a flood of its own; the route, move by move on the map as it then stands
    (an obstacle destroyed at index i is gone for the move from cell i to cell i + 1); that each destroyed obstacle could be
    destroyed and was beside the agent; the sums; and the report of the first blockage (PY16 §3.2). Not checked: that the route
    is the shortest and the removal the least, beyond `removal_bound` <= `removal_cost`.

    Args:
      task: one task or a batch.
      solution: the answers, with the same batch dimensions.

    Returns:
      list of str; for a batch each begins with the task's index: "task 3: ".
    """
    sides: dict[str, int] = {}
    tasks, problems = _arrays("task", task, _TASK_FORM, sides)
    solutions, more = _arrays("solution", solution, _SOLUTION_FORM, sides)
    if problems or more:
        return problems + more
    batch = tasks["start"].shape[:-1]
    if any(array.shape[: len(batch)] != batch for array in (*tasks.values(), *solutions.values())):
        told = {name: list(array.shape) for name, array in (tasks | solutions).items()}
        return [f"all fields must have the same batch dimensions, got shapes {told}"]
    for index in np.ndindex(batch):
        one_task = SimpleNamespace(**{name: array[index] for name, array in tasks.items()})
        one_solution = SimpleNamespace(**{name: array[index] for name, array in solutions.items()})
        name = "" if not batch else f"task {index[0] if len(batch) == 1 else index}: "
        problems += [name + problem for problem in _check_one(one_task, one_solution)]
    return problems


def _arrays(what: str, record: object, form: dict[str, tuple[str, str]], sides: dict[str, int]):
    """Returns the fields of a record as NumPy arrays, and what is wrong with them; `sides` learns how long each side is."""
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
        if array.dtype != dtype or not has_rank or any(known[side] not in (None, actual[side]) for side in core):
            wanted = ", ".join(["..."] * (batch_rank > 0) + [str(known[side] or side) for side in core])
            problems.append(f"{what}.{name} must be {dtype} [{wanted}], got {array.dtype} {list(array.shape)}")
            continue
        sides["..."] = batch_rank
        sides.update(actual)
        arrays[name] = array
    return arrays, problems


def _check_one(task: SimpleNamespace, solution: SimpleNamespace) -> list[str]:
    problems = _task_problems(task)
    if problems:
        return problems
    height, width = task.size
    labels, start, goal = task.labels[:, :height, :width], tuple(task.start.tolist()), tuple(task.goal.tolist())
    free = _free(labels, np.zeros_like(task.destroyable))
    reached = _piece(free, start)
    if int(solution.status) not in list(Status):
        return [f"status {solution.status} is none of {', '.join(f'{s.name} ({s.value})' for s in Status)}"]
    status = Status(int(solution.status))
    problems = _status_problems(status, solution, _true_status(task, labels, free, reached, start, goal))
    problems += _blockage_problems(solution, labels, free, reached, goal)
    if status.is_solved:
        return problems + _route_problems(task, solution, labels, start, goal) + _destroyed_problems(task, solution)
    return problems + _no_route_problems(status, solution)


def _task_problems(task: SimpleNamespace) -> list[str]:
    height, width = task.size
    if not (0 < height <= task.labels.shape[1] and 0 < width <= task.labels.shape[2]):
        return [f"task.size {task.size.tolist()} does not fit labels of {list(task.labels.shape[1:])} cells"]
    lowest, highest, known = task.labels.min(), task.labels.max(), len(task.destroyable)
    if lowest < OUTSIDE or highest >= known:
        return [f"task.labels hold {lowest} to {highest}, but must lie between {OUTSIDE} and {known - 1}, the last id"]
    return []


def _true_status(task, labels, free, reached, start, goal) -> Status:
    """Returns how the task ends for one who has no limits."""
    if not _at(free, start):
        return Status.START_BLOCKED
    open_at_most = _free(labels, task.destroyable)
    if not _at(open_at_most, goal):
        return Status.GOAL_BLOCKED
    if _at(reached, goal):
        return Status.PATH_EXISTS
    return Status.SOLVED if _at(_piece(open_at_most, start), goal) else Status.UNSOLVABLE


def _status_problems(status: Status, solution: SimpleNamespace, truth: Status) -> list[str]:
    is_too_long = solution.num_cells > len(solution.cells)
    limit_met = truth in (Status.SOLVED, Status.UNSOLVABLE) or (truth is Status.PATH_EXISTS and is_too_long)
    if status is truth or (status is Status.BUDGET_SPENT and limit_met):
        return []
    return [f"status is {status.name}, but the truth is {truth.name}: {truth.meaning}"]


def _blockage_problems(solution, labels, free, reached, goal) -> list[str]:
    """The seed, contour and blocking ids against their definitions; all must be empty where nothing blocks."""
    seed, contour, blocking = (-1, -1), np.zeros_like(free), np.zeros(0, np.int32)
    if reached.any() and not _at(reached, goal):
        seed = _nearest(reached, goal)
        blob = _piece(~free, _ahead(free, seed, goal), by_corners=True)
        contour = reached & _around(blob)
        met = labels[:, blob & _around(contour)]
        blocking = np.unique(met[met >= 0])
    problems = []
    if tuple(solution.seed.tolist()) != seed:
        problems.append(f"seed is {tuple(solution.seed.tolist())}, but must be {seed}")
    padding = [(0, whole - own) for whole, own in zip(solution.contour.shape, contour.shape, strict=True)]
    wrong = np.argwhere(solution.contour != np.pad(contour, padding))
    if len(wrong):
        told = "should not be on it" if solution.contour[tuple(wrong[0])] else "is missing"
        problems.append(f"contour is wrong in {len(wrong)} cells: {tuple(wrong[0].tolist())} {told}")
    expected = np.pad(blocking, (0, len(solution.blocking) - len(blocking)), constant_values=-1)
    if (solution.blocking != expected).any():
        given = solution.blocking[solution.blocking != -1].tolist()
        problems.append(f"blocking is {given} (then -1 to the end), but must be {blocking.tolist()}")
    return problems


def _route_problems(task, solution, labels, start, goal) -> list[str]:
    num_cells, cells = int(solution.num_cells), solution.cells
    if not 1 <= num_cells <= len(cells):
        return [f"num_cells is {num_cells}, but a route that fits has 1 to {len(cells)} cells"]
    route, problems = cells[:num_cells], []
    if (cells[num_cells:] != -1).any():
        problems.append(f"cells must be -1 from index {num_cells} (num_cells) on")
    height, width = labels.shape[1:]
    outside = np.flatnonzero((route < 0).any(axis=1) | (route >= (height, width)).any(axis=1))
    if len(outside):
        return [*problems, f"cell {outside[0]} of the route, {tuple(route[outside[0]].tolist())}, lies outside the map"]
    for name, cell, place in (("start", start, 0), ("goal", goal, -1)):
        if tuple(route[place].tolist()) != cell:
            problems.append(f"the route has its {name} in {tuple(route[place].tolist())}, but the task's is {cell}")
    problems += _replay(labels, route, np.zeros_like(task.destroyable), solution)
    num_diagonal = int((np.diff(route, axis=0) != 0).all(axis=1).sum())
    length = num_cells - 1 - num_diagonal + num_diagonal * 2**0.5
    if not _is_close(solution.cost, length):
        problems.append(f"cost is {solution.cost}, but the route is {length:.6f} long")
    return problems


def _replay(labels: np.ndarray, route: np.ndarray, gone: np.ndarray, solution: SimpleNamespace) -> list[str]:
    """Walks the route, destroying as told; what is malformed in the list of destroyed obstacles is told elsewhere."""
    problems, here = [], 0
    steps = zip(solution.destroyed.tolist(), solution.destroyed_at.tolist(), strict=True)
    for obstacle, index in list(steps)[: max(0, int(solution.num_destroyed))]:
        if not (0 <= obstacle < len(gone) and here <= index < len(route)):
            continue
        problems += _illegal_move(_free(labels, gone), route, here, index)
        row, col = route[index].tolist()
        if not (labels[:, max(0, row - 1) : row + 2, max(0, col - 1) : col + 2] == obstacle).any():
            problems.append(f"obstacle {obstacle} is destroyed from {(row, col)}, which is not beside it")
        gone[obstacle], here = True, index
    return problems + _illegal_move(_free(labels, gone), route, here, len(route) - 1)


def _illegal_move(free: np.ndarray, route: np.ndarray, first: int, last: int) -> list[str]:
    """What is wrong with the first illegal move between two indexes of the route, if any."""
    before, after = route[first:last], route[first + 1 : last + 1]
    is_step = abs(after - before).max(axis=1, initial=0) == 1
    sides = free[before[:, 0], after[:, 1]] & free[after[:, 0], before[:, 1]]  # of a straight move: its own two cells
    wrong = np.flatnonzero(~(is_step & free[tuple(before.T)] & free[tuple(after.T)] & sides))
    if not len(wrong):
        return []
    a, b = (tuple(cells[wrong[0]].tolist()) for cells in (before, after))
    reason = "is no step to a neighbour" if not is_step[wrong[0]] else "cuts a blocked corner"
    reason = f"starts in {a}, which is blocked" if not free[a] else f"enters {b}, which is blocked" if not free[b] else reason
    return [f"move {first + wrong[0]} of the route, {a} to {b}, {reason}"]


def _destroyed_problems(task: SimpleNamespace, solution: SimpleNamespace) -> list[str]:
    """The list of destroyed obstacles and its sums."""
    number, room, known = int(solution.num_destroyed), len(solution.destroyed), len(task.destroyable)
    if not 0 <= number <= room:
        return [f"num_destroyed is {number}, but `destroyed` has room for 0 to {room}"]
    ids, at, problems = solution.destroyed[:number].tolist(), solution.destroyed_at[:number].tolist(), []
    if (solution.destroyed[number:] != -1).any() or (solution.destroyed_at[number:] != -1).any():
        problems.append(f"destroyed and destroyed_at must be -1 from index {number} (num_destroyed) on")
    if any(not 0 <= i < known for i in ids):
        return [*problems, f"destroyed {ids} names an obstacle that does not exist: ids are 0 to {known - 1}"]
    if len(set(ids)) < number:
        problems.append(f"destroyed {ids} names an obstacle twice")
    if solution.status == Status.PATH_EXISTS and ids:
        problems.append(f"status PATH_EXISTS says that nothing needs destroying, but {ids} were destroyed")
    problems += [f"obstacle {i} was destroyed, but is not destroyable" for i in ids if not task.destroyable[i]]
    if at != sorted(at) or any(not 0 <= i < solution.num_cells for i in at):
        problems.append(f"destroyed_at {at} must rise and lie on the route, 0 to {int(solution.num_cells) - 1}")
    total = float(task.removal_cost[ids].sum(dtype=np.float64))
    if not _is_close(solution.removal_cost, total):
        problems.append(f"removal_cost is {solution.removal_cost}, but the destroyed obstacles cost {total}")
    if not 0 <= solution.removal_bound <= total * (1 + _TOLERANCE):
        problems.append(f"removal_bound is {solution.removal_bound}, but must lie between 0 and the removal cost {total}")
    return problems


def _no_route_problems(status: Status, solution: SimpleNamespace) -> list[str]:
    """What a solution without a route must hold; one that met a limit may tell how long the route would have been."""
    is_too_long = status is Status.BUDGET_SPENT and solution.num_cells > len(solution.cells)
    wanted = {
        "cells": (solution.cells == -1).all(),
        "num_cells": solution.num_cells == 0 or is_too_long,
        "cost": solution.cost == np.inf,
        "destroyed": (solution.destroyed == -1).all(),
        "num_destroyed": solution.num_destroyed == 0,
        "destroyed_at": (solution.destroyed_at == -1).all(),
        "removal_cost": solution.removal_cost == np.inf,
        "removal_bound": solution.removal_bound >= 0 if status is Status.BUDGET_SPENT else solution.removal_bound == np.inf,
    }
    wrong = [name for name, is_right in wanted.items() if not is_right]
    return [f"{name} must be empty, 0 or inf where status is {status.name}" for name in wrong]


def _is_close(given: np.ndarray, true: float) -> bool:
    return bool(abs(given - true) <= _TOLERANCE * true)


def _free(labels: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the cells that no obstacle covers once those marked in `gone` are gone."""
    is_open = np.concatenate([gone, [False, True]])  # OUTSIDE (-2) and FREE (-1) index it from its end
    return np.all(is_open[labels], axis=0)


def _at(mask: np.ndarray, cell: tuple[int, ...]) -> bool:
    return 0 <= cell[0] < mask.shape[0] and 0 <= cell[1] < mask.shape[1] and bool(mask[cell])


def _nearest(reached: np.ndarray, goal: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the reached cell of least octile distance to the goal; of several the one in the lowest row, then column."""
    cells = np.argwhere(reached)  # in row order
    apart = abs(cells - np.array(goal))
    distance = apart.max(axis=1) - apart.min(axis=1) + apart.min(axis=1) * 2**0.5
    return tuple(cells[distance.argmin()].tolist())


def _ahead(free: np.ndarray, seed: tuple[int, ...], goal: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the blocked cell on the greedy octile step; (-1, -1) where the step leaves the map.

    The step is diagonal unless row or column agree already. Where its cell is free but not reached, both cells beside it are
    blocked (else they were reached, and nearer to the goal than the seed); as they touch, either stands for the obstacle.
    """
    row, col = (int(np.sign(there - here)) for here, there in zip(seed, goal, strict=True))
    steps = [(seed[0] + row, seed[1] + col), (seed[0] + row, seed[1]), (seed[0], seed[1] + col)]
    return next((cell for cell in steps if cell != seed and _at(~free, cell)), (-1, -1))


def _around(mask: np.ndarray) -> np.ndarray:
    """Returns the cells with a cell of `mask` among themselves and their 8 neighbours."""
    wide = np.pad(mask, 1)
    wide = wide[:-2] | wide[1:-1] | wide[2:]
    return wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]


def _piece(mask: np.ndarray, cell: tuple[int, ...], *, by_corners: bool = False) -> np.ndarray:
    """Returns the part of `mask` that hangs together with `cell` by sides (or corners too); empty where `cell` is not on it.

    As no move cuts a corner, what the agent reaches by eight moves hangs together by sides. The flood goes over the runs of
    cells in each row, linked where they touch a run of the next row.
    """
    if not _at(mask, cell):
        return np.zeros_like(mask)
    flat = np.pad(mask, ((0, 0), (1, 1))).ravel()  # a blocked cell at both ends of a row: no run goes on in the next
    width = mask.shape[1] + 2
    run = np.cumsum(flat & ~np.concatenate([[False], flat[:-1]])) - 1
    links: list[list[int]] = [[] for _ in range(run[-1] + 1)]
    for ahead in (width - 1, width, width + 1) if by_corners else (width,):
        touching = np.flatnonzero(flat[:-ahead] & flat[ahead:])
        upper, lower = run[touching], run[touching + ahead]
        is_new = np.ones(len(touching), bool)  # two runs meet in one stretch of cells: its first is enough
        is_new[1:] = (upper[1:] != upper[:-1]) | (lower[1:] != lower[:-1])
        for above, below in zip(upper[is_new].tolist(), lower[is_new].tolist(), strict=True):
            links[above].append(below)
            links[below].append(above)
    waiting = [int(run[cell[0] * width + cell[1] + 1])]
    met = set(waiting)
    while waiting:
        new = [other for other in links[waiting.pop()] if other not in met]
        met.update(new)
        waiting += new
    is_in = np.zeros(len(links), bool)
    is_in[list(met)] = True
    return (flat & is_in[run]).reshape(-1, width)[:, 1:-1]
