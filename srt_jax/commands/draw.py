"""`srt-jax draw`: pictures, contact sheets and animations of tasks and their solutions."""

import dataclasses
import os
import pathlib
from collections.abc import Sequence
from typing import Annotated

import typer

from srt_jax.coalition.task_files import holds_coalitions
from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import note, say, say_json, show_progress, waiting
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, read_framed, with_reading
from srt_jax.draw.gallery import SHOWS, Named, gallery
from srt_jax.draw.parts.polar_frame import PolarFrame
from srt_jax.draw.picture import FORMATS
from srt_jax.draw.picture import draw as draw_one
from srt_jax.draw.sheet import MOST_ON_SHEET, contact_sheet
from srt_jax.formats.reading import Reading
from srt_jax.formats.shared.whole_files import make_folder
from srt_jax.geometry.frame import Frame
from srt_jax.many_tasks import solve_many
from srt_jax.solver import MODES
from srt_jax.task import NamedTask


@with_reading
def draw(
    inputs: Annotated[
        list[str],
        typer.Argument(metavar="INPUT...", help="What 'srt-jax solve' reads.", show_default=False),
    ],
    out: Annotated[
        pathlib.Path,
        typer.Option(
            metavar="DIR|FILE",
            help="A folder; or a file .png, .svg, .pdf (many tasks: a sheet) or .gif (one task).",
        ),
    ] = pathlib.Path("pictures"),
    show: Annotated[
        str,
        typer.Option(
            metavar="WHAT",
            help=f"{', '.join(SHOWS)}.",
            autocompletion=lambda: list(SHOWS),
        ),
    ] = "pictures",
    ending: Annotated[
        str,
        typer.Option(
            "--format",
            metavar="png|svg|pdf",
            help="In a folder.",
            autocompletion=lambda: ["png", "svg", "pdf"],
        ),
    ] = "png",
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only the tasks of these names.")
    ] = None,
    polar: Annotated[
        bool,
        typer.Option("--polar", help="Over pictures: the agent's frame with the fuzzy sectors."),
    ] = False,
    metres_per_cell: Annotated[
        float | None,
        typer.Option(
            help="With --polar: the side of a cell. Default: that of the map, else 1.",
        ),
    ] = None,
    heading: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES",
            help="With --polar: where the agent looks, leftwards from east. Default: the goal.",
        ),
    ] = None,
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    mode: Annotated[
        str,
        typer.Option(
            metavar="|".join(MODES),
            help="As in 'srt-jax solve'.",
            autocompletion=lambda: list(MODES),
        ),
    ] = "least",
    toll: options.TollOption = None,
    max_destroyed: Annotated[
        int, typer.Option(min=1, help="Most obstacles that may be destroyed in one task.")
    ] = 8,
    as_json: JsonOption = False,
) -> int:
    """Draws tasks with their solutions: pictures, contact sheets, animations of the wave and of the
    whole loop.
    """
    frame = PolarFrame(metres_per_cell, heading) if polar else None
    worth = options.toll_for(mode, toll)
    _check(out, show, ending)
    if any(holds_coalitions(path) for path in inputs):
        from srt_jax.commands.coalitions import draw_files

        files = draw_files(inputs, out, ending=ending, max_destroyed=max_destroyed)
        if as_json:
            say_json({"files": [str(file) for file in files]})
        else:
            say(f"Drew {len(files)} task{'s' if len(files) > 1 else ''} of coalitions: {files[0]}")
        return 0
    # What --only names may lie beyond the first tasks: the limit is then one on what was chosen.
    how = dataclasses.replace(reading, limit=None) if only else reading

    with waiting("reading", quiet=as_json):
        tasks, frames, notes, failed = read_framed(inputs, how, destroyable, quiet=as_json)
    frames = [frame for task, frame in zip(tasks, frames) if not only or task.name in only]
    tasks = _chosen(tasks, only)[: reading.limit]
    if not tasks:
        raise ValueError(f"{', '.join(inputs)}: the batch is empty: no task to draw")
    if out.suffix.lower() == ".gif" and len(tasks) > 1:
        raise ValueError(
            f"--out {out}: a GIF shows one task, and there are {len(tasks)}: give a folder, or"
            " --only NAME"
        )
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
    named = [(name, task, solution) for (name, task), solution in zip(tasks, solutions)]
    with at_once(tasks):
        files = _draw(named, frames[: len(tasks)], out, show, ending, frame, quiet=as_json)
    if as_json:
        document = {"files": [str(file) for file in files], "tasks": [task.name for task in tasks]}
        say_json(document | ({"notes": notes} if notes else {}))
    else:
        where = str(files[0]) if len(files) == 1 else f"{len(files)} files in {out}"
        say(f"Drew {len(tasks)} task{'s' if len(tasks) > 1 else ''}: {where}")
    return 2 if failed else 0


def _check(out: pathlib.Path, show: str, ending: str) -> None:
    """Refuses what cannot be drawn before anything is solved."""
    if show not in SHOWS:
        raise ValueError(f"--show must be one of {', '.join(SHOWS)}, got {show!r}")
    if f".{ending}" not in FORMATS:
        raise ValueError(f"--format must be png, svg or pdf, got {ending!r}")
    suffix = out.suffix.lower()
    if suffix and not os.path.isdir(out) and suffix not in (*FORMATS, ".gif"):
        raise ValueError(
            f"--out {out}: cannot draw a file with the ending {suffix!r}: use .png, .svg, .pdf,"
            " .gif, or a folder"
        )
    if suffix in FORMATS and show in ("loop", "wave"):
        raise ValueError(f"--out {out}: --show {show} is an animation: end the name in .gif")


def _chosen(tasks: list[NamedTask], only: list[str] | None) -> list[NamedTask]:
    there = {task.name for task in tasks}
    missing = [name for name in only or [] if name not in there]
    if missing:
        few = ", ".join(sorted(there)[:5])
        raise ValueError(
            f"--only {missing[0]}: no task has this name; there are"
            f" {few}{', ...' if len(there) > 5 else ''}"
        )
    return [task for task in tasks if not only or task.name in only]


def _draw(
    named: Named,
    frames: Sequence[Frame | None],
    out: pathlib.Path,
    show: str,
    ending: str,
    frame: PolarFrame | None,
    *,
    quiet: bool,
) -> list[pathlib.Path]:
    if out.suffix.lower() in FORMATS:
        if len(named) == 1 and show != "sheet":
            name, task, solution = named[0]
            draw_one(task, solution, out, title=name, polar=frame, frame=frames[0])
        else:
            if len(named) > MOST_ON_SHEET:
                note(
                    f"{out} shows the first {MOST_ON_SHEET} of {len(named)} tasks: give a folder"
                    " for all"
                )
            with waiting("drawing", quiet=quiet):
                contact_sheet(named[:MOST_ON_SHEET], out, frames=frames[:MOST_ON_SHEET])
        return [out]
    if out.suffix.lower() == ".gif":
        from srt_jax.draw.animation import animate

        name, task, solution = named[0]
        with waiting("drawing", quiet=quiet):
            what = "wave" if show == "wave" else "loop"
            animate(task, solution, out, what=what, title=name, frame=frames[0])
        return [out]
    make_folder(out)
    with show_progress("drawing", len(named), quiet=quiet) as progress:
        return gallery(
            named, out, show=show, ending=ending, polar=frame, frames=frames, progress=progress
        )
