"""`srt-jax solve`: tasks from files, answers as a table, JSON, results and pictures."""

import pathlib
import time
from collections import Counter
from typing import Annotated, Any

import numpy as np
import typer

from sign_model.foundation.legible import counted
from srt_jax.answers import shards
from srt_jax.answers.doubts import doubts_of
from srt_jax.answers.results_file import require_name
from srt_jax.coalition.task_files import holds_coalitions
from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import (
    BAD_INPUT,
    note,
    printer,
    say,
    say_json,
    say_wrapped,
    show_progress,
    took,
)
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.commands.shared.memory_limit import keep_together
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, read_framed, with_reading
from srt_jax.commands.shared.reporting import exit_code, report, require_page_name
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.shared.whole_files import make_folder
from srt_jax.many_tasks import solve_many
from srt_jax.robots.path_file import require_metres, require_path_name
from srt_jax.scale import run
from srt_jax.scale.parts import as_part


@with_reading
def solve(
    inputs: Annotated[
        list[str],
        typer.Argument(
            metavar="INPUT...",
            help=(
                "Maps (.map, ROS .yaml, pictures, .xml), places (.osm, .osm.gz, .osm.bz2, .pbf,"
                " .geojson), tasks "
                "(.scen, .npz, .json, .svg)."
            ),
            show_default=False,
        ),
    ],
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    mode: Annotated[
        str,
        typer.Option(
            metavar="least|paper|literal|shortest",
            help=(
                "least: the least removal. paper: the paper's loop. literal: to the letter."
                " shortest: break or go round, the least length and tolls."
            ),
        ),
    ] = "least",
    toll: options.TollOption = None,
    max_destroyed: Annotated[
        int, typer.Option(min=1, help="Most obstacles that may be destroyed in one task.")
    ] = 8,
    out: Annotated[
        pathlib.Path | None,
        typer.Option(
            metavar="DIR",
            help=(
                "Write results.json and pictures here; of more than 4096 tasks, or with"
                " --shard-size or --workers, shards instead: run again, it resumes."
            ),
        ),
    ] = None,
    pictures: Annotated[
        int, typer.Option(min=0, help="With --out: draw at most so many tasks.")
    ] = 12,
    page: Annotated[
        pathlib.Path | None,
        typer.Option(
            "--report", metavar="FILE.html", help="Write a web page: table, filters, pictures."
        ),
    ] = None,
    results: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Write the answers here: .json, or .parquet."),
    ] = None,
    path: Annotated[
        pathlib.Path | None,
        typer.Option(
            "--path",
            metavar="FILE",
            help="Write the route of one task, in metres: .geojson, or .json (nav_msgs/Path).",
        ),
    ] = None,
    shard_size: Annotated[
        int | None,
        typer.Option(
            min=1,
            rich_help_panel=options.SHARED,
            help="With --out: tasks in a shard. Default: 4096.",
            show_default=False,
        ),
    ] = None,
    workers: options.WorkersOption = None,
    part: options.PartOption = None,
    engine: options.EngineOption = None,
    address: options.AddressOption = None,
    as_json: JsonOption = False,
) -> int:
    """Says of the tasks in the files what blocks, what to destroy and how to go: [bold]0[/bold]
    all solved, [bold]1[/bold] some unsolvable, [bold]2[/bold] bad input, [bold]3[/bold] budget
    spent.
    """
    require_page_name(page)
    worth = options.toll_for(mode, toll)
    if results:
        require_name(results)
    if path:
        require_path_name(path)
    how = {"workers": workers, "part": part, "engine": engine, "address": address}
    is_shared = any(value is not None for value in (shard_size, *how.values()))
    coalitions = [path for path in inputs if holds_coalitions(path)]
    if coalitions:
        _require_alone(coalitions, inputs, page, results, path)
        if is_shared:
            raise ValueError(
                f"{coalitions[0]}: tasks of coalitions are solved at once: leave out --workers,"
                " --part, --engine and --shard-size"
            )
        from srt_jax.commands.coalitions import solve_files

        return solve_files(
            inputs, max_destroyed=max_destroyed, out=out, pictures=pictures, as_json=as_json
        )

    others = {"--report": page, "--results": results, "--path": path}
    folder = _require_folder(out, others) if is_shared else out
    if counts := _counts_for_shards(folder, inputs, reading, others, is_shared):
        assert folder is not None
        request = shards.Request(
            inputs=tuple(inputs),
            counts=counts,
            reading=reading,
            destroyable=destroyable,
            mode=mode,
            toll=worth,
            max_destroyed=max_destroyed,
            shard_size=shard_size or shards.SHARD_SIZE,
            format=shards.format_of(folder),
        )
        return _solve_to_shards(folder, request, how, as_json=as_json)

    tasks, frames, notes, failed = read_framed(inputs, reading, destroyable, quiet=as_json)
    if not tasks:
        raise ValueError(f"{', '.join(inputs)}: the batch is empty: no task to solve")
    if path and len(tasks) > 1:
        raise ValueError(
            f"--path {path} holds the route of one task, and there are {len(tasks)}: choose one,"
            " such as by --rows 3:4"
        )
    if path:
        require_metres(path, frames[0])
    begin = time.perf_counter()
    # a task has no more to destroy; up to 8 share a program
    most = min(max_destroyed, max(8, *(len(task.task.destroyable) for task in tasks)))
    progress_shown = show_progress("solving", len(tasks), quiet=as_json, compiles=True)
    with at_once(tasks), progress_shown as progress:
        solutions = solve_many(
            [task.task for task in tasks],
            mode=mode,
            toll=worth,
            max_destroyed=most,
            progress=progress,
        )
    seconds = time.perf_counter() - begin
    doubts = Notes()
    if destroyable is None and reading.labels is None and reading.block is None:
        gone = [np.asarray(s.destroyed)[: int(s.num_destroyed)].tolist() for s in solutions]
        doubts = doubts_of(tasks, gone, frames)
        notes = [*notes, *doubts.records("answers")]
    with at_once(tasks):
        records = report(
            tasks,
            solutions,
            seconds,
            out=out,
            pictures=pictures,
            as_json=as_json,
            html=page,
            results=results,
            notes=notes,
            mode=mode,
            frames=frames,
            path=path,
            toll=worth,
        )
    for doubt in doubts if not as_json else ():
        say_wrapped(printer(), f"Note: {doubt}.")
    return BAD_INPUT if failed else exit_code(records)


