"""Options that several commands have; those about reading files are in `reading_options`."""

import contextlib
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from srt_jax.commands.shared import console
from srt_jax.commands.shared.console import error_line
from srt_jax.formats.notes import Notes

if TYPE_CHECKING:  # it loads JAX, which `plan --help` does not need
    from srt_jax.task import NamedTask

JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document and nothing else.")
]
DomainArgument = Annotated[
    str, typer.Argument(metavar="DOMAIN", help="PDDL domain file.", show_default=False)
]
DestroyableOption = Annotated[
    str | None,
    typer.Option(
        metavar="all|none|IDS",
        help="Which obstacles can be destroyed, e.g. 3,7. Default: as the file says; maps: all.",
    ),
]


TollOption = Annotated[
    float | None,
    typer.Option(
        metavar="CELLS",
        help=(
            "With --mode shortest: the detour that one unit of removal cost is worth. Default: 1."
        ),
        show_default=False,
    ),
]
LimitOption = Annotated[
    int | None,
    typer.Option(min=1, help="Only the first so many rows of a scenario, or tasks of a batch."),
]
RowsOption = Annotated[
    str | None,
    typer.Option(
        metavar="A:B",
        help="Only rows A to B - 1, counted from 0 as in the tasks' names; A or B may be left out.",
    ),
]
SHARED = "Many processes and machines"

WorkersOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        rich_help_panel=SHARED,
        help="Processes, one core each. Default: this one, on all cores.",
        show_default=False,
    ),
]
PartOption = Annotated[
    str | None,
    typer.Option(
        metavar="I/N|slurm",
        rich_help_panel=SHARED,
        help="Only every N-th shard from the I-th on, I from 0; slurm: as its job array says.",
        show_default=False,
    ),
]
EngineOption = Annotated[
    str | None,
    typer.Option(
        metavar="dask|ray",
        rich_help_panel=SHARED,
        help="Workers of Dask or Ray, on this machine unless --address names a cluster.",
        show_default=False,
    ),
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        rich_help_panel=SHARED,
        help="Of the engine's scheduler, such as tcp://head:8786 (dask), auto (ray).",
        show_default=False,
    ),
]


_ROW = re.compile(r"\s*[0-9]{0,18}\s*")


def row_range(text: str | None) -> tuple[int | None, int | None] | None:
    """Returns the rows typed after --rows, as the two ends of a slice; None where nothing was."""
    if text is None:
        return None
    first, colon, last = text.partition(":")
    if not colon or not all(_ROW.fullmatch(end) for end in (first, last)):
        raise ValueError(
            "--rows must be two numbers A:B, such as 100:200, or 100: for all from there on, got"
            f" {text[:60]!r}"
        )
    ends = [int(end) if end.strip() else None for end in (first, last)]
    return ends[0], ends[1]


def toll_for(mode: str, toll: float | None) -> float:
    """Returns what --toll stands for; ValueError where the mode does not ask for one."""
    if toll is not None and mode != "shortest":
        raise ValueError(
            f"--toll {toll:g}: only --mode shortest weighs tolls against length: add it, or leave"
            " out --toll"
        )
    return 1.0 if toll is None else toll


@contextlib.contextmanager
def print_notes(path: str, notes: Notes, *, quiet: bool) -> Iterator[None]:
    """Prints the notes on a file once it is read, and in any case where reading ends in an
    error.
    """
    try:
        yield
    except Exception:
        print_lines(path, notes)
        raise
    if not quiet:
        print_lines(path, notes)


def print_lines(path: str, notes: Notes) -> None:
    """Prints the notes on a file, one line each, on standard error."""
    for note in notes:
        console.note(f"{pathlib.PurePath(path).name}: {note}")


class ReadTasks(NamedTuple):
    """The tasks of many files.

    notes: records of what was noted while the files were read. failed: the files that could not be
      read.
    """

    tasks: "list[NamedTask]"
    notes: list[dict[str, Any]]
    failed: list[str]


def _reading(path: str, inputs: Sequence[str]) -> contextlib.AbstractContextManager[None]:
    """Shows which file is being read, once that takes long."""
    of = f" ({inputs.index(path) + 1} of {len(inputs)})" if len(inputs) > 1 else ""
    return console.waiting(f"reading {pathlib.PurePath(path).name}{of}", quiet=False)


_FAULTS_OF_A_FILE = (ValueError, ImportError, OSError, MemoryError, RecursionError, OverflowError)
"""What a reader raises because of one file; the other files can still be read."""


def read_all(
    inputs: Sequence[str], read: "Callable[[str, Notes], list[NamedTask]]", *, quiet: bool
) -> ReadTasks:
    """Reads every file. A file that cannot be read does not stop the others: its error is printed
    in one line, and its name is kept.

    Args:
      read: takes the name of a file and receives the notes on it. quiet: no notes are printed,
        except those on files that could not be read.

    Raises:
      ValueError, ImportError, OSError, MemoryError, RecursionError, OverflowError: no file could be
        read; this is the error of the last one.
    """
    tasks, records, failed = [], [], []
    for path in inputs:
        notes = Notes()
        try:
            with print_notes(path, notes, quiet=quiet), _reading(path, inputs):
                tasks += read(path, notes)
        except BrokenPipeError:  # the reader of the output went away: no fault of the file
            raise
        except _FAULTS_OF_A_FILE as error:
            failed.append(path)
            if len(failed) == len(inputs):
                raise
            error_line(_message(path, error))
        records += notes.records(path)
    return ReadTasks(tasks, records, failed)


def _message(path: str, error: Exception) -> str:
    """Returns what is wrong with a file; the messages of Python's own errors do not name it."""
    if isinstance(error, ValueError | ImportError):
        return str(error)
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    if isinstance(error, MemoryError):
        return f"{path}: out of memory ({reason}): give a smaller file"
    return f"{path}: cannot be read: {reason}"


def sides(text: str) -> int | tuple[int, int]:
    """Returns the cells a side typed after --size: a number, or a range as (least, greatest)."""
    try:
        low, _, high = text.partition("-")
        return (int(low), int(high)) if high else int(low)
    except ValueError:
        raise ValueError(
            f"--size must be a number such as 64, or a range such as 64-500, got {text!r}"
        ) from None
