"""Shortens a valid plan without a new search: removes detours and unnecessary actions.

The plan is followed in both directions: forwards, the state before each step; backwards, the
situation that the rest of the plan needs. If an earlier state already includes a later situation,
all steps between them are a detour.
"""

import numpy as np

from sign_model.bits import as_number, pack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.planning_task import PlanningTask

_MAX_TRIED = 200
"""Longer plans are not tested for single unnecessary actions: that takes time quadratic in the
length.
"""


def shorten(task: PlanningTask, plan: list[int], clock: Clock = NO_LIMIT) -> list[int]:
    """Returns a plan at most as long as `plan`, and valid if that was: without detours, the longest
    removed first, then without unnecessary actions.

    Args:
      task: that the plan solves.
      plan: action numbers in the order of execution.
      clock: once its limit has passed, the plan stays as it is then.
    """
    # Ends: every round but the last shortens the plan.
    while not clock.is_over():
        shorter = drop_detours(task, plan)
        if len(shorter) <= _MAX_TRIED and not clock.is_over():
            shorter = _drop_unnecessary(task, shorter)
        if len(shorter) == len(plan):
            return shorter
        plan = shorter
    return plan


def states_along(task: PlanningTask, plan: list[int]) -> np.ndarray:
    """Returns bool [n + 1, F]: the state before each step, and the last state."""
    states = [task.start]
    for action in plan:
        states.append((states[-1] & ~task.deletes[action]) | task.adds[action])
    return np.array(states)


def drop_detours(task: PlanningTask, plan: list[int]) -> list[int]:
    """Returns the plan without the steps between a state and the latest step whose needs that state
    already meets.
    """
    # The state before each step, and what must hold there for the rest of the plan to reach the
    # goal, as whole numbers: the places after the last step are among them.
    steps, start, goal = _numbered(task, plan)
    states, needs = [start], [goal]
    for _, adds, deletes in steps:
        states.append((states[-1] & ~deletes) | adds)
    for conditions, adds, _ in reversed(steps):
        needs.append((needs[-1] & ~adds) | conditions)
    needs.reverse()

    # Jump from each state to the latest step that it can continue with.
    kept, at = [], 0
    while at < len(plan):
        state, later = states[at], len(plan)
        while later > at and needs[later] & ~state:
            later -= 1
        if later > at:
            at = later
        else:
            kept.append(plan[at])
            at += 1
    return kept


def _drop_unnecessary(task: PlanningTask, plan: list[int]) -> list[int]:
    """Returns the plan without unnecessary actions: each action is removed in turn, with all
    actions that then cannot be executed; what still reaches the goal replaces the plan.
    """
    steps, start, goal = _numbered(task, plan)
    for skipped in range(len(plan)):
        state, kept = start, []
        for i, (conditions, adds, deletes) in enumerate(steps):
            if i != skipped and not conditions & ~state:
                state = (state & ~deletes) | adds
                kept.append(plan[i])
        if not goal & ~state:
            return _drop_unnecessary(task, kept)
    return plan


def _numbered(task: PlanningTask, plan: list[int]) -> tuple[list[tuple[int, int, int]], int, int]:
    """Returns conditions, adds and deletes of each step, and start and goal, as whole numbers."""
    parts = (
        [as_number(row) for row in pack(matrix[plan])]
        for matrix in (task.conditions, task.adds, task.deletes)
    )
    return list(zip(*parts)), as_number(pack(task.start)), as_number(pack(task.goal))
