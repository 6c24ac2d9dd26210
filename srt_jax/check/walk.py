"""Whether a route can be walked as the solution says, and whether the symbolic plan agrees with
it.
"""

from types import SimpleNamespace

import numpy as np

from srt_jax.check.bound import exact, rounded_down
from srt_jax.check.floods import free_cells
from srt_jax.types import Act, Status

_TOLERANCE = 1e-5
"""Relative error allowed to a length in float32."""


def route_problems(task, solution, labels, start, goal) -> list[str]:
    num_cells, cells = int(solution.num_cells), solution.cells
    if not 1 <= num_cells <= len(cells):
        return [f"num_cells is {num_cells}, but a route that fits has 1 to {len(cells)} cells"]
    # Its form: padding, the map, the ends.
    route, problems = cells[:num_cells], []
    if (cells[num_cells:] != -1).any():
        problems.append(f"cells must be -1 from index {num_cells} (num_cells) on")
    height, width = labels.shape[1:]
    outside = np.flatnonzero((route < 0).any(axis=1) | (route >= (height, width)).any(axis=1))
    if len(outside):
        return [
            *problems,
            (
                f"cell {outside[0]} of the route, {tuple(route[outside[0]].tolist())}, lies outside"
                " the map"
            ),
        ]
    for name, cell, place in (("start", start, 0), ("goal", goal, -1)):
        if tuple(route[place].tolist()) != cell:
            problems.append(
                f"the route has its {name} in {tuple(route[place].tolist())}, but the task's is"
                f" {cell}"
            )
    # Its moves, and its length from the numbers of straight and diagonal ones.
    problems += _replay(labels, route, np.zeros_like(task.destroyable), solution)
    length = length_of(route)
    if not is_close(solution.cost, length):
        problems.append(f"cost is {solution.cost}, but the route is {length:.6f} long")
    return problems


def _replay(
    labels: np.ndarray, route: np.ndarray, gone: np.ndarray, solution: SimpleNamespace
) -> list[str]:
    """Walks the route and destroys what the solution says; errors in the form of that list are
    reported by `destroyed_problems`.
    """
    problems, here = [], 0
    steps = zip(solution.destroyed.tolist(), solution.destroyed_at.tolist(), strict=True)
    for obstacle, index in list(steps)[: max(0, int(solution.num_destroyed))]:
        if not (0 <= obstacle < len(gone) and here <= index < len(route)):
            continue
        problems += illegal_move(free_cells(labels, gone), route, here, index)
        row, col = route[index].tolist()
        if not (labels[:, max(0, row - 1) : row + 2, max(0, col - 1) : col + 2] == obstacle).any():
            problems.append(
                f"obstacle {obstacle} is destroyed from {(row, col)}, which is not beside it"
            )
        gone[obstacle], here = True, index
    return problems + illegal_move(free_cells(labels, gone), route, here, len(route) - 1)


def illegal_move(free: np.ndarray, route: np.ndarray, first: int, last: int) -> list[str]:
    """What is wrong with the first illegal move between two indexes of the route, if any."""
    before, after = route[first:last], route[first + 1 : last + 1]
    is_step = abs(after - before).max(axis=1, initial=0) == 1
    # of a straight move: its own two cells
    sides = free[before[:, 0], after[:, 1]] & free[after[:, 0], before[:, 1]]
    wrong = np.flatnonzero(~(is_step & free[tuple(before.T)] & free[tuple(after.T)] & sides))
    if not len(wrong):
        return []
    a, b = (tuple(cells[wrong[0]].tolist()) for cells in (before, after))
    reason = "is no step to a neighbour" if not is_step[wrong[0]] else "cuts a blocked corner"
    reason = (
        f"starts in {a}, which is blocked"
        if not free[a]
        else f"enters {b}, which is blocked"
        if not free[b]
        else reason
    )
    return [f"move {first + wrong[0]} of the route, {a} to {b}, {reason}"]


def destroyed_problems(task: SimpleNamespace, solution: SimpleNamespace) -> list[str]:
    """The list of destroyed obstacles and its sums."""
    number, room, known = (
        int(solution.num_destroyed),
        len(solution.destroyed),
        len(task.destroyable),
    )
    # The form of the list: the rest makes sense only for ids that exist.
    if not 0 <= number <= room:
        return [f"num_destroyed is {number}, but `destroyed` has room for 0 to {room}"]
    ids, at, problems = (
        solution.destroyed[:number].tolist(),
        solution.destroyed_at[:number].tolist(),
        [],
    )
    if (solution.destroyed[number:] != -1).any() or (solution.destroyed_at[number:] != -1).any():
        problems.append(
            f"destroyed and destroyed_at must be -1 from index {number} (num_destroyed) on"
        )
    if any(not 0 <= i < known for i in ids):
        return [
            *problems,
            f"destroyed {ids} names an obstacle that does not exist: ids are 0 to {known - 1}",
        ]
    # What may be destroyed, and in which order.
    if len(set(ids)) < number:
        problems.append(f"destroyed {ids} names an obstacle twice")
    if solution.status == Status.PATH_EXISTS and ids:
        problems.append(
            f"status PATH_EXISTS says that nothing needs destroying, but {ids} were destroyed"
        )
    problems += [
        f"obstacle {i} was destroyed, but is not destroyable"
        for i in ids
        if not task.destroyable[i]
    ]
    if at != sorted(at) or any(not 0 <= i < solution.num_cells for i in at):
        problems.append(
            f"destroyed_at {at} must rise and lie on the route, 0 to {int(solution.num_cells) - 1}"
        )
    return problems + _sum_problems(task, solution, ids)


