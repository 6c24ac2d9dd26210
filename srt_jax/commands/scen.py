"""`srt-jax scen`: the optimal lengths of a MovingAI scenario, computed anew."""

import json
import sys
import time
from typing import Annotated

import numpy as np
import typer

from srt_jax.commands.console import counted
from srt_jax.commands.options import JsonOption
from srt_jax.commands.scenario_lengths import MATCH, optimal_lengths, relative_errors
from srt_jax.formats.movingai import read_scen
from srt_jax.formats.reading import read_scenario_map


def scen(
    scenario: Annotated[str, typer.Argument(metavar="FILE.scen", help="A MovingAI scenario.")],
    map_path: Annotated[
        str | None,
        typer.Option(
            "--map", metavar="FILE.map", help="Its map. Default: the one it names, beside it."
        ),
    ] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first so many rows.")] = None,
    as_json: JsonOption = False,
) -> int:
    """Computes every optimal length of a scenario anew: [bold]0[/bold] all match, [bold]1[/bold]
    some do not.
    """
    free = read_scenario_map(scenario, map_path)
    rows = read_scen(scenario)[:limit]
    if not rows:
        raise ValueError(f"{scenario}: the scenario has no row")
    begin = time.perf_counter()
    with counted("rows", len(rows), quiet=as_json) as progress:
        errors = relative_errors(optimal_lengths(free, rows, progress=progress), rows)
    worst, num_matches = float(errors.max()), int((errors <= MATCH).sum())
    if as_json:
        told = worst if np.isfinite(worst) else None
        print(json.dumps({"rows": len(rows), "matches": num_matches, "max_relative_error": told}))
    else:
        seconds = time.perf_counter() - begin
        print(
            f"{len(rows)} rows, {num_matches} match (relative error <= {MATCH:g}), max error"
            f" {worst:.2e}, {seconds:.1f} s"
        )
        for index in np.flatnonzero(errors > MATCH)[:5].tolist():
            print(
                f"  row {index + 1}: error {errors[index]:.2e}, the scenario says"
                f" {rows[index].length}",
                file=sys.stderr,
            )
    return 0 if num_matches == len(rows) else 1
