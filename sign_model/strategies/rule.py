"""Which way of planning to take, and when to give up: the metacognitive rule as a small record.

The choice between ways of planning is the task of metacognitive regulation, and a rule of it is the
agent's own, like a heuristic: mediated by a sign, and modified by experience (PY16 §3.1). The ways
take turns. A way that stalls, or has spent its turn, waits until all others have had theirs; each
round gives longer turns. So what one way solves quickly is never lost to another.

    backwards     regression with a beam, as in reference [17] of PY16; gives up when no situation
                  was rated better for many steps
    curiously     forwards, what is new first
    goal by goal  forwards, one goal after the other
    boldly        forwards, carrying out whole relaxed plans
    forwards      forwards, every situation rated before one is chosen; landmarks as a second rating
    deferred      the same, but situations are rated only when their turn comes
"""

import json
import math
import pathlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from sign_model.foundation.files import atomic_write, read_text

WAYS = ("backwards", "curiously", "goal by goal", "boldly", "forwards", "deferred")
"""The names of the ways of planning."""


@dataclass(frozen=True)
class PlanningRule:
    """A metacognitive rule.

    Attributes:
      name: of the sign that mediates it.
      turns: {way: expansions of its first turn}, in the order of the turns; a way that is not
        named is never taken.
      growth: by which factor turns grow from round to round.
      improvement: the most effort that improves the plan found, in units of about a microsecond for
        each expansion of the budget; 0 leaves plans as they are found.
      beam: how many situations the regression keeps in a step at first.
      effort: how much of that effort each step of the plan found is worth; by what the plan took
        where None.
      trust: (a, b): every way has one turn, and the shortest plan is taken if it has at most a n +
        b steps, where n is an estimate of the least length; else `UNLEARNED` plans as well, and the
        shorter plan is kept. The first plan is taken where None.
      at_once: how many situations the ways forwards rate together.

    Examples:
      >>> import sign_model
      >>> rule = sign_model.PlanningRule("mine", turns={"forwards": 500, "backwards": 2000})
      >>> list(rule.turns), rule.growth
      (['forwards', 'backwards'], 4)
    """

    name: str
    turns: Mapping[str, int] = field(default_factory=dict)
    growth: int = 4
    improvement: int = 40
    beam: int = 32
    effort: int | None = None
    trust: tuple[float, float] | None = None
    at_once: int = 32

    def __post_init__(self) -> None:
        if not self.turns or not set(self.turns) <= set(WAYS):
            raise ValueError(
                f"a planning rule takes its ways from {', '.join(WAYS)}, at least one, got"
                f" {', '.join(self.turns) or 'none'}"
            )
        numbers = (*self.turns.values(), self.growth - 1, self.improvement + 1)
        numbers += (self.beam, self.at_once)
        numbers += () if self.effort is None else (self.effort + 1,)
        if not all(isinstance(n, int) and n >= 1 for n in numbers):
            raise ValueError(
                f"the planning rule '{self.name}' needs whole numbers: turns, beam and at_once from"
                " 1 up, growth from 2 up, improvement and effort from 0 up"
            )
        if self.trust is not None and not (len(self.trust) == 2 and all(map(_is_real, self.trust))):
            raise ValueError(
                f"the planning rule '{self.name}' needs two numbers as its trust, got {self.trust}"
            )


def _is_real(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


UNLEARNED = PlanningRule(
    "unlearned",
    {
        "backwards": 8000,
        "curiously": 16000,
        "goal by goal": 4000,
        "boldly": 1000,
        "forwards": 4000,
        "deferred": 4000,
    },
)
"""The rule of an agent without experience."""


def save_rule(path: str | pathlib.Path, rule: PlanningRule) -> None:
    """Writes a rule as JSON; the file is replaced as a whole or not at all. `srt-jax plan --rule
    FILE` plans by it.

    Examples:
      >>> import os, tempfile
      >>> import sign_model
      >>> path = os.path.join(tempfile.mkdtemp(), "rule.json")
      >>> sign_model.save_rule(path, sign_model.PlanningRule("mine", {"backwards": 100}))
      >>> sign_model.load_rule(path).turns
      {'backwards': 100}
    """
    record = asdict(rule) | {"turns": [[way, effort] for way, effort in rule.turns.items()]}
    with atomic_write(path) as file:
        file.write(json.dumps({"planning_rule": record}, indent=1) + "\n")


def load_rule(path: str | pathlib.Path) -> PlanningRule:
    """Returns the rule that `save_rule` wrote.

    Raises:
      ValueError: the file cannot be read or does not contain a rule; the message names the file and
        the fault.

    Examples:
      >>> import os, tempfile
      >>> import sign_model
      >>> path = os.path.join(tempfile.mkdtemp(), "rule.json")
      >>> sign_model.save_rule(path, sign_model.PlanningRule("mine", {"forwards": 100}))
      >>> sign_model.load_rule(path).name
      'mine'
    """
    try:
        return rule_of(json.loads(read_text(path, what="planning rule"))["planning_rule"])
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(
            f"{path}: not a planning rule ({error}): give a file written by save_rule"
        ) from None


def rule_of(record: dict[str, Any]) -> PlanningRule:
    """Returns the rule of a record of a file; KeyError, TypeError or ValueError if it is not
    one.
    """
    fields: dict[str, Any] = record | {"turns": dict(record["turns"])}
    if fields.get("trust") is not None:
        fields["trust"] = tuple(fields["trust"])
    return PlanningRule(**fields)
