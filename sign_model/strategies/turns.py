"""Carries out a metacognitive rule: the ways of planning take turns until one has a plan or a
proof, the others may look for a shorter plan, and then the plan is improved part by part.
"""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sign_model.clock import NO_LIMIT, Clock, OutOfTime
from sign_model.map_algorithm.heuristics import DEFAULTS, HeuristicSign
from sign_model.map_algorithm.map_planner import BEAMS, Regression, Rungs
from sign_model.map_algorithm.mutex import mutexes
from sign_model.map_algorithm.shorten import shorten
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.rule import UNLEARNED, PlanningRule

if TYPE_CHECKING:
    from sign_model.strategies.forward_task import ForwardTask

_PATIENCE = (8, 32)
"""How many steps of a regression may pass without a better rating before it gives up its turn, at
least and at most: the fewer, the longer a step takes.
"""

_WORDS_OF_PATIENCE = 1 << 19
"""The words that these steps go through, about (A + F) F / 64 for each situation of a beam."""

_RATED_PER_EXPANSION = 64
"""How many situations a regression may rate for each expansion of its turn."""

NEAR = 1.3
"""A plan found at once is left as it is if it is at most so many times as long as the estimate.
Chosen by hand: optimal plans of blocks exceed the estimate 0.8 to 1.3 times, those of hands 1.5
times, and there the search goes on in vain.
"""

_LARGE = 1 << 15
"""A task with more words is not planned backwards before other ways have tried it."""

_HUGE = 1 << 17
"""A task with more words is not planned backwards once there is a plan."""

_VAST = 1 << 19
"""A task with more words is planned backwards last of all."""

_QUICK = {"curiously": 16000, "goal by goal": 500, "boldly": 500, "forwards": 4000}
"""The expansions of these ways before all others on a large task."""

_FORWARD_WORDS = 1 << 27
"""How many words of tables, for all situations, limit the last of these, and the expansions that
look for a shorter plan.
"""

_LANDMARK_WORDS = 1 << 18
"""A task with more words gets no landmarks forwards."""

_GOAL_PATIENCE = 1000
"""How many situations are rated for one goal before another goal is tried."""

_EFFORT_PER_EXPANSION, _EFFORT_WITHOUT_STALL, _LEAST_EFFORT = 1500, 50, 100_000
"""How much effort improves a plan, for each expansion that it took; less where the first way led to
it at once, since such plans are short.
"""


def _words(task: PlanningTask) -> int:
    """Returns the size of the task's tables in words of 64 bits."""
    return sum(task.conditions.shape) * task.num_features // 64


class Way(Protocol):
    """A way of planning that can be continued."""

    @property
    def plan(self) -> list[int] | None:
        """The plan, once it was found."""
        ...

    @property
    def expansions(self) -> int:
        """The situations expanded so far."""
        ...

    @property
    def is_exhausted(self) -> bool:
        """Whether there is no use in continuing it."""
        ...

    @property
    def is_proof(self) -> bool:
        """Whether it was proven that there is no plan."""
        ...

    def advance(self, max_expansions: int) -> None:
        """Continues until there is a plan or a proof, or until so many expansions in all."""
        ...


@dataclass(frozen=True)
class Outcome:
    """What a rule made of a task.

    regression: the plan, the proof or neither, and the expansions.
    estimate: how long a plan may be at least: an estimate, not a bound; 0 where there is none.
    finder: the way that found the shortest plan, before it was improved; "" without one.
    spent: {way: its expansions}.
    lengths: {way: the length of its plan}, of those that found one.
    mutex: bool [F, F], features of the task that never hold together; None where it was not needed.
    """

    regression: Regression
    estimate: int
    finder: str
    spent: Mapping[str, int]
    lengths: Mapping[str, int]
    mutex: np.ndarray | None


def outcome_of(
    task: PlanningTask,
    signs: Sequence[HeuristicSign],
    rule: PlanningRule,
    *,
    max_expansions: int,
    clock: Clock = NO_LIMIT,
) -> Outcome:
    """Returns what the ways of a rule alone make of a task, whether it is trusted or not; arguments
    as in `plan_by_rule`.
    """
    turns, estimate, mutex = _Turns(task, signs, rule, max_expansions, clock), 0, None
    with contextlib.suppress(OutOfTime):
        turns.run()
        if rule is not UNLEARNED:
            estimate = turns.estimate()
            mutex = turns.mutex() if turns.plan and not turns.is_shortest else None
    plan = turns.plan
    found = Regression(plan, turns.spent, plan is None and turns.is_proven, turns.is_shortest)
    spent = {name: way.expansions for name, way in turns.ways.items()}
    lengths = {name: len(way.plan) for name, way in turns.ways.items() if way.plan is not None}
    return Outcome(found, estimate, turns.finder, spent, lengths, mutex)


