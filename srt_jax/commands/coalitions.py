"""Tasks of coalitions on the command line: solved, replayed, printed, drawn."""

import pathlib
import time
from collections import Counter
from typing import Any

import jax
import numpy as np

from srt_jax.check.coalition import check_coalition
from srt_jax.coalition.explain import coalition_record
from srt_jax.coalition.solve import solve_coalition
from srt_jax.coalition.task import NamedCoalition, stack_coalitions
from srt_jax.coalition.task_files import read_coalitions
from srt_jax.coalition.types import CoalitionSolution
from srt_jax.commands.shared.console import (
    fit_table,
    printer,
    say_json,
    say_wrapped,
    show_progress,
    took,
)
from srt_jax.commands.shared.reporting import exit_code
from srt_jax.draw.coalition import animate_coalition, draw_coalition
from srt_jax.formats.shared.whole_files import atomic_write, make_folder

_COLUMNS = (
    ("task", 0),
    ("status", 0),
    ("agents", 3),
    ("helps", 1),
    ("destroyed", 2),
    ("cost / bound", 1),
    ("done at", 1),
)
_MOST_ROWS = 40


def solve_files(
    inputs: list[str],
    *,
    max_destroyed: int,
    out: pathlib.Path | None,
    pictures: int,
    as_json: bool,
) -> int:
    """Solves the tasks in files of coalitions, replays every answer, and prints and writes them as
    `srt-jax solve` does; returns the exit code.
    """
    import json

    tasks = [named for path in inputs for named in read_coalitions(path)]
    begin = time.perf_counter()
    solutions = solved(tasks, max_destroyed)
    seconds = time.perf_counter() - begin
    with show_progress("replaying", len(tasks), quiet=as_json) as progress:
        for (name, task), solution in zip(tasks, solutions):
            problems = check_coalition(task, solution)
            if problems:
                raise AssertionError(
                    f"{name}: a solution failed its replay, please report it: {'; '.join(problems)}"
                )
            progress(1)
    records = [coalition_record(name, task, one) for (name, task), one in zip(tasks, solutions)]
    if out:
        make_folder(out)
        with atomic_write(out / "results.json") as file:
            json.dump({"coalitions": records}, file, indent=1)
        for (name, task), solution in list(zip(tasks, solutions))[:pictures]:
            draw_coalition(task, solution, out / f"{_file_name(name)}.png", title=name)
    if as_json:
        say_json({"coalitions": records})
    else:
        _print(records, seconds, out)
    return exit_code(records)


def draw_files(inputs: list[str], out: pathlib.Path, *, ending: str, max_destroyed: int) -> list:
    """Draws the tasks in files of coalitions: a folder of pictures, or one picture or GIF; returns
    the files.

    Raises:
      ValueError: one file is to show several tasks.
    """
    tasks = [named for path in inputs for named in read_coalitions(path)]
    solutions = solved(tasks, max_destroyed)
    if not out.suffix:
        make_folder(out)
        files = [out / f"{_file_name(name)}.{ending}" for name, _ in tasks]
    elif len(tasks) > 1:
        raise ValueError(
            f"--out {out}: it shows one task of a coalition, and there are {len(tasks)}: give a"
            " folder"
        )
    else:
        files = [out]
    for file, (name, task), solution in zip(files, tasks, solutions):
        draw = animate_coalition if file.suffix.lower() == ".gif" else draw_coalition
        draw(task, solution, file, title=name)
    return files


def solved(tasks: list[NamedCoalition], max_destroyed: int) -> list[CoalitionSolution]:
    """Returns the answers to tasks of any sizes, each without the padding of the batch."""
    most = min(max_destroyed, max(len(named.task.removal_cost) for named in tasks))
    batch = stack_coalitions([named.task for named in tasks])
    whole = jax.tree.map(np.asarray, solve_coalition(batch, max_destroyed=most))
    answers = []
    for index, (_, task) in enumerate(tasks):
        one = jax.tree.map(lambda array: array[index], whole)  # noqa: B023
        agents, obstacles = task.able.shape
        names = ("help", "cells", "num_cells", "needed", "cost", "finish")
        cut = {name: getattr(one, name)[:agents] for name in names}
        answers.append(one.replace(firm=one.firm[:obstacles], **cut))
    return answers


def _print(records: list[dict[str, Any]], seconds: float, out: pathlib.Path | None) -> None:
    console = printer()
    rows = [
        [
            record["name"],
            record["status"],
            str(len(record["agents"])),
            " ".join(f"{e['helper']}>{e['agent']}" for e in record["helps"]),
            " ".join(str(step["obstacle"]) for step in record["destroyed"]),
            f"{record['removal_cost']:g} / {record['removal_bound']:g}"
            if record["removal_cost"] is not None
            else "",
            f"{record['makespan']:.2f}" if record["makespan"] is not None else "",
        ]
        for record in records[:_MOST_ROWS]
    ]
    console.print(fit_table(_COLUMNS, rows, console.width))
    if len(records) > _MOST_ROWS:
        more = len(records) - _MOST_ROWS
        say_wrapped(console, f"... and {more} more tasks (all of them in --json or --out)")
    counts = ", ".join(
        f"{count} {status}" for status, count in Counter(r["status"] for r in records).most_common()
    )
    say_wrapped(
        console,
        f"{len(records)} task{'s' if len(records) > 1 else ''} of coalitions{took(seconds)}:"
        f" {counts}; every answer replayed.",
    )
    if out:
        say_wrapped(console, f"Wrote {out / 'results.json'} and pictures.")
    if len(records) == 1:
        for line in records[0]["explanation"].split("\n"):
            say_wrapped(console, line)


def _file_name(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name) or "task"
