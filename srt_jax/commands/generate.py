"""`srt-jax generate`: batches of tasks, with the least removal where it is proven."""

import pathlib
from typing import Annotated

import numpy as np
import typer

from sign_model.foundation.legible import counted
from srt_jax.commands.shared.console import say, say_json, waiting
from srt_jax.commands.shared.options import JsonOption, sides
from srt_jax.formats.batch import write_batch
from srt_jax.instances.generate import generate as made
from srt_jax.task import stack


def generate(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="half, quarter, bagel-K, rooms, fences, rings, mixed, or helpers (coalitions)",
            show_default=False,
        ),
    ],
    out: Annotated[
        pathlib.Path,
        typer.Option(metavar="FILE.npz", help="Where the batch goes.", show_default=False),
    ],
    count: Annotated[int, typer.Option(min=1, help="How many tasks.")] = 16,
    size: Annotated[
        str, typer.Option(metavar="S|LOW-HIGH", help="Cells a side, or a range of them.")
    ] = "64",
    seed: Annotated[
        int, typer.Option(min=0, help="The same seed gives the same tasks on every machine.")
    ] = 0,
    as_json: JsonOption = False,
) -> int:
    """Writes a batch of tasks; with the least removal known where there is a proof of it."""
    if out.suffix.lower() != ".npz":
        raise ValueError(f"--out {out}: a batch is an .npz file: end the name in .npz")
    sizes = sides(size)
    if kind == "helpers":
        return _helpers(out, count, sizes, seed, as_json)
    with waiting("generating", quiet=as_json):
        names, tasks, optima = zip(*made(kind, count=count, size=sizes, seed=seed))
    write_batch(out, stack(tasks), names=names, optimum=np.array(optima, np.float32))
    known = int(np.sum(~np.isnan(optima)))
    return _told(out, len(tasks), known, as_json)


def _helpers(
    out: pathlib.Path, count: int, size: int | tuple[int, int], seed: int, as_json: bool
) -> int:
    """Tasks of coalitions, all of one size."""
    from srt_jax.coalition.generate import helpers
    from srt_jax.coalition.task import stack_coalitions
    from srt_jax.coalition.task_files import write_coalitions

    if not isinstance(size, int):
        raise ValueError("--size: tasks of kind helpers have one size: give one number")
    with waiting("generating", quiet=as_json):
        names, tasks, optima = zip(*helpers(count=count, size=size, seed=seed))
    write_coalitions(out, stack_coalitions(tasks), names=names, optimum=optima)
    return _told(out, len(tasks), int(np.sum(~np.isnan(optima))), as_json)


def _told(out: pathlib.Path, number: int, known: int, as_json: bool) -> int:
    if as_json:
        say_json({"file": str(out), "tasks": number, "known_optimum": known})
    else:
        say(
            f"Wrote {counted(number, 'task')} to {out}; the least removal is known for {known}."
            f" Next: srt-jax solve {out}"
        )
    return 0
