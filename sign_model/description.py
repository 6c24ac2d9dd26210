"""A world model in words, and as a drawing: text for people, DOT for Graphviz."""

from collections.abc import Iterable, Iterator

import numpy as np

from sign_model.map_algorithm.plan_specification import SPECIFY, Step
from sign_model.signs.from_tasks import GOAL, START
from sign_model.signs.matrix import ColumnKind, Component, num_matrices
from sign_model.signs.network import is_procedural, networks
from sign_model.signs.sign import PredictionMatrix, Sign
from sign_model.signs.world_model import WorldModel

NETWORK_NAMES = {Component.IMAGE: "W_p", Component.SIGNIFICANCE: "W_m", Component.MEANING: "W_a"}
COMPONENT_NAMES = {
    Component.IMAGE: "image",
    Component.SIGNIFICANCE: "significance",
    Component.MEANING: "personal meaning",
}
_COLOURS = {Component.IMAGE: "black", Component.SIGNIFICANCE: "blue", Component.MEANING: "red"}


def describe(model: WorldModel, *, names: Iterable[str] | str | None = None) -> str:
    """Returns the signs, their matrices and the three networks as text; for a model without signs,
    only the heading.

    The world model of a task opens with what matters: what there is, the start, what is wanted.
    Its situations and actions come first, its facts and acts last.

    A matrix reads from its first moment to its last: `nose -> mouth`. Effects follow `=>`: `+` what
    is added, `-` what is deleted. `[strict order]` marks a component of a procedural sign, whose
    columns have the same order in all its matrices. Links are listed once, under the sign where
    they begin; signs that are asked for by name say too which others need them.

    Args:
      model: the world model.
      names: the signs to describe, in this order, or the name of one; by default all.

    Raises:
      ValueError: a name is not the name of a sign.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> model = sign_model.world_model_of(task)
      >>> for line in sign_model.describe(model, names="(open)").splitlines()[2:]:
      ...     print(line)
      (open)
        image
          1. predicate open
          W_p: predicate open
        needed in W_a by: act (push), act (walk)
      >>> sign_model.describe(model).splitlines()[2:4]
      ['At the start: (closed)', 'Wanted: (through)']
    """
    links = np.asarray(networks(model.matrices))
    counts = ", ".join(
        f"{int(links[component].sum())} in {NETWORK_NAMES[component]}" for component in Component
    )
    total = int(num_matrices(model.matrices))
    heading = (
        f"World model of {len(model.names)} signs with {total} prediction matrices; links:"
        f" {counts}."
    )
    if names is None:
        signs, opening = _by_weight(model), _opening(model)
    else:
        signs = [model.sign(name) for name in ([names] if isinstance(names, str) else names)]
        opening = []
    lines = [
        line
        for sign in signs
        for line in (
            *_sign_lines(model, sign, links),
            *(() if names is None else _needed_by(model, sign, links)),
        )
    ]
    return "\n".join([heading, *opening, *lines]) + "\n"


KINDS = ("situation", "action", "predicate", "type", "object", "role", "script", "fact", "act")
"""The kinds of signs of a task, those first that tell most."""

_LISTED = ("object", "type", "predicate", "action", "script", "fact", "act")
_MOST_LISTED = 12


def kind_of_sign(name: str) -> str:
    """Returns which of `KINDS` a sign of a task is, by its name."""
    first = name.split(" ", 1)[0]
    if name.startswith("("):
        return "fact"
    return first if " " in name and first in KINDS else "object"


def _by_weight(model: WorldModel) -> list[Sign]:
    """Returns all signs; those of a task by their kinds, others as they are."""
    signs = list(model.signs())
    if START in model.names:
        signs.sort(key=lambda sign: KINDS.index(kind_of_sign(sign.name)))
    return signs


def _opening(model: WorldModel) -> list[str]:
    """Returns what matters of the world model of a task; nothing of another one."""
    if START not in model.names or GOAL not in model.names:
        return []
    by_kind: dict[str, list[str]] = {}
    for name in model.names:
        kind = kind_of_sign(name)
        by_kind.setdefault(kind, []).append(name.removeprefix(f"{kind} "))
    counted = []
    for kind in _LISTED:
        if members := by_kind.get(kind):
            is_listed = kind not in ("script", "fact", "act") and len(members) <= _MOST_LISTED
            which = f" ({', '.join(members)})" if is_listed else ""
            counted.append(f"{len(members)} {kind}{'s' if len(members) > 1 else ''}{which}")
    return [
        f"It knows {', '.join(counted)}.",
        f"At the start: {_facts_of(model, START)}",
        f"Wanted: {_facts_of(model, GOAL)}",
    ]


