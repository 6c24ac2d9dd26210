"""Options that several commands have, and how their text is read."""

from typing import Annotated

import typer

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]


def cell(option: str, text: str | None) -> tuple[int, int] | None:
    """Returns the cell that "3,5" names, None for None; ValueError names the option."""
    try:
        row, col = (text or "0,0").split(",")
        return (int(row), int(col)) if text is not None else None
    except ValueError:
        raise ValueError(f"{option} {text!r} is no cell: write row,column, such as 3,5") from None