def plan_by_rule(
    task: PlanningTask,
    signs: Sequence[HeuristicSign],
    rule: PlanningRule,
    *,
    max_expansions: int,
    clock: Clock = NO_LIMIT,
) -> Regression:
    """Returns the shortest plan found, its actions numbered as in the task, a proof that there is
    none, or a spent budget.

    Args:
      task: to be solved.
      signs: the heuristics of the regression.
      rule: which ways to take, in which order and for how long.
      max_expansions: the most situations expanded in all.
      clock: asked in every phase; once its limit has passed the best plan so far is returned.
    """
    outcome = outcome_of(task, signs, rule, max_expansions=max_expansions, clock=clock)
    found = outcome.regression
    if rule.trust is None:
        return found
    trusted = rule.trust[0] * outcome.estimate + rule.trust[1]
    return kept_or_unlearned(task, found, trusted, max_expansions=max_expansions, clock=clock)


def kept_or_unlearned(
    task: PlanningTask,
    found: Regression,
    trusted: float,
    *,
    max_expansions: int,
    clock: Clock = NO_LIMIT,
) -> Regression:
    """Returns what experience found where it is trusted as far as that, else the shorter plan of
    that and of planning without experience.

    Args:
      trusted: the most steps of a plan that is kept as it is. One that is longer than planning
        without experience was found to make them, or none at all, is a case for planning without.
      max_expansions: the most situations expanded in all, those of `found` among them.
    """
    if found.is_proof or found.is_shortest or clock.is_over():
        return found
    if found.plan is not None and len(found.plan) <= trusted:
        return found
    left = max_expansions - found.expansions
    other = plan_by_rule(task, DEFAULTS, UNLEARNED, max_expansions=left, clock=clock)
    is_longer = other.plan is None or (found.plan and len(found.plan) <= len(other.plan))
    best = found if found.plan is not None and is_longer else other
    return replace(best, expansions=found.expansions + other.expansions)


class _Turns:
    def __init__(
        self,
        task: PlanningTask,
        signs: Sequence[HeuristicSign],
        rule: PlanningRule,
        max_expansions: int,
        clock: Clock,
    ) -> None:
        self.task, self.signs, self.rule, self.clock = task, signs, rule, clock
        self.budget = max_expansions
        self.plan: list[int] | None = None
        self.is_proven = self.is_shortest = False
        self.ways: dict[str, Way] = {}
        self.beams = (rule.beam, *(beam for beam in BEAMS if beam > rule.beam))
        self.improving, self.finder = 0, ""
        self.forward: ForwardTask | None = None

    @property
    def spent(self) -> int:
        """The expansions of all ways together, and of improving the plan."""
        found = sum(way.expansions for way in self.ways.values())
        return min(self.budget, found + self.improving)

    def run(self) -> None:
        """Gives the ways their turns, then improves the plan."""
        order = list(self.rule.turns)
        words = _words(self.task)
        most = _FORWARD_WORDS // max(1, words)
        if words > _VAST:
            order.sort(key=lambda way: way == "backwards")
        growth, finder = 1, ""
        if words > _LARGE:
            for name in (name for name in order if name in _QUICK):
                self._turn(name, min(most if name == "forwards" else 1 << 40, _QUICK[name]))
                if self.plan is not None or self.is_proven:
                    break
        has_one_round = self.rule.trust is not None
        while self.plan is None and not self.is_proven and self.spent < self.budget:
            self.clock.check()
            waiting = [name for name in order if not self._is_over(name)]
            if not waiting:
                return
            for name in waiting:
                self._turn(name, self.rule.turns[name] * growth)
                if self.plan is not None or self.is_proven:
                    finder = finder or name
                    if not has_one_round or self.is_proven:
                        break
            growth *= self.rule.growth
            if has_one_round:
                break
        if self.plan is None or self.is_shortest or not self.plan:
            return

        # A plan that the regression finds at once, and that is about as long as what it needs at
        # least, is short: nothing is gained by looking further.
        way = self.ways.get("backwards")
        is_quick = finder == order[0] == "backwards"
        estimate = way.rungs.estimate() if isinstance(way, _Backwards) else 0
        if is_quick and len(self.plan) <= NEAR * estimate:
            return

        # The ways that had no turn yet may find a shorter plan; deferring only makes plans longer.
        effort = self.spent
        for name in order:
            is_useful = name != "deferred" and not (name == "backwards" and words > _HUGE)
            if name not in self.ways and is_useful:
                limit = effort // 16 if is_quick else 8 * most
                if words > _LARGE:
                    limit = min(limit, 2 * _QUICK.get(name, limit))
                self._turn(name, min(self.rule.turns[name], limit))
        self._improve(is_quick)

    def estimate(self) -> int:
        """Returns how long a plan may be at least: an estimate, not a bound."""
        if self.forward is not None:
            return self.forward.estimate()
        way = self.ways.get("backwards")
        return way.rungs.estimate(by_all=True) if isinstance(way, _Backwards) else 0

    def _is_over(self, name: str) -> bool:
        return name in self.ways and self.ways[name].is_exhausted

    def _turn(self, name: str, expansions: int) -> None:
        """Continues a way, and takes its plan if that is shorter."""
        if name not in self.ways:
            self.ways[name] = _MAKERS[name](self)
        way = self.ways[name]
        way.advance(way.expansions + max(0, min(expansions, self.budget - self.spent)))
        self.is_proven = self.is_proven or way.is_proof
        if way.plan is not None:
            plan = shorten(self.task, way.plan, self.clock)
            if self.plan is None or len(plan) < len(self.plan):
                self.plan, self.finder = plan, name
            if isinstance(way, _Backwards):
                self.is_shortest = self.is_shortest or way.is_shortest

    def _improve(self, is_quick: bool) -> None:
        from sign_model.strategies.improve import improve

        assert self.plan is not None
        each = _EFFORT_WITHOUT_STALL if is_quick else _EFFORT_PER_EXPANSION
        effort = _LEAST_EFFORT + each * self.spent
        if self.rule.effort is not None:
            effort = self.rule.effort * len(self.plan)
        effort = min(self.rule.improvement * self.budget, effort)
        if not self.rule.improvement or len(self.plan) < 3:
            return
        left = self.budget - self.spent
        self.plan, self.improving = improve(
            self.task,
            self.mutex(),
            self.plan,
            effort=effort,
            max_expansions=left,
            clock=self.clock,
        )

    def mutex(self) -> np.ndarray:
        """Returns which features never hold together, bool [F, F]."""
        task, way = self.task, self.ways.get("backwards")
        if not isinstance(way, _Backwards):
            parts = (task.conditions, task.adds, task.deletes)
            return mutexes(task.features, *parts, task.start[None], self.clock)[0]
        mutex = np.zeros((task.num_features, task.num_features), bool)
        kept = way.rungs.space.kept_features
        mutex[np.ix_(kept, kept)] = way.rungs.space.mutex
        return mutex


