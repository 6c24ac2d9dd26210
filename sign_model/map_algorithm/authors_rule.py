"""The A-step rule of the paper's authors, plain and slow, to reproduce their published results.

Candidates are rated by the number of features that the situation before them shares with the start;
all candidates with the greatest number are kept, and tried depth-first in the order of the actions.
Only the situations on the current path are remembered. Unlike their program, this one respects
deletes, excludes situations that mutexes forbid, and stops when the situation is included in the
start, not the other way round.
"""

import time
from collections.abc import Iterator

import numpy as np

from sign_model.map_algorithm.regression import regression_space
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.result import PlanResult, PlanStatus

Situation = frozenset[int]


def plan_by_authors_rule(task: PlanningTask, *, max_iterations: int = 100_000) -> PlanResult:
    """Returns the first plan that the rule finds; BUDGET_SPENT without a plan, because the rule
    discards candidates and so proves nothing.

    Args:
      task: to be solved. Their program required complete goals; this one accepts partial goals too.
      max_iterations: the most situations expanded.
    """
    # Situations and actions as sets of features.
    began = time.perf_counter()
    space = regression_space(task)
    start, goal = _members(space.situations(task.start)), _members(space.situations(task.goal))
    scripts = [tuple(map(_members, rows)) for rows in zip(space.conditions, space.adds, space.bad)]

    # Depth-first search: the situations of the current path, the actions between them, and for each
    # situation the candidates not tried yet. Ends: no situation repeats on a path, and the number
    # of iterations is bounded.
    path, actions, iterations = [goal], [], 0
    branches = [_best(path, start, scripts)]
    while branches and not path[-1] <= start:
        if iterations >= max_iterations:
            return PlanResult(
                PlanStatus.BUDGET_SPENT, (), iterations, {"search": time.perf_counter() - began}
            )
        action, before = next(branches[-1], (-1, goal))
        if action < 0:
            branches.pop()
            path.pop()
            actions = actions[:-1]
        else:
            iterations += 1
            path.append(before)
            actions.append(action)
            branches.append(_best(path, start, scripts))

    # The action chosen last is executed first.
    seconds = {"search": time.perf_counter() - began}
    if not branches:
        return PlanResult(PlanStatus.BUDGET_SPENT, (), iterations, seconds)
    names = tuple(task.action_names[space.kept_actions[action]] for action in reversed(actions))
    if wrong := validate(task, names):
        raise AssertionError(f"the rule made an invalid plan: {wrong[0]}")
    return PlanResult(PlanStatus.SOLVED, names, iterations, seconds)


def _members(row: np.ndarray) -> Situation:
    """Returns the numbers of the features in a row, bool [F]."""
    return frozenset(row.nonzero()[0].tolist())


def _best(
    path: list[Situation], start: Situation, scripts: list[tuple[Situation, ...]]
) -> Iterator[tuple[int, Situation]]:
    """Returns the candidates (action, situation before it) that share the most features with the
    start, in the order of the actions.

    Args:
      path: the situations from the goal to the current one.
      start: of the task.
      scripts: (conditions, adds, bad) of each action.
    """
    situation = path[-1]
    matching = (
        (action, (situation - adds) | conditions)
        for action, (conditions, adds, bad) in enumerate(scripts)
        if adds & situation and not bad & situation
    )
    found = [(action, before) for action, before in matching if before not in path]
    most = max((len(before & start) for _, before in found), default=0)
    return iter([(action, before) for action, before in found if len(before & start) == most])
