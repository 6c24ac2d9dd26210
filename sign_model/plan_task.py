"""One task in, one replayed plan out: `plan` composes a precedent, a planner and the independent
replay.
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from sign_model.clock import Clock, OutOfTime
from sign_model.forward_search.best_first import best_first
from sign_model.map_algorithm.heuristics import (
    DEFAULTS,
    LANDMARKS,
    OVERLAP,
    RELAXED_PLAN,
    HeuristicSign,
)
from sign_model.map_algorithm.map_planner import Regression
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.result import PlanResult, PlanStatus
from sign_model.strategies.rule import UNLEARNED, PlanningRule
from sign_model.strategies.turns import plan_by_rule

Heuristic = str | HeuristicSign | Sequence[HeuristicSign] | None

_SIGNS = {sign.name: sign for sign in (OVERLAP, LANDMARKS, RELAXED_PLAN)}


class Skill(Protocol):
    """How to plan the problems of a domain."""

    def plan(self, task: PlanningTask, *, max_expansions: int, clock: Clock) -> Regression:
        """The shortest plan found, a proof that there is none, or a spent budget."""
        ...


class Memory(Protocol):
    """Experience: solved tasks as precedents. What it answers is replayed first and never
    trusted.
    """

    def recall(self, task: PlanningTask) -> Sequence[str] | None:
        """The plan of this very task, or None."""
        ...

    def suggest(self, task: PlanningTask) -> Sequence[str] | None:
        """A plan that may serve the task, perhaps a long one, or None."""
        ...

    def skill(self, task: PlanningTask) -> Skill | None:
        """What was learned of the task's domain, or None."""
        ...


def plan(
    task: PlanningTask,
    *,
    planner: str = "map",
    heuristic: Heuristic = None,
    rule: PlanningRule | None = None,
    memory: Memory | None = None,
    max_expansions: int = 200_000,
    max_seconds: float | None = None,
    weight: float = 2.0,
) -> PlanResult:
    """Returns a plan that was replayed forward (empty where nothing is to do), a proof of none, or
    a spent budget.

    Args:
      task: from `load` or `task_from_arrays`.
      planner: "map" (PY16 §3.1, counts steps) or a forward search: "astar" (the cheapest plan),
        "wastar" (weighs costs), "gbfs" (the first plan it meets).
      heuristic: for map a heuristic sign, several of them, or one's name; the unlearned `DEFAULTS`
        where None. For the others blind, goals, hmax, hadd or ff. Where None, ff for wastar and
        gbfs; astar then first compares a plan of MAP with a bound of the landmarks, and searches
        by hmax if that proves nothing.
      rule: for map, which ways of planning take turns; the `UNLEARNED` one where None.
      memory: precedents, tried first; where none serves, planning continues without it. What it
        learned of the domain serves where neither rule nor heuristic is given.
      max_expansions: the most situations expanded.
      max_seconds: the most time for it all, the replay of a long plan included; unbounded where
        None.
      weight: of weighted A*.

    Raises:
      ValueError: a planner or heuristic that isn't known, a budget below 1, a time limit below 0.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> sign_model.plan(task).actions
      ('(push)', '(walk)')
    """
    if max_expansions < 1:
        raise ValueError(f"max_expansions must be at least 1, got {max_expansions}")
    began, clock = time.perf_counter(), Clock(max_seconds)
    recalled = memory.recall(task) if memory is not None else None
    if recalled is not None and not validate(task, recalled):
        return _finished(
            task, PlanStatus.SOLVED, tuple(recalled), 1, began, time.perf_counter(), clock
        )
    if planner == "map":
        signs, skill = _signs(heuristic), None
        if memory is not None and rule is None and heuristic is None:
            # a memory of one's own need not have learned anything
            skill = memory.skill(task) if hasattr(memory, "skill") else None
        if skill is not None:
            found = skill.plan(task, max_expansions=max_expansions, clock=clock)
        else:
            found = plan_by_rule(
                task, signs, rule or UNLEARNED, max_expansions=max_expansions, clock=clock
            )
        actions = found.plan
    elif heuristic is not None and not isinstance(heuristic, str):
        raise ValueError(
            f"planner '{planner}' takes the name of a heuristic (blind, goals, hmax, hadd, ff), not"
            " a sign"
        )
    else:
        found = Regression(None, 0, False)
        if planner == "astar" and heuristic is None:
            found = _proven_at_once(task, max_expansions, clock)
        if found.plan is None and not found.is_proof:
            spent = found.expansions
            found = best_first(
                task, planner, max_expansions - spent, clock, heuristic=heuristic, weight=weight
            )
            found = replace(found, expansions=found.expansions + spent)
        actions = found.plan
    if not found.is_proof and (planner == "map" or actions is None):
        actions = _shorter(actions, _suggested(task, memory))
    searched = time.perf_counter()
    if actions is None:
        status = PlanStatus.UNSOLVABLE if found.is_proof else PlanStatus.BUDGET_SPENT
        return _finished(task, status, (), found.expansions, began, searched, clock)
    names = task.action_names
    return _finished(
        task,
        PlanStatus.SOLVED,
        tuple(names[a] for a in actions),
        found.expansions,
        began,
        searched,
        clock,
    )


