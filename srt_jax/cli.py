"""The command `srt-jax`: reads tasks, solves them, prints a table or JSON, draws pictures."""

import json
import pathlib
import sys
import time
from collections import Counter
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from srt_jax.check import check
from srt_jax.console import counted, error_line, printer
from srt_jax.inputs import Cell, NamedTask, read_scenario_map, read_tasks
from srt_jax.many import solve_many
from srt_jax.results import as_record, write_results
from srt_jax.types import Solution, Status

app = typer.Typer(
    add_completion=True,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Solves smart relocation tasks: finds the way, or what blocks it, what to destroy, and the way then.",
)

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


def run(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code; whatever goes wrong is told in one line on standard error."""
    try:
        return app(arguments, prog_name="srt-jax", standalone_mode=False) or 0
    except typer.Exit as stop:
        return stop.exit_code
    except (typer.Abort, KeyboardInterrupt):
        error_line("stopped; files appear only when whole, so nothing half-written is left")
        return 130
    except (ValueError, ImportError) as error:
        return error_line(str(error))
    except Exception as error:
        told = getattr(error, "format_message", None)  # what all of the parser's errors have, and only they
        if told is None:
            raise
        context = getattr(error, "ctx", None)
        hint = f"; see '{context.command_path} --help'" if context else ""
        return error_line(told().rstrip(".") + hint)


def _cell(option: str, text: str | None) -> Cell | None:
    try:
        row, col = (text or "0,0").split(",")
        return (int(row), int(col)) if text is not None else None
    except ValueError:
        raise ValueError(f"{option} {text!r} is no cell: write row,column, such as 3,5") from None


@app.command(
    epilog="Examples:  srt-jax solve city.map --start 3,5 --goal 200,310   |   srt-jax solve tasks.npz world.json --out answers"
)
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
        str, typer.Option(metavar="least|paper", help="least: the least removal. paper: the paper's greedy loop.")
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


def report(
    tasks: list[NamedTask],
    solutions: list[Solution],
    seconds: float,
    *,
    out: pathlib.Path | None,
    pictures: int,
    as_json: bool,
) -> list[dict[str, Any]]:
    """Replays every solution, then prints and writes them; returns the records."""
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
        print(json.dumps({"tasks": records}))
    else:
        _print_table(records, seconds)
    return records


def _write(out, tasks, solutions, records, pictures: int, *, quiet: bool) -> None:
    from srt_jax.draw import draw

    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"{out}: cannot be made a folder: {error.strerror}") from error
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


@app.command(epilog="Example:  srt-jax scen Berlin_0_512.map.scen --map Berlin_0_512.map")
def scen(
    scenario: Annotated[str, typer.Argument(metavar="FILE.scen", help="A MovingAI scenario.")],
    map_path: Annotated[
        str | None, typer.Option("--map", metavar="FILE.map", help="Its map. Default: the one it names, beside it.")
    ] = None,
    limit: Annotated[int | None, typer.Option(min=1, help="Only the first so many rows.")] = None,
    as_json: JsonOption = False,
) -> int:
    """Computes every optimal length of a scenario anew: [bold]0[/bold] all match, [bold]1[/bold] some do not."""
    from srt_jax.formats.movingai import read_scen
    from srt_jax.scenario import MATCH, optimal_lengths, relative_errors

    free = read_scenario_map(scenario, map_path)
    rows = read_scen(scenario)[:limit]
    if not rows:
        raise ValueError(f"{scenario}: the scenario has no row")
    begin = time.perf_counter()
    with counted("rows", len(rows), quiet=as_json) as progress:
        errors = relative_errors(optimal_lengths(free, rows, progress=progress), rows)
    worst, num_matches = float(errors.max()), int((errors <= MATCH).sum())
    if as_json:
        told = worst if np.isfinite(worst) else None
        print(json.dumps({"rows": len(rows), "matches": num_matches, "max_relative_error": told}))
    else:
        seconds = time.perf_counter() - begin
        print(f"{len(rows)} rows, {num_matches} match (relative error <= {MATCH:g}), max error {worst:.2e}, {seconds:.1f} s")
        for index in np.flatnonzero(errors > MATCH)[:5].tolist():
            print(f"  row {index + 1}: error {errors[index]:.2e}, the scenario says {rows[index].length}", file=sys.stderr)
    return 0 if num_matches == len(rows) else 1


@app.command(epilog="Example:  srt-jax demo --out demo")
def demo(
    out: Annotated[
        pathlib.Path, typer.Option(metavar="DIR", help="Where the table, the pictures and the results go.")
    ] = pathlib.Path("demo"),
    pairs: Annotated[int, typer.Option(min=1, max=100, help="Pairs of start and goal; five tasks each.")] = 6,
    seed: Annotated[int, typer.Option(min=0, help="Draws other pairs.")] = 0,
    as_json: JsonOption = False,
) -> int:
    """The main job on a real city, Helsinki: goals cut off in the paper's five ways, solved as one batch, drawn."""
    from srt_jax import demo as work
    from srt_jax.formats.batch import write_batch
    from srt_jax.formats.files import written
    from srt_jax.task import stack

    place = work.city()
    tasks = work.tasks_in(place, pairs=pairs, seed=seed)
    begin = time.perf_counter()
    with counted("solving", len(tasks), quiet=as_json) as progress:
        solutions = solve_many([task.task for task in tasks], progress=progress)
    seconds = time.perf_counter() - begin
    records = report(tasks, solutions, seconds, out=out, pictures=len(work.BLOCKAGES), as_json=as_json)
    text = work.as_markdown(work.summary(place, tasks, solutions), place)
    with written(out / "table.md") as file:
        file.write(text)
    write_batch(out / "tasks.npz", stack([task.task for task in tasks]), names=[task.name for task in tasks])
    if not as_json:
        print(f"\n{text}\nAlso in {out}: table.md, and tasks.npz for 'srt-jax solve {out / 'tasks.npz'}'.")
    return 0 if all(Status[record["status"]].is_solved for record in records) else 1


@app.command(
    epilog="Examples:  srt-jax generate mixed --count 1000 --size 64-500 --out tasks.npz   |   "
    "srt-jax generate bagel-10 --count 8 --size 500 --out bagels.npz"
)
def generate(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="half, quarter, bagel-K, rooms, fences or mixed", show_default=False)
    ],
    out: Annotated[pathlib.Path, typer.Option(metavar="FILE.npz", help="Where the batch goes.", show_default=False)],
    count: Annotated[int, typer.Option(min=1, help="How many tasks.")] = 16,
    size: Annotated[str, typer.Option(metavar="S|LOW-HIGH", help="Cells a side, or a range of them.")] = "64",
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same tasks on every machine.")] = 0,
    as_json: JsonOption = False,
) -> int:
    """Writes a batch of tasks; with the least removal known where there is a proof of it."""
    from srt_jax.formats.batch import write_batch
    from srt_jax.generate import generate as made
    from srt_jax.task import stack

    if out.suffix.lower() != ".npz":
        raise ValueError(f"--out {out}: a batch is an .npz file: end the name in .npz")
    names, tasks, optima = zip(*made(kind, count=count, size=_sizes(size), seed=seed))
    write_batch(out, stack(tasks), names=names, optimum=np.array(optima, np.float32))
    known = int(np.sum(~np.isnan(optima)))
    if as_json:
        print(json.dumps({"file": str(out), "tasks": len(tasks), "known_optimum": known}))
    else:
        print(f"Wrote {len(tasks)} tasks to {out}; the least removal is known for {known}. Next: srt-jax solve {out}")
    return 0


def _sizes(text: str) -> int | tuple[int, int]:
    try:
        low, _, high = text.partition("-")
        return (int(low), int(high)) if high else int(low)
    except ValueError:
        raise ValueError(f"--size must be a number such as 64, or a range such as 64-500, got {text!r}") from None
