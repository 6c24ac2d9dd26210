"""What a solution says, as plain data: where the goal lies, what blocks, what was done, and what
would follow otherwise.
"""

import importlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from sign_model.foundation.legible import finite_or_none
from srt_jax.answers.what_if import exact_cost, if_flag
from srt_jax.engine.entrance import require_answer
from srt_jax.paths.approach import approach as approach_of
from srt_jax.paths.cost_to_come import path_cost
from srt_jax.symbols import places
from srt_jax.symbols.scene_of_task import PlannedStep, planned_steps
from srt_jax.types import FREE, Act, Approach, Array, Solution, Status, Task

NORTH = 90.0
"""The default heading: up the map, in degrees counter-clockwise from its right."""


class Explanation(dict):
    """What `explanation` returns of one task: a dict of JSON types, which a notebook shows as a
    picture and a table.

    A copy, a pickled one and what `json` makes of it are the same data without the picture.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> data = srt_jax.explanation(task, srt_jax.solve(task))
      >>> data["status"], data["route"]["length"]
      ('SOLVED', 6.0)
      >>> "<svg" in data._repr_html_()
      True
    """

    _shown: tuple[Task, Solution] | None = None

    def _repr_html_(self) -> str:
        """A picture of the answer and the data as a table, for notebooks."""
        return importlib.import_module("srt_jax.draw.notebook").explanation_html(self, self._shown)

    def __reduce__(self) -> Any:
        return type(self), (dict(self),)


def explanation(
    task: Task,
    solution: Solution,
    *,
    what_if: bool = False,
    heading: float = NORTH,
    cell_side: float | None = None,
    table: places.FuzzyTable = places.DEFAULT_TABLE,
    approach: Approach | None = None,
) -> Any:
    """Returns why the way was blocked and what was done about it, as a dict of JSON types, an
    `Explanation`; a list of them for a batch.

    Keys: status, meaning; unit of lengths, "cells" or "m"; heading, as given; start; goal {cell,
    distance, direction, seen_as, away, turn, sector, square}; blockage {seed, gap, contour_cells,
    obstacles [...]} or None, those first that can be destroyed; destroyed [{id, from, index,
    removal_cost}]; removal_cost, removal_bound, is_proven_least; total {total, bound, is_proven,
    toll, way_round} of mode "shortest", else None: `toll` what was paid in all, `way_round` the
    length of the shortest path with nothing destroyed or None; num_needed, the obstacles that have
    to go where max_destroyed is less, else None; route {num_cells, length, relocation} or None;
    approach {begin, end, gap, length, num_cells}, the way as near as one gets, or None where the
    task is solved or no cell is free; plan [{act, obstacle, from, to, cells, relocation}];
    separating [ids]. With `what_if` also if_firm: for each obstacle destroyed how the task would
    end if it were indestructible {id, status, destroyed, removal_cost}; and alternatives: the other
    sets of obstacles found so, cheapest first {status, destroyed, removal_cost, is_as_cheap}. What
    is seen is named from where the agent starts: `away` and `turn` (radians leftwards of the
    heading) are of its nearest point, which the words `seen_as` name; `sector` is four pairs
    (r, phi), `square` (centre (x, y), side).

    Args:
      what_if: solve again for each obstacle destroyed.
      heading: where the agent looks, in degrees counter-clockwise from the right of the map; 90,
        the default, is up.
      cell_side: metres a cell (`World.goal_side`, `Frame.side`); the words of the table are in
        metres. Without it lengths are in cell sides, and a cell counts as a metre in the words.
      table: the grounding of the fuzzy words.
      approach: of the same tasks, where it is known; else it is found for those not solved.

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
      >>> srt_jax.explanation(task, solution)["destroyed"]
      [{'id': 0, 'from': [2, 2], 'index': 2, 'removal_cost': 1.0}]
    """
    require_answer("explanation", task, solution)
    batch = np.shape(solution.status)
    options = {"what_if": what_if, "heading": heading, "cell_side": cell_side, "table": table}
    if not batch:
        return _of_one(task, solution, approach, **options)
    parts = (
        jax.tree.map(lambda array, i=index: np.asarray(array)[i], (task, solution, approach))
        for index in np.ndindex(batch)
    )
    return [_of_one(*part, **options) for part in parts]


