"""What a solution says, in words: where the goal lies, what blocks, what was destroyed, and how good that is."""

import jax
import numpy as np

from srt_jax.types import Array, Solution, Status, Task

_COMPASS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


def explain(task: Task, solution: Solution) -> str:
    """Returns why the way was blocked and what was done about it; one line per task of a batch.

    Directions are those of the map: north is towards row 0. Lengths are in cell sides.

    Raises:
      ValueError: task and solution have different batch dimensions.
    """
    batch = np.shape(solution.status)
    if np.shape(task.start)[:-1] != batch:
        raise ValueError(f"the task has batch dimensions {list(np.shape(task.start)[:-1])}, the solution {list(batch)}")
    if not batch:
        return _explain_one(task, solution)
    lines = []
    for index in np.ndindex(batch):
        one = _explain_one(*(jax.tree.map(lambda array, i=index: np.asarray(array)[i], record) for record in (task, solution)))
        lines.append(f"task {', '.join(map(str, index))}: {one}")
    return "\n".join(lines)


def _explain_one(task: Task, solution: Solution) -> str:
    status = Status(int(solution.status))
    if status is Status.START_BLOCKED:
        return f"The start {_cell(task.start)} {_what_covers(task, task.start)}, so the agent cannot move."
    told = [_where_goal_is(task)]
    if status is Status.PATH_EXISTS:
        told.append(f"A path exists, {float(solution.cost):.1f} long; nothing has to be destroyed.")
    else:
        told.append(_what_blocks(task, solution))
        told.append(_what_was_done(task, solution, status))
    return " ".join(told)


def _where_goal_is(task: Task) -> str:
    down, right = (np.asarray(task.goal, int) - np.asarray(task.start, int)).tolist()
    if not (down or right):
        return f"The goal {_cell(task.goal)} is the start."
    octant = round(np.arctan2(-down, right) / (np.pi / 4)) % 8
    return (
        f"The goal {_cell(task.goal)} lies {np.hypot(down, right):.0f} away to the {_COMPASS[octant]} of {_cell(task.start)}."
    )


def _what_blocks(task: Task, solution: Solution) -> str:
    num_cells = int(np.sum(solution.contour))
    ids = np.asarray(solution.blocking)
    named = ", ".join(_obstacle(task, i) for i in ids[ids >= 0][:6].tolist())
    more = f" and {(ids >= 0).sum() - 6} more" if (ids >= 0).sum() > 6 else ""
    return (
        f"No path leads there: the agent gets as near as {_cell(solution.seed)}, where it is cut off along "
        f"{_count(num_cells, 'cell')} by {_count((ids >= 0).sum(), 'obstacle')}: {named}{more}."
    )


def _what_was_done(task: Task, solution: Solution, status: Status) -> str:
    bound, num_destroyable = float(solution.removal_bound), int(np.sum(task.destroyable))
    if status is Status.UNSOLVABLE:
        return f"Unsolvable: even with {_count(num_destroyable, 'destroyable obstacle')} gone there is no path."
    if status is Status.GOAL_BLOCKED:
        return f"Unsolvable: the goal {_what_covers(task, task.goal)}."
    if status is Status.BUDGET_SPENT:
        return f"Not answered: the way needs more than max_destroyed or max_cells allow (removal cost at least {bound:g})."
    cells = np.asarray(solution.cells)
    steps = [
        f"obstacle {solution.destroyed[i]} from {_cell(cells[solution.destroyed_at[i]])}"
        for i in range(int(solution.num_destroyed))
    ]
    cost = float(solution.removal_cost)
    proven = "proven least" if cost <= bound * (1 + 1e-6) else f"the least is at least {bound:g}"
    return f"Destroyed {', then '.join(steps)}; removal cost {cost:g}, {proven}. Route {float(solution.cost):.1f} long."


def _what_covers(task: Task, cell: Array) -> str:
    row, col = np.asarray(cell).tolist()
    height, width = np.asarray(task.size).tolist()
    if not (0 <= row < height and 0 <= col < width):
        return f"lies outside the map of {height} x {width} cells"
    owners = np.asarray(task.labels)[:, row, col]
    return "lies in " + ", ".join(_obstacle(task, i) for i in sorted(owners[owners >= 0].tolist()))


def _obstacle(task: Task, index: int) -> str:
    return f"{index} ({'destroyable' if bool(np.asarray(task.destroyable)[index]) else 'firm'})"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _cell(cell: Array) -> str:
    row, col = np.asarray(cell).tolist()
    return f"({row}, {col})"
