"""`srt-jax solve`: tasks from files, answers as a table, JSON, results and pictures."""

import pathlib
import time
from typing import Annotated

import typer

from srt_jax.commands.options import JsonOption
from srt_jax.commands.report import report
from srt_jax.console import counted
from srt_jax.inputs import Cell, read_tasks
from srt_jax.many import solve_many
from srt_jax.types import Status


def solve(
    inputs: Annotated[
        list[str], typer.Argument(metavar="INPUT...", help=".map, .scen, .npz batch or .json world", show_default=False)
    ],
    start: Annotated[str | None, typer.Option(metavar="R,C", help="Start cell on a .map.")] = None,
    goal: Annotated[str | None, typer.Option(metavar="R,C", help="Goal cell on a .map.")] = None,
    destroyable: Annotated[
        str | None,
        typer.Option(
            metavar="all|none|IDS", help="Which obstacles can be destroyed, e.g. 3,7. Default: as the file says; maps: all."
        ),
    ] = None,
    repair: Annotated[bool, typer.Option("--repair", help="Make valid the polygons that cross themselves.")] = False,
    mode: Annotated[
        str,
        typer.Option(
            metavar="least|paper|literal", help="least: the least removal. paper: the paper's loop. literal: to the letter."
        ),
    ] = "least",
    max_destroyed: Annotated[int, typer.Option(min=1, help="Most obstacles that may be destroyed in one task.")] = 8,
    out: Annotated[pathlib.Path | None, typer.Option(metavar="DIR", help="Write results.json and pictures here.")] = None,
    pictures: Annotated[int, typer.Option(min=0, help="With --out: draw at most so many tasks.")] = 12,
    as_json: JsonOption = False,
) -> int:
    """Solves the tasks in the files: [bold]0[/bold] all solved, [bold]1[/bold] some unsolvable, [bold]2[/bold] bad input."""
    ends = {"start": _cell("--start", start), "goal": _cell("--goal", goal)}
    tasks = [task for path in inputs for task in read_tasks(path, **ends, destroyable=destroyable, repair=repair)]
    if not tasks:
        raise ValueError(f"{', '.join(inputs)}: the batch is empty: no task to solve")
    begin = time.perf_counter()
    with counted("solving", len(tasks), quiet=as_json) as progress:
        solutions = solve_many([task.task for task in tasks], mode=mode, max_destroyed=max_destroyed, progress=progress)
    seconds = time.perf_counter() - begin
    records = report(tasks, solutions, seconds, out=out, pictures=pictures, as_json=as_json)
    return 0 if all(Status[record["status"]].is_solved for record in records) else 1


def _cell(option: str, text: str | None) -> Cell | None:
    try:
        row, col = (text or "0,0").split(",")
        return (int(row), int(col)) if text is not None else None
    except ValueError:
        raise ValueError(f"{option} {text!r} is no cell: write row,column, such as 3,5") from None
