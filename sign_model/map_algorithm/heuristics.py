"""The heuristics of the A-step as small records: each is mediated by a sign and can be modified by
learning (PY16 §3.1).

The rating of a situation S is a sum of four weighted counts, each over the predicates (or action
schemas) that it names:

    landmarks   features that are needed on every way from the start to S
    plan        actions of the relaxed plans of the features of S
    held        features of S that hold at the start
    unmet       features of S that do not hold at the start

Weights are whole numbers by name. Two names stand for several: "@goal" for the predicates of the
goal, and "*" for every other name.
"""

import json
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from sign_model.foundation.files import atomic_write, read_text

Weights = Mapping[str, int]


COUNTS = ("landmarks", "plan", "held", "unmet")
"""The tables of a sign."""


@dataclass(frozen=True)
class HeuristicSign:
    """One heuristic: the weights by which it rates a situation, {predicate or schema: weight}. An
    empty table counts nothing.

    Examples:
      >>> import sign_model
      >>> sign = sign_model.HeuristicSign("mine", landmarks={"*": 1}, unmet={"@goal": 2})
      >>> sign.landmarks["*"], sign.plan
      (1, {})
    """

    name: str
    landmarks: Weights = field(default_factory=dict)
    plan: Weights = field(default_factory=dict)
    held: Weights = field(default_factory=dict)
    unmet: Weights = field(default_factory=dict)


OVERLAP = HeuristicSign("overlap", unmet={"*": 1})
"""The number of features of the situation that do not hold at the start: the rule of the paper's
authors.
"""

LANDMARKS = HeuristicSign("landmarks", landmarks={"*": 1}, held={"@goal": 1}, unmet={"@goal": 1})
"""The number of landmarks, and of features whose predicate occurs in the goal."""

RELAXED_PLAN = HeuristicSign("relaxed plan", plan={"*": 1}, held={"@goal": 1}, unmet={"@goal": 1})
"""The size of the relaxed plan, and the number of features whose predicate occurs in the goal."""

DEFAULTS = (LANDMARKS, RELAXED_PLAN)
"""Unlearned and domain-independent. Both are tried: neither is best in all domains."""


def weight_of(weights: Weights, name: str, goal_names: Iterable[str] = ()) -> int:
    """Returns the weight of a predicate or schema: its own, else that of "@goal" if the name is one
    of `goal_names`, else that of "*", else 0.
    """
    if name in weights:
        return weights[name]
    if "@goal" in weights and name in goal_names:
        return weights["@goal"]
    return weights.get("*", 0)


def save_signs(path: str | pathlib.Path, signs: Sequence[HeuristicSign]) -> None:
    """Writes signs as JSON; the file is replaced as a whole or not at all. `srt-jax plan --signs
    FILE` plans by them.

    Examples:
      >>> import sign_model
      >>> sign = sign_model.HeuristicSign("mine", landmarks={"*": 1}, unmet={"@goal": 2})
      >>> import os, tempfile
      >>> path = os.path.join(tempfile.mkdtemp(), "signs.json")
      >>> sign_model.save_signs(path, [sign])
      >>> [one.name for one in sign_model.load_signs(path)]
      ['mine']
    """
    text = json.dumps(
        {
            "heuristic_signs": [
                {k: v if k == "name" else dict(v) for k, v in asdict(s).items()} for s in signs
            ]
        },
        indent=1,
    )
    with atomic_write(path) as file:
        file.write(text + "\n")


def load_signs(path: str | pathlib.Path) -> tuple[HeuristicSign, ...]:
    """Returns the signs that `save_signs` wrote.

    Raises:
      ValueError: the file cannot be read or does not contain heuristic signs; the message names the
        file and the fault.

    Examples:
      >>> import sign_model
      >>> sign = sign_model.HeuristicSign("mine", landmarks={"*": 1}, unmet={"@goal": 2})
      >>> import os, tempfile
      >>> path = os.path.join(tempfile.mkdtemp(), "signs.json")
      >>> sign_model.save_signs(path, [sign])
      >>> sign_model.load_signs(path) == (sign,)
      True
    """
    try:
        entries = json.loads(read_text(path, what="file of heuristic signs"))["heuristic_signs"]
        return tuple(sign_of(entry) for entry in entries)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(
            f"{path}: not a file of heuristic signs ({error}): write one with save_signs"
        ) from None


def sign_of(entry: dict[str, Any]) -> HeuristicSign:
    """Returns one sign of a file; raises ValueError, KeyError or TypeError if it is not one."""
    name, tables = entry["name"], {key: value for key, value in entry.items() if key != "name"}
    for key, table in tables.items():
        if key not in COUNTS:
            raise ValueError(f"'{key}' is not a count of a heuristic sign")
        for weight in table.values():
            if not isinstance(weight, int) or isinstance(weight, bool) or not 0 <= weight <= 255:
                raise ValueError(f"weight {weight!r} must be a whole number from 0 to 255")
    return HeuristicSign(str(name), **tables)
