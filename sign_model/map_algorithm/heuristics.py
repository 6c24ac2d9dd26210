"""The A-step's heuristics as small records that signs mediate, and that learning modifies.

A rating of a situation S is a sum of four weighted counts, each over the predicates (or action
schemas) it names:

    landmarks   features that S still needs on every way from the start
    plan        actions of the relaxed plans of the features of S
    held        features of S that hold in the start
    unmet       features of S that do not

Weights are whole numbers by name. Two names stand for many: "*" every name not given, "@goal" the
predicates of the goal.
"""

import json
import os
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field

Weights = Mapping[str, int]


@dataclass(frozen=True)
class HeuristicSign:
    """One heuristic: the weights by which it rates a situation. An empty table counts nothing.

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
"""How much of the situation the start lacks: the rule of the paper's authors."""

LANDMARKS = HeuristicSign("landmarks", landmarks={"*": 1}, held={"@goal": 1}, unmet={"@goal": 1})
"""Landmarks still needed, and what the situation keeps of the kinds that the goal asks for."""

RELAXED_PLAN = HeuristicSign("relaxed plan", plan={"*": 1}, held={"@goal": 1}, unmet={"@goal": 1})
"""Size of the relaxed plan, and what the situation keeps of the kinds that the goal asks for."""

DEFAULTS = (LANDMARKS, RELAXED_PLAN)
"""Unlearned and domain-independent. They are tried side by side: neither serves all domains."""


def weight_of(weights: Weights, name: str, goal_names: Iterable[str] = ()) -> int:
    """Returns the weight of a predicate or schema: its own, else that of "@goal" where it applies,
    else that of "*", else 0.
    """
    if name in weights:
        return weights[name]
    if "@goal" in weights and name in goal_names:
        return weights["@goal"]
    return weights.get("*", 0)


def save_signs(path: str | pathlib.Path, signs: Sequence[HeuristicSign]) -> None:
    """Writes signs as JSON, whole or not at all.

    Examples:
      >>> import sign_model
      >>> sign = sign_model.HeuristicSign("mine", landmarks={"*": 1}, unmet={"@goal": 2})
      >>> import os, tempfile
      >>> path = os.path.join(tempfile.mkdtemp(), "signs.json")
      >>> sign_model.save_signs(path, [sign])
      >>> [one.name for one in sign_model.load_signs(path)]
      ['mine']
    """
    target = pathlib.Path(path)
    text = json.dumps(
        {
            "heuristic_signs": [
                {k: v if k == "name" else dict(v) for k, v in asdict(s).items()} for s in signs
            ]
        },
        indent=1,
    )
    unfinished = target.with_name(target.name + f".{os.getpid()}.part")
    try:
        unfinished.write_text(text + "\n", encoding="utf-8")
        os.replace(unfinished, target)
    finally:
        unfinished.unlink(missing_ok=True)


def load_signs(path: str | pathlib.Path) -> tuple[HeuristicSign, ...]:
    """Returns the signs that `save_signs` wrote; ValueError names the file and what is wrong with
    it.

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
        entries = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))["heuristic_signs"]
        return tuple(_checked_sign(entry) for entry in entries)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path}: not a file of heuristic signs ({error}): write one with save_signs"
        ) from None


def _checked_sign(entry: dict) -> HeuristicSign:
    name, tables = entry["name"], {key: value for key, value in entry.items() if key != "name"}
    for key, table in tables.items():
        if key not in ("landmarks", "plan", "held", "unmet"):
            raise ValueError(f"'{key}' is no count of a heuristic sign")
        for weight in table.values():
            if not isinstance(weight, int) or isinstance(weight, bool) or not 0 <= weight <= 255:
                raise ValueError(f"weight {weight!r} must be a whole number from 0 to 255")
    return HeuristicSign(str(name), **tables)
