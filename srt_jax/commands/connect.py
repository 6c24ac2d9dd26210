"""`srt-jax connect`: the least removal that joins regions of a map, replayed, with a picture."""

import dataclasses
import pathlib
from typing import Annotated, Any

import numpy as np
import typer

from sign_model.foundation.legible import counted
from srt_jax.answers.doubts import doubts_of
from srt_jax.check import check_connection
from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import printer, say, say_json, say_wrapped, waiting
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, read_framed, with_reading
from srt_jax.connecting.connect import Connection
from srt_jax.connecting.connect import connect as connect_task
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.geometry.frame import Frame
from srt_jax.robots.ends import as_end, cell_in
from srt_jax.types import Cell


@with_reading
def connect(
    path: Annotated[
        str,
        typer.Argument(
            metavar="INPUT", help="A map or a file with one task, as for solve.", show_default=False
        ),
    ],
    region: Annotated[
        list[str] | None,
        typer.Option(
            metavar="R,C|Xm,Ym|LONE,LATN",
            help=(
                "A cell of a region to be joined, as --start; once for each. Default: all regions"
                " of free cells."
            ),
        ),
    ] = None,
    min_cells: Annotated[
        int, typer.Option(min=1, help="Without --region: leave smaller regions as they are.")
    ] = 1,
    max_branches: Annotated[
        int, typer.Option(min=1, help="Choices of obstacles looked into, at most.")
    ] = 256,
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    out: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Draw the map joined: .png, .svg, .pdf."),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Finds the least removal that joins regions of a map, and replays it. Exit code
    [bold]1[/bold] where nothing joins them.
    """
    ends = [as_end("--region", text) for text in region or []]
    # Start and goal do not matter.
    how = dataclasses.replace(reading, chooses=True, tells_choice=False)
    tasks, frames, notes, _ = read_framed([path], how, destroyable, quiet=as_json)
    if len(tasks) != 1:
        raise ValueError(
            f"{path} holds {len(tasks)} tasks: connect takes one, choose it with --rows or --limit"
        )
    (name, task), frame = tasks[0], frames[0] or Frame.of_cells(*tasks[0].task.labels.shape[-2:])
    cells = [cell_in(frame, end, f"{path}: region") for end in ends] or None
    with at_once(tasks), waiting("joining", quiet=as_json):
        found = connect_task(task, cells, min_cells=min_cells, max_branches=max_branches)
    problems = check_connection(task, found, cells, min_cells=min_cells)
    if problems:
        raise AssertionError(f"{name}: the replay says: {problems[0]}")
    doubts = Notes()
    if destroyable is None and reading.labels is None:
        doubts = doubts_of(tasks, [found.destroyed], frames)
        notes = [*notes, *doubts.records("answers")]
    if out:
        from srt_jax.draw.connection import draw_connection

        draw_connection(task, found, out, cells=cells, title=name, frame=frame)
    if as_json:
        say_json(_record(name, found, cells) | ({"notes": notes} if notes else {}))
    else:
        say_wrapped(printer(), _sentence(name, found, cells, frame))
        if out:
            say(f"Wrote {out}.")
        for doubt in doubts:
            say_wrapped(printer(), f"Note: {doubt}.")
    return int(found.removal_cost == np.inf)


def _record(name: str, found: Connection, cells: list[Cell] | None) -> dict[str, Any]:
    is_there = found.removal_cost < np.inf
    return {
        "name": name,
        "regions": None if cells is None else [list(cell) for cell in cells],
        "destroyed": list(found.destroyed),
        "removal_cost": found.removal_cost if is_there else None,
        "removal_bound": found.removal_bound if is_there else None,
        "is_proven": found.removal_cost == found.removal_bound,
        "joined_cells": int(found.joined.sum()),
    }


def _sentence(name: str, found: Connection, cells: list[Cell] | None, frame: Frame) -> str:
    what = "all regions of free cells" if cells is None else counted(len(cells), "region")
    if found.removal_cost == np.inf:
        return f"{name}: nothing that can be destroyed joins {what}."
    number = int(found.joined.sum())
    size = f"{number} cells"
    if frame.has_metres:
        size += f", {number * frame.side**2:.6g} square metres"
    if not found.destroyed:
        return f"{name}: {what} are one already ({size})."
    ids = ", ".join(map(str, found.destroyed))
    proof = "the least that joins them"
    if found.removal_bound < found.removal_cost:
        proof = f"at least {found.removal_bound:g} are needed"
    return (
        f"{name}: to join {what}, destroy {counted(len(found.destroyed), 'obstacle')} ({ids}) at a"
        f" cost of {found.removal_cost:g}, {proof}; then they are one of {size}."
    )
