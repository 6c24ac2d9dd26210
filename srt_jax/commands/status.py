"""`srt-jax status`: how far a folder of shards is, whoever works in it."""

import datetime
import pathlib
from typing import Annotated

import typer

from sign_model.foundation.legible import counted
from srt_jax.answers import shards
from srt_jax.commands.shared.console import say, say_json
from srt_jax.commands.shared.options import JsonOption
from srt_jax.dataset.folder import MANIFEST, read_plan
from srt_jax.dataset.specification import DatasetJob
from srt_jax.scale import Job, Standing, standing


def status(
    folder: Annotated[
        pathlib.Path,
        typer.Argument(
            metavar="DIR", help="A folder of srt-jax dataset or solve.", show_default=False
        ),
    ],
    as_json: JsonOption = False,
) -> int:
    """Tells how far a folder of shards is: done, claimed and by whom, missing, rate, time left.

    [bold]0[/bold] all is done, [bold]1[/bold] something is missing.
    """
    found = standing(_job_in(folder))
    if as_json:
        say_json({"folder": str(folder)} | found.as_json())
    else:
        say(*_lines(folder, found))
    return int(found.done < found.units)


def _job_in(folder: pathlib.Path) -> Job:
    if (folder / MANIFEST).is_file():
        return DatasetJob(folder, read_plan(folder))
    if (folder / shards.MANIFEST).is_file():
        return shards.read_job(folder)
    if not folder.is_dir():
        what = "this is no folder" if folder.exists() else "no such folder"
        raise ValueError(
            f"{folder}: {what}: name one that srt-jax dataset or srt-jax solve writes its shards to"
        )
    raise ValueError(
        f"{folder}: holds neither {MANIFEST} nor {shards.MANIFEST}: name a folder that srt-jax"
        " dataset or srt-jax solve writes its shards to (solve does so beyond 4096 tasks, or with"
        " --shard-size)"
    )


def _lines(folder: pathlib.Path, found: Standing) -> list[str]:
    lines = [
        f"{folder}: {found.done} of {counted(found.units, 'shard')} done, {len(found.claimed)}"
        f" claimed, {found.missing} missing; {found.tasks_done} of {counted(found.tasks, 'task')}."
    ]
    if found.rate is not None and found.left is not None:
        left = datetime.timedelta(seconds=round(found.left))
        lines.append(f"{found.rate:.3g} tasks a second of late: {left} left.")
    lines += [
        f"{unit}: claimed by process {holder.pid} on {holder.host}"
        for unit, holder in sorted(found.claimed.items())
    ]
    lines += [
        f"{unit}: left by a process that is gone; whoever works here next makes it"
        for unit in found.abandoned
    ]
    if found.missing and not found.claimed:
        lines.append("Nobody is at work here: run the same command again to go on.")
    return lines
