"""`srt-jax bench`: side-by-side measurements against the peers installed; a table, and a JSON file
to keep.
"""

import importlib
import json
import pathlib
import time
from typing import Annotated, Any

import typer

from srt_jax.bench.machine import machine
from srt_jax.commands.shared.console import aside, say, say_json
from srt_jax.commands.shared.options import JsonOption
from srt_jax.formats.shared.whole_files import atomic_write, make_folder

NAMES = ("kernels", "solve", "plan", "learning", "envs", "gradients")
"""The modules of `srt_jax.bench` that measure: `run(quick)` returns the measurements, and
`table(result)` the same as text.
"""


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
    """Measures us and the peers installed (the extra [italic]bench[/italic]) in one run: ratios
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
        result, text = _measure(one, quick)
        results[one] = result
        make_folder(out)
        command = f"srt-jax bench {one}{' --quick' if quick else ''}"
        record = {
            "command": command,
            "date": time.strftime("%Y-%m-%d"),
            "made_on": machine(),
            "text": text,
            **result,
        }
        with atomic_write(out / f"{one}.json") as file:
            json.dump(record, file, indent=1)
        if not as_json:
            say(*text.splitlines())
    if as_json:
        say_json(results)
    else:
        say(f"Kept in {out}: {', '.join(f'{one}.json' for one in results)}")
    return 0


def _measure(name: str, quick: bool) -> tuple[dict[str, Any], str]:
    """Returns the measurements and the same as a table; the module is imported only now."""
    module = importlib.import_module(f"srt_jax.bench.{name}")
    options = {"log": aside} if name == "plan" else {}
    result = module.run(quick, **options)
    return result, module.table(result)