def _sum_problems(task: SimpleNamespace, solution: SimpleNamespace, ids: list[int]) -> list[str]:
    """The removal cost and its bound, compared as whole numbers with the costs of `ids`."""
    problems = []
    total = sum(exact(cost) for cost in task.removal_cost[ids])
    if solution.removal_cost != rounded_down(total):
        problems.append(
            f"removal_cost is {solution.removal_cost}, but the destroyed obstacles cost"
            f" {rounded_down(total)}"
        )
    if not (solution.removal_bound >= 0 and exact(solution.removal_bound) <= total):
        rule = f"must lie between 0 and the removal cost {rounded_down(total)}"
        problems.append(f"removal_bound is {solution.removal_bound}, but {rule}")
    return problems


def length_of(route: np.ndarray) -> float:
    """The length of a route of legal moves, in cell sides."""
    num_diagonal = int((np.diff(route, axis=0) != 0).all(axis=1).sum())
    return len(route) - 1 - num_diagonal + num_diagonal * 2**0.5


def is_close(given: np.ndarray, true: float) -> bool:
    return bool(abs(given - true) <= _TOLERANCE * true)


def plan_problems(solution: SimpleNamespace, labels: np.ndarray) -> list[str]:
    """The plan against route and destroyed obstacles: each step must do on the route what it
    says.
    """
    acts, ids, ends = (
        solution.plan[:, 0].tolist(),
        solution.plan[:, 1].tolist(),
        solution.plan_at.tolist(),
    )
    # The form of the plan.
    number, last = sum(act >= 0 for act in acts), int(solution.num_cells) - 1
    if any(act not in list(Act) for act in acts[:number]) or any(
        v != -1 for v in acts[number:] + ids[number:] + ends[number:]
    ):
        return [
            f"plan must hold acts (0 to {len(Act) - 1}) and then (-1, -1), plan_at -1 from there"
            f" on: {list(zip(acts, ids))}"
        ]
    acts, ids, ends = [Act(act) for act in acts[:number]], ids[:number], ends[:number]
    if (
        ends != sorted(ends)
        or any(not 0 <= end <= last for end in ends)
        or (ends or [0])[-1] != last
    ):
        return [f"plan_at {ends} must rise along the route and end with it, at {last}"]
    # What it destroys, and where; then each step by itself.
    destroyed = list(zip(solution.destroyed.tolist(), solution.destroyed_at.tolist()))[
        : int(solution.num_destroyed)
    ]
    done = [(obstacle, end) for act, obstacle, end in zip(acts, ids, ends) if act is Act.DESTROY]
    if done != destroyed:
        return [f"the plan destroys (obstacle, index) {done}, but the solution {destroyed}"]
    problems = []
    for place, act in enumerate(acts):
        problems += _step_problems(solution, labels, acts, ids, ends, place, act)
    return problems


def _step_problems(solution, labels, acts, ids, ends, place: int, act: Act) -> list[str]:
    obstacle, begin, end = ids[place], ends[place - 1] if place else 0, ends[place]
    following = (
        (acts[place + 1], ids[place + 1], ends[place + 1]) if place + 1 < len(acts) else None
    )
    step = f"step {place} of the plan, {act.name} {obstacle},"
    if act is Act.APPROACH:
        return (
            []
            if following == (Act.DESTROY, obstacle, end)
            else [f"{step} must be followed by DESTROY at its end"]
        )
    if act is Act.DESTROY:
        is_beside = place and (acts[place - 1], ids[place - 1]) == (Act.APPROACH, obstacle)
        return [] if is_beside else [f"{step} must follow APPROACH"]
    meets = _met(labels, solution.cells[begin : end + 1])
    if act is Act.RELOCATE:
        is_free = obstacle == -1 and not (meets & set(solution.destroyed.tolist()) - {-1})
        return [] if is_free else [f"{step} must be of no obstacle and meet none"]
    if not place or (acts[place - 1], ids[place - 1]) != (Act.DESTROY, obstacle):
        return [f"{step} must follow DESTROY"]
    if end > begin and obstacle not in meets:
        return [f"{step} goes from index {begin} to {end} of the route without meeting it"]
    if following and end != min(
        _left_behind(labels, solution.cells, obstacle, begin), following[2]
    ):
        return [f"{step} must end where the route leaves the obstacle behind, not at index {end}"]
    return []


def _met(labels: np.ndarray, stretch: np.ndarray) -> set[int]:
    """The obstacles of which a stretch of the route, from its first cell on, enters a cell or
    passes one by its corner.
    """
    before, after = stretch[:-1], stretch[1:]
    cells = (after.T, (before[:, 0], after[:, 1]), (after[:, 0], before[:, 1]))
    return {int(owner) for rows, cols in cells for owner in np.unique(labels[:, rows, cols])}


def _left_behind(labels: np.ndarray, cells: np.ndarray, obstacle: int, begin: int) -> int:
    index = begin + 1
    while (
        index < len(cells)
        and cells[index, 0] >= 0
        and (labels[:, cells[index, 0], cells[index, 1]] == obstacle).any()
    ):
        index += 1
    return index
