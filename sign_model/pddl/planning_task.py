"""The grounded task: one planning problem as boolean matrices, with the names that give its bits
their meaning.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sign_model.foundation.legible import counted
from sign_model.pddl.lifted import Atom, Domain, Problem


@dataclass(frozen=True, eq=False)
class PlanningTask:
    """A grounded STRIPS task. F features, A actions; an action may go when its conditions hold;
    then deletes, then adds.

    Attributes:
      features: the atom of each feature; ("not", p, ...) is the complement of p, made where p must
        be false.
      actions: (schema, argument, ...) of each ground action.
      conditions, adds, deletes: bool [A, F]; no action both adds and deletes a feature.
      costs: int64 [A], 0 to 10^12.
      start, goal: bool [F]; the goal is partial, the start complete.
      domain, problem: the lifted task this one was grounded from; None where it was made from
        arrays.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> task.features
      (('closed',), ('open',), ('through',))
      >>> task.conditions.shape  # actions, features
      (2, 3)
    """

    features: tuple[Atom, ...]
    actions: tuple[Atom, ...]
    conditions: np.ndarray
    adds: np.ndarray
    deletes: np.ndarray
    costs: np.ndarray
    start: np.ndarray
    goal: np.ndarray
    domain: Domain | None = None
    problem: Problem | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """What it is in a line; `features` and `actions` hold the names."""
        named = ""
        if self.problem is not None and self.domain is not None:
            named = f"{self.problem.name!r} of {self.domain.name!r}, "
        return (
            f"PlanningTask({named}{counted(self.num_features, 'feature')},"
            f" {counted(self.num_actions, 'action')}, {int(self.start.sum())} true at the start,"
            f" {int(self.goal.sum())} wanted)"
        )

    @property
    def num_features(self) -> int:
        return len(self.features)

    @property
    def num_actions(self) -> int:
        return len(self.actions)

    @property
    def action_names(self) -> tuple[str, ...]:
        """The actions as a plan file writes them: `(pick-up a)`."""
        return tuple(f"({' '.join(action)})" for action in self.actions)

    @property
    def has_costs(self) -> bool:
        """Whether actions have costs: the problem says (:metric minimize (total-cost)), or costs
        other than 1 were given.
        """
        if self.problem is not None:
            return self.problem.counts_costs
        return bool((self.costs != 1).any())

    def cost_of(self, actions: Sequence[int] | np.ndarray) -> int | None:
        """Returns the total cost of a plan, given by the numbers of its actions; None where actions
        have no costs.
        """
        return sum(self.costs[np.asarray(actions, int)].tolist()) if self.has_costs else None

    def situation(self, atoms: Sequence[Atom]) -> np.ndarray:
        """Returns bool [F], True at the given atoms; ValueError for one that is no feature."""
        index = {atom: i for i, atom in enumerate(self.features)}
        situation = np.zeros(self.num_features, bool)
        for atom in atoms:
            if atom not in index:
                raise ValueError(
                    f"({' '.join(atom)}) is no feature of this task: it is static, unreachable or"
                    " misspelt"
                )
            situation[index[atom]] = True
        return situation


def task_from_arrays(
    conditions: np.ndarray,
    adds: np.ndarray,
    deletes: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    costs: np.ndarray | None = None,
) -> PlanningTask:
    """Returns a task of nameless features and actions (`(f0)`, `(a0)`); an action that deletes and
    adds a feature adds it.

    Args:
      conditions, adds, deletes: bool [A, F].
      start, goal: bool [F].
      costs: whole numbers [A], 0 or more; 1 each where not given.

    Raises:
      ValueError: arrays of another shape or dtype, a cost below 0 or no whole number.
    """
    num_actions, num_features = conditions.shape
    given = {
        "conditions": conditions,
        "adds": adds,
        "deletes": deletes,
        "start": start,
        "goal": goal,
    }
    for name, array in given.items():
        shape = (num_features,) if name in ("start", "goal") else (num_actions, num_features)
        if array.dtype != bool or array.shape != shape:
            raise ValueError(
                f"{name} must be bool {list(shape)}, got {array.dtype} {list(array.shape)}"
            )
    if costs is not None and (
        costs.shape != (num_actions,) or not ((costs >= 0) & (costs == np.floor(costs))).all()
    ):
        raise ValueError(
            f"costs must be whole numbers [{num_actions}] from 0 up, got {list(costs.shape)}:"
            f" {costs}"
        )
    return PlanningTask(
        features=tuple((f"f{i}",) for i in range(num_features)),
        actions=tuple((f"a{i}",) for i in range(num_actions)),
        conditions=conditions,
        adds=adds,
        deletes=deletes & ~adds,
        costs=np.ones(num_actions, np.int64) if costs is None else costs.astype(np.int64),
        start=start,
        goal=goal,
    )
