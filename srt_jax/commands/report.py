"""What comes of solved tasks: every answer replayed, then a table or JSON, results and pictures in a folder."""

import json
import pathlib
from collections import Counter
from collections.abc import Sequence
from typing import Any

from rich.table import Table

from srt_jax.check import check
from srt_jax.console import counted, printer
from srt_jax.formats.files import make_folder
from srt_jax.inputs import NamedTask
from srt_jax.results import as_record, write_results
from srt_jax.types import Solution, Status


def report(
    tasks: list[NamedTask],
    solutions: list[Solution],
    seconds: float,
    *,
    out: pathlib.Path | None,
    pictures: int,
    as_json: bool,
    notes: Sequence[dict[str, Any]] = (),
) -> list[dict[str, Any]]:
    """Replays every solution, then prints and writes them; returns the records. `notes` on the files go into the JSON."""
    with counted("replaying", len(tasks), quiet=as_json) as progress:
        for (name, task), solution in zip(tasks, solutions):
            problems = check(task, solution)
            if problems:
                raise AssertionError(f"{name}: a solution failed its replay, please report it: {'; '.join(problems)}")
            progress(1)
    records = [as_record(name, task, solution) for (name, task), solution in zip(tasks, solutions)]
    if out:
        _write(out, tasks, solutions, records, pictures, quiet=as_json)
    if as_json:
        print(json.dumps({"tasks": records} | ({"notes": list(notes)} if notes else {})))
    else:
        _print_table(records, seconds)
    return records


def _write(out, tasks, solutions, records, pictures: int, *, quiet: bool) -> None:
    from srt_jax.draw import draw

    make_folder(out)
    with counted("drawing", min(pictures, len(tasks)), quiet=quiet) as progress:
        for (name, task), solution in list(zip(tasks, solutions))[:pictures]:
            draw(task, solution, out / f"{pathlib.PurePath(name).name}.png", title=name)
            progress(1)
    write_results(out / "results.json", records)
    if not quiet:
        drawn = f" and {min(pictures, len(tasks))} pictures" if pictures else ""
        printer().print(f"Wrote {out / 'results.json'}{drawn}.", highlight=False)


def _print_table(records: list[dict[str, Any]], seconds: float, most: int = 40) -> None:
    table = Table("task", "status", "blocked by", "contour", "destroyed", "cost / bound", "route")
    for record in records[:most]:
        is_solved = Status[record["status"]].is_solved
        table.add_row(
            record["name"],
            record["status"],
            _shortened(record["blocking"]),
            str(len(record["contour"]) or ""),
            _shortened(record["destroyed"]),
            f"{record['removal_cost']:g} / {record['removal_bound']:g}" if is_solved else "",
            f"{record['cost']:.2f}" if is_solved else "",
        )
    console = printer()
    console.print(table)
    if len(records) > most:
        console.print(f"... and {len(records) - most} more tasks (all of them in --json or --out)", highlight=False)
    counts = ", ".join(f"{count} {status}" for status, count in Counter(record["status"] for record in records).most_common())
    console.print(
        f"{len(records)} tasks in {seconds:.2f} s, compiling included: {counts}; every answer replayed.", highlight=False
    )
    if len(records) == 1:
        console.print(records[0]["explanation"], highlight=False)


def _shortened(ids: list[int], most: int = 6) -> str:
    return " ".join(map(str, ids[:most])) + (f" +{len(ids) - most}" if len(ids) > most else "")
