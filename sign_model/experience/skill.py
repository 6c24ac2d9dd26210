"""A skill: how to plan the problems of a domain with fewer expansions, learned from a few small
problems of it for larger ones (PY16 §3.1, metacognitive regulation).

A skill speaks of roles, never of objects: its signs weigh predicates and action schemas, its rule
names ways of planning, and it knows how many expansions a step of a plan took without experience.
So it serves every problem of its domain:

    its ways of planning have one turn each, and the shortest plan is taken
    where that is longer than planning without experience would take at once, the regression looks
      again with as many situations as that keeps; where the regression by one sign is all that was
      learned, other ways look beside it, as far as `SHARE` allows
    where there is no plan, or a far longer one than such plans were, the other ways of planning
      take their turns until one has a plan
    the plan is improved part by part, by narrow beams first, until `SHARE` of the expansions that
      planning without experience would take are spent, and most of it was in vain at last
    a plan that is still far too long, or none at all, is a case for planning without experience;
      the shorter of both plans is kept, so none is lost

`experience.practice` makes skills.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.heuristics import (
    DEFAULTS,
    LANDMARKS,
    RELAXED_PLAN,
    HeuristicSign,
    sign_of,
)
from sign_model.map_algorithm.map_planner import BEAMS, Regression
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.improve import Patience, improve
from sign_model.strategies.rule import UNLEARNED, PlanningRule, rule_of
from sign_model.strategies.turns import (
    NEAR,
    Outcome,
    kept_or_unlearned,
    outcome_of,
    plan_by_rule,
)

SHARE = 0.45
"""The least expansions of a skill, as a share of those that planning without it would take."""

BOTH = HeuristicSign(
    "landmarks and relaxed plan",
    landmarks=LANDMARKS.landmarks,
    plan=RELAXED_PLAN.plan,
    held=LANDMARKS.held,
    unmet=LANDMARKS.unmet,
)
"""The sum of the unlearned signs: alone about as good as both of them tried one by one."""

_AT_LEAST = 1.1
"""How many times the expansions that found a plan are spent at least, to improve it too."""

_AT_ONCE, _NOT_AT_ONCE = 58, 100
"""The expansions of a step of a plan that planning without experience finds by its first
regression: its two signs keep 32 situations each, less at first; and where it then looks further,
since the plan is longer than `NEAR` times the estimate.
"""

_AFTER_STALL = 2.5
"""How many times what found a plan after the regression stalled planning without experience takes
at least: about half of it improves the plan.
"""

_AFTER_FAILURE = 3.3
"""The same where the regression found the plans of small problems, and then stalls."""

_GROSS = 1.5
"""How many times as long as trusted a plan may be at most that was improved so far."""

_FEW_AT_ONCE = 8
"""So many situations are rated together by the deferred search where little of the share is left:
where planning without experience would leave the plan as it is.
"""

_ASTRAY = 1.1
"""How many times as many steps as its plan needs a regression takes at most that is trusted."""

_WIDE = BEAMS[0]
"""How many situations planning without experience keeps in a step at first."""

_BEAMS = (4, 8, 16)
"""How many situations are kept while a part of a plan is improved, pass by pass."""


@dataclass(frozen=True)
class Skill:
    """What was learned of a domain.

    Attributes:
      domain: names and arities of its predicates and schemas.
      rule: which ways of planning to take.
      signs: the heuristics of the regression.
      per_step: how many expansions a step of a plan takes without experience on the largest
        problem practised; None where nothing was learned, so that the rule alone plans.
      length: of the plan of that problem.
      growth: `per_step` grows by this power of the length where the regression stalls.

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
    per_step: float | None = None
    length: int = 0
    growth: float = 0.0

    def plan(
        self, task: PlanningTask, *, max_expansions: int, clock: Clock = NO_LIMIT
    ) -> Regression:
        """Returns the shortest plan found, its actions numbered as in the task, a proof that there
        is none, or a spent budget.

        Args:
          task: of the domain.
          max_expansions: the most situations expanded in all.
          clock: once its limit has passed, the best plan so far is returned.

        Examples:
          >>> import sign_model
          >>> from sign_model.blocks import random_blocks_tasks
          >>> task = random_blocks_tasks(4, 1)[0]
          >>> memory = sign_model.Memory().practised([random_blocks_tasks(3, 1)[0]])
          >>> found = memory.skill(task).plan(task, max_expansions=1000)
          >>> len(found.plan) == len(sign_model.plan(task).actions)
          True
        """
        options = {"max_expansions": max_expansions, "clock": clock}
        if self.per_step is None:
            return plan_by_rule(task, self.signs, self.rule, **options)
        outcome, found = attempt(self, task, **options)
        if found.is_proof:
            return found
        is_regressed = found.plan is not None and outcome.finder == "backwards"
        if is_regressed and not self.is_alone:
            return found
        trusted = _trusted(self, outcome)
        if found.plan is None or (len(found.plan) > trusted and not is_regressed):
            found = _second_opinion(self, task, found, **options)
        return kept_or_unlearned(task, found, _GROSS * trusted, **options)

    @property
    def is_alone(self) -> bool:
        """Whether the regression is the only way that was learned."""
        return list(self.rule.turns) == ["backwards"]

    @property
    def width(self) -> int:
        """How many situations all signs of the regression keep in a step."""
        return self.rule.beam * len(self.signs)

    def expected(self, outcome: Outcome, length: int, spent: int) -> float:
        """Returns how many expansions planning without experience would take for a plan of this
        length, an estimate; `spent` were to find it.
        """
        if outcome.finder == "backwards":
            return length * (_AT_ONCE if _is_near(outcome, length) else _NOT_AT_ONCE)
        known = length * max(_AT_ONCE, self.per_step or 0.0)
        if "backwards" in outcome.lengths:
            return known
        longer = max(1.0, length / max(1, self.length))
        times = _AFTER_FAILURE if self.is_alone else _AFTER_STALL
        return max(known * longer**self.growth, times * spent)


