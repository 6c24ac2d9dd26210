"""`srt-jax tradeoffs`: what breaking through is worth, as a table, JSON and a picture of routes."""

import pathlib
from typing import Annotated, Any

import typer

from srt_jax.commands.shared import options
from srt_jax.commands.shared.console import fit_table, printer, say_json, say_wrapped, waiting
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.commands.shared.options import JsonOption
from srt_jax.commands.shared.reading_options import AS_SET, read_framed, with_reading
from srt_jax.formats.reading import Reading
from srt_jax.tolls.pareto_front import Tradeoff
from srt_jax.tradeoffs import tradeoffs as front_of_task

_COLUMNS = (
    ("length", 0),
    ("removal cost", 0),
    ("destroyed", 1),
    ("best at tolls", 1),
    ("proven", 2),
)


@with_reading
def tradeoffs(
    path: Annotated[
        str,
        typer.Argument(
            metavar="INPUT", help="A file with one task, as for solve.", show_default=False
        ),
    ],
    reading: Reading = AS_SET,
    destroyable: options.DestroyableOption = None,
    tolls: Annotated[
        str | None,
        typer.Option(
            metavar="T,T,...",
            help="Tolls to try: cell sides for one unit of removal cost. Default: 16, by the map.",
        ),
    ] = None,
    max_destroyed: Annotated[
        int, typer.Option(min=1, help="Most obstacles that may be destroyed.")
    ] = 8,
    out: Annotated[
        pathlib.Path | None,
        typer.Option(metavar="FILE", help="Draw the front and its routes here: .png, .svg, .pdf."),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Weighs breaking through against going round: the front of route lengths and removal costs.
    Exit code [bold]1[/bold] where there is no route.
    """
    chosen = _numbers(tolls)
    tasks, frames, _, _ = read_framed([path], reading, destroyable, quiet=as_json)
    if len(tasks) != 1:
        raise ValueError(
            f"{path} holds {len(tasks)} tasks: tradeoffs takes one, choose it with --rows or"
            " --limit"
        )
    name, task = tasks[0]
    frame = frames[0]
    side = frame.side if frame is not None and frame.has_metres else None
    with at_once(tasks), waiting("weighing", quiet=as_json):
        front = front_of_task(task, tolls=chosen, max_destroyed=max_destroyed)
        if out and front:
            from srt_jax.draw.tradeoffs import draw_tradeoffs

            draw_tradeoffs(task, front, out, title=name)
    if as_json:
        say_json({"name": name, "cell_side": side, "front": list(map(_record, front))})
        return int(not front)
    if not front:
        say_wrapped(
            printer(), f"{name}: no toll leads to a route: srt-jax solve tells what blocks."
        )
        return 1
    if out:
        say_wrapped(printer(), f"Wrote {out}.")
    printer().print(fit_table(_COLUMNS, [_row(point, side) for point in front], printer().width))
    return 0


def _numbers(text: str | None) -> list[float] | None:
    try:
        return None if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"--tolls must be numbers such as 1,5,20, got {text!r}") from None


def _record(point: Tradeoff) -> dict[str, Any]:
    return {
        "length": point.length,
        "removal_cost": point.removal_cost,
        "destroyed": list(point.destroyed),
        "tolls": list(point.tolls),
        "is_proven": point.is_proven,
    }


def _row(point: Tradeoff, side: float | None) -> list[str]:
    low, high = point.tolls
    return [
        f"{point.length:.2f}" if side is None else f"{point.length * side:.2f} m",
        f"{point.removal_cost:g}",
        " ".join(map(str, point.destroyed)) or "nothing",
        f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}",
        "yes" if point.is_proven else "no",
    ]
