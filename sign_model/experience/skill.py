"""A skill: how to plan the problems of a domain with fewer expansions, learned from a few small
problems of it for larger ones (PY16 §3.1, metacognitive regulation).

A skill speaks of roles, never of objects: its signs weigh predicates and action schemas, its rule
names ways of planning, and it knows how many expansions a step of a plan took without experience.
So it serves every problem of its domain:

    its ways of planning have one turn each, and the shortest plan is taken
    the plan is improved part by part, by narrow beams first, until `SHARE` of the expansions that
      planning without experience would take are spent, and most of it was in vain at last
    a plan far longer than such plans were, or none at all, is a case for planning without
      experience; the shorter of both plans is kept, so none is lost

`experience.practice` makes skills.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.heuristics import (
    LANDMARKS,
    RELAXED_PLAN,
    HeuristicSign,
    sign_of,
)
from sign_model.map_algorithm.map_planner import Regression
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.improve import Patience, improve
from sign_model.strategies.rule import UNLEARNED, PlanningRule, rule_of
from sign_model.strategies.turns import Outcome, kept_or_unlearned, outcome_of, plan_by_rule

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

_AT_LEAST = 1.2
"""How many times the expansions that found a plan are spent at least, to improve it too."""

_BEAMS = (4, 8, 16)
"""How many situations are kept while a part of a plan is improved, pass by pass."""


@dataclass(frozen=True)
class Skill:
    """What was learned of a domain.

    Attributes:
      domain: names and arities of its predicates and schemas.
      rule: which ways of planning to take.
      signs: the heuristics of the regression.
      per_step: how many expansions a step of a plan takes without experience; None where nothing
        was learned, so that the rule alone plans.

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
        factor, more = self.rule.trust or (0.0, 0.0)
        return kept_or_unlearned(task, found, factor * outcome.estimate + more, **options)


def attempt(
    skill: Skill, task: PlanningTask, *, max_expansions: int, clock: Clock = NO_LIMIT
) -> tuple[Outcome, Regression]:
    """Returns what the ways of a skill make of a task, and that with the plan improved; arguments
    as of `Skill.plan`.
    """
    outcome = outcome_of(task, skill.signs, skill.rule, max_expansions=max_expansions, clock=clock)
    found = outcome.regression
    if not found.plan or outcome.mutex is None or skill.per_step is None:
        return outcome, found
    plan, spent = found.plan, found.expansions
    least = int(max(SHARE * skill.per_step * len(plan), _AT_LEAST * spent))
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
    return outcome, replace(found, plan=plan, expansions=spent)


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
        per_step = record.get("per_step")  # files of earlier versions have none
        if not isinstance(record["domain"], str) or not isinstance(per_step, float | int | None):
            raise TypeError("domain must be text, per_step a number")
        signs = tuple(sign_of(entry) for entry in record["signs"])
        return Skill(record["domain"], rule_of(record["rule"]), signs, per_step)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise ValueError(f"{where}: not a skill ({error}): write it with save_memory") from None
