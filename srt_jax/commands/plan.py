"""`srt-jax plan`: a PDDL task planned on the sign model, and replayed before it is printed."""

import json
import sys
from typing import Annotated

import typer

from srt_jax.commands.console import waiting
from srt_jax.commands.options import JsonOption


def plan(
    domain: Annotated[
        str, typer.Argument(metavar="DOMAIN", help="PDDL domain file.", show_default=False)
    ],
    problem: Annotated[
        str, typer.Argument(metavar="PROBLEM", help="PDDL problem file.", show_default=False)
    ],
    planner: Annotated[
        str,
        typer.Option(
            metavar="map|astar|wastar|gbfs",
            help="map: the paper's planner. The others: forward search.",
        ),
    ] = "map",
    max_expansions: Annotated[
        int, typer.Option(min=1, help="The most situations expanded.")
    ] = 200_000,
    max_seconds: Annotated[
        float | None, typer.Option(min=0, help="The most time for the search.")
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Plans: [bold]0[/bold] a plan, [bold]1[/bold] proven unsolvable, [bold]2[/bold] bad input,
    [bold]3[/bold] budget spent.
    """
    import sign_model

    task = sign_model.load(domain, problem)
    with waiting("planning", quiet=as_json):
        result = sign_model.plan(
            task, planner=planner, max_expansions=max_expansions, max_seconds=max_seconds
        )
    problems = sign_model.validate(task, list(result.actions)) if result.is_solved else []
    if problems:
        raise AssertionError(
            f"{problem}: a plan failed its replay, please report it: {'; '.join(problems)}"
        )
    if as_json:
        told = {
            "status": result.status.name,
            "actions": list(result.actions),
            "expansions": result.expansions,
        }
        print(json.dumps(told | {"seconds": result.seconds}))
    else:
        if result.is_solved:
            print(*result.actions, sep="\n")
        took = ", ".join(f"{stage} {seconds:.3f} s" for stage, seconds in result.seconds.items())
        steps = f"{len(result.actions)} steps, " if result.is_solved else ""
        print(
            f"; {result.status.name}: {steps}{result.expansions} expansions; {took}",
            file=sys.stderr,
        )
    return int(result.status)
