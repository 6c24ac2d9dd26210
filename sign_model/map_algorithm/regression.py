"""A task prepared for regression: only the features and actions that matter, and for each action
the features that a situation after it cannot have.

An action a may be the last step towards a situation S (the test of the M-step) if

    adds(a) & S != 0      it explains a part of S
    bad(a) & S == 0       it breaks nothing of S; bad(a) are the features that it deletes, and those
                          that are mutex with one of its conditions and that it does not add

so two masks are the whole test of relevance and consistency.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sign_model.bits import any_row, pack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.mutex import clashes, mutexes
from sign_model.pddl.lifted import Atom
from sign_model.pddl.planning_task import PlanningTask

MAX_FEATURES = 1 << 15
"""The most features of a regression: each is compared with each, in matrices of that side."""


@dataclass(frozen=True, eq=False)
class RegressionSpace:
    """The matrices of a regression, over the F features and A actions that were kept.

    features: F atoms.
    kept_features, kept_actions: int [F], int [A], their numbers in the task.
    conditions, adds, deletes, bad: bool [A, F].
    mutex: bool [F, F]; a feature that is mutex with itself can never be reached.
    """

    features: tuple[Atom, ...]
    kept_features: np.ndarray
    kept_actions: np.ndarray
    conditions: np.ndarray
    adds: np.ndarray
    deletes: np.ndarray
    bad: np.ndarray
    mutex: np.ndarray

    def situations(self, of_task: np.ndarray) -> np.ndarray:
        """Returns situations of the task, bool [..., F of the task], over the kept features."""
        return of_task[..., self.kept_features]

    def is_consistent(self, goals: np.ndarray) -> np.ndarray:
        """Returns bool [N]: False for each goal, bool [N, F], that can never hold by the mutexes
        alone.
        """
        owner, member = np.nonzero(goals)
        excluded = any_row(pack(self.mutex), owner, member, len(goals))
        return ~np.any(excluded & pack(goals), axis=1)


def regression_space(
    task: PlanningTask,
    starts: np.ndarray | None = None,
    goals: np.ndarray | None = None,
    clock: Clock = NO_LIMIT,
) -> RegressionSpace:
    """Returns the space that serves every pair of a start and a goal.

    Args:
      task: whose features and actions all of them share.
      starts, goals: bool [N, F]; by default those of the task. Mutexes hold for all starts at once.
      clock: asked in every phase; OutOfTime once its limit has passed.

    Raises:
      ValueError: the goals can depend on more than `MAX_FEATURES` features.
    """
    # Mutexes, and the actions that can ever be executed.
    starts = task.start[None] if starts is None else starts
    goals = task.goal[None] if goals is None else goals
    if task.num_features > MAX_FEATURES:
        return _of_relevant(task, starts, goals, clock)
    mutex, usable = mutexes(task.features, task.conditions, task.adds, task.deletes, starts, clock)
    usable = usable & ~(task.conditions & np.diag(mutex)).any(axis=1)

    # Of those, the features and actions that matter for some goal.
    relevant = relevant_features(
        task.conditions[usable], task.adds[usable], np.atleast_1d(goals.any(axis=0)), clock
    )
    helpful = (task.adds[usable] & relevant).any(axis=1)
    features, actions = np.flatnonzero(relevant), np.flatnonzero(usable)[helpful]
    conditions, adds, deletes = (
        m[np.ix_(actions, features)] for m in (task.conditions, task.adds, task.deletes)
    )
    return space_over(task.features, features, actions, conditions, adds, deletes, mutex)


def space_over(
    atoms: Sequence[Atom],
    features: np.ndarray,
    actions: np.ndarray,
    conditions: np.ndarray,
    adds: np.ndarray,
    deletes: np.ndarray,
    mutex: np.ndarray,
) -> RegressionSpace:
    """Returns the space over some features and actions of a task.

    Args:
      atoms: of all features of the task.
      features, actions: int [f], int [a], the numbers of those kept.
      conditions, adds, deletes: bool [a, f], over the kept ones only.
      mutex: bool [F, F], over all features of the task.
    """
    among = mutex[np.ix_(features, features)]
    return RegressionSpace(
        features=tuple(atoms[f] for f in features),
        kept_features=features,
        kept_actions=actions,
        conditions=conditions,
        adds=adds,
        deletes=deletes,
        bad=deletes | (clashes(conditions, among) & ~adds),
        mutex=among,
    )


def _of_relevant(
    task: PlanningTask, starts: np.ndarray, goals: np.ndarray, clock: Clock
) -> RegressionSpace:
    """Returns the space of a task with too many features, made without those that no goal depends
    on.
    """
    kept = np.flatnonzero(
        relevant_features(task.conditions, task.adds, np.atleast_1d(goals.any(axis=0)), clock)
    )
    if len(kept) > MAX_FEATURES:
        raise ValueError(
            f"the goal can depend on {len(kept):,} features, more than the {MAX_FEATURES:,} that"
            " the planner 'map' compares with each other: take a forward search, such as gbfs"
        )
    smaller = replace(
        task,
        features=tuple(task.features[f] for f in kept),
        conditions=task.conditions[:, kept],
        adds=task.adds[:, kept],
        deletes=task.deletes[:, kept],
        start=task.start[kept],
        goal=task.goal[kept],
    )
    space = regression_space(smaller, starts[:, kept], goals[:, kept], clock)
    return replace(space, kept_features=kept[space.kept_features])


def relevant_features(
    conditions: np.ndarray, adds: np.ndarray, goal: np.ndarray, clock: Clock
) -> np.ndarray:
    """Returns bool [F]: what some chain of actions can need for the goal, bool [F]. Ends: the set
    only grows.
    """
    relevant = goal.copy()
    while True:
        clock.check()
        larger = relevant | conditions[(adds & relevant).any(axis=1)].any(axis=0)
        if (larger == relevant).all():
            return relevant
        relevant = larger