def _facts_of(model: WorldModel, situation: str) -> str:
    facts = sorted(model.sign(situation).meaning[0].features)
    return " ".join(facts) or "(nothing)"


def _needed_by(model: WorldModel, sign: Sign, links: np.ndarray) -> Iterator[str]:
    """Yields which signs have one as a feature, network by network."""
    number = model.index(sign.name)
    for component in Component:
        if owners := model.named(links[component, :, number]):
            yield f"  needed in {NETWORK_NAMES[component]} by: {', '.join(owners)}"


def to_dot(
    model: WorldModel,
    *,
    components: Iterable[Component] = tuple(Component),
    name: str = "world_model",
) -> str:
    """Returns the networks as a Graphviz digraph: an edge for each link, black in W_p, blue in W_m,
    red in W_a.

    Args:
      model: the world model.
      components: which networks to draw.
      name: of the graph.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> sign_model.to_dot(sign_model.world_model_of(task)).splitlines()[0]
      'digraph "world_model" {'
    """
    links = np.asarray(networks(model.matrices))
    nodes = [f"  {_quoted(sign)};" for sign in model.names]
    edges = [
        f"  {_quoted(model.names[source])} -> {_quoted(model.names[target])}"
        f' [color={_COLOURS[component]}, label="{NETWORK_NAMES[component]}"];'
        for component in components
        for source, target in np.argwhere(links[component])
    ]
    return "\n".join([f"digraph {_quoted(name)} {{", "  rankdir=LR;", *nodes, *edges, "}"]) + "\n"


def describe_steps(steps: Iterable[Step]) -> str:
    """Returns a specified plan as an indented list, each act with its sub-plan below it; "" for a
    plan without acts.
    """
    return "".join(_step_lines(steps, indent=0))


def describe_matrix(matrix: PredictionMatrix) -> str:
    """Returns one matrix as one line; `(nothing)` if it has no columns."""
    conditions = " -> ".join(
        _set_text(column.features)
        for column in matrix.columns
        if column.kind == ColumnKind.CONDITION
    )
    if not matrix.is_causal:
        return conditions or "(nothing)"
    effects = (
        [f"+{_set_text(matrix.named(ColumnKind.ADDS))}"] if matrix.named(ColumnKind.ADDS) else []
    )
    effects += (
        [f"-{_set_text(matrix.named(ColumnKind.DELETES))}"]
        if matrix.named(ColumnKind.DELETES)
        else []
    )
    return " ".join([conditions or "(nothing)", "=>", *effects])


def _set_text(features: frozenset[str]) -> str:
    """Returns a set of features: a single one by its name, several in braces."""
    return next(iter(features)) if len(features) == 1 else "{" + ", ".join(sorted(features)) + "}"


def _sign_lines(model: WorldModel, sign: Sign, links: np.ndarray) -> Iterator[str]:
    """Yields the lines that describe one sign; links is bool [3, S, S], of `networks`."""
    number = model.index(sign.name)
    yield f"\n{sign.name}"
    for component in Component:
        matrices = sign.matrices(component)
        if matrices:
            mark = " [strict order]" if is_procedural(model.matrices, number, component) else ""
            yield f"  {COMPONENT_NAMES[component]}{mark}"
            yield from (
                f"    {count}. {describe_matrix(matrix)}"
                for count, matrix in enumerate(matrices, 1)
            )
            yield (
                f"    {NETWORK_NAMES[component]}:"
                f" {', '.join(model.named(links[component, number])) or '-'}"
            )


def _step_lines(steps: Iterable[Step], *, indent: int) -> Iterator[str]:
    """Yields the lines of some steps and of their sub-plans."""
    for step in steps:
        is_open = step.decision == SPECIFY and step.steps is None
        yield f"{'  ' * indent}{step.action}{' (no sub-plan found)' if is_open else ''}\n"
        yield from _step_lines(step.steps or (), indent=indent + 1)


def _quoted(text: str) -> str:
    """Returns a text as a quoted name of DOT."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
