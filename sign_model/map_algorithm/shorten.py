"""Shortens a valid plan without a new search: removes detours and unnecessary actions.

The plan is followed in both directions: forwards, the state before each step; backwards, the
situation that the rest of the plan needs. If an earlier state already includes a later situation,
all steps between them are a detour.
"""

import numpy as np

from sign_model.bits import pack
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


def needs_along(task: PlanningTask, plan: list[int]) -> np.ndarray:
    """Returns bool [n + 1, F]: what must hold before each step for the rest of the plan to reach
    the goal.
    """
    needs = [task.goal]
    for action in reversed(plan):
        needs.append((needs[-1] & ~task.adds[action]) | task.conditions[action])
    return np.array(needs[::-1])


def drop_detours(task: PlanningTask, plan: list[int]) -> list[int]:
    """Returns the plan without the steps between a state and the latest step whose needs that state
    already meets.
    """
    # Which needs each state meets, [needs, states].
    needs, lacking = pack(needs_along(task, plan)), ~pack(states_along(task, plan))
    meets = np.array([~(needs & missing).any(axis=1) for missing in lacking]).T

    # Jump from each state to the latest step that it can continue with.
    kept, at = [], 0
    while at < len(plan):
        later = np.flatnonzero(meets[:, at])[-1]
        if later > at:
            at = int(later)
        else:
            kept.append(plan[at])
            at += 1
    return kept


def _drop_unnecessary(task: PlanningTask, plan: list[int]) -> list[int]:
    """Returns the plan without unnecessary actions: each action is removed in turn, with all
    actions that then cannot be executed; what still reaches the goal replaces the plan.
    """
    for skipped in range(len(plan)):
        state, kept = task.start, []
        for i, action in enumerate(plan):
            if i != skipped and not (task.conditions[action] & ~state).any():
                state = (state & ~task.deletes[action]) | task.adds[action]
                kept.append(action)
        if not (task.goal & ~state).any():
            return _drop_unnecessary(task, kept)
    return plan
