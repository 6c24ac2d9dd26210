"""The A-step rule of the paper's authors, plain and slow, kept to reproduce what they published.

Candidates are rated by how many features the situation before them shares with the start; all that
share the most are kept, and tried depth-first in the order of the actions. There is no memory of
situations seen but those on the way itself. Unlike their program, deletes are respected, situations
that mutexes exclude are no candidates, and the search stops when the situation is included in the
start, not the other way round.
"""

import time
from collections.abc import Iterator

from sign_model.map_algorithm.regression import regression_space
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.result import PlanResult, PlanStatus

Situation = frozenset[int]


def plan_by_authors_rule(task: PlanningTask, *, max_iterations: int = 100_000) -> PlanResult:
    """Returns the first plan that the rule finds; BUDGET_SPENT without one: the rule cuts, hence it
    proves nothing.

    Args:
      task: to be solved. Their program wanted complete goals; this one takes partial ones as well.
      max_iterations: the most situations expanded.
    """
    began = time.perf_counter()
    space = regression_space(task)
    start, goal = _members(space.situations(task.start)), _members(space.situations(task.goal))
    scripts = [tuple(map(_members, rows)) for rows in zip(space.conditions, space.adds, space.bad)]
    way, actions, iterations = [goal], [], 0
    branches = [_best(way, start, scripts)]
    while branches and not way[-1] <= start:
        if iterations >= max_iterations:
            return PlanResult(
                PlanStatus.BUDGET_SPENT, (), iterations, {"search": time.perf_counter() - began}
            )
        action, before = next(branches[-1], (-1, goal))
        if action < 0:
            branches.pop()
            way.pop()
            actions = actions[:-1]
        else:
            iterations += 1
            way.append(before)
            actions.append(action)
            branches.append(_best(way, start, scripts))
    seconds = {"search": time.perf_counter() - began}
    if not branches:
        return PlanResult(PlanStatus.BUDGET_SPENT, (), iterations, seconds)
    names = tuple(task.action_names[space.kept_actions[action]] for action in reversed(actions))
    if wrong := validate(task, names):
        raise AssertionError(f"the rule made an invalid plan: {wrong[0]}")
    return PlanResult(PlanStatus.SOLVED, names, iterations, seconds)


def _members(row) -> Situation:
    return frozenset(row.nonzero()[0].tolist())


def _best(
    way: list[Situation], start: Situation, scripts: list[tuple[Situation, ...]]
) -> Iterator[tuple[int, Situation]]:
    """The candidates (action, situation before it) that share the most features with the start,
    in the order of the actions.
    """
    situation = way[-1]
    fitting = (
        (action, (situation - adds) | conditions)
        for action, (conditions, adds, bad) in enumerate(scripts)
        if adds & situation and not bad & situation
    )
    found = [(action, before) for action, before in fitting if before not in way]
    most = max((len(before & start) for _, before in found), default=0)
    return iter([(action, before) for action, before in found if len(before & start) == most])