def attempt(
    skill: Skill, task: PlanningTask, *, max_expansions: int, clock: Clock = NO_LIMIT
) -> tuple[Outcome, Regression]:
    """Returns what the ways of a skill make of a task, and that with the plan improved; arguments
    as of `Skill.plan`.
    """
    options = {"max_expansions": max_expansions, "clock": clock}
    outcome = outcome_of(task, skill.signs, skill.rule, **options)
    found = outcome.regression
    if not found.plan or outcome.mutex is None or skill.per_step is None:
        return outcome, found

    # Where planning without experience would look further, or the plan is far longer than such
    # plans were, a wider beam does.
    is_trusted = len(found.plan) <= _trusted(skill, outcome)
    is_short = is_trusted and _is_near(outcome, len(found.plan))
    if skill.is_alone:
        found = _beside(skill, task, outcome, found, **options)
    elif outcome.finder == "backwards" and skill.width < _WIDE and not is_short:
        signs = skill.signs[:1] if is_trusted else (LANDMARKS,)  # by another sign
        found = _shorter(found, _wide(signs, task, found, **options).regression)
    elif outcome.finder == "backwards" and skill.width >= _WIDE and is_short:
        return outcome, found  # it would be left as it is
    return outcome, _improved(skill, task, outcome, found, **options)


