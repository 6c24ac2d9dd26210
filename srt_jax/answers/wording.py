"""What a solution says, in words: where the goal lies, what blocks, what was destroyed, and how
good that is.
"""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from sign_model.foundation.legible import counted
from srt_jax.answers.facts import NORTH, contour_of, explanation, obstacle_data
from srt_jax.answers.measures import heading_text, length_text, seen_text
from srt_jax.answers.what_if import Outcome, exact_cost, if_flag, if_gone
from srt_jax.engine.entrance import require_answer, require_one_answer
from srt_jax.geometry.frame import Frame
from srt_jax.symbols import places
from srt_jax.types import Approach, Array, Solution, Status, Task


def explain(
    task: Task,
    solution: Solution,
    *,
    what_if: bool = False,
    heading: float = NORTH,
    cell_side: float | None = None,
    frame: Frame | None = None,
    approach: Approach | None = None,
) -> str:
    """Returns why the way was blocked and what was done about it; one line per task of a batch.

    Compass directions are those of the map: north is towards row 0. Fuzzy ones are the agent's, as
    in `explanation`, which has the same as data, and the same options: the paper's words, and the
    distance and the degrees that they stand for. Lengths are in cell sides; in metres where
    `cell_side` is given, and places too where a `frame` in metres is: (x, y) of the middle of the
    cell, instead of (row, col). An answer without a route to the goal says how near one gets, and
    by which route. With `what_if` it also names the other sets found when each obstacle destroyed
    has to stay, among them those of the same cost.

    Raises:
      TypeError: no task or no solution. ValueError: the solution is of another map, or has other
        batch dimensions.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> "Destroyed obstacle 0 from (2, 2)" in srt_jax.explain(task, solution)
      True
    """
    require_answer("explain", task, solution)
    place = _place_in(frame)
    if cell_side is None and frame is not None and frame.has_metres:
        cell_side = frame.side
    data = explanation(
        task, solution, what_if=what_if, heading=heading, cell_side=cell_side, approach=approach
    )
    if isinstance(data, dict):
        return _in_words(task, data, place)
    batch = np.shape(solution.status)
    lines = []
    for index, part in zip(np.ndindex(batch), data):
        one = jax.tree.map(lambda array, i=index: np.asarray(array)[i], task)
        lines.append(f"task {', '.join(map(str, index))}: {_in_words(one, part, place)}")
    return "\n".join(lines)


def why(task: Task, solution: Solution, obstacle: int, *, cell_side: float | None = None) -> str:
    """Returns what part an obstacle has in the answer to one task: why it was destroyed, or why it
    is in the report.

    What would follow if it were otherwise is found by solving again. Lengths as in `explain`.

    Raises:
      TypeError: no whole number. ValueError: no obstacle has that id.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> "was destroyed from (2, 2)" in srt_jax.why(task, solution, 0)
      True
    """
    named = _obstacle_title(task, solution, obstacle, cell_side)
    destroyed = np.asarray(solution.destroyed).tolist()
    if obstacle in destroyed:
        place = destroyed.index(obstacle)
        cell = np.asarray(solution.cells)[np.asarray(solution.destroyed_at)[place]]
        before = ", ".join(map(str, destroyed[:place]))
        met = f"behind {before}, which had to go first" if before else "the first in the way"
        otherwise = if_flag(task, solution, obstacle, is_destroyable=False)
        return (
            f"{named} was destroyed from {_cell(cell)}: it is {met}. If {obstacle} were"
            f" indestructible: {otherwise.in_words()}."
        )
    separating = [i for i in np.asarray(solution.separating).tolist() if i >= 0]
    if obstacle in separating:
        others = [i for i in separating if i != obstacle]
        company = f" together with {', '.join(map(str, others))}" if others else ""
        otherwise = if_flag(task, solution, obstacle, is_destroyable=True)
        return (
            f"{named} keeps start and goal apart{company}. If {obstacle} could be destroyed:"
            f" {otherwise.in_words()}."
        )
    if obstacle in np.asarray(solution.blocking).tolist():
        if not bool(np.asarray(task.destroyable)[obstacle]):
            otherwise = if_flag(task, solution, obstacle, is_destroyable=True)
            return (
                f"{named} is part of what blocks first and is indestructible. If it could be"
                f" destroyed: {otherwise.in_words()}."
            )
        return (
            f"{named} is part of what blocks first, but need not go:"
            f" {_why_it_may_stand(task, solution, obstacle)}."
        )
    return f"{named} has no part in it."


