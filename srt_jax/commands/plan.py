"""`srt-jax plan`: a PDDL task planned on the sign model, and replayed before it is printed."""

import pathlib
from typing import Annotated

import typer

from srt_jax.commands.shared.options import DomainArgument, JsonOption
from srt_jax.commands.short_plan import plan_files


def plan(
    domain: DomainArgument,
    problem: Annotated[
        list[str], typer.Argument(metavar="PROBLEM", help="PDDL problem file.", show_default=False)
    ],
    planner: Annotated[
        str,
        typer.Option(
            metavar="map|astar|wastar|gbfs",
            help="map: the paper's planner, few steps. Forward search: astar: the cheapest plan;"
            " wastar: sooner, weighs costs; gbfs: the first plan.",
        ),
    ] = "map",
    max_expansions: Annotated[
        int, typer.Option(min=1, help="The most situations expanded.")
    ] = 200_000,
    max_seconds: Annotated[
        float | None,
        typer.Option(
            min=0, help="The most time for reading, grounding and search. Default: no limit."
        ),
    ] = None,
    experience: Annotated[
        pathlib.Path | None,
        typer.Option(
            metavar="FILE",
            help="Plan with what srt-jax practise, or --remember, has written there.",
            show_default=False,
        ),
    ] = None,
    remember: Annotated[
        bool,
        typer.Option(
            "--remember",
            help="Keep the plan in the file of --experience, as a precedent; make it if need be.",
        ),
    ] = False,
    signs: Annotated[
        pathlib.Path | None,
        typer.Option(
            metavar="FILE",
            help="The heuristic signs of map: a file of sign_model.save_signs.",
            show_default=False,
        ),
    ] = None,
    rule: Annotated[
        pathlib.Path | None,
        typer.Option(
            metavar="FILE",
            help="Which ways of planning take turns in map: a file of sign_model.save_rule.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Plans a PDDL task on the sign model: [bold]0[/bold] a plan, [bold]1[/bold] proven unsolvable,
    [bold]2[/bold] bad input, [bold]3[/bold] budget spent.
    """
    if len(problem) > 1:
        raise ValueError(
            f"plan takes a domain and one problem, got {len(problem)} problems: call it for"
            " each, or use sign_model.plan_batch in Python"
        )
    if remember and experience is None:
        raise ValueError("--remember needs --experience FILE, where the plan is to be kept")
    if planner != "map" and (signs or rule):
        raise ValueError(f"--signs and --rule say how map plans, and the planner is {planner}")
    given = {"experience": experience, "signs": signs, "rule": rule}
    known = {name: path for name, path in given.items() if path is not None}
    return plan_files(
        domain,
        problem[0],
        planner,
        max_expansions,
        max_seconds,
        as_json,
        is_remembered=remember,
        **known,
    )
