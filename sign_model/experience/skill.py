"""A skill: which way of planning serves a domain, by which heuristic signs, learned from a few
small problems of it for larger ones (PY16 §3.1, metacognitive regulation).

A skill speaks of roles, never of objects: it weighs predicates and action schemas, and its rule
names ways of planning. So it serves every problem of its domain. Candidates are tried on the
problems practised, and compared with planning without experience. None is taken whose plan is
longer on any of them, or that takes more than `SHARE` of the expansions; of the rest one that plans
as the problems were planned without experience, but narrowly, and gives short plans.

On another problem its plan is trusted only as far as experience goes. How long plans without
experience are was seen on the problems practised, beside an estimate that costs nothing; a line
through these lengths, raised by the greatest distance from it, tells how long they will be. A plan
that is longer is not trusted, and planning without experience has its say too. Where the smaller
problems would not have taught to trust the plan of the largest, nothing is learned.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from sign_model.clock import Clock
from sign_model.map_algorithm.heuristics import (
    DEFAULTS,
    LANDMARKS,
    RELAXED_PLAN,
    HeuristicSign,
    sign_of,
)
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.rule import UNLEARNED, WAYS, PlanningRule, rule_of
from sign_model.strategies.turns import Outcome, outcome_of

SHARE = 0.35
"""The most expansions of a skill on the problems practised, as a share of those without it."""

_BEAMS = (4, 8, 16, 32)
_EFFORTS = (0, 1000, 4000, 16000)
_TURN = 8000
"""Expansions before a skill gives up."""


@dataclass(frozen=True)
class Skill:
    """What was learned of a domain.

    Attributes:
      domain: names and arities of its predicates and schemas.
      rule: which way of planning to take.
      signs: the heuristics of the regression.

    Examples:
      >>> import sign_model
      >>> from sign_model.blocks import random_blocks_tasks
      >>> tasks = [random_blocks_tasks(n, 1, seed=n)[0] for n in (3, 4)]
      >>> memory = sign_model.Memory().practised(tasks)
      >>> skill = memory.skill(random_blocks_tasks(8, 1, seed=0)[0])
      >>> isinstance(skill, sign_model.Skill)
      True
    """

    domain: str
    rule: PlanningRule
    signs: tuple[HeuristicSign, ...]


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
    unlearned = [
        outcome_of(
            task, DEFAULTS, UNLEARNED, max_expansions=max_expansions, clock=Clock(max_seconds)
        )
        for task in tasks
    ]
    teaching = [
        (task, one) for task, one in zip(tasks, unlearned) if one.regression.plan is not None
    ]
    nothing = Skill(domain, UNLEARNED, DEFAULTS)
    total = sum(one.regression.expansions for _, one in teaching)
    best, best_key, most = nothing, None, SHARE * total
    bounds = [len(one.regression.plan or ()) for _, one in reversed(teaching)]
    usual = max(UNLEARNED.turns, key=[one.finder for _, one in teaching].count)
    for rule, signs in _candidates() if teaching else ():
        raw_length, before = None, None
        for effort in _EFFORTS:
            tried = replace(rule, effort=effort)
            found = _trial(tried, signs, teaching, most, max_seconds)
            if found is None:  # no plan, or too dear: more effort makes it no cheaper
                break
            is_useless, before = before == found.lengths, found.lengths
            if effort > _EFFORTS[1] and is_useless:
                break  # more effort brings nothing; a little is kept for larger problems
            if found.is_longer:
                continue  # more effort may help
            length = sum(found.lengths)
            raw_length = length if raw_length is None else raw_length
            # First those found as they are without experience: what scales there scales here. Then
            # the shortest plans, of those the least improved ones, and of those the most thorough
            # way that there is room for: what is just enough for small problems fails on larger.
            is_new = usual not in rule.turns
            width = rule.beam * len(signs)
            key = (is_new, length, raw_length, -width, -effort, found.expansions)
            if best_key is None or key < best_key:
                best_key = key
                best = Skill(domain, replace(tried, trust=_trust(found.estimates, bounds)), signs)
    # What is left of the share goes to other ways, so that the shortest of several plans is taken.
    if best_key is not None:
        for way in WAYS:
            more = replace(best.rule, turns={**best.rule.turns, way: _TURN})
            if way in best.rule.turns:
                continue
            found = _trial(more, best.signs, teaching, most, max_seconds)
            if found and not found.is_longer and sum(found.lengths) <= best_key[1]:
                best = replace(best, rule=replace(more, trust=_trust(found.estimates, bounds)))
                best_key = (*best_key[:-1], found.expansions)
    # Would the smaller problems have taught to trust the plan of the largest? If not, experience
    # does not carry over here, and would only be paid for.
    if best_key is not None and len(bounds) > 1:
        found = _trial(best.rule, best.signs, teaching, most, max_seconds)
        assert found is not None  # it was tried before
        factor, more = _trust(found.estimates[1:], bounds[1:])
        if found.lengths[0] > factor * found.estimates[0] + more:
            best, best_key = nothing, None
    if log is not None:
        log(_report(best, best_key, total, teaching))
    return best


def _report(
    skill: Skill,
    key: tuple[int, ...] | None,
    total: int,
    teaching: Sequence[tuple[PlanningTask, Outcome]],
) -> str:
    if key is None:
        return f"{len(teaching)} problems: nothing serves better than planning without experience"
    ways, signs = ", ".join(skill.rule.turns), ", ".join(sign.name for sign in skill.signs)
    return (
        f"{len(teaching)} problems: {ways} (signs {signs}; beam {skill.rule.beam}, effort"
        f" {skill.rule.effort}), {key[-1]} expansions for {total} without experience"
    )


def _candidates() -> Iterator[tuple[PlanningRule, tuple[HeuristicSign, ...]]]:
    """Yields (rule, signs), without trust and effort."""
    for ways in (
        ("goal by goal",),
        ("boldly",),
        ("forwards",),
        ("deferred",),
        ("goal by goal", "boldly"),
        ("goal by goal", "boldly", "deferred"),
    ):
        yield PlanningRule("practised", dict.fromkeys(ways, _TURN)), DEFAULTS
    for signs in (DEFAULTS, (LANDMARKS,), (RELAXED_PLAN,)):
        for beam in _BEAMS:
            yield PlanningRule("practised", {"backwards": _TURN}, beam=beam), signs


class _Tried(NamedTuple):
    """What a candidate makes of the problems, from the largest down; it ends with the first plan
    that is longer than without experience.
    """

    lengths: list[int]
    expansions: int
    estimates: list[int]
    is_longer: bool


def _trial(
    rule: PlanningRule,
    signs: tuple[HeuristicSign, ...],
    teaching: Sequence[tuple[PlanningTask, Outcome]],
    most: float,
    max_seconds: float | None,
) -> _Tried | None:
    """Returns what a candidate makes of the problems; None where one gets no plan within `most`
    expansions of all of them.
    """
    lengths, spent, estimates = [], 0, []
    for task, one in reversed(teaching):  # the largest first: it soonest spends what there is
        left = max(1, int(most) - spent)
        found = outcome_of(task, signs, rule, max_expansions=left, clock=Clock(max_seconds))
        spent += found.regression.expansions
        plan = found.regression.plan
        if plan is None or spent > most:
            return None
        lengths.append(len(plan))
        estimates.append(found.estimate)
        if len(plan) > len(one.regression.plan or ()):
            return _Tried(lengths, spent, estimates, True)
    return _Tried(lengths, spent, estimates, False)


def _trust(estimates: Sequence[int], lengths: Sequence[int]) -> tuple[float, float]:
    """Returns (a, b): a plan of more than a n + b steps, for an estimate n, is longer than
    those made without experience.
    """
    n, length = np.array(estimates, float), np.array(lengths, float)
    if len(set(estimates)) < 3:
        return float((length / np.maximum(n, 1)).max()), 0.0
    factor, more = np.polyfit(n, length, 1)
    raised = more + (length - factor * n - more).max()
    return float(factor), float(raised + 1e-6)  # lengths on the line are not above it


def plain_skill(skill: Skill) -> dict[str, Any]:
    """Returns a skill as plain data, for JSON."""
    record = asdict(skill)
    record["rule"]["turns"] = [[way, effort] for way, effort in skill.rule.turns.items()]
    return record


def skill_of(record: Mapping[str, Any], where: str) -> Skill:
    """Returns the inverse of `plain_skill`.

    Raises:
      ValueError: a part is missing or of a wrong type; names `where`.
    """
    try:
        if not isinstance(record["domain"], str):
            raise TypeError("domain must be text")
        signs = tuple(sign_of(entry) for entry in record["signs"])
        return Skill(record["domain"], rule_of(record["rule"]), signs)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"{where}: not a skill ({error}): write it with save_memory") from None
