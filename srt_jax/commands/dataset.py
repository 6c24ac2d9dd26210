"""`srt-jax dataset`: labelled tasks by the number, in shards; run again, it resumes where it was
stopped.
"""

import pathlib
from typing import Annotated

import typer

from sign_model.foundation.legible import counted
from srt_jax.commands.shared.console import say, say_json, show_progress
from srt_jax.commands.shared.memory_limit import keep_together
from srt_jax.commands.shared.options import (
    AddressOption,
    EngineOption,
    JsonOption,
    PartOption,
    TollOption,
    WorkersOption,
    sides,
    toll_for,
)
from srt_jax.dataset import write_dataset
from srt_jax.scale.parts import as_part


def dataset(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="half, quarter, bagel-K, rooms, fences, rings or mixed",
            show_default=False,
        ),
    ],
    out: Annotated[
        pathlib.Path,
        typer.Option(metavar="DIR", help="The folder for the shards.", show_default=False),
    ],
    count: Annotated[int, typer.Option(min=1, help="How many tasks.")] = 1024,
    size: Annotated[
        str, typer.Option(metavar="S|LOW-HIGH", help="Cells a side, or a range of them.")
    ] = "64",
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same bytes.")] = 0,
    shard_size: Annotated[int, typer.Option(min=1, help="Tasks in a shard.")] = 1024,
    format: Annotated[
        str, typer.Option(metavar="npz|arrayrecord", help="The shards' format.")
    ] = "npz",
    mode: Annotated[
        str,
        typer.Option(
            metavar="least|shortest",
            help="What the labels say: the least removal, or whether to break or to go round.",
        ),
    ] = "least",
    toll: TollOption = None,
    workers: WorkersOption = None,
    part: PartOption = None,
    engine: EngineOption = None,
    address: AddressOption = None,
    as_json: JsonOption = False,
) -> int:
    """Writes tasks with exact labels: costs to go, correction factors, focal maps, first blockers,
    least removals.
    """
    worth = toll_for(mode, toll)
    keep_together()
    # a part holds its share of the shards, so of the tasks, to within a shard
    total = -(-count // as_part(part).count)
    with show_progress("labelling", total, quiet=as_json, compiles=True) as advance:
        plan = write_dataset(
            out,
            kind=kind,
            count=count,
            size=sides(size),
            seed=seed,
            shard_size=shard_size,
            format=format,
            mode=mode,
            toll=worth,
            progress=advance,
            workers=workers,
            part=part,
            engine=engine,
            address=address,
        )
    if as_json:
        say_json({"folder": str(out), "tasks": plan.count, "shards": plan.num_shards()})
    else:
        say(
            f"{out} holds {counted(plan.count, 'task')} in"
            f" {counted(plan.num_shards(), 'shard')}. Next:"
            f" srt_jax.dataset.load({str(out)!r})"
        )
    return 0
