"""`srt-jax demo`: the main job on the city that comes with the package."""

import pathlib
import time
from typing import Annotated, Any

import typer

from srt_jax.commands import helsinki as work
from srt_jax.commands.shared.console import (
    fit_table,
    printer,
    say,
    say_wrapped,
    show_progress,
    waiting,
)
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reporting import exit_code, report, require_page_name
from srt_jax.formats.batch import write_batch
from srt_jax.formats.shared.whole_files import atomic_write
from srt_jax.many_tasks import solve_many
from srt_jax.task import stack


def demo(
    out: Annotated[
        pathlib.Path,
        typer.Option(metavar="DIR", help="Where the table, the pictures and the results go."),
    ] = pathlib.Path("demo"),
    pairs: Annotated[
        int, typer.Option(min=1, max=100, help="Pairs of start and goal; five tasks each.")
    ] = 6,
    seed: Annotated[int, typer.Option(min=0, help="Draws other pairs.")] = 0,
    page: Annotated[
        pathlib.Path | None,
        typer.Option(
            "--report", metavar="FILE.html", help="Write a web page: table, filters, pictures."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """The main job on a real city, Helsinki: goals cut off in the paper's five ways, solved as one
    batch, drawn.
    """
    require_page_name(page)
    with waiting("laying out the city", quiet=as_json):
        place = work.city()
        tasks = work.tasks_in(place, pairs=pairs, seed=seed)
    begin = time.perf_counter()
    with show_progress("solving", len(tasks), quiet=as_json, compiles=True) as progress:
        solutions = solve_many([task.task for task in tasks], progress=progress)
    seconds = time.perf_counter() - begin
    with waiting("summing up", quiet=as_json):
        rows = work.summary(place, tasks, solutions)

    def write_more() -> None:
        with atomic_write(out / "table.md") as file:
            file.write(work.as_markdown(rows, place))
        write_batch(
            out / "tasks.npz",
            stack([task.task for task in tasks]),
            names=[task.name for task in tasks],
        )

    records = report(
        tasks,
        solutions,
        seconds,
        out=out,
        pictures=len(work.BLOCKAGES),
        as_json=as_json,
        html=page,
        write_more=write_more,
    )
    if not as_json:
        _print_summary(rows, place)
        say(f"Also in {out}: table.md, and tasks.npz for 'srt-jax solve {out / 'tasks.npz'}'.")
    return exit_code(records)


_RANKS = {
    "tasks": 1,
    "open route": 2,
    "proven least": 3,
    "objects on contour": 4,
    "contour cells": 5,
}
"""Of the summary's columns; those without one stay, however narrow the terminal."""


def _print_summary(rows: list[dict[str, Any]], place: work.City) -> None:
    cells = [list(work.as_text(row).values()) for row in rows]
    console = printer()
    columns = [(name, _RANKS.get(name, 0)) for name in rows[0]]
    console.print()
    say_wrapped(console, work.heading(place))
    console.print(fit_table(columns, cells, console.width))
    say_wrapped(console, f"Map data: {place.attribution}")
