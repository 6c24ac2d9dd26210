"""`srt-jax compare`: two files of results, or two modes on the same tasks, side by side."""

import pathlib
from typing import Annotated

import typer

from srt_jax.answers.compare import (
    Answer,
    Pair,
    Sums,
    answer_of,
    answer_of_record,
    pairs,
    sums,
)
from srt_jax.answers.results_file import read_results
from srt_jax.answers.shards import read_answers
from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import (
    fit_table,
    printer,
    say_json,
    say_wrapped,
    show_progress,
)
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, read_framed, with_reading
from srt_jax.formats.reading import Reading
from srt_jax.many_tasks import solve_many
from srt_jax.solver import MODES

_MOST_ROWS = 40

_Sides = list[tuple[str, list[Answer]]]
"""The answers of each side with its name: the first is compared with every other."""


@with_reading
def compare(
    inputs: Annotated[
        list[str],
        typer.Argument(
            metavar="A B",
            help="Two files of results (.json, .parquet), or folders of srt-jax solve --out; with"
            " --modes files of tasks.",
            show_default=False,
        ),
    ],
    modes: Annotated[
        str | None,
        typer.Option(
            metavar="A,B,...",
            help=f"Solve the tasks in two modes or more, each held against the first:"
            f" {', '.join(MODES)}.",
            show_default=False,
        ),
    ] = None,
    toll: options.TollOption = None,
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    show_all: Annotated[
        bool, typer.Option("--all", help="Show equal answers too, and every row.")
    ] = False,
    as_json: JsonOption = False,
) -> int:
    """Shows where two sets of answers differ, task by task and in sum: [bold]0[/bold] they are
    equal, [bold]1[/bold] some differ. How tasks are read goes with [bold]--modes[/bold].
    """
    if modes is None:
        if reading != AS_SET or destroyable is not None or toll is not None:
            raise ValueError(
                "compare reads answers as they are: what says how tasks are read or solved goes"
                " with --modes"
            )
        sides = _of_files(inputs)
    else:
        sides = _of_modes(inputs, modes, toll, reading, destroyable, as_json)
    (first, left), *others = sides
    documents, differing = [], 0
    for name, right in others:
        found, names = pairs(left, right), (first, name)
        total = sums(found)
        differing += total.differing
        documents.append(_document(found, total, names))
        if not as_json:
            _print_rows(found, names, show_all)
            _print_sums(total, names)
    if as_json:
        say_json(documents[0] if len(documents) == 1 else {"comparisons": documents})
    return int(differing > 0)


def _of_files(inputs: list[str]) -> _Sides:
    if len(inputs) != 2:
        raise ValueError(
            f"compare takes two files of results, got {len(inputs)}: write srt-jax compare A.json"
            " B.json, or --modes least,paper for two modes on the same tasks"
        )
    sides = []
    for path in inputs:
        try:
            folder = pathlib.Path(path)
            records = read_answers(folder) if folder.is_dir() else read_results(path)
            sides.append((path, [answer_of_record(record) for record in records]))
        except (ValueError, TypeError, AttributeError) as error:
            if isinstance(error, ValueError) and str(path) in str(error):
                raise
            raise ValueError(f"{path}: {error}") from error
    return sides


def _of_modes(
    inputs: list[str],
    text: str,
    toll: float | None,
    reading: Reading,
    destroyable: str | None,
    as_json: bool,
) -> _Sides:
    chosen = [mode.strip() for mode in text.split(",")]
    if len(chosen) < 2 or any(mode not in MODES for mode in chosen):
        raise ValueError(
            f"--modes must be two or more of {', '.join(MODES)}, such as least,paper: {text!r}"
        )
    if toll is not None and "shortest" not in chosen:
        raise ValueError("--toll is for the mode shortest, which --modes does not name")
    tasks, _, _, failed = read_framed(inputs, reading, destroyable, quiet=as_json)
    if failed:
        raise ValueError(f"{failed[0]} cannot be read: compare takes all tasks or none")
    sides = []
    total = len(chosen) * len(tasks)
    progress_shown = show_progress("solving", total, quiet=as_json, compiles=True)
    with at_once(tasks), progress_shown as progress:
        for mode in chosen:
            solutions = solve_many(
                [task.task for task in tasks],
                mode=mode,
                toll=1.0 if toll is None or mode != "shortest" else toll,
                progress=progress,
            )
            answers = [answer_of(task.name, one) for task, one in zip(tasks, solutions)]
            sides.append((mode, answers))
    return sides


def _print_rows(found: list[Pair], names: tuple[str, str], show_all: bool) -> None:
    chosen = found if show_all else [pair for pair in found if pair.differs]
    shown = chosen if show_all else chosen[:_MOST_ROWS]
    columns = [("task", 0), ("status", 0), ("removal cost", 1), ("route", 1), ("destroyed", 2)]
    console = printer()
    if shown:
        say_wrapped(console, f"{names[0]} | {names[1]}")
        console.print(fit_table(columns, [_row(pair) for pair in shown], console.width))
    if len(chosen) > len(shown):
        say_wrapped(console, f"... and {len(chosen) - len(shown)} more tasks differ (--all)")


def _row(pair: Pair) -> list[str]:
    def both(name: str, shape: str) -> str:
        texts = [
            "no task"
            if side is None
            else ""
            if getattr(side, name) is None
            else shape.format(getattr(side, name))
            for side in (pair.left, pair.right)
        ]
        return texts[0] if name not in pair.differs and texts[0] == texts[1] else " | ".join(texts)

    gone = [
        (" ".join(map(str, side.destroyed[:6])) or "nothing") if side and side.is_solved else ""
        for side in (pair.left, pair.right)
    ]
    return [
        pair.name,
        both("status", "{}"),
        both("removal_cost", "{:g}"),
        both("length", "{:.2f}"),
        gone[0] if gone[0] == gone[1] else " | ".join(gone),
    ]


def _print_sums(total: Sums, names: tuple[str, str]) -> None:
    def change(left: float, right: float, shape: str = "g") -> str:
        return "" if left == right else f"{right - left:+{shape}}"

    rows = [
        ["tasks", *map(str, total.tasks), change(*total.tasks), ""],
        ["solved", *map(str, total.solved), change(*total.solved), ""],
    ]
    for name, shape, (left, right), (less_left, less_right) in (
        ("removal cost", "g", total.removal_costs, total.cheaper),
        ("length", ".2f", total.lengths, total.shorter),
    ):
        rows.append(
            [
                name,
                f"{left:{shape}}",
                f"{right:{shape}}",
                change(left, right, shape),
                f"{less_left} | {less_right}",
            ]
        )
    console = printer()
    columns = [("sum", 0), (names[0], 1), (names[1], 1), ("change", 0), ("tasks with less", 2)]
    console.print(fit_table(columns, rows, console.width))
    say_wrapped(
        console,
        f"{total.differing} of {max(total.tasks)} tasks differ; costs and lengths are sums over the"
        f" {total.shared} tasks that both solve.",
    )


def _document(found: list[Pair], total: Sums, names: tuple[str, str]) -> dict:
    rows = [
        {
            "name": pair.name,
            "differs": list(pair.differs),
            "left": pair.left and pair.left._asdict(),
            "right": pair.right and pair.right._asdict(),
        }
        for pair in found
    ]
    return {"left": names[0], "right": names[1], "tasks": rows, "sums": total._asdict()}
