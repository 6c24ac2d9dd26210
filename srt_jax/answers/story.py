"""The plan carried out, as a tree one can read: symbolic steps, and the cells under each (PY16
§3.1, plan specification).
"""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from sign_model.foundation.legible import counted
from srt_jax.answers.facts import NORTH, explanation
from srt_jax.engine.entrance import require_one_answer
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.symbols import places
from srt_jax.symbols.scene_of_task import (
    SPECIFY,
    PlannedStep,
    obstacle_name,
    plan_lines,
    planned_steps,
    reached,
    scene_of,
    scene_signs,
    scene_texts,
)
from srt_jax.types import Act, Solution, Status, Task


def story(
    task: Task,
    solution: Solution,
    *,
    heading: float = NORTH,
    cell_side: float | None = None,
    rule: Any = None,
) -> str:
    """Returns what was planned and done for one task, as an indented tree; one line that says why
    where there is no route.

    At the top stands the abstract act, to reach the goal area. A metacognitive rule, itself a sign,
    decides whether it is realised as it is, by path planning, or specified; then its sub-plan
    stands below it, each step with its relocation sign and the cells of the route.

    Args:
      heading, cell_side: as in `explanation`; lengths are in metres where cell_side is given.
      rule: signs that decide; by default
        `sign_model.map_algorithm.plan_specification.metacognition()`.

    Raises:
      ValueError: a batch instead of one task.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> print(srt_jax.story(task, solution).splitlines()[0])
      reach the goal area at (2, 6) (specified: 3 steps)
    """
    require_one_answer("story", task, solution)
    status, steps = Status(int(solution.status)), planned_steps(solution)
    goal = f"reach the goal area at {_cell(task.goal)}"
    if not status.is_solved:
        return f"{goal}: no plan ({status.meaning})"
    if not steps:
        return f"{goal}: nothing to do"
    (reach,) = reached(scene_of(task, solution), plan_lines(solution), rule=rule)
    side = 1.0 if cell_side is None else cell_side
    view = places.view_from(task.start, heading=heading, cell_side=side, table=places.DEFAULT_TABLE)
    cells = np.asarray(solution.cells)
    if reach.decision != SPECIFY or reach.steps is None:
        whole = PlannedStep(Act.RELOCATE, -1, 0, int(solution.num_cells) - 1)
        return (
            f"{goal} (realised: path planning alone)\n  {_stretch(whole, cells, view, cell_side)}"
        )
    lines = [f"{goal} (specified: {counted(len(steps), 'step')})"]
    for step in steps:
        lines += [f"  {line}" for line in _step(step, cells, view, cell_side)]
    return "\n".join(lines)


def scene_pddl(task: Task, solution: Solution) -> tuple[str, str, list[str]]:
    """Returns one task on the symbolic level, as any PDDL planner reads it: domain, problem, and
    the plan carried out.

    The plan's lines are the actions of a plan file, `(approach i obstacle-7 area-0)`; none where
    there is no route. The problem of an unsolvable task holds the indestructible obstacles
    that separate and has no plan.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> domain, problem, plan = srt_jax.scene_pddl(task, solution)
      >>> plan[0]
      '(approach i obstacle-0 area-0)'
    """
    require_one_answer("scene_pddl", task, solution)
    return *scene_texts(scene_of(task, solution)), plan_lines(solution)


def scene_problem(task: Task, solution: Solution) -> Any:
    """Returns one task on the symbolic level as a problem of unified-planning, for its engines,
    compilers and validators.

    It is the problem of `scene_pddl`, whose plan solves it too; that of an unsolvable task has no
    plan.

    Raises:
      ImportError: unified-planning is missing. ValueError: a batch was given.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> problem = srt_jax.scene_problem(task, srt_jax.solve(task))
      >>> sorted(action.name for action in problem.actions)
      ['approach', 'destroy', 'pass', 'relocate']
    """
    what = "a problem of unified-planning"
    readers = require_module("unified_planning.io", extra="up", what=what)
    domain, problem, _ = scene_pddl(task, solution)
    return readers.PDDLReader().parse_problem_string(domain, problem)


def _step(
    step: PlannedStep, cells: np.ndarray, view: places.View, cell_side: float | None
) -> Iterator[str]:
    about = f" obstacle {step.obstacle}" if step.obstacle >= 0 else ""
    if step.act is Act.DESTROY:
        yield f"destroy{about} from {_cell(cells[step.end])}"
        return
    yield f"{step.act.name.lower()}{about}"
    yield f"  {_stretch(step, cells, view, cell_side)}"


def scene_model(
    task: Task, solution: Solution, *, heading: float = NORTH, cell_side: float | None = None
) -> Any:
    """Returns one task as the agent's world model of signs, which `sign_model` describes and draws.

    Its signs are those of the problem of `scene_pddl`; of the sign `i` and what it can destroy; and
    of where the goal and the obstacles are seen, down to degrees and metres.

    Args:
      heading, cell_side: as in `explanation`.

    Raises:
      ValueError: a batch instead of one task.

    Examples:
      >>> import numpy as np
      >>> import sign_model
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> model = srt_jax.scene_model(task, srt_jax.solve(task), heading=0)
      >>> print(sign_model.describe(model, names="obstacle-0").splitlines()[4])
          1. {ahead, close}
    """
    require_one_answer("scene_model", task, solution)
    scene = scene_of(task, solution)
    known = explanation(task, solution, heading=heading, cell_side=cell_side)
    seen = {scene.goal: known["goal"]["seen_as"]}
    for obstacle in (known["blockage"] or {"obstacles": []})["obstacles"]:
        seen[obstacle_name(obstacle["id"])] = obstacle["seen_as"]
    shown = {name: tuple(seen[name]) for name in (*scene.areas, *scene.obstacles) if name in seen}
    return scene_signs(dataclasses.replace(scene, seen_as=shown), table=places.DEFAULT_TABLE)


def _stretch(
    step: PlannedStep, cells: np.ndarray, view: places.View, cell_side: float | None
) -> str:
    """Returns a stretch of route in words: its ends, its length, and the relocation it is an
    instance of.
    """
    part = cells[step.begin : step.end + 1]
    if len(part) == 1:
        return f"stay at {_cell(part[0])}"
    moved = places.relocation(view, part, 1.0 if cell_side is None else cell_side)
    metres = "" if cell_side is None else " m"
    name = moved["name"] or f"moving {moved['link']:.0f}{metres} away"
    where = f"{_cell(part[0])} to {_cell(part[-1])}, cells {step.begin} to {step.end}"
    return f"{name}: {where}, {moved['deviation']:.1f}{metres} off the straight link"


def _cell(cell: Any) -> str:
    row, col = np.asarray(cell).tolist()
    return f"({row}, {col})"
