"""Delete-relaxation heuristics of many states at once: h_max, h_add and FF as fixpoints over the
task's matrices.
"""

from collections.abc import Callable

import numpy as np

from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.planning_task import PlanningTask

StateHeuristic = Callable[[np.ndarray], np.ndarray]
"""States bool [N, F] -> float32 (float64 where costs are large) [N], inf for a state from which
the goal cannot be reached.
"""

_CHECKED_EVERY = 1 << 12
_NEEDS_AT_ONCE = 1 << 24
"""How many conditions, of all actions in all states, are looked up at once: bounds the memory."""


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
        self.task, self.name, self.clock = task, name, clock
        self.goal = np.flatnonzero(task.goal)
        # Whole numbers up to 2^24 are exact in float32; where a sum of costs may be greater,
        # float64 keeps hmax admissible.
        is_small = int(task.costs.sum()) < 1 << 24
        self.dtype: type[np.floating] = np.float32 if is_small else np.float64
        self.costs = task.costs.astype(self.dtype)
        most = max(1, int(task.conditions.sum(axis=1).max(initial=0)))
        # the extra feature is free
        self.needs = np.full((task.num_actions, most), task.num_features)
        for action, row in enumerate(task.conditions):
            if not action % _CHECKED_EVERY:
                clock.check()
            held = np.flatnonzero(row)
            self.needs[action, : len(held)] = held
        self.feature_of, self.achievers = np.nonzero(task.adds.T)
        self.first = np.flatnonzero(np.diff(self.feature_of, prepend=-1))

    def __call__(self, states: np.ndarray) -> np.ndarray:
        if not len(states):
            return np.zeros(0, self.dtype)
        most = max(1, _NEEDS_AT_ONCE // max(1, self.needs.size))
        return np.concatenate(
            [self._rated(states[i : i + most]) for i in range(0, len(states), most)]
        )

    def _rated(self, states: np.ndarray) -> np.ndarray:
        cost, action_cost = self._fixpoint(states)
        if self.name == "hmax":
            return cost[:, self.goal].max(axis=1, initial=0)
        summed = cost[:, self.goal].sum(axis=1, dtype=self.dtype)
        if self.name == "hadd":
            return summed
        found = [
            self._relaxed_plan(*row) if np.isfinite(h) else np.inf
            for *row, h in zip(states, cost, action_cost, summed)
        ]
        return np.array(found, self.dtype)

    def _fixpoint(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(cost of each feature [N, F], of each action [N, A]). Ends: costs only fall, and take
        finitely many values.
        """
        free = np.zeros((len(states), 1), self.dtype)
        cost = np.where(states, self.dtype(0), self.dtype(np.inf))
        while True:
            self.clock.check()
            of_needs = np.concatenate([cost, free], axis=1)[:, self.needs]
            together = (
                of_needs.max(axis=2)
                if self.name == "hmax"
                else of_needs.sum(axis=2, dtype=self.dtype)
            )
            action_cost = together + self.costs
            new = cost.copy()
            if len(self.first):
                features = self.feature_of[self.first]
                new[:, features] = np.minimum(
                    cost[:, features],
                    np.minimum.reduceat(action_cost[:, self.achievers], self.first, axis=1),
                )
            if (new == cost).all():
                return cost, action_cost
            cost = new

    def _relaxed_plan(self, state: np.ndarray, cost: np.ndarray, action_cost: np.ndarray) -> float:
        """The cost of the relaxed plan: for each needed feature its cheapest achiever, ties to the
        lowest action.
        """
        chosen: set[int] = set()
        waiting, seen = [f for f in self.goal if not state[f]], set()
        while waiting:
            feature = waiting.pop()
            if feature in seen:
                continue
            seen.add(feature)
            achievers = np.flatnonzero(self.task.adds[:, feature])
            best = int(achievers[action_cost[achievers].argmin()])
            chosen.add(best)
            waiting += [f for f in np.flatnonzero(self.task.conditions[best]) if not state[f]]
        return float(self.costs[list(chosen)].sum())
