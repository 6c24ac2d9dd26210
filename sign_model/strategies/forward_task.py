"""What the searches forwards of one task share: its actions that matter, and plans numbered as in
the whole task.
"""

from dataclasses import replace
from typing import Protocol

import numpy as np

from sign_model.clock import Clock
from sign_model.map_algorithm.regression import relevant_features
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.alike import Alike
from sign_model.strategies.forwards import Scripts


class ForwardTask:
    """The actions of a task that matter for its goal, prepared once for all searches forwards.

    Args:
      task: to be solved.
      clock: asked in every phase.

    Attributes:
      actions: int [n], the numbers of these actions in the task.
      task: the task with these actions only.
      scripts, alike: made of it.
    """

    def __init__(self, task: PlanningTask, clock: Clock) -> None:
        self.clock = clock
        features = relevant_features(task.conditions, task.adds, task.goal, self.clock)
        self.actions = np.flatnonzero((task.adds & features).any(axis=1))
        self.task = task
        if len(self.actions) < task.num_actions:
            self.task = replace(
                task,
                actions=tuple(task.actions[a] for a in self.actions),
                conditions=task.conditions[self.actions],
                adds=task.adds[self.actions],
                deletes=task.deletes[self.actions],
                costs=task.costs[self.actions],
            )
        one = self.task
        self.scripts = Scripts(one.conditions, one.adds, one.deletes, self.clock)
        self.alike = Alike(one)

    def estimate(self) -> int:
        """Returns the length of a relaxed plan from the start."""
        relaxed, states = self.scripts.relaxed, self.task.start[None]
        cost, goal = relaxed.from_states(states), np.flatnonzero(self.task.goal)
        if not (cost[goal] < relaxed.far).all():
            return 0
        return len(relaxed.relaxed_plans(states, cost, goal).action)


class Search(Protocol):
    """A search that can be continued."""

    @property
    def plan(self) -> list[int] | None: ...

    @property
    def expansions(self) -> int: ...

    @property
    def is_exhausted(self) -> bool: ...

    def advance(self, max_expansions: int) -> None: ...


class Numbered:
    """A search forwards whose plan has the numbers of the whole task.

    Args:
      search: over the actions that matter.
      actions: their numbers.
      is_complete: whether it is a proof when nothing is left of it.
    """

    def __init__(self, search: "Search", actions: np.ndarray, is_complete: bool) -> None:
        self.search, self.actions, self.is_complete = search, actions, is_complete

    @property
    def plan(self) -> list[int] | None:
        plan = self.search.plan
        return None if plan is None else [int(self.actions[a]) for a in plan]

    @property
    def expansions(self) -> int:
        return self.search.expansions

    @property
    def is_exhausted(self) -> bool:
        return self.search.is_exhausted

    @property
    def is_proof(self) -> bool:
        return self.is_complete and self.search.is_exhausted

    def advance(self, max_expansions: int) -> None:
        self.search.advance(max_expansions)
