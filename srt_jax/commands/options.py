"""Options that several commands have; those about reading files are in `reading`."""

import pathlib
import sys
from typing import Annotated

import typer

from srt_jax.formats.notes import Notes

JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document and nothing else.")
]
DestroyableOption = Annotated[
    str | None,
    typer.Option(
        metavar="all|none|IDS",
        help="Which obstacles can be destroyed, e.g. 3,7. Default: as the file says; maps: all.",
    ),
]


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
        raise ValueError(
            f"--size must be a number such as 64, or a range such as 64-500, got {text!r}"
        ) from None
