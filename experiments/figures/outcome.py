"""What every experiment leaves behind: tables on the terminal, one JSON file that says how it was
made, figures beside it.
"""

import argparse
import json
import math
import pathlib
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from srt_jax.bench.machine import machine, machine_line
from srt_jax.formats.shared.whole_files import atomic_write, make_folder


class Table(NamedTuple):
    """A table for people. rows: text, one entry a column; note: what has to be known to read it."""

    title: str
    columns: Sequence[str]
    rows: list[list[str]]
    note: str = ""


def options(name: str, doc: str, **defaults: Any) -> argparse.ArgumentParser:
    """Returns a parser with what all experiments take: --out, --seed, --quick."""
    parser = argparse.ArgumentParser(
        prog=f"python -m experiments.{name}",
        description=doc,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--out",
        type=pathlib.Path,
        default=pathlib.Path("results") / name,
        metavar="DIR",
        help=f"where {name}.json and the figures go (default: %(default)s)",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=0,
        help="another seed draws other tasks; the same, the same (default: 0)",
    )
    parser.add_argument(
        "--quick", action="store_true", help="few and small cases, in under a minute"
    )
    return parser


def run(main: Callable[[], int]) -> None:
    """Ends the process with what `main` returns; bad input and a missing package become one line on
    standard error.
    """
    try:
        sys.exit(main())
    except (ValueError, ImportError) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)


class Outcome:
    """What an experiment found: raw data, tables and figures, kept with the command, the machine
    and the time it took.
    """

    def __init__(
        self, name: str, given: argparse.Namespace, arguments: Sequence[str], *packages: str
    ) -> None:
        self.name, self.out = name, given.out
        self._began, self._tables, self._data, self._figures = time.perf_counter(), [], {}, []
        self._command, self._machine = (
            " ".join([f"python -m experiments.{name}", *arguments]),
            machine(*packages),
        )
        make_folder(self.out)

    def progress(self, message: str) -> None:
        """Prints on standard error what is being done, with the seconds since the beginning."""
        print(
            f"[{time.perf_counter() - self._began:6.1f} s] {message}", file=sys.stderr, flush=True
        )

    def add(self, table: Table) -> None:
        """Keeps a table and prints it."""
        self._tables.append(table)
        print(f"\n{as_text(table)}", flush=True)

    def keep(self, **data: Any) -> None:
        """Keeps raw data under the names given."""
        self._data |= data

    def figure(self, figure: Any, name: str, caption: str) -> None:
        """Writes a matplotlib figure as PNG and SVG."""
        for ending in ("png", "svg"):
            with atomic_write(self.out / f"{name}.{ending}", "wb") as file:
                figure.savefig(file, format=ending, dpi=220)
        self._figures.append({"file": f"{name}.png", "caption": caption})

    def save(self) -> None:
        """Writes NAME.json and prints where everything is."""
        record = {
            "experiment": self.name,
            "command": self._command,
            "date": time.strftime("%Y-%m-%d"),
            "machine": self._machine,
            "seconds": round(time.perf_counter() - self._began, 1),
            "tables": [table._asdict() for table in self._tables],
            "figures": self._figures,
            "data": _plain(self._data),
        }
        with atomic_write(self.out / f"{self.name}.json") as file:
            json.dump(record, file, indent=1, allow_nan=False)
        figures = "".join(f", {figure['file']} and .svg" for figure in self._figures)
        print(f"\n{machine_line(self._machine)}\nIn {self.out}: {self.name}.json{figures}.")


def _plain(data: Any) -> Any:
    """Returns the data with None for what JSON has no number for: NaN and the infinities."""
    if isinstance(data, dict):
        return {name: _plain(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def as_text(table: Table) -> str:
    """Returns the table for a terminal: columns wide enough, numbers to the right."""
    lines = [list(table.columns), *table.rows]
    widths = [max(len(line[place]) for line in lines) for place in range(len(table.columns))]
    to_right = [_is_of_numbers(table, place) for place in range(len(table.columns))]

    def line_of(entries: Sequence[str]) -> str:
        cells = zip(entries, widths, to_right)
        return "  ".join(
            entry.rjust(width) if right else entry.ljust(width) for entry, width, right in cells
        ).rstrip()

    rule = "  ".join("-" * width for width in widths)
    return "\n".join(
        [
            table.title,
            "",
            line_of(lines[0]),
            rule,
            *map(line_of, lines[1:]),
            *([table.note] if table.note else []),
        ]
    )


def as_markdown(table: Table) -> str:
    """Returns the table in Markdown."""

    def line_of(entries: Sequence[str]) -> str:
        return "| " + " | ".join(entry.replace("|", "\\|") for entry in entries) + " |"

    ruler = (
        "|"
        + "|".join(
            "---:" if _is_of_numbers(table, place) else "---" for place in range(len(table.columns))
        )
        + "|"
    )
    lines = [
        f"**{table.title}**",
        "",
        line_of(table.columns),
        ruler,
        *map(line_of, table.rows),
        "",
        table.note,
    ]
    return "\n".join(lines).rstrip()


def _is_of_numbers(table: Table, place: int) -> bool:
    """Whether most entries of a column begin as numbers do."""
    entries = [row[place] for row in table.rows if row[place]]
    return place > 0 and 2 * sum(entry[0].isdigit() or entry[0] in "+-" for entry in entries) > len(
        entries
    )


def time_text(spread: dict[str, float], *, unit: float = 1e3) -> str:
    """Returns a median with its quartiles: "12.3 (11.9-13.0)"; seconds times `unit`."""
    median, low, high = (_three_digits(spread[name] * unit) for name in ("median", "low", "high"))
    return median if spread["count"] < 2 or low == high else f"{median} ({low}-{high})"


def _three_digits(value: float) -> str:
    if value != value:
        return "-"
    return (
        f"{value:.0f}"
        if value >= 100
        else f"{value:.1f}"
        if value >= 10
        else f"{value:.2f}"
        if value >= 1
        else f"{value:.3f}"
    )
