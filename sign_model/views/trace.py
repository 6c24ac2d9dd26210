"""The iterations of MAP on one task as one can read them: what the M-step selects, how the A-step
rates it and why, what the P-step makes of it (PY16 §3.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sign_model.foundation.legible import counted
from sign_model.map_algorithm.a_step import Rating, make_rating
from sign_model.map_algorithm.heuristics import COUNTS, LANDMARKS, HeuristicSign
from sign_model.map_algorithm.map_planner import BEAMS, fitting_actions, regress
from sign_model.map_algorithm.regression import RegressionSpace, regression_space
from sign_model.pddl.planning_task import PlanningTask
from sign_model.signs.from_tasks import fact_name

_SHOWN = 8
"""Candidates of an iteration that the text names."""


@dataclass(frozen=True)
class Candidate:
    """An action that the M-step selects.

    Attributes:
      action: `(stack a b)`.
      rating: of the situation before it; the lower, the nearer to the start.
      parts: what the rating is the sum of, {count: value}, without zeros.
    """

    action: str
    rating: int
    parts: dict[str, int]


@dataclass(frozen=True)
class Iteration:
    """One iteration of MAP on the way to the plan.

    Attributes:
      situation: the facts of the current situation.
      num_scripts: actions of the task, of which the M-step selects the candidates.
      candidates: the best rated first; equal ratings in the order of the actions.
      taken: the number of the candidate that the plan has.
      before: the facts of the next situation, the one before the action.
    """

    situation: tuple[str, ...]
    num_scripts: int
    candidates: tuple[Candidate, ...]
    taken: int
    before: tuple[str, ...]


@dataclass(frozen=True)
class Trace:
    """MAP's way from the goal back to the start.

    Attributes:
      sign: the name of the heuristic sign that rates.
      iterations: from the goal to the start.
      start: the facts of the start.
      plan: in the order of execution; None where MAP found none.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> trace = sign_model.trace(sign_model.load(domain, problem))
      >>> [iteration.before for iteration in trace.iterations]
      [('(open)',), ('(closed)',)]
    """

    sign: str
    iterations: tuple[Iteration, ...]
    start: tuple[str, ...]
    plan: tuple[str, ...] | None

    def __repr__(self) -> str:
        """What it is in a line; `str` tells the iterations."""
        found = "no plan" if self.plan is None else f"plan of {counted(len(self.plan), 'step')}"
        return (
            f"Trace(by the sign {self.sign!r}, {counted(len(self.iterations), 'iteration')},"
            f" {found})"
        )

    def __str__(self) -> str:
        """The iterations as text."""
        if self.plan is None:
            return "MAP found no plan by this sign."
        lines = [
            f"MAP goes back from the goal to the start in {len(self.iterations)} iterations, rating"
            f" by the sign '{self.sign}'."
        ]
        for number, one in enumerate(self.iterations, 1):
            lines += _lines(number, one)
        lines.append("The situation is included in the start. The plan, in the order of execution:")
        lines += [f"  {action}" for action in self.plan]
        return "\n".join(lines)


def trace(
    task: PlanningTask,
    *,
    heuristic: HeuristicSign = LANDMARKS,
    max_expansions: int = 20_000,
) -> Trace:
    """Returns the iterations of MAP that lead to the plan, with everything that was weighed on the
    way; for small tasks.

    Situations beside this way, which the beam keeps too, are left out; so a rating that is not the
    best may be taken, because it led to the start first.

    Args:
      task: to be planned.
      heuristic: the sign that rates.
      max_expansions: the most situations expanded.

    Raises:
      ValueError: the goal can depend on too many features.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> print(sign_model.trace(sign_model.load(domain, problem)))
      MAP goes back from the goal to the start in 2 iterations, rating by the sign 'landmarks'.
      1. Situation: (through)
         M: 1 of 2 scripts fit: walk
         A: (walk) rated 1 = 1 landmarks; taken
         P: the situation before it: (open)
      2. Situation: (open)
         M: 1 of 2 scripts fit: push
         A: (push) rated 0; taken
         P: the situation before it: (closed)
      The situation is included in the start. The plan, in the order of execution:
        (push)
        (walk)
    """
    space = regression_space(task)
    start, goal = (space.situations(rows) for rows in (task.start, task.goal))
    schemas = [task.actions[a][0] for a in space.kept_actions]
    rating = make_rating(heuristic, space, start, goal, schemas)
    plan: list[int] | None = None
    for beam in BEAMS:
        found = regress(space, start, goal, rating, beam=beam, max_expansions=max_expansions)
        max_expansions -= found.expansions
        plan = found.plan
        if plan is not None or found.is_proof or max_expansions <= 0:
            break
    names = [task.action_names[a] for a in space.kept_actions]
    held = _facts(space, start)
    if plan is None:
        return Trace(heuristic.name, (), held, None)

    # Along the plan from its end: each situation, and all that the M-step selects in it.
    parts = {
        count: make_rating(replace(_NOTHING, **{count: table}), space, start, goal, schemas)
        for count in COUNTS
        if any((table := getattr(heuristic, count)).values())
    }
    iterations, situation = [], goal
    for action in reversed(plan):
        iterations.append(_iteration(space, situation, action, names, rating, parts))
        situation = (situation & ~space.adds[action]) | space.conditions[action]
    return Trace(heuristic.name, tuple(iterations), held, tuple(names[a] for a in plan))


_NOTHING = HeuristicSign("part")


def _iteration(
    space: RegressionSpace,
    situation: np.ndarray,
    action: int,
    names: Sequence[str],
    rating: Rating,
    parts: dict[str, Rating],
) -> Iteration:
    """Returns what an iteration weighs in a situation, bool [F], from which the plan takes an
    action.
    """
    actions = fitting_actions(space, situation)
    before = (situation & ~space.adds[actions]) | space.conditions[actions]
    ratings = rating(before)
    values = {count: part(before) for count, part in parts.items()}
    order = np.argsort(ratings, kind="stable")
    candidates = tuple(
        Candidate(
            names[int(actions[i])],
            int(ratings[i]),
            {count: int(row[i]) for count, row in values.items() if row[i]},
        )
        for i in order
    )
    taken = int(np.flatnonzero(actions[order] == action)[0])
    return Iteration(
        _facts(space, situation),
        len(names),
        candidates,
        taken,
        _facts(space, before[order[taken]]),
    )


def _facts(space: RegressionSpace, situation: np.ndarray) -> tuple[str, ...]:
    return tuple(fact_name(space.features[f]) for f in np.flatnonzero(situation))


def _lines(number: int, one: Iteration) -> list[str]:
    indent = " " * (len(str(number)) + 2)
    scripts: dict[str, int] = {}
    for candidate in one.candidates:
        name = candidate.action.strip("()").split()[0]
        scripts[name] = scripts.get(name, 0) + 1
    counted = ", ".join(name if n == 1 else f"{name} ({n} times)" for name, n in scripts.items())
    lines = [
        f"{number}. Situation: {' '.join(one.situation)}",
        f"{indent}M: {len(one.candidates)} of {one.num_scripts} scripts fit: {counted}",
    ]
    shown = [i for i in range(len(one.candidates)) if i < _SHOWN or i == one.taken]
    for i in shown:
        lines.append(
            f"{indent}{'A:' if i == 0 else '  '} {_rated(one.candidates[i], i == one.taken)}"
        )
    if len(shown) < len(one.candidates):
        lines.append(f"{indent}   and {len(one.candidates) - len(shown)} more")
    lines.append(f"{indent}P: the situation before it: {' '.join(one.before) or '(nothing)'}")
    return lines


def _rated(candidate: Candidate, is_taken: bool) -> str:
    parts = " + ".join(f"{value} {count}" for count, value in candidate.parts.items())
    why = f" = {parts}" if parts else ""
    return f"{candidate.action} rated {candidate.rating}{why}{'; taken' if is_taken else ''}"
