"""A solved task as a scene of the relocation domain, which any planner can check, and its plan in
the words of that domain.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sign_model.map_algorithm.plan_specification import SPECIFY, Step
from sign_model.relocation.domain import AGENT, DOMAIN, Scene, problem_text, scene_signs
from sign_model.relocation.scenes import chain_scene, contour_scene, reached
from sign_model.relocation.working_memory import BREAKABLE, area
from srt_jax.types import Act, Array, Solution, Status, Task

__all__ = [
    "SPECIFY",
    "Scene",
    "Step",
    "obstacle_name",
    "plan_lines",
    "planned_steps",
    "reached",
    "scene_of",
    "scene_signs",
    "scene_texts",
]


class PlannedStep(NamedTuple):
    """One step of a solution's plan: what, about which obstacle (-1: none), between which indexes
    into the route's cells.
    """

    act: Act
    obstacle: int
    begin: int
    end: int


def planned_steps(solution: Solution) -> list[PlannedStep]:
    """Returns the steps of one solution's plan, in order."""
    steps, begin = [], 0
    for (act, obstacle), end in zip(
        np.asarray(solution.plan).tolist(), np.asarray(solution.plan_at).tolist()
    ):
        if act < 0:
            break
        steps.append(PlannedStep(Act(act), obstacle, begin, end))
        begin = end
    return steps


def scene_of(
    task: Task, solution: Solution, *, seen_as: Mapping[str, Sequence[str]] | None = None
) -> Scene:
    """Returns what one task comes down to on the symbolic level, obstacle 7 called `obstacle-7`.

    - Solved: a chain of areas with what was destroyed between each two.
    - Solved by the paper's loop, which meets obstacles one by one: two areas with everything that
      was destroyed between them.
    - Unsolvable: two areas, and between them the indestructible obstacles that separate.
    - Else what is known: the obstacles on the first contour.
    """
    status, steps = Status(int(solution.status)), planned_steps(solution)
    if status.is_solved:
        destroyed = [obstacle_name(step.obstacle) for step in steps if step.act is Act.DESTROY]
        if not steps:  # start and goal are one cell
            return Scene(area(0), area(0), seen_as=seen_as or {})
        if _is_chain(steps):
            return chain_scene(destroyed, seen_as=seen_as)
        return contour_scene(destroyed, seen_as=seen_as)
    if status in (Status.UNSOLVABLE, Status.GOAL_BLOCKED):
        return contour_scene([], _names(solution.separating), seen_as=seen_as)
    ids = [i for i in np.asarray(solution.blocking).tolist() if i >= 0]
    flags = np.asarray(task.destroyable)
    return contour_scene(
        [obstacle_name(i) for i in ids if flags[i]],
        [obstacle_name(i) for i in ids if not flags[i]],
        seen_as=seen_as,
    )


def scene_texts(scene: Scene, name: str = "scene") -> tuple[str, str]:
    """Returns domain and problem in PDDL."""
    return DOMAIN, problem_text(scene, name)


def plan_lines(solution: Solution) -> list[str]:
    """Returns one solution's plan as actions of its scene: `(approach i obstacle-7 area-0)`."""
    steps = planned_steps(solution)
    return list(_lines(steps, _is_chain(steps)))


def _lines(steps: list[PlannedStep], is_chain: bool) -> Iterator[str]:
    here = 0
    for step in steps:
        name = obstacle_name(step.obstacle)
        if step.act is Act.APPROACH:
            yield f"(approach {AGENT} {name} {area(here)})"
        elif step.act is Act.DESTROY:
            yield f"(destroy {AGENT} {name} {area(here)} {BREAKABLE})"
        elif step.act is Act.PASS:
            yield f"(pass {AGENT} {area(here)} {area(here + 1)} {name})"
            here += is_chain
        else:
            yield f"(relocate {AGENT} {area(0)} {area(1)})"


def _is_chain(steps: list[PlannedStep]) -> bool:
    """Whether each obstacle is passed before the next one is approached."""
    acts = [step.act for step in steps]
    return acts.count(Act.DESTROY) == acts.count(Act.PASS)


def _names(ids: Array) -> list[str]:
    return [obstacle_name(i) for i in np.asarray(ids).tolist() if i >= 0]


def obstacle_name(obstacle: int) -> str:
    """Returns what an obstacle is called in a scene."""
    return f"obstacle-{obstacle}"