def why_not(
    task: Task, solution: Solution, obstacle: int, *, cell_side: float | None = None
) -> str:
    """Returns why an obstacle was not destroyed in the answer to one task, and what would follow if
    it were. Lengths as in `explain`.

    Raises:
      TypeError: no whole number. ValueError: no obstacle has that id.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> srt_jax.why_not(task, solution, 0).endswith("was destroyed.")
      True
    """
    named = _obstacle_title(task, solution, obstacle, cell_side)
    status = Status(int(solution.status))
    if obstacle in np.asarray(solution.destroyed).tolist():
        return f"{named} was destroyed."
    if status is Status.START_BLOCKED:
        return f"{named} was not destroyed: the agent cannot move."
    if status is Status.PATH_EXISTS:
        return f"{named} was not destroyed: a path exists, nothing has to go."
    if not bool(np.asarray(task.destroyable)[obstacle]):
        otherwise = if_flag(task, solution, obstacle, is_destroyable=True)
        return f"{named} was not destroyed: it cannot be. If it could: {otherwise.in_words()}."
    return f"{named} was not destroyed: {_why_it_may_stand(task, solution, obstacle)}."


def _why_it_may_stand(task: Task, solution: Solution, obstacle: int) -> str:
    gone: Outcome = if_gone(task, solution, obstacle)
    if not gone.status.is_solved:
        return f"that would not open a way ({gone.in_words()})"
    cost = float(solution.removal_cost)
    if not np.isfinite(cost):
        return f"with it gone {gone.in_words()}"
    chosen = [i for i in np.asarray(solution.destroyed).tolist() if i >= 0]
    # Exact sums: two sets may differ by less than one float32 from the next.
    more = exact_cost(task, gone.destroyed) - exact_cost(task, chosen)
    compared = "more than" if more > 0 else "less than" if more < 0 else "the same as"
    return f"with it gone {gone.in_words()}, {compared} the {cost:g} of what was chosen"


def _obstacle_title(task: Task, solution: Solution, obstacle: int, cell_side: float | None) -> str:
    require_one_answer("why or why_not", task, solution)
    known = np.shape(task.destroyable)[-1]
    if not isinstance(obstacle, int | np.integer) or isinstance(obstacle, bool):
        raise TypeError(
            f"obstacle must be the id of one obstacle, such as 3, got {obstacle!r}: ask for each by"
            " itself"
        )
    if not 0 <= obstacle < known:
        raise ValueError(f"no obstacle has the id {obstacle}: ids are 0 to {known - 1}")
    side, unit = (1.0, "cells") if cell_side is None else (cell_side, "m")
    view = places.view_from(task.start, heading=NORTH, cell_side=side, table=places.DEFAULT_TABLE)
    data = obstacle_data(task, contour_of(task, solution), obstacle, view, side)
    return f"Obstacle {_obstacle(data, unit)}"


_Place = Callable[[Any], str]
"""A cell -> how it is written."""


def _place_in(frame: Frame | None) -> _Place:
    if frame is None or not frame.has_metres:
        return _cell

    def place(cell: Any) -> str:
        x, y = (np.round(frame.point_of(np.asarray(cell, np.int32)), 2) + 0.0).tolist()
        return f"({x:.2f} m, {y:.2f} m)"

    return place


