"""How files are read: the options that solve, draw and convert share, put in the place of their
parameter `reading`.
"""

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Annotated, Any, NamedTuple

import typer

from srt_jax.commands.shared import options
from srt_jax.formats import geojson, gridmap, pictures
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.task_files import read_prepared
from srt_jax.geometry.frame import Frame
from srt_jax.robots.ends import as_end, as_radius
from srt_jax.task import NamedTask

AS_SET = Reading()
_PLACES = "Places and maps"


def with_reading(command: Callable[..., int]) -> Callable[..., int]:
    """Returns the command with the options of `_reading` instead of its parameter `reading`."""
    options = inspect.signature(_reading).parameters

    @functools.wraps(command)
    def run(**typed: Any) -> int:
        reading = _reading(**{name: typed.pop(name) for name in options})
        return command(**typed, reading=reading)

    parameters = []
    for name, parameter in inspect.signature(command).parameters.items():
        parameters += list(options.values()) if name == "reading" else [parameter]
    keywords = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in parameters]
    run.__signature__ = inspect.Signature(keywords, return_annotation=int)  # pyright: ignore[reportAttributeAccessIssue]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in keywords} | {
        "return": int
    }
    return run


class FramedTasks(NamedTuple):
    """What was read, as `options.ReadTasks`; frames: where the map of each task lies, None where
    that is not known.
    """

    tasks: list[NamedTask]
    frames: list[Frame | None]
    notes: list[dict[str, Any]]
    failed: list[str]


def read_framed(
    inputs: Sequence[str], how: Reading, destroyable: str | None, *, quiet: bool
) -> FramedTasks:
    """Reads every file as `options.read_all` does, with its tasks made ready to be solved."""
    frames: list[Frame | None] = []

    def read(path: str, notes: Notes) -> list[NamedTask]:
        source = read_prepared(path, how, destroyable, notes)
        frames.extend([source.frame] * len(source.tasks))
        return source.tasks

    tasks, records, failed = options.read_all(inputs, read, quiet=quiet)
    return FramedTasks(tasks, frames, records, failed)


def _reading(
    *,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="R,C|Xm,Ym|LONE,LATN",
            help=(
                "Start on a map or place: a cell, metres such as 1.5m,-2m, or degrees such as"
                " 24.94E,60.17N. Default: see docs/formats.md; a .map requires it."
            ),
        ),
    ] = None,
    goal: Annotated[
        str | None,
        typer.Option(metavar="R,C|Xm,Ym|LONE,LATN", help="Goal on a map or place, as --start."),
    ] = None,
    radius: Annotated[
        str | None,
        typer.Option(
            metavar="Rm|R",
            help="Radius of the robot, metres such as 0.22m or cells: obstacles are dilated.",
        ),
    ] = None,
    block: Annotated[
        str | None,
        typer.Option(
            metavar="half|quarter|bagel-K",
            help="Cut the goal off by one more obstacle, which can be destroyed (PY16, 4).",
        ),
    ] = None,
    limit: options.LimitOption = None,
    rows: options.RowsOption = None,
    size: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            rich_help_panel=_PLACES,
            help="N x N cells on the largest square of a place. Default: 500.",
        ),
    ] = None,
    cell_side: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            rich_help_panel=_PLACES,
            help=(
                "Cells of M metres on the whole place, or in an .svg scene; of a .map, .scen, .npz"
                " or picture, which do not say it."
            ),
        ),
    ] = None,
    rule: Annotated[
        str,
        typer.Option(
            metavar="touch|centre",
            rich_help_panel=_PLACES,
            help="Which cells a polygon covers: all it meets, or centres.",
        ),
    ] = "touch",
    labels: Annotated[
        str | None,
        typer.Option(
            metavar="PICTURE",
            rich_help_panel=_PLACES,
            help="Names the obstacles of a map of cells: each colour is one, the rest is walls.",
        ),
    ] = None,
    tags: Annotated[
        str | None,
        typer.Option(
            metavar="RULES.json",
            rich_help_panel=_PLACES,
            help="Which tags are obstacles, and which of them destroyable.",
        ),
    ] = None,
    units: Annotated[
        str,
        typer.Option(
            metavar="|".join(geojson.UNITS),
            rich_help_panel=_PLACES,
            help="Of the coordinates in GeoJSON.",
        ),
    ] = "auto",
    free_pixels: Annotated[
        str,
        typer.Option(
            metavar="|".join(pictures.POLARITIES),
            rich_help_panel=_PLACES,
            help="Which pixels of a picture are free.",
        ),
    ] = "light",
    threshold: Annotated[
        float,
        typer.Option(
            metavar="0..255",
            rich_help_panel=_PLACES,
            help="Shade from which on a pixel is light.",
        ),
    ] = 128.0,
    unknown: Annotated[
        str,
        typer.Option(
            metavar="|".join(gridmap.UNKNOWN_AS),
            rich_help_panel=_PLACES,
            help="What unknown cells of a ROS map count as.",
        ),
    ] = "blocked",
    repair: Annotated[
        bool,
        typer.Option(
            "--repair", help="Make valid the polygons of a .json world that cross themselves."
        ),
    ] = False,
) -> Reading:
    """Returns how to read files, from the options as typed."""
    return Reading(
        start=None if start is None else as_end("--start", start),
        goal=None if goal is None else as_end("--goal", goal),
        radius=None if radius is None else as_radius("--radius", radius),
        labels=labels,
        block=block,
        size=size,
        cell_side=cell_side,
        rule=rule,
        tags=tags,
        units=units,
        free_pixels=free_pixels,
        threshold=threshold,
        unknown=unknown,
        repair=repair,
        limit=limit,
        rows=options.row_range(rows),
    )
