"""`srt-jax practise`: what a few small problems teach of a PDDL domain, kept for `srt-jax plan`."""

import pathlib
from typing import Annotated

import typer

from sign_model import Memory, load, load_memory, save_memory
from sign_model.foundation.collector import paused_collector
from srt_jax.commands.shared.console import aside, say, waiting
from srt_jax.commands.shared.options import DomainArgument


def practise(
    domain: DomainArgument,
    problems: Annotated[
        list[str],
        typer.Argument(
            metavar="PROBLEM",
            help="PDDL problem files, a few, from small to large.",
            show_default=False,
        ),
    ],
    out: Annotated[
        pathlib.Path,
        typer.Option(
            metavar="FILE",
            help="Keep what was learned (.json); what the file holds of other domains stays.",
            show_default=False,
        ),
    ],
    max_expansions: Annotated[
        int, typer.Option(min=1, help="The most situations expanded in one attempt at a problem.")
    ] = 200_000,
    max_seconds: Annotated[
        float, typer.Option(min=0, help="The most time for one attempt at a problem.")
    ] = 30.0,
) -> int:
    """Learns from small problems of a PDDL domain how to plan larger ones: srt-jax plan
    --experience FILE takes it up.
    """
    known = load_memory(out) if out.exists() else Memory()
    told: list[str] = []
    with waiting("practising", quiet=False), paused_collector():
        tasks = [load(pathlib.Path(domain), pathlib.Path(problem)) for problem in problems]
        memory = known.practised(
            tasks, max_expansions=max_expansions, max_seconds=max_seconds, log=told.append
        )
    save_memory(memory, out)
    say(*told)
    aside(f"Wrote {out}.")
    return 0
