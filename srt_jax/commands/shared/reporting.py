"""What comes of solved tasks: every answer replayed, then a table or JSON; results, pictures and a
web page as asked.
"""

import importlib.util
import pathlib
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from sign_model.foundation.extras import install_command
from sign_model.foundation.files import require_folder_of
from srt_jax.answers.results_file import as_record, write_results
from srt_jax.check import check
from srt_jax.commands.shared.console import (
    BUDGET_SPENT,
    fit_table,
    note,
    printer,
    say_json,
    say_wrapped,
    show_progress,
    took,
)
from srt_jax.formats.shared.whole_files import make_folder
from srt_jax.geometry.frame import Frame
from srt_jax.paths.approach import approach
from srt_jax.robots.path_file import write_path
from srt_jax.task import NamedTask
from srt_jax.types import Approach, Solution, Status, Task

_COLUMNS = (
    ("task", 0),
    ("status", 0),
    ("blocked by", 2),
    ("destroyed", 2),
    ("route", 1),
    ("cost / bound", 3),
    ("contour", 4),
)
"""Of the table, in the order in which people ask; the greater the number the sooner a column goes
where the terminal is narrow.
"""


def report(
    tasks: list[NamedTask],
    solutions: list[Solution],
    seconds: float,
    *,
    out: pathlib.Path | None,
    pictures: int,
    as_json: bool,
    html: pathlib.Path | None = None,
    results: pathlib.Path | None = None,
    write_more: Callable[[], None] | None = None,
    notes: Sequence[dict[str, Any]] = (),
    mode: str | None = None,
    frames: Sequence[Frame | None] | None = None,
    path: pathlib.Path | None = None,
    toll: float = 1.0,
) -> list[dict[str, Any]]:
    """Replays every solution, writes all files, then prints; returns the records. `notes` on the
    files go into the JSON.

    Args:
      results: a file of results. write_more: writes what else the command leaves.
      frames: where the map of each task lies, None where that is not known: then lengths are in
        cell sides.
      path: a file for the route of the one task.
    """
    nears: list[Approach | None] = []
    known = frames or [None] * len(tasks)
    sides = [frame.side if frame is not None and frame.has_metres else None for frame in known]
    with show_progress("replaying", len(tasks), quiet=as_json) as progress:
        for (name, task), solution in zip(tasks, solutions):
            # of what is not solved the way as near as one gets, replayed as well
            is_solved = Status(int(solution.status)).is_solved
            nears.append(None if is_solved else jax.tree.map(np.asarray, approach(task)))
            problems = check(task, solution, mode=mode, toll=toll, approach=nears[-1])
            if problems:
                raise AssertionError(
                    f"{name}: a solution failed its replay, please report it: {'; '.join(problems)}"
                )
            progress(1)
    records = [
        as_record(name, task, solution, cell_side=side, frame=frame, approach=near)
        for (name, task), solution, side, frame, near in zip(tasks, solutions, sides, known, nears)
    ]
    # All files first: a standard output that is closed or full loses none of them.
    wrote: list[str] = []
    if out:
        wrote += _write(out, tasks, solutions, records, pictures, known, nears, quiet=as_json)
    if html:
        wrote += _write_page(html, tasks, solutions, records, nears, seconds, quiet=as_json)
    for file in (results,) if results else ():
        write_results(file, records)
        wrote.append(f"Wrote {file}: the answers.")
    if path:
        name, task = tasks[0]
        write_path(path, task, solutions[0], known[0], approach=nears[0], name=name)
        wrote.append(_path_text(path, records[0]))
    if write_more:
        write_more()
    if as_json:
        say_json({"tasks": records} | ({"notes": list(notes)} if notes else {}))
    else:
        for line in wrote:
            say_wrapped(printer(), line)
        _print_table(tasks, records, seconds)
    return records


def exit_code(records: Sequence[dict[str, Any]]) -> int:
    """Returns 0 where all tasks are solved, 1 where one cannot be, else 3: for some the budget
    was spent.
    """
    statuses = {Status[record["status"]] for record in records}
    if all(status.is_solved for status in statuses):
        return 0
    return BUDGET_SPENT if all(s.is_solved or s is Status.BUDGET_SPENT for s in statuses) else 1


