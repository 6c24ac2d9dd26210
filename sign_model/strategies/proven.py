"""A plan that is proven to be the cheapest without a search for the proof: MAP finds it, and what
every plan costs at least is as much.
"""

import time

from sign_model.clock import NO_LIMIT, Clock
from sign_model.forward_search.relaxation import make_heuristic
from sign_model.map_algorithm.heuristics import DEFAULTS
from sign_model.map_algorithm.least_length import least_cost
from sign_model.map_algorithm.map_planner import BEAMS, Regression, Rungs
from sign_model.map_algorithm.mutex import MAX_PAIR_WORDS
from sign_model.map_algorithm.shorten import shorten
from sign_model.pddl.planning_task import PlanningTask


def proven_cheapest(
    task: PlanningTask, *, max_expansions: int, clock: Clock = NO_LIMIT
) -> Regression:
    """Returns a plan that is proven to be the cheapest, a proof that there is none, or neither
    where that is not found at once.

    Args:
      task: to be solved.
      max_expansions: the most situations expanded; half of them are spent at most.
      clock: asked in every phase; OutOfTime once its limit has passed. Half of what is left of it
        is spent at most.
    """
    if sum(task.conditions.shape) * task.num_features // 64 > MAX_PAIR_WORDS:
        return Regression(None, 0, False)  # what never holds together is hardly known
    share = NO_LIMIT if clock.end is None else Clock(max(0, clock.end - time.perf_counter()) / 2)
    rungs = Rungs(task, DEFAULTS, share)
    if rungs.is_excluded:
        return Regression(None, 0, True)
    costs = task.costs[rungs.space.kept_actions]
    bound = least_cost(rungs.space, rungs.start, rungs.goal, costs, share)
    if not bound or bound < make_heuristic("hmax", task, share)(task.start[None])[0]:
        return Regression(None, 0, False)

    # Wider and wider beams, until a plan costs no more than that.
    left, spent = max_expansions // 2, 0
    for beam in BEAMS[:-1]:
        found = rungs.tried(beam, left - spent)
        spent += found.expansions
        if found.is_proof:
            return Regression(None, spent, True)
        if found.plan is not None:
            plan = shorten(task, found.plan, share)
            if int(task.costs[plan].sum()) == bound:
                return Regression(plan, spent, False, True)
        if spent >= left or share.is_over():
            break
    return Regression(None, spent, False)