def _proven_at_once(task: PlanningTask, max_expansions: int, clock: Clock) -> Regression:
    """Returns the cheapest plan where the bound of the landmarks proves it; no plan where the
    search has to.
    """
    from sign_model.strategies.proven import proven_cheapest

    try:
        return proven_cheapest(task, max_expansions=max_expansions, clock=clock)
    except OutOfTime:
        return Regression(None, 0, False)


def _shorter(one: list[int] | None, other: list[int] | None) -> list[int] | None:
    return one if other is None or (one is not None and len(one) <= len(other)) else other


def _suggested(task: PlanningTask, memory: Memory | None) -> list[int] | None:
    """The plan of a precedent that fits the task, as action numbers; None where there is none, or
    it does not unfold.
    """
    suggestion = memory.suggest(task) if memory is not None else None
    if suggestion is None or validate(task, suggestion):
        return None
    number_of = {name: i for i, name in enumerate(task.action_names)}
    return [number_of[name.lower()] for name in suggestion]


def _signs(heuristic: Heuristic) -> Sequence[HeuristicSign]:
    if heuristic is None:
        return DEFAULTS
    if isinstance(heuristic, HeuristicSign):
        return (heuristic,)
    if isinstance(heuristic, str):
        if heuristic not in _SIGNS:
            raise ValueError(
                f"heuristic sign '{heuristic}' is not known to MAP: choose one of"
                f" {', '.join(_SIGNS)}"
            )
        return (_SIGNS[heuristic],)
    if not heuristic:
        raise ValueError("MAP needs at least one heuristic sign: give None for the unlearned ones")
    return tuple(heuristic)


def _finished(
    task: PlanningTask,
    status: PlanStatus,
    actions: tuple[str, ...],
    expansions: int,
    began: float,
    searched: float,
    clock: Clock,
) -> PlanResult:
    """Replays the plan and gathers the times. A plan that fails its replay is our own slip, never
    an answer.
    """
    try:
        if status == PlanStatus.SOLVED and (wrong := validate(task, actions, clock=clock)):
            raise AssertionError(f"the planner made an invalid plan: {wrong[0]}")
    except OutOfTime:  # a plan that was not replayed to its end is no answer
        status, actions = PlanStatus.BUDGET_SPENT, ()
    spent = {
        "parse": task.seconds.get("parse", 0.0),
        "build": task.seconds.get("ground", 0.0),
        "search": searched - began,
        "validate": time.perf_counter() - searched,
    }
    return PlanResult(status, actions, expansions, spent, _cost_of(task, status, actions))


def _cost_of(task: PlanningTask, status: PlanStatus, actions: Sequence[str]) -> int | None:
    if status != PlanStatus.SOLVED or not task.has_costs:
        return None
    number_of = {name: i for i, name in enumerate(task.action_names)}
    return task.cost_of([number_of[name.lower()] for name in actions])