def require_page_name(html: pathlib.Path | None) -> None:
    """Raises ValueError, before anything is solved, where the page could not be written."""
    if html and html.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--report {html}: a report is a web page: end the name in .html")
    if html:
        require_folder_of(html, f"--report {html}")


def _path_text(path: pathlib.Path, record: dict[str, Any]) -> str:
    """Returns what to tell of a route that was written."""
    if record["approach"] is None:
        return f"Wrote {path}: the route."
    return (
        f"Wrote {path}: the way as near to the goal as one gets, for there is no route"
        f" ({record['status']})."
    )


def _write(
    out, tasks, solutions, records, pictures: int, frames, nears, *, quiet: bool
) -> list[str]:
    """Writes results and pictures, and returns what to tell of them."""
    make_folder(out)
    drawn = [(name, task, solution) for (name, task), solution in zip(tasks, solutions)][:pictures]
    files = []
    if drawn and importlib.util.find_spec("matplotlib") is None:
        note(f"no pictures, for drawing needs matplotlib: {install_command('draw', 'matplotlib')}")
    elif drawn:
        from srt_jax.draw.gallery import gallery

        with show_progress("drawing", len(drawn), quiet=quiet) as progress:
            count = len(drawn)
            options = {"frames": frames[:count], "approaches": nears[:count]}
            files = gallery(drawn, out, progress=progress, **options)
    write_results(out / "results.json", records)
    few = (
        ""
        if not files
        else f" (--pictures {len(tasks)} draws all {len(tasks)})"
        if len(drawn) < len(tasks)
        else ""
    )
    and_pictures = f" and {len(files)} picture{'s' if len(files) > 1 else ''}{few}" if files else ""
    return [f"Wrote {out / 'results.json'}{and_pictures}."]


def _write_page(
    html: pathlib.Path, tasks, solutions, records, nears, seconds: float, *, quiet: bool
) -> list[str]:
    from srt_jax.draw.webpage import write_page

    with show_progress("writing the page", len(tasks), quiet=quiet) as progress:
        options = {"seconds": seconds, "approaches": nears, "progress": progress}
        write_page(html, tasks, solutions, records, **options)
    return [f"Wrote {html}: open it in a browser; it needs no network."]


def _print_table(
    tasks: list[NamedTask], records: list[dict[str, Any]], seconds: float, most: int = 40
) -> None:
    console = printer()
    rows = [_row(task, record) for (_, task), record in zip(tasks, records[:most])]
    console.print(fit_table(_COLUMNS, rows, console.width))
    if len(records) > most:
        say_wrapped(
            console, f"... and {len(records) - most} more tasks (all of them in --json or --out)"
        )
    counts = ", ".join(
        f"{count} {status}"
        for status, count in Counter(record["status"] for record in records).most_common()
    )
    number = f"{len(records)} task{'s' if len(records) > 1 else ''}"
    say_wrapped(console, f"{number}{took(seconds)}: {counts}; every answer replayed.")
    if len(records) == 1:
        say_wrapped(console, records[0]["explanation"])


def _row(task: Task, record: dict[str, Any]) -> list[str]:
    is_solved = Status[record["status"]].is_solved
    # what can be destroyed first
    blocking = sorted(record["blocking"], key=lambda i: not task.destroyable[i])
    return [
        record["name"],
        record["status"],
        _shortened(blocking),
        _shortened(record["destroyed"]),
        _route_text(record, is_solved),
        f"{record['removal_cost']:g} / {record['removal_bound']:g}" if is_solved else "",
        str(len(record["contour"]) or ""),
    ]


def _route_text(record: dict[str, Any], is_solved: bool) -> str:
    """Returns the length of the route, or how far from the goal one gets."""
    near, side = record["approach"], record["cell_side"]
    if not is_solved and near is None:
        return ""
    length = record["cost"] if is_solved else near["gap"]
    text = f"{length:.2f}" if side is None else f"{length * side:.2f} m"
    return text if is_solved else f"{text} short"


def _shortened(ids: list[int], most: int = 6) -> str:
    return " ".join(map(str, ids[:most])) + (f" +{len(ids) - most}" if len(ids) > most else "")
