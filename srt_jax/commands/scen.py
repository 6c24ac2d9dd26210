"""`srt-jax scen`: the optimal lengths of a MovingAI scenario, computed again."""

import time
from typing import Annotated

import numpy as np
import typer

from sign_model.foundation.legible import counted
from srt_jax.answers.scenario_lengths import MATCH, optimal_lengths, relative_errors
from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import aside, say, say_json, show_progress, took
from srt_jax.commands.shared.options import JsonOption
from srt_jax.formats.movingai import read_scen
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.shared.scenarios import scenario_maps


def scen(
    scenario: Annotated[str, typer.Argument(metavar="FILE.scen", help="A MovingAI scenario.")],
    map_path: Annotated[
        str | None,
        typer.Option(
            "--map", metavar="FILE.map", help="Its map. Default: the one it names, beside it."
        ),
    ] = None,
    limit: options.LimitOption = None,
    rows: options.RowsOption = None,
    as_json: JsonOption = False,
) -> int:
    """Computes every optimal length of a scenario again: [bold]0[/bold] all match, [bold]1[/bold]
    some do not.
    """
    chosen = Reading(limit=limit, rows=options.row_range(rows)).chosen(
        scenario, read_scen(scenario)
    )
    if not chosen:
        raise ValueError(f"{scenario}: the scenario has no row")
    notes = Notes()
    with options.print_notes(scenario, notes, quiet=as_json):
        maps = scenario_maps(scenario, chosen, map_path, notes)
    numbers, wanted = [number for number, _ in chosen], [row for _, row in chosen]
    errors = np.zeros(len(wanted))
    begin = time.perf_counter()
    with show_progress("rows", len(wanted), quiet=as_json, compiles=True) as progress:
        for free in {id(free): free for free in maps}.values():
            places = [place for place, on in enumerate(maps) if on is free]
            on_it = [wanted[place] for place in places]
            errors[places] = relative_errors(optimal_lengths(free, on_it, progress=progress), on_it)
    worst, num_matches = float(errors.max()), int((errors <= MATCH).sum())
    if as_json:
        finite = worst if np.isfinite(worst) else None
        say_json({"rows": len(wanted), "matches": num_matches, "max_relative_error": finite})
    else:
        seconds = time.perf_counter() - begin
        say(
            f"{counted(len(wanted), 'row')}{took(seconds, compiles=False)}, {num_matches} match"
            f" (relative error <= {MATCH:g}), max error {worst:.2e}"
        )
        for index in np.flatnonzero(errors > MATCH)[:5].tolist():
            aside(
                f"row {numbers[index] + 1}: error {errors[index]:.2e}, the scenario says"
                f" {wanted[index].length}"
            )
    return 0 if num_matches == len(wanted) else 1