def _beside(
    skill: Skill,
    task: PlanningTask,
    outcome: Outcome,
    found: Regression,
    *,
    max_expansions: int,
    clock: Clock,
) -> Regression:
    """Returns the shorter plan of the one that the regression found, and of those of other ways
    with what is left of the share: the goals one by one, what is new, and the deferred search;
    where the regression went astray, a narrower one by another sign.
    """
    assert found.plan is not None
    length = len(found.plan)
    room = int(SHARE * skill.expected(outcome, length, found.expansions)) - found.expansions
    signs: Sequence[HeuristicSign] = DEFAULTS
    turns = {"goal by goal": length, "curiously": length, "deferred": room}
    at_once = _FEW_AT_ONCE if _is_near(outcome, length) else UNLEARNED.at_once
    if outcome.lengths["backwards"] > _ASTRAY * length:
        signs = [sign for sign in (BOTH, RELAXED_PLAN) if sign not in skill.signs][:1] or DEFAULTS
        turns, room = {"backwards": 1 << 30}, max_expansions
    room = min(room, max_expansions - found.expansions)
    if room < length:
        return found
    beam = max(1, skill.rule.beam // 2)
    rule = PlanningRule(
        "beside", turns, improvement=0, beam=beam, at_once=at_once, trust=(0.0, 0.0)
    )
    other = outcome_of(task, signs, rule, max_expansions=room, clock=clock)
    return _shorter(found, other.regression)


def _trusted(skill: Skill, outcome: Outcome) -> float:
    """Returns how long a plan may be that is taken as it is."""
    factor, more = skill.rule.trust or (0.0, 0.0)
    return factor * outcome.estimate + more


def _wide(
    signs: Sequence[HeuristicSign],
    task: PlanningTask,
    found: Regression,
    *,
    max_expansions: int,
    clock: Clock,
) -> Outcome:
    """Returns what the regression makes of the task with as many situations as without
    experience.
    """
    rule = PlanningRule("wide", {"backwards": 1 << 30}, improvement=0, beam=_WIDE, trust=(0.0, 0.0))
    left = max(1, max_expansions - found.expansions)
    return outcome_of(task, signs, rule, max_expansions=left, clock=clock)


def _is_near(outcome: Outcome, length: int) -> bool:
    """Returns whether planning without experience would leave a plan of this length as it is."""
    return length <= NEAR * outcome.estimate


def _shorter(one: Regression, other: Regression) -> Regression:
    """Returns the regression of the shorter plan, the first of two equal ones, with the expansions
    of both.
    """
    is_other = other.plan is not None and (one.plan is None or len(other.plan) < len(one.plan))
    return replace(other if is_other else one, expansions=one.expansions + other.expansions)


def _second_opinion(
    skill: Skill,
    task: PlanningTask,
    found: Regression,
    *,
    max_expansions: int,
    clock: Clock,
) -> Regression:
    """Returns the shorter plan of the one found, and of the wide regression by the first unlearned
    sign; or, where that has none or the regression was tried alone, of the other ways in turn.
    """
    options = {"max_expansions": max_expansions, "clock": clock}
    outcome = None if skill.is_alone else _wide((RELAXED_PLAN,), task, found, **options)
    if outcome is None or not (outcome.regression.plan or outcome.regression.is_proof):
        found = found if outcome is None else _shorter(found, outcome.regression)
        spent = max(2, found.expansions)
        turns = {way: min(turn, spent // 2) for way, turn in UNLEARNED.turns.items()}
        left = max(1, max_expansions - spent)
        del turns["backwards"]
        rule = PlanningRule("others", turns, improvement=0, trust=(0.0, 0.0))
        outcome = outcome_of(task, DEFAULTS, rule, max_expansions=left, clock=clock)
    other = outcome.regression
    if other.is_proof:
        return replace(other, expansions=found.expansions + other.expansions)
    found = _shorter(found, other)
    if found.plan and outcome.mutex is not None:
        found = _improved(skill, task, outcome, found, **options)
    return found


def _improved(
    skill: Skill,
    task: PlanningTask,
    outcome: Outcome,
    found: Regression,
    *,
    max_expansions: int,
    clock: Clock,
) -> Regression:
    """Returns what was found with its plan improved part by part."""
    assert found.plan is not None and outcome.mutex is not None
    plan, spent = found.plan, found.expansions
    expected = skill.expected(outcome, len(plan), spent)
    least = int(max(SHARE * expected, 0 if skill.is_alone else _AT_LEAST * spent))
    patience = Patience(least, spent, spent, spent)
    for beam in _BEAMS:
        if patience.is_over:
            break
        plan, more = improve(
            task,
            outcome.mutex,
            plan,
            effort=UNLEARNED.improvement * max_expansions,
            signs=(BOTH,),
            beam=beam,
            patience=patience,
            max_expansions=max_expansions - spent,
            clock=clock,
        )
        spent += more
    return replace(found, plan=plan, expansions=spent)


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
        # files of earlier versions lack some
        per_step, length = record.get("per_step"), record.get("length", 0)
        growth = record.get("growth", 0.0)
        if not isinstance(record["domain"], str) or not isinstance(per_step, float | int | None):
            raise TypeError("domain must be text, per_step a number")
        if not isinstance(length, int) or not isinstance(growth, float | int):
            raise TypeError("length and growth must be numbers")
        signs = tuple(sign_of(entry) for entry in record["signs"])
        return Skill(record["domain"], rule_of(record["rule"]), signs, per_step, length, growth)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"{where}: not a skill ({error}): write it with save_memory") from None