def _in_words(task: Task, data: dict[str, Any], place: _Place) -> str:
    status = Status[data["status"]]
    if status is Status.START_BLOCKED:
        cannot = (
            f"The start {place(data['start'])} {_what_covers(task, task.start)}, so the agent"
            " cannot move."
        )
        return f"{cannot} {_how_near(data, place)}"
    lines = [_where_goal_is(data, place)]
    if status is Status.PATH_EXISTS:
        lines.append(
            f"A path exists, {length_text(data['route']['length'], data['unit'])} long; nothing has"
            " to be destroyed."
        )
        if data["total"]:
            lines.append(f"Going round is cheaper than breaking through{_how_sure(data['total'])}.")
    elif status is Status.BROKE_THROUGH:
        lines.append(_why_break(data, place))
    else:
        lines += [_what_blocks(data, place), _what_was_done(task, data, status, place)]
    if not status.is_solved:
        lines.append(_how_near(data, place))
    for other in data.get("alternatives", ()):
        same = "the same " if other["is_as_cheap"] else ""
        lines.append(
            f"Instead {' + '.join(map(str, other['destroyed']))} could go, at {same}cost"
            f" {other['removal_cost']:g}."
        )
    for other in data.get("if_firm", ()):
        if other["removal_cost"] is None:
            ending = other["status"].lower().replace("_", " ")
            lines.append(f"If {other['id']} were indestructible: {ending}.")
    return " ".join(lines)


def _where_goal_is(data: dict[str, Any], place: _Place) -> str:
    goal = data["goal"]
    if goal["direction"] is None:
        return f"The goal {place(goal['cell'])} is the start."
    return (
        f"The goal {place(goal['cell'])} lies to the {goal['direction']} of {place(data['start'])},"
        f" {seen_text(goal, data['unit'])}, looking {heading_text(data['heading'])}."
    )


def _how_near(data: dict[str, Any], place: _Place) -> str:
    """The sentence on the way as near as one gets, of an answer without a route to the goal."""
    near, unit = data["approach"], data["unit"]
    if near is None:
        return "No cell of the map is free."
    is_moved = near["begin"] != data["start"]
    begins = f" from {place(near['begin'])}, the free cell nearest the start," if is_moved else ""
    to = " to" if is_moved else ""
    long = f"{length_text(near['length'], unit)} long"
    if near["gap"] == 0:
        return f"As near as one gets:{begins} a path leads to the goal, {long}."
    return (
        f"As near as one gets:{begins}{to} {place(near['end'])},"
        f" {length_text(near['gap'], unit)} from the goal, by a route {long}."
    )


def _what_blocks(data: dict[str, Any], place: _Place) -> str:
    blockage, unit = data["blockage"], data["unit"]
    obstacles = blockage["obstacles"]
    named = ", ".join(_obstacle(one, unit) for one in obstacles[:6])
    more = f" and {len(obstacles) - 6} more" if len(obstacles) > 6 else ""
    return (
        f"No path leads there: the agent gets within {length_text(blockage['gap'], unit)} of the"
        f" goal, to {place(blockage['seed'])}, where it is cut off along"
        f" {counted(blockage['contour_cells'], 'cell')} by {counted(len(obstacles), 'obstacle')}:"
        f" {named}{more}."
    )


def _what_was_done(task: Task, data: dict[str, Any], status: Status, place: _Place) -> str:
    bound = data["removal_bound"]
    if status is Status.UNSOLVABLE:
        return _why_unsolvable(int(np.sum(task.destroyable)), data["separating"])
    if status is Status.GOAL_BLOCKED:
        return f"Unsolvable: the goal {_what_covers(task, task.goal)}."
    if status is Status.BUDGET_SPENT and data["num_needed"]:
        needed = (
            f"the least removal needs {counted(data['num_needed'], 'obstacle')} destroyed, more"
            " than max_destroyed allows"
        )
        return f"Not answered: {needed} (removal cost at least {bound:g})."
    if status is Status.BUDGET_SPENT:
        return (
            "Not answered: the way needs more than max_destroyed or max_cells allow (removal cost"
            f" at least {bound:g})."
        )
    if status is Status.STOPPED_SHORT:
        return (
            "Stopped short: what lies ahead is indestructible, though a way can be opened"
            f" (removal cost at least {bound:g})."
        )
    steps = _steps(data, place)
    proven = "proven least" if data["is_proven_least"] else f"the least is at least {bound:g}"
    route = data["route"]
    moved = f", {route['relocation']['name']}" if route["relocation"]["name"] else ""
    return (
        f"Destroyed {steps}; removal cost {data['removal_cost']:g}, {proven}. "
        f"Route {length_text(route['length'], data['unit'])} long{moved}."
        + (f" {_total_in_words(data['total'])}" if data["total"] else "")
    )


