"""A plan that is proven to be the cheapest without a search for the proof: MAP finds it, and what
every plan costs at least is as much.
"""

import time
from dataclasses import replace

from sign_model.clock import NO_LIMIT, Clock
from sign_model.forward_search.relaxation import make_heuristic
from sign_model.map_algorithm.heuristics import DEFAULTS
from sign_model.map_algorithm.least_length import least_cost
from sign_model.map_algorithm.map_planner import Regression
from sign_model.map_algorithm.mutex import MAX_PAIR_WORDS
from sign_model.map_algorithm.regression import regression_space
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.rule import PlanningRule
from sign_model.strategies.turns import plan_by_rule

_RULE = PlanningRule("at once", {"backwards": 8000}, growth=2)
_MOST_EXPANSIONS = 20_000
_SHARE = 8
"""Of how many expansions one is spent here, at most."""


def proven_cheapest(
    task: PlanningTask, *, max_expansions: int, clock: Clock = NO_LIMIT
) -> Regression | None:
    """Returns a plan that is proven to be the cheapest, or a proof that there is none; None where
    that is not found at once.

    Args:
      task: to be solved.
      max_expansions: the most situations expanded; a part of them is spent.
      clock: asked in every phase; OutOfTime once its limit has passed.
    """
    if sum(task.conditions.shape) * task.num_features // 64 > MAX_PAIR_WORDS:
        return None  # what never holds together is hardly known
    space = regression_space(task, clock=clock)
    start, goal = space.situations(task.start), space.situations(task.goal)
    if not space.is_consistent(goal[None])[0]:
        return Regression(None, 0, True)
    bound = least_cost(space, start, goal, task.costs[space.kept_actions], clock)
    if not bound or bound < make_heuristic("hmax", task, clock)(task.start[None])[0]:
        return None
    share = NO_LIMIT if clock.end is None else Clock(max(0, clock.end - time.perf_counter()) / 2)
    most = max(1, min(_MOST_EXPANSIONS, max_expansions // _SHARE))
    found = plan_by_rule(task, DEFAULTS, _RULE, max_expansions=most, clock=share)
    if found.plan is not None and int(task.costs[found.plan].sum()) == bound:
        return replace(found, is_shortest=True)
    return found if found.is_proof else None