def _of_one(
    task: Task,
    solution: Solution,
    approach: Approach | None,
    *,
    what_if: bool,
    heading: float,
    cell_side: float | None,
    table,
) -> Explanation:
    status, unit = Status(int(solution.status)), "cells" if cell_side is None else "m"
    cell_side = 1.0 if cell_side is None else cell_side
    view = places.view_from(task.start, heading=heading, cell_side=cell_side, table=table)
    cost, bound = float(solution.removal_cost), float(solution.removal_bound)
    data = {
        "status": status.name,
        "meaning": status.meaning,
        "unit": unit,
        "heading": heading,
        "start": _cell(task.start),
        "goal": {
            "cell": _cell(task.goal),
            **_apart(task, cell_side),
            **_view_data(places.of_goal(view, task.goal, cell_side)),
        },
        "blockage": _blockage(task, solution, view, cell_side),
        "destroyed": _destroyed_data(task, solution),
        "removal_cost": finite_or_none(cost),
        "removal_bound": finite_or_none(bound),
        "is_proven_least": status.is_solved and cost == bound,
        "total": _total(task, solution, cell_side),
        "num_needed": None if status.is_solved else int(solution.num_destroyed) or None,
        "route": None,
        "approach": None if status.is_solved else _approach_data(task, approach, cell_side),
        "plan": [_step(step, solution, view, cell_side) for step in planned_steps(solution)],
        "separating": [i for i in np.asarray(solution.separating).tolist() if i >= 0],
    }
    if status.is_solved:
        cells = np.asarray(solution.cells)[: int(solution.num_cells)]
        moved = places.relocation(view, cells, cell_side)
        data["route"] = {
            "num_cells": len(cells),
            "length": float(solution.cost) * cell_side,
            "relocation": moved,
        }
    out = Explanation(data | (_what_if(task, solution) if what_if else {}))
    out._shown = task, solution
    return out


def _total(task: Task, solution: Solution, cell_side: float) -> dict[str, Any] | None:
    """What mode "shortest" weighs; None of the other modes."""
    total, bound = float(solution.total), float(solution.total_bound)
    if not (Status(int(solution.status)).is_solved and bound > 0):
        return None
    height, width = np.asarray(task.size).tolist()
    free = (np.asarray(task.labels)[:, :height, :width] == FREE).all(axis=0)
    way_round = float(path_cost(free, np.asarray(task.start), np.asarray(task.goal)))
    return {
        "total": total * cell_side,
        "bound": bound * cell_side,
        "is_proven": total == bound,
        "toll": max(0.0, total - float(solution.cost)) * cell_side,
        "way_round": way_round * cell_side if np.isfinite(way_round) else None,
    }


class Contour(NamedTuple):
    """The contour of a solution.

    cells: int [N, 2]. met: int [N, K], the labels of each one and its neighbours, in all layers.
    """

    cells: np.ndarray
    met: np.ndarray

    def of(self, obstacle: int) -> np.ndarray:
        """Returns the cells that touch one obstacle, int [N, 2]."""
        return self.cells[(self.met == obstacle).any(axis=1)]


def contour_of(task: Task, solution: Solution) -> Contour:
    """Returns the contour with what its cells touch."""
    height, width = np.asarray(task.size).tolist()
    cells = np.argwhere(np.asarray(solution.contour)[:height, :width])
    labels = np.asarray(task.labels)[:, :height, :width]
    last = np.array([height - 1, width - 1])
    met = [
        labels[:, *np.clip(cells + np.array([down, right]), 0, last).T]
        for down in (-1, 0, 1)
        for right in (-1, 0, 1)
    ]
    return Contour(cells, np.concatenate(met).T)


def obstacle_data(
    task: Task, contour: Contour, obstacle: int, view: places.View, cell_side: float
) -> dict[str, Any]:
    """Returns what is known of one obstacle: flags, cost, and where its part of the contour is
    seen, if it has one.
    """
    data = {
        "id": obstacle,
        "is_destroyable": bool(np.asarray(task.destroyable)[obstacle]),
        "removal_cost": float(np.asarray(task.removal_cost)[obstacle]),
    }
    cells = contour.of(obstacle)
    if not len(cells):
        return data | {"contour_cells": 0}
    return data | {
        "contour_cells": len(cells),
        **_view_data(places.of_cells(view, cells, cell_side)),
    }


