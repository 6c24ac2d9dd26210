"""Options that several commands have, and what those about reading files come to."""

import pathlib
import sys
from typing import Annotated

import typer

from srt_jax.formats import geojson, gridmap, pictures
from srt_jax.notes import Notes
from srt_jax.sources import Cell, Reading

_PLACES = "Places and maps"

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
StartOption = Annotated[
    str | None,
    typer.Option(metavar="R,C", help="Start cell on a map or place. Default: see docs/formats.md; a .map asks for it."),
]
GoalOption = Annotated[str | None, typer.Option(metavar="R,C", help="Goal cell on a map or place.")]
DestroyableOption = Annotated[
    str | None,
    typer.Option(
        metavar="all|none|IDS", help="Which obstacles can be destroyed, e.g. 3,7. Default: as the file says; maps: all."
    ),
]
BlockOption = Annotated[
    str | None,
    typer.Option(
        metavar="half|quarter|bagel-K", help="Cut the goal off by one more obstacle, which can be destroyed (PY16, 4)."
    ),
]
RepairOption = Annotated[bool, typer.Option("--repair", help="Make valid the polygons of a .json world that cross themselves.")]
SizeOption = Annotated[
    int | None,
    typer.Option(
        min=1, metavar="N", rich_help_panel=_PLACES, help="N x N cells on the largest square of a place. Default: 500."
    ),
]
CellSideOption = Annotated[
    float | None,
    typer.Option(metavar="M", rich_help_panel=_PLACES, help="Cells of M metres on the whole place, or in an .svg scene."),
]
RuleOption = Annotated[
    str,
    typer.Option(
        metavar="touch|centre", rich_help_panel=_PLACES, help="Which cells a polygon covers: all it meets, or centres."
    ),
]
TagsOption = Annotated[
    str | None,
    typer.Option(
        metavar="RULES.json", rich_help_panel=_PLACES, help="Which tags are obstacles, and which of them destroyable."
    ),
]
UnitsOption = Annotated[
    str, typer.Option(metavar="|".join(geojson.UNITS), rich_help_panel=_PLACES, help="Of the coordinates in GeoJSON.")
]
FreePixelsOption = Annotated[
    str,
    typer.Option(metavar="|".join(pictures.POLARITIES), rich_help_panel=_PLACES, help="Which pixels of a picture are free."),
]
ThresholdOption = Annotated[
    float, typer.Option(metavar="0..255", rich_help_panel=_PLACES, help="Shade from which on a pixel is light.")
]
UnknownOption = Annotated[
    str,
    typer.Option(
        metavar="|".join(gridmap.UNKNOWN_AS), rich_help_panel=_PLACES, help="What unknown cells of a ROS map count as."
    ),
]


def reading(*, start: str | None, goal: str | None, free_pixels: str, **others: object) -> Reading:
    """Returns how to read files, from the options as typed."""
    return Reading(start=cell("--start", start), goal=cell("--goal", goal), free_pixels=free_pixels, **others)  # type: ignore[arg-type]


def cell(option: str, text: str | None) -> Cell | None:
    """Returns the cell typed as row,column; None where none was."""
    try:
        row, col = (text or "0,0").split(",")
        return (int(row), int(col)) if text is not None else None
    except ValueError:
        raise ValueError(f"{option} {text!r} is no cell: write row,column, such as 3,5") from None


def tell(path: str, notes: Notes) -> None:
    """Prints what was noted while a file was read, on standard error."""
    for note in notes:
        print(f"srt-jax: note: {pathlib.PurePath(path).name}: {note}", file=sys.stderr)


def sides(text: str) -> int | tuple[int, int]:
    """Returns the cells a side typed after --size: a number, or a range as (least, greatest)."""
    try:
        low, _, high = text.partition("-")
        return (int(low), int(high)) if high else int(low)
    except ValueError:
        raise ValueError(f"--size must be a number such as 64, or a range such as 64-500, got {text!r}") from None
