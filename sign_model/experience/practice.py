"""What a few small problems of a domain teach: a skill for its larger ones.

The problems are planned without experience first. Then candidates are tried, and none is taken
whose plan is longer on any problem.

Where the regression mostly found the plans, it is tried alone, by one of its signs: planning
without experience tries two and takes the shorter plan, and by the better one alone its plan is
mostly the same. Elsewhere the regression is tried by one or two signs, with cheap ways forwards
that solved the largest problem. Small problems are solved well by every sign, so there the signs
are compared by beams several times narrower.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sign_model.clock import Clock
from sign_model.experience.skill import BOTH, Skill, attempt
from sign_model.map_algorithm.heuristics import (
    DEFAULTS,
    LANDMARKS,
    RELAXED_PLAN,
    HeuristicSign,
)
from sign_model.map_algorithm.map_planner import BEAMS, Rungs
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.rule import UNLEARNED, WAYS, PlanningRule
from sign_model.strategies.turns import Outcome, outcome_of

MOST = 0.8
"""The most expansions of a skill on the problems practised, as a share of those without it; on
larger problems it is less, since what is small is soon found in any way.
"""

_CHEAP = 0.1
"""A way forwards is taken if it solved the hardest problem with at most this share."""

_TURN = 4
"""How many times as many expansions a way may take as it took on the problems practised."""

_FAR = 1.15
"""How many times as long as expected a plan is that is not trusted."""


_SIGNS = (BOTH, RELAXED_PLAN, LANDMARKS)
"""Signs of the regression, the ones preferred first."""

_CHOICES = (*((sign,) for sign in _SIGNS), *itertools.combinations(_SIGNS, 2))
"""What a skill may rate by: one sign, or two signs with half as wide a beam each."""

_WIDTHS = (BEAMS[0], BEAMS[0] // 2)
"""Situations kept in a step, by all signs together."""

_NARROWER = (2, 4, 8)
"""So many times narrower beams compare the signs: they separate good ones from bad ones even on
small problems.
"""

_MOST_TRIED = 3
"""So many choices of each width are tried, the best ones first."""

_WHOLE = 1 << 30

_EVERY_PLAN = (0.0, 1e9)
"""Trusts every plan, as long as a skill is tried."""

_STEPS, _PATIENCE = 4, 16
"""A narrow beam may take so many times as many steps as the plan has, and so many without a better
rating.
"""

_ENOUGH = 3
"""Plans of so many lengths tell how what they take grows."""

_GROWTH = 1.0
"""The greatest power of the length by which the expansions of a step grow: small problems tell
little.
"""

_ALONE_BEAMS = ((24, 28), (32,))
"""Situations kept by one sign alone where the regression is the usual way: three eighths, or up to
half, of what planning without experience keeps by both of its signs.
"""

_ALONE = (RELAXED_PLAN, BOTH)
"""The signs for that, the ones preferred first. Where planning without experience finds a plan by
the same sign, this one is mostly the same.
"""

_CLEARLY = 0.05
"""By which share the plans of another sign must be shorter: less is chance on small problems."""


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
    is_usual = bool(taught) and _is_usual("backwards", taught)
    candidates = _candidates(domain, taught, is_usual, max_seconds) if taught else ()
    for place, skill in enumerate(candidates):
        tried = _tried(skill, taught, int(MOST * total), max_seconds)
        if tried is None:
            continue
        is_other = "backwards" not in skill.rule.turns or skill.width >= BEAMS[0]
        effort = (is_other, tried.raw_length, tried.expansions, place)
        key = (tried.is_new, tried.length, *effort)
        if best_key is None or key < best_key:
            rule = replace(skill.rule, trust=_trust(taught, tried.estimates))
            best, best_key, spent = replace(skill, rule=rule), key, tried.expansions
        if skill.is_alone:  # these come in the order of preference
            break
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
    domain: str, taught: Sequence[_Taught], is_usual: bool, max_seconds: float | None
) -> Iterator[Skill]:
    """Yields the skills to try, the ones preferred first."""
    # What the ways forwards take, each alone, on the problem that takes most.
    hardest = max(taught, key=lambda one: (one.expansions, one.length))
    most, turns = int(_CHEAP * hardest.expansions), {}
    for way in WAYS[1:]:
        rule = PlanningRule("practised", {way: max(1, most)}, improvement=0, trust=(0.0, 0.0))
        clock = Clock(max_seconds)
        found = outcome_of(hardest.task, DEFAULTS, rule, max_expansions=_WHOLE, clock=clock)
        if found.regression.plan is not None:
            turns[way] = _TURN * max(1, found.regression.expansions)

    # What a step of a plan takes on the largest problem, and how that grows.
    largest = max(taught, key=lambda one: (one.length, one.expansions))
    each = [one.expansions / one.length for one in taught]
    lengths = [one.length for one in taught]
    growth = 0.0
    if len(set(lengths)) >= _ENOUGH:
        growth = float(np.polyfit(np.log(lengths), np.log(each), 1)[0])
    known = (largest.expansions / largest.length, largest.length, min(_GROWTH, max(0.0, growth)))

    # Where the regression mostly found the plans, it does so by one sign.
    if is_usual:
        signs = _signs_in_order(taught, max_seconds)
        for beams, sign in itertools.product(_ALONE_BEAMS, signs):
            for beam in beams:
                backwards = {"backwards": _WHOLE}
                rule = PlanningRule(
                    "practised", backwards, improvement=0, beam=beam, trust=_EVERY_PLAN
                )
                yield Skill(domain, rule, (sign,), *known)

    # Elsewhere signs and beams: the choices that find short plans with much narrower beams.
    lengths_by = {sign.name: _narrow_lengths(sign, taught, max_seconds) for sign in _SIGNS}
    listed = []
    for width in _WIDTHS:
        by_score = sorted(_CHOICES, key=lambda signs: _score(signs, width, lengths_by))
        listed += [(signs, width // len(signs)) for signs in by_score[:_MOST_TRIED]]
    choices = [({"backwards": _WHOLE} | turns, signs, beam) for signs, beam in listed]
    for ways, signs, beam in (*choices, (turns, DEFAULTS, 32)):
        if ways:
            rule = PlanningRule("practised", ways, improvement=0, beam=beam, trust=_EVERY_PLAN)
            yield Skill(domain, rule, signs, *known)


def _signs_in_order(taught: Sequence[_Taught], max_seconds: float | None) -> list[HeuristicSign]:
    """Returns the signs by which the regression is tried alone: one comes before those preferred to
    it if its plans are shorter by more than `_CLEARLY`.
    """
    lengths, beam = {sign.name: 0 for sign in _ALONE}, _ALONE_BEAMS[0][0]
    for one in taught:
        for sign in _ALONE:
            rungs = Rungs(one.task, (sign,), Clock(max_seconds))
            found = rungs.tried(beam, _STEPS * beam * one.length, _PATIENCE)
            lengths[sign.name] += 2 * one.length if found.plan is None else len(found.plan)
    preferred = lengths[_ALONE[0].name]
    return sorted(
        _ALONE,
        key=lambda sign: (
            lengths[sign.name]
            if sign is _ALONE[0] or lengths[sign.name] < (1 - _CLEARLY) * preferred
            else preferred + 1
        ),
    )


def _narrow_lengths(
    sign: HeuristicSign, taught: Sequence[_Taught], max_seconds: float | None
) -> dict[int, list[int]]:
    """Returns {situations kept: the lengths of the plans that one sign finds}, each beam alone; a
    plan that is not found counts twice.
    """
    beams = sorted({w // (n * k) for w in _WIDTHS for n in (1, 2) for k in _NARROWER} - {0})
    lengths: dict[int, list[int]] = {beam: [] for beam in beams}
    for one in taught:
        rungs = Rungs(one.task, (sign,), Clock(max_seconds))
        for beam in beams:
            found = rungs.tried(beam, _STEPS * beam * one.length, _PATIENCE)
            lengths[beam].append(2 * one.length if found.plan is None else len(found.plan))
    return lengths


def _score(
    signs: tuple[HeuristicSign, ...], width: int, lengths_by: dict[str, dict[int, list[int]]]
) -> int:
    """Returns the sum of the lengths of all problems by beams that are narrower than `width`."""
    total = 0
    for times in _NARROWER:
        beam = max(1, width // (len(signs) * times))
        total += sum(map(min, zip(*(lengths_by[sign.name][beam] for sign in signs))))
    return total


def _is_usual(way: str, taught: Sequence[_Taught]) -> bool:
    """Returns whether one way found most of the plans without experience, that of the largest
    problem among them.
    """
    found = [one.outcome.finder == way for one in taught]
    return found[-1] and 2 * sum(found) > len(found)


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