def _blockage(
    task: Task, solution: Solution, view: places.View, cell_side: float
) -> dict[str, Any] | None:
    seed = _cell(solution.seed)
    if seed[0] < 0:
        return None
    ids = [i for i in np.asarray(solution.blocking).tolist() if i >= 0]
    ids.sort(key=lambda i: not np.asarray(task.destroyable)[i])  # what can be destroyed first
    contour = contour_of(task, solution)
    obstacles = [obstacle_data(task, contour, i, view, cell_side) for i in ids]
    gap = octile_length(seed, _cell(task.goal)) * cell_side
    return {
        "seed": seed,
        "gap": gap,
        "contour_cells": int(np.sum(solution.contour)),
        "obstacles": obstacles,
    }


def _approach_data(
    task: Task, approach: Approach | None, cell_side: float
) -> dict[str, Any] | None:
    near = approach_of(task) if approach is None else approach
    if not int(near.num_cells):
        return None
    return {
        "begin": _cell(near.begin),
        "end": _cell(near.end),
        "gap": float(near.gap) * cell_side,
        "length": float(near.cost) * cell_side,
        "num_cells": int(near.num_cells),
    }


def octile_length(cell: Sequence[int], goal: Sequence[int]) -> float:
    """Returns the octile distance of two cells, in cell sides, on the host."""
    long, short = sorted((abs(cell[0] - goal[0]), abs(cell[1] - goal[1])), reverse=True)
    return long - short + short * 2**0.5


def _destroyed_data(task: Task, solution: Solution) -> list[dict[str, Any]]:
    cells, costs = np.asarray(solution.cells), np.asarray(task.removal_cost)
    ids, at = np.asarray(solution.destroyed).tolist(), np.asarray(solution.destroyed_at).tolist()
    return [
        {"id": i, "from": _cell(cells[index]), "index": index, "removal_cost": float(costs[i])}
        for i, index in zip(ids, at)
        if i >= 0
    ]


def _step(
    step: PlannedStep, solution: Solution, view: places.View, cell_side: float
) -> dict[str, Any]:
    cells = np.asarray(solution.cells)[step.begin : step.end + 1]
    data = {
        "act": step.act.name,
        "obstacle": step.obstacle if step.obstacle >= 0 else None,
        "from": _cell(cells[0]),
        "to": _cell(cells[-1]),
        "cells": [step.begin, step.end],
    }
    return (
        data
        if step.act is Act.DESTROY
        else data | {"relocation": places.relocation(view, cells, cell_side)["name"]}
    )


def _what_if(task: Task, solution: Solution) -> dict[str, Any]:
    destroyed = [i for i in np.asarray(solution.destroyed).tolist() if i >= 0]
    outcomes = [
        (obstacle, if_flag(task, solution, obstacle, is_destroyable=False))
        for obstacle in destroyed
    ]
    others = {
        frozenset(outcome.destroyed): outcome for _, outcome in outcomes if outcome.status.is_solved
    }
    others.pop(frozenset(destroyed), None)
    chosen = exact_cost(task, destroyed)
    return {
        "if_firm": [{"id": obstacle, **outcome.as_data()} for obstacle, outcome in outcomes],
        "alternatives": [
            {**outcome.as_data(), "is_as_cheap": exact_cost(task, outcome.destroyed) == chosen}
            for outcome in sorted(others.values(), key=lambda other: other.removal_cost)
        ],
    }


def _apart(task: Task, cell_side: float) -> dict[str, Any]:
    down, right = (np.asarray(task.goal, int) - np.asarray(task.start, int)).tolist()
    octant = round(np.arctan2(-down, right) / (np.pi / 4)) % 8
    return {
        "distance": float(np.hypot(down, right)) * cell_side,
        "direction": _COMPASS[octant] if down or right else None,
    }


_COMPASS = (
    "east",
    "north-east",
    "north",
    "north-west",
    "west",
    "south-west",
    "south",
    "south-east",
)


def _view_data(seen: places.Seen) -> dict[str, Any]:
    return {
        "seen_as": list(seen.seen_as),
        "away": seen.nearest[0],
        "turn": seen.nearest[1],
        "spans": list(seen.spans),
        "sector": [list(pair) for pair in seen.sector],
        "square": [list(seen.square[0]), seen.square[1]],
    }


def _cell(cell: Array) -> list[int]:
    return np.asarray(cell).tolist()
