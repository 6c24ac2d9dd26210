"""Delete-relaxation heuristics of many states at once: h_max, h_add and FF as fixpoints over the
task's matrices.
"""

from collections.abc import Callable

import numpy as np

from sign_model.pddl.planning_task import PlanningTask

StateHeuristic = Callable[[np.ndarray], np.ndarray]
"""States bool [N, F] -> float32 [N], inf for a state from which the goal cannot be reached."""


def make_heuristic(name: str, task: PlanningTask) -> StateHeuristic:
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
    return _Relaxation(task, name)


class _Relaxation:
    def __init__(self, task: PlanningTask, name: str) -> None:
        self.task, self.name = task, name
        self.goal = np.flatnonzero(task.goal)
        self.costs = task.costs.astype(np.float32)
        most = max(1, int(task.conditions.sum(axis=1).max(initial=0)))
        # the extra feature is free
        self.needs = np.full((task.num_actions, most), task.num_features)
        for action, row in enumerate(task.conditions):
            held = np.flatnonzero(row)
            self.needs[action, : len(held)] = held
        self.feature_of, self.achievers = np.nonzero(task.adds.T)
        self.first = np.flatnonzero(np.diff(self.feature_of, prepend=-1))

    def __call__(self, states: np.ndarray) -> np.ndarray:
        cost, action_cost = self._fixpoint(states)
        if self.name == "hmax":
            return cost[:, self.goal].max(axis=1, initial=0)
        summed = cost[:, self.goal].sum(axis=1, dtype=np.float32)
        if self.name == "hadd":
            return summed
        found = [
            self._relaxed_plan(*row) if np.isfinite(h) else np.inf
            for *row, h in zip(states, cost, action_cost, summed)
        ]
        return np.array(found, np.float32)

    def _fixpoint(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(cost of each feature [N, F], of each action [N, A]). Ends: costs only fall, and take
        finitely many values.
        """
        free = np.zeros((len(states), 1), np.float32)
        cost = np.where(states, np.float32(0), np.float32(np.inf))
        while True:
            of_needs = np.concatenate([cost, free], axis=1)[:, self.needs]
            together = (
                of_needs.max(axis=2)
                if self.name == "hmax"
                else of_needs.sum(axis=2, dtype=np.float32)
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
        """The cost of the relaxed plan: for each needed feature its cheapest achiever, ties to
        the lowest action.
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
