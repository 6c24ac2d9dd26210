"""What a few small problems of a domain teach: a skill for its larger ones.

The problems are planned without experience first. Then candidates are tried: cheap ways forwards
that solved the largest problem, with a narrow regression by one or two signs or without one. None
is taken whose plan is longer on any problem. Of the rest one is taken whose ways find short plans
before these are improved, and that plans as the problems were planned without experience: small
problems tell little, and what serves planning without experience on them serves it on larger ones.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sign_model.clock import Clock
from sign_model.experience.skill import BOTH, Skill, attempt
from sign_model.map_algorithm.heuristics import DEFAULTS, LANDMARKS, RELAXED_PLAN
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.rule import UNLEARNED, WAYS, PlanningRule
from sign_model.strategies.turns import Outcome, outcome_of

MOST = 0.8
"""The most expansions of a skill on the problems practised, as a share of those without it; on
larger problems it is less, since what is small is soon found in any way.
"""

_CHEAP = 0.1
"""A way forwards is taken if it solved the largest problem with at most this share."""

_TURN = 4
"""How many times as many expansions a way may take as it took on the problems practised."""

_FAR = 1.15
"""How many times as long as expected a plan is that is not trusted."""

_SIGNS = (
    ((BOTH,), 16),
    ((LANDMARKS,), 16),
    ((RELAXED_PLAN,), 16),
    ((BOTH, RELAXED_PLAN), 8),
    ((BOTH, LANDMARKS), 8),
    ((RELAXED_PLAN, LANDMARKS), 8),
    ((BOTH,), 8),
    ((BOTH,), 32),
    ((RELAXED_PLAN,), 32),
    ((LANDMARKS,), 32),
)
"""Signs of the regression and situations kept in a step, the ones preferred first."""

_WHOLE = 1 << 30


class _Taught(NamedTuple):
    """A problem, and what planning without experience makes of it."""

    task: PlanningTask
    outcome: Outcome

    @property
    def length(self) -> int:
        return len(self.outcome.regression.plan or ())

    @property
    def expansions(self) -> int:
        return self.outcome.regression.expansions


def practise(
    tasks: Sequence[PlanningTask],
    domain: str,
    *,
    max_expansions: int,
    max_seconds: float | None = None,
    log: Callable[[str], None] | None = None,
) -> Skill:
    """Returns the skill that the problems teach; planning without experience where nothing serves
    them better.

    Args:
      tasks: of one domain, from small to large, at least one; those that planning without
        experience does not solve teach nothing.
      domain: its names and arities.
      max_expansions: of each attempt.
      max_seconds: of each attempt.
      log: called with a line of text to report progress.
    """
    options = {"max_expansions": max_expansions}
    taught = [
        _Taught(task, outcome_of(task, DEFAULTS, UNLEARNED, clock=Clock(max_seconds), **options))
        for task in tasks
    ]
    taught = [one for one in taught if one.length]
    total = sum(one.expansions for one in taught)
    best, best_key, spent = Skill(domain, UNLEARNED, DEFAULTS), None, 0
    candidates = _candidates(domain, taught, max_seconds) if taught else ()
    for place, skill in enumerate(candidates):
        tried = _tried(skill, taught, int(MOST * total), max_seconds)
        if tried is None:
            continue
        key = (tried.is_new, tried.length, tried.raw_length, place)
        if best_key is None or key < best_key:
            rule = replace(skill.rule, trust=_trust(taught, tried.estimates))
            best, best_key, spent = replace(skill, rule=rule), key, tried.expansions
    if log is not None:
        log(_report(best, len(taught), spent, total))
    return best


def _report(skill: Skill, count: int, spent: int, total: int) -> str:
    if skill.per_step is None:
        return f"{count} problems: nothing serves better than planning without experience"
    ways, signs = ", ".join(skill.rule.turns), ", ".join(sign.name for sign in skill.signs)
    return (
        f"{count} problems: {ways} (signs: {signs}; beam {skill.rule.beam}), {spent} expansions"
        f" for {total} without experience"
    )


def _candidates(
    domain: str, taught: Sequence[_Taught], max_seconds: float | None
) -> Iterator[Skill]:
    """Yields the skills to try, the ones preferred first."""
    # What the ways forwards take, each alone, on the largest problem.
    largest = max(taught, key=lambda one: (one.length, one.expansions))
    most, turns = int(_CHEAP * largest.expansions), {}
    for way in WAYS[1:]:
        rule = PlanningRule("practised", {way: max(1, most)}, improvement=0, trust=(0.0, 0.0))
        clock = Clock(max_seconds)
        found = outcome_of(largest.task, DEFAULTS, rule, max_expansions=_WHOLE, clock=clock)
        if found.regression.plan is not None:
            turns[way] = _TURN * max(1, found.regression.expansions)

    # The usual expansions of a step, and how long a plan may be before it is distrusted.
    each = [one.expansions / one.length for one in taught]
    per_step = float(np.median(each[-3:]))
    for ways, signs, beam in (
        *(({"backwards": _WHOLE, **turns}, signs, beam) for signs, beam in _SIGNS),
        (turns, DEFAULTS, 32),
    ):
        if ways:
            rule = PlanningRule("practised", ways, improvement=0, beam=beam, trust=(0.0, 0.0))
            yield Skill(domain, rule, signs, per_step)


class _Tried(NamedTuple):
    """What a skill makes of all problems: steps before and after its plans are improved, whether it
    has the way that mostly served without experience, and the estimates of all lengths.
    """

    length: int
    raw_length: int
    expansions: int
    is_new: bool
    estimates: list[int]


def _tried(
    skill: Skill, taught: Sequence[_Taught], most: int, max_seconds: float | None
) -> _Tried | None:
    """Returns what a skill makes of the problems; None where one gets no plan, or a longer one, or
    all together take more than `most` expansions.
    """
    length, raw_length, spent, estimates = 0, 0, 0, []
    for one in reversed(taught):  # the largest first: it soonest tells
        left = max(1, most - spent)
        outcome, found = attempt(skill, one.task, max_expansions=left, clock=Clock(max_seconds))
        spent += found.expansions
        if found.plan is None or len(found.plan) > one.length or spent > most:
            return None
        length += len(found.plan)
        raw_length += len(outcome.regression.plan or ())
        estimates.insert(0, outcome.estimate)
    finders = [one.outcome.finder for one in taught]
    usual = max(UNLEARNED.turns, key=finders.count)
    return _Tried(length, raw_length, spent, usual not in skill.rule.turns, estimates)


def _trust(taught: Sequence[_Taught], estimates: Sequence[int]) -> tuple[float, float]:
    """Returns (a, b): a plan of more than a n + b steps, for an estimate n, is too long to be
    trusted: by the greatest ratio, or by the line through all lengths where that rises faster.
    """
    n, length = np.maximum(1, np.array(estimates, float)), np.array([o.length for o in taught])
    ratio, rises = float((length / n).max()), (0.0, 0.0)
    if len(set(estimates)) >= 3:
        slope, begin = np.polyfit(n, length, 1)
        above = (length - slope * n - begin).max()
        rises = (float(slope), float(begin + above))
    twice = 2 * n.max()
    factor, more = max((ratio, 0.0), rises, key=lambda line: line[0] * twice + line[1])
    return _FAR * factor, _FAR * more
