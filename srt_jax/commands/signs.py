"""`srt-jax signs`: the world model of a PDDL task, for people: in words, as a picture, and as the
iterations of MAP.
"""

import pathlib
from typing import Annotated

import numpy as np
import typer

from sign_model import (
    animate_trace,
    describe,
    draw_networks,
    load,
    to_dot,
    trace,
    world_model_of,
)
from sign_model.foundation.files import atomic_write
from sign_model.signs.activation import spread_activation
from sign_model.signs.world_model import WorldModel
from srt_jax.commands.shared.console import aside, say
from srt_jax.commands.shared.options import DomainArgument

_DECAY, _STEPS, _SHOWN = (0.5, 0.5, 0.5), 4, 20


def signs(
    domain: DomainArgument,
    problem: Annotated[
        str, typer.Argument(metavar="PROBLEM", help="PDDL problem file.", show_default=False)
    ],
    sign: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Describe this sign alone, such as 'action stack'."),
    ] = None,
    recall: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="List what comes to mind with a sign, nearest first."),
    ] = None,
    iterations: Annotated[
        bool, typer.Option("--trace", help="Print MAP's iterations: M-, A- and P-step.")
    ] = False,
    svg: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Draw the three networks (SVG)."),
    ] = None,
    dot: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Write the networks for Graphviz (DOT)."),
    ] = None,
    animate: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Draw MAP's iterations, moving (SVG)."),
    ] = None,
) -> int:
    """Describes the signs of a PDDL task: what the planner knows, and how it plans."""
    task = load(pathlib.Path(domain), pathlib.Path(problem))
    is_asked = bool(sign or recall or iterations or svg or dot or animate)
    model = world_model_of(task)
    if sign or not is_asked:
        _say_all(describe(model, names=sign or None).rstrip("\n"))
    if recall is not None:
        say(*_recalled(model, recall))
    if svg is not None:
        _write(svg, draw_networks(model, names=sign or None))
    if dot is not None:
        _write(dot, to_dot(model))
    if iterations or animate is not None:
        way = trace(task)
        if iterations:
            _say_all(str(way))
        if animate is not None:
            _write(animate, animate_trace(way))
    return 0


def _say_all(text: str) -> None:
    say(*text.split("\n"))


def _recalled(model: WorldModel, name: str) -> list[str]:
    """Returns the signs that spreading activation reaches from one, with how active each is."""
    active = model.features([name]).astype(np.float32)
    decay = np.array(_DECAY, np.float32)
    found = np.asarray(spread_activation(model.matrices, active, decay=decay, steps=_STEPS))
    order = [int(i) for i in np.argsort(-found, kind="stable") if found[i] > 0 and not active[i]]
    lines = [f"{found[i]:.3f} {model.names[i]}" for i in order[:_SHOWN]]
    return lines + [f"and {len(order) - _SHOWN} more"] * (len(order) > _SHOWN)


def _write(path: pathlib.Path, text: str) -> None:
    with atomic_write(path) as file:
        file.write(text)
    aside(f"Wrote {path}.")
