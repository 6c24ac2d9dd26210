"""A world model in words, and as a drawing: text for people, DOT for Graphviz."""

from collections.abc import Iterable, Iterator

import numpy as np

from sign_model.map_algorithm.plan_specification import SPECIFY, Step
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


def describe(model: WorldModel, *, names: Iterable[str] | None = None) -> str:
    """Returns the signs, their matrices and the three networks as text; for a model without signs,
    only the heading.

    A matrix reads from its first moment to its last: `nose -> mouth`. Effects follow `=>`: `+` what
    is added, `-` what is deleted. `[strict order]` marks a component of a procedural sign, whose
    columns have the same order in all its matrices. Links are listed once, under the sign where
    they begin.

    Args:
      model: the world model.
      names: the signs to describe, in this order; by default all.

    Raises:
      ValueError: a name is not the name of a sign.
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
    signs = model.signs() if names is None else tuple(model.sign(name) for name in names)
    return (
        "\n".join([heading, *(line for sign in signs for line in _sign_lines(model, sign, links))])
        + "\n"
    )


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
