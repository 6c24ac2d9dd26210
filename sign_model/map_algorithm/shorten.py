"""Shortens a valid plan without a new search from scratch: drops detours and needless actions.

The plan is seen twice: forward, as the state before each step, and backward, as the situation that
the rest of it needs. Where an earlier state already includes a later need, all between is a detour.
"""

import numpy as np

from sign_model.bits import pack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.planning_task import PlanningTask

_MAX_TRIED = 200
"""Longer plans are not tried without each of their actions: that takes time with the square of the
length.
"""


def shorten(task: PlanningTask, plan: list[int], clock: Clock = NO_LIMIT) -> list[int]:
    """Returns a plan no longer than `plan`, valid if it was: detours dropped, the longest first,
    then needless actions.

    Args:
      plan: action numbers in the order of execution.
      clock: once its limit has passed, the plan stays as it is then.
    """
    while not clock.is_over():
        shorter = drop_detours(task, plan)
        if len(shorter) <= _MAX_TRIED and not clock.is_over():
            shorter = _drop_useless(task, shorter)
        if len(shorter) == len(plan):
            return shorter
        plan = shorter
    return plan


def states_along(task: PlanningTask, plan: list[int]) -> np.ndarray:
    """Returns bool [n + 1, F]: the state before each step, and the last one."""
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
    """Returns the plan without the steps between a state and the latest step whose needs it meets
    already.
    """
    states, needs = states_along(task, plan), needs_along(task, plan)
    needed, lacking = pack(needs), ~pack(states)
    meets = np.array([~(needed & missing).any(axis=1) for missing in lacking]).T  # [need, state]
    kept, at = [], 0
    while at < len(plan):
        later = np.flatnonzero(meets[:, at])[-1]
        if later > at:
            at = int(later)  # the state here already meets what a later step needs
        else:
            kept.append(plan[at])
            at += 1
    return kept


def _drop_useless(task: PlanningTask, plan: list[int]) -> list[int]:
    """Drops, for each action in turn, it and all that then cannot go, where the goal is reached all
    the same.
    """
    for skipped in range(len(plan)):
        state, kept = task.start, []
        for i, action in enumerate(plan):
            if i != skipped and not (task.conditions[action] & ~state).any():
                state = (state & ~task.deletes[action]) | task.adds[action]
                kept.append(action)
        if not (task.goal & ~state).any():
            return _drop_useless(task, kept)
    return plan
