"""`srt-jax bench`: side-by-side measurements against the peers installed; a table, and a JSON file
to keep.
"""

import json
import pathlib
import time
from typing import Annotated, Any

import typer

from srt_jax.bench.machine import machine
from srt_jax.commands.console import aside, say, say_json
from srt_jax.commands.options import JsonOption
from srt_jax.formats.files import make_folder, written

NAMES = ("kernels", "solve", "plan", "learning", "envs")


def bench(
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help=f"{', '.join(NAMES)} or all.")
    ] = "all",
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer and smaller cases, under a minute each.")
    ] = False,
    out: Annotated[
        pathlib.Path, typer.Option(metavar="DIR", help="Where NAME.json goes.")
    ] = pathlib.Path("bench"),
    as_json: JsonOption = False,
) -> int:
    """Measures us and the peers installed (pip install 'srt-jax\\[bench]') in one run: ratios
    first.
    """
    if name not in (*NAMES, "all"):
        raise ValueError(
            f"no measurement is called {name!r}: choose one of {', '.join(NAMES)}, or all"
        )
    results = {}
    for one in NAMES if name == "all" else [name]:
        if not as_json:
            say(f"== {one}")
        result, table = _measured(one, quick)
        results[one] = result
        make_folder(out)
        command = f"srt-jax bench {one}{' --quick' if quick else ''}"
        record = {
            "command": command,
            "date": time.strftime("%Y-%m-%d"),
            "made_on": machine(),
            "told": table,
            **result,
        }
        with written(out / f"{one}.json") as file:
            json.dump(record, file, indent=1)
        if not as_json:
            say(*table.splitlines())
    if as_json:
        say_json(results)
    else:
        say(f"Kept in {out}: {', '.join(f'{one}.json' for one in results)}")
    return 0


def _measured(name: str, quick: bool) -> tuple[dict[str, Any], str]:
    """Returns the measurements and the same as a table; each is loaded when it is requested."""
    if name == "kernels":
        from srt_jax.bench import kernels

        result = kernels.run(quick)
        return result, kernels.table(result)
    if name == "solve":
        from srt_jax.bench import solve

        result = solve.run(quick)
        return result, solve.table(result)
    if name == "learning":
        from srt_jax.bench import learning

        result = learning.run(quick)
        return result, learning.table(result)
    if name == "envs":
        from srt_jax.bench import envs

        result = envs.run(quick)
        return result, envs.table(result)
    from srt_jax.bench import plan as planning

    result = planning.run(quick, log=aside)
    return result, planning.table(result)
