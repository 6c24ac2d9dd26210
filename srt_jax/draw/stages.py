"""What happens on the way, stage after stage: explore, blocked or not, walk up, destroy, continue
(PY16 §3.2).

The route of a solution is shown as the loop would run: at each stop the agent explores again,
from its place and with what is destroyed gone. Which obstacle it destroys then is the
solution's choice.
"""

from typing import NamedTuple

import numpy as np

from srt_jax.draw.parts.content import (
    Cell,
    Removal,
    cell_kinds,
    free_without,
    legs_of,
    removals_in,
    require_single,
)
from srt_jax.paths.contour import contour
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.paths.seed import seed_cell
from srt_jax.types import Solution, Task


class Stage(NamedTuple):
    """kinds: uint8 [H, W] of `Kind`, all reached cells marked, nothing destroyed now. place: where
    the agent is.

    length: float32 [H, W], how far each cell lies from there, inf where not reached. sees_goal:
      whether the goal is reached.
    seed, contour: what blocks, None and all False where nothing does. leg: int [n, 2], where the
      agent walks, None: nowhere.
    removals: what it destroys at the end of the leg.
    """

    kinds: np.ndarray
    place: Cell
    length: np.ndarray
    sees_goal: bool
    seed: Cell | None
    contour: np.ndarray
    leg: np.ndarray | None
    removals: list[Removal]


def stages_of(task: Task, solution: Solution) -> list[Stage]:
    """Returns the stages of one task's solution; a single one, without leg, where there is no
    route.
    """
    require_single(task, solution)
    removals, legs = removals_in(task, solution), legs_of(solution)
    cells = np.asarray(solution.cells)
    goal = np.asarray(task.goal)
    gone = np.zeros(len(task.destroyable), bool)
    stops = sorted({removal.at for removal in removals})
    ends = [*stops, None] if legs or stops else [None]
    stages, begin = [], 0
    for end in ends:
        place = (
            (int(cells[begin][0]), int(cells[begin][1]))
            if legs
            else tuple(np.asarray(task.start).tolist())
        )
        now = [removal for removal in removals if removal.at == end]
        last = int(solution.num_cells) - 1 if end is None else end
        leg = cells[begin : last + 1] if legs and last > begin else None
        stages.append(_stage(task, gone, place, goal, leg, now))
        gone = gone | np.isin(np.arange(len(gone)), [removal.obstacle for removal in now])
        begin = last
    return stages


def _stage(
    task: Task, gone: np.ndarray, place: Cell, goal: np.ndarray, leg, removals: list[Removal]
) -> Stage:
    free, here = free_without(task, gone), np.array(place, np.int32)
    length = np.asarray(cost_to_come(free, here))
    reached = np.isfinite(length)
    sees_goal = bool(reached[tuple(goal)])
    seed, around = None, np.zeros_like(free)
    if not sees_goal and reached.any():
        found = np.asarray(seed_cell(reached, goal))
        seed, around = (int(found[0]), int(found[1])), np.asarray(contour(free, found, goal))
    return Stage(
        cell_kinds(task, gone, place), place, length, sees_goal, seed, around, leg, removals
    )