class _Backwards:
    """The rungs of the regression as turns."""

    def __init__(self, turns: _Turns) -> None:
        self.turns = turns
        self.rungs = Rungs(turns.task, turns.signs, turns.clock)
        self.plan: list[int] | None = None
        self.expansions, self.rung = 0, 0
        least, most = _PATIENCE
        self.patience = max(least, min(most, _WORDS_OF_PATIENCE // max(1, _words(turns.task))))
        self.is_proof, self.is_shortest = self.rungs.is_excluded, False

    @property
    def is_exhausted(self) -> bool:
        return self.is_proof or self.rung >= len(self.turns.beams)

    def advance(self, max_expansions: int) -> None:
        """Tries one rung until it stalls, even beyond the turn; the last rung to its end."""
        beams = self.turns.beams
        beam, is_last = beams[self.rung], self.rung == len(beams) - 1
        left = self.turns.budget - self.turns.spent
        rated = _RATED_PER_EXPANSION * (max_expansions - self.expansions)
        limits = (None, None) if is_last else (self.patience, rated)
        found = self.rungs.tried(beam, left, *limits)
        self.expansions += found.expansions
        self.plan, self.is_proof = found.plan, self.is_proof or found.is_proof
        self.is_shortest = found.is_shortest
        self.rung += 1


def _shared(turns: _Turns) -> "ForwardTask":
    from sign_model.strategies.forward_task import ForwardTask

    if turns.forward is None:
        turns.forward = ForwardTask(turns.task, turns.clock)
    return turns.forward


def _goal_by_goal(turns: _Turns) -> Way:
    from sign_model.strategies.forward_task import Numbered
    from sign_model.strategies.goal_by_goal import GoalByGoal

    shared = _shared(turns)
    search = GoalByGoal(
        shared.scripts,
        shared.task.adds,
        shared.task.deletes,
        shared.task.start,
        shared.task.goal,
        patience=_GOAL_PATIENCE,
        clock=shared.clock,
    )
    return Numbered(search, shared.actions, is_complete=False)


def _forwards(turns: _Turns, *, is_bold: bool = False, is_deferred: bool = False) -> Way:
    from sign_model.strategies.forward_task import Numbered
    from sign_model.strategies.forwards import Forwards
    from sign_model.strategies.landmarks_left import LandmarksLeft

    shared, landmarks = _shared(turns), None
    task = shared.task
    if not is_bold and _words(task) <= _LANDMARK_WORDS:
        landmarks = LandmarksLeft(task, task.start, task.goal, shared.clock)
    search = Forwards(
        shared.scripts,
        task.start,
        task.goal,
        is_bold=is_bold,
        is_deferred=is_deferred,
        landmarks=landmarks,
        at_once=turns.rule.at_once,
        canonical=shared.alike.canonical if shared.alike else None,
        clock=shared.clock,
    )
    return Numbered(search, shared.actions, is_complete=True)


def _curiously(turns: _Turns) -> Way:
    from sign_model.strategies.curiously import Curiously
    from sign_model.strategies.forward_task import Numbered

    shared = _shared(turns)
    search = Curiously(shared.scripts, shared.task.start, shared.task.goal, clock=shared.clock)
    return Numbered(search, shared.actions, is_complete=True)


_MAKERS: Mapping[str, Callable[[_Turns], Way]] = {
    "backwards": _Backwards,
    "curiously": _curiously,
    "goal by goal": _goal_by_goal,
    "boldly": lambda turns: _forwards(turns, is_bold=True),
    "forwards": _forwards,
    "deferred": lambda turns: _forwards(turns, is_deferred=True),
}