def _counts_for_shards(
    out: pathlib.Path | None,
    inputs: list[str],
    reading: Reading,
    others: dict[str, Any],
    is_shared: bool,
) -> tuple[int, ...] | None:
    """Returns the tasks of each input where answers go to shards, else None. Though nobody said so
    they do if they went there before, or are too many for one file.
    """
    if not is_shared and (out is None or any(others.values())):
        return None
    is_sure = is_shared or (out is not None and (out / shards.MANIFEST).exists())
    try:
        counts = shards.count_all(inputs, reading)
    except ValueError:
        if is_sure:
            raise
        return None  # of one file: the others are solved, and its error is told then
    return counts if is_sure or sum(counts) > shards.SHARD_SIZE else None


def _require_folder(out: pathlib.Path | None, others: dict[str, Any]) -> pathlib.Path:
    """Returns the folder for shards; ValueError where there is none, or what is not written beside
    them.
    """
    if out is None:
        raise ValueError("--workers, --part, --engine and --shard-size write shards: add --out DIR")
    wrong = next((name for name, value in others.items() if value), None)
    if wrong:
        raise ValueError(
            f"{wrong} is for tasks that are solved at once, not for shards: leave it out, or"
            " --workers, --part, --engine and --shard-size"
        )
    return out


def _solve_to_shards(
    folder: pathlib.Path, request: shards.Request, how: dict[str, Any], *, as_json: bool
) -> int:
    """Makes the shards that are missing, tells what is in them, and returns the exit code."""
    part = as_part(how["part"])
    total = sum(request.counts)
    if not total:
        raise ValueError(f"{', '.join(request.inputs)}: the batch is empty: no task to solve")
    keep_together()
    begin = time.perf_counter()
    make_folder(folder)
    job = shards.settled_job(folder, request)
    units = part.units(len(job))
    asked = sum(job.num_tasks(unit) for unit in units)
    with show_progress("solving", asked, quiet=as_json) as progress:
        given: dict[str, Any] = how | {"part": part}
        made = run(job, **given, progress=progress)
    seconds = time.perf_counter() - begin
    counts = sum((job.statuses(unit) for unit in units), Counter())
    left_out = asked - sum(counts.values())
    if as_json:
        document = {"folder": str(folder), "tasks": sum(counts.values()), "shards": len(units)}
        document |= {"made": len(made.outcomes), "left_out": left_out, "statuses": dict(counts)}
        say_json(document)
    else:
        if left_out:
            note(f"tasks left out: --block {request.reading.block} does not fit: {left_out}")
        told = ", ".join(f"{count} {status}" for status, count in counts.most_common())
        say(
            f"{folder} holds {counted(sum(counts.values()), 'answer')} in"
            f" {counted(len(units), 'shard')},"
            f" {len(made.outcomes)} of them made{took(seconds, compiles=False)}: {told};"
            " every answer replayed."
        )
    return exit_code([{"status": status} for status in counts])


def _require_alone(
    coalitions: list[str],
    inputs: list[str],
    page: pathlib.Path | None,
    results: pathlib.Path | None,
    path: pathlib.Path | None,
) -> None:
    """Raises ValueError where tasks of coalitions come with what is for other tasks only."""
    others = [path for path in inputs if path not in coalitions]
    if others:
        raise ValueError(
            f"{coalitions[0]} holds a coalition's task, {others[0]} does not: solve them one after"
            " the other"
        )
    if page or results or path:
        name = "--report" if page else "--results" if results else "--path"
        raise ValueError(
            f"{coalitions[0]}: {name} is not for tasks of coalitions: use --out or --json"
        )
