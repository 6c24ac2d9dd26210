"""Delete-relaxation heuristics of many states at once: h_max, h_add and FF as fixpoints over the
task's matrices.
"""

from collections.abc import Callable

import numpy as np

from sign_model.clock import NO_LIMIT, Clock
from sign_model.forward_search.relaxed_costs import RelaxedCosts
from sign_model.pddl.planning_task import PlanningTask

StateHeuristic = Callable[[np.ndarray], np.ndarray]
"""States bool [N, F] -> float32 (float64 where costs are large) [N], inf for a state from which
the goal cannot be reached.
"""

_STATES_AT_ONCE = 64
"""How many states are rated together: bounds the memory."""


def make_heuristic(name: str, task: PlanningTask, clock: Clock = NO_LIMIT) -> StateHeuristic:
    """Returns the heuristic called `name` (blind, goals, hmax, hadd, ff) for one task; ValueError
    for any other.

    blind and hmax never overestimate the cost of a plan; goals counts unmet goals; ff is the cost
    of the relaxed plan of h_add.
    """
    if name == "blind":
        return lambda states: np.zeros(len(states), np.float32)
    if name == "goals":
        return lambda states: (task.goal & ~states).sum(axis=1).astype(np.float32)
    if name not in ("hmax", "hadd", "ff"):
        raise ValueError(
            f"heuristic '{name}' is not known to a forward search: choose blind, goals, hmax, hadd"
            " or ff"
        )
    return _Relaxation(task, name, clock)


class _Relaxation:
    def __init__(self, task: PlanningTask, name: str, clock: Clock) -> None:
        self.task, self.name = task, name
        self.goal = np.flatnonzero(task.goal)
        self.relaxed = RelaxedCosts(
            task.conditions, task.adds, task.costs, is_sum=name != "hmax", clock=clock
        )
        # Whole numbers up to 2^24 are exact in float32; where a sum of costs may be greater,
        # float64 keeps hmax admissible.
        is_small = int(task.costs.sum()) < 1 << 24
        self.dtype: type[np.floating] = np.float32 if is_small else np.float64

    def __call__(self, states: np.ndarray) -> np.ndarray:
        parts = [
            self._rated(states[i : i + _STATES_AT_ONCE])
            for i in range(0, len(states), _STATES_AT_ONCE)
        ]
        return np.concatenate([np.zeros(0, self.dtype), *parts])

    def _rated(self, states: np.ndarray) -> np.ndarray:
        cost = self.relaxed.from_states(states)
        goal = cost[self.goal]
        can_reach = np.all(goal < self.relaxed.far, axis=0)
        is_exact = self.relaxed.is_exact(cost)
        rating = np.full(len(states), np.inf if is_exact else float(1 << 40), self.dtype)
        if self.name == "hmax":
            rating[can_reach] = goal[:, can_reach].max(axis=0, initial=0)
        elif self.name == "hadd":
            rating[can_reach] = goal[:, can_reach].sum(axis=0, dtype=np.float64)
        else:
            plans = self.relaxed.relaxed_plans(states[can_reach], cost[:, can_reach], self.goal)
            rating[can_reach] = np.bincount(
                plans.owner, weights=self.task.costs[plans.action], minlength=int(can_reach.sum())
            )
        return rating