def _steps(data: dict[str, Any], place: _Place) -> str:
    return ", then ".join(
        f"obstacle {one['id']} from {place(one['from'])}" for one in data["destroyed"]
    )


def _why_break(data: dict[str, Any], place: _Place) -> str:
    """What breaking saves where there is a way round."""
    total, length = data["total"], data["route"]["length"]
    saved, gained = total["way_round"] - length, total["way_round"] - total["total"]
    unit = data["unit"]
    return (
        f"A path exists, {length_text(total['way_round'], unit)} long, but breaking {_names(data)}"
        f" saves {saved:.1f} of it for a toll of {total['toll']:.1f}: {gained:.1f} gained."
        f" Destroyed {_steps(data, place)}; removal cost {data['removal_cost']:g}. Route"
        f" {length_text(length, unit)} long."
        f" {_total_in_words(total)}"
    )


def _names(data: dict[str, Any]) -> str:
    ids = [str(one["id"]) for one in data["destroyed"]]
    return f"obstacle{'s' if len(ids) > 1 else ''} {', '.join(ids)}"


def _total_in_words(total: dict[str, Any]) -> str:
    return f"Length and tolls {total['total']:.1f}{_how_sure(total)}."


def _how_sure(total: dict[str, Any]) -> str:
    return (
        ", proven least" if total["is_proven"] else f", the least is at least {total['bound']:.1f}"
    )


def _why_unsolvable(num_destroyable: int, separating: list[int]) -> str:
    """The sentence that names the indestructible obstacles which alone keep start and goal apart,
    where they are known.
    """
    named = ", ".join(map(str, separating[:6])) + (" and more" if len(separating) > 6 else "")
    keeps = "keep" if len(separating) > 1 else "keeps"
    proof = f": {named} alone {keeps} start and goal apart" if named else ""
    if not num_destroyable:
        return f"Unsolvable: nothing can be destroyed{proof}."
    return (
        f"Unsolvable: even with {counted(num_destroyable, 'destroyable obstacle')} gone there is"
        f" no path{proof}."
    )


def _what_covers(task: Task, cell: Array) -> str:
    row, col = np.asarray(cell).tolist()
    height, width = np.asarray(task.size).tolist()
    if not (0 <= row < height and 0 <= col < width):
        return f"lies outside the map of {height} x {width} cells"
    owners, flags = np.asarray(task.labels)[:, row, col], np.asarray(task.destroyable)
    return "lies in " + ", ".join(
        f"{i} ({_kind(bool(flags[i]))})" for i in sorted(owners[owners >= 0].tolist())
    )


def _obstacle(known: dict[str, Any], unit: str) -> str:
    """Returns an obstacle in words: `7 (destroyable, 12 cells of contour, close, ahead: 12 cells,
    10 degrees to the left)`.
    """
    seen = (
        [f"{counted(known['contour_cells'], 'cell')} of contour", seen_text(known, unit)]
        if known["contour_cells"]
        else []
    )
    return f"{known['id']} ({', '.join([_kind(known['is_destroyable']), *seen])})"


def _kind(is_destroyable: bool) -> str:
    return "destroyable" if is_destroyable else "indestructible"


def _cell(cell: Any) -> str:
    row, col = np.asarray(cell).tolist()
    return f"({row}, {col})"
