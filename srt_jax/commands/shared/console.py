"""What the command line shows besides results: progress on long work, tables that fit, one-line
errors.
"""

import contextlib
import datetime
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from sign_model.foundation.legible import legible

# rich takes longer to load than a small command takes to run: it is loaded where it is used
if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

BAD_INPUT, BUDGET_SPENT, CRASHED, PIPE_CLOSED = 2, 3, 70, 141
"""Exit codes besides 0 (all solved), 1 (some task cannot be solved) and those of signals; 70 is
EX_SOFTWARE of sysexits.
"""

_PATIENCE = 2.0
"""Seconds after which work shows its progress."""

_SHORTENED = 10
"""Signs to which a column that may be shortened is, at most."""


_QUIET = {"is_quiet": False}


def be_quiet(is_quiet: bool) -> None:
    """Sets whether standard error holds errors alone, without progress, notes and asides."""
    _QUIET["is_quiet"] = is_quiet


def took(seconds: float, *, compiles: bool = True) -> str:
    """Returns how long it took, to be put into a line of results; nothing where it is to be
    quiet.
    """
    if _QUIET["is_quiet"]:
        return ""
    return f" in {seconds:.2f} s" + (", compiling included" if compiles else "")


def printer() -> "Console":
    """Returns the console for results; as wide as the terminal, and never narrower than a table
    needs when there is none.
    """
    from rich.console import Console

    console = Console()
    return console if console.is_terminal else Console(width=max(120, console.width))


def say(*lines: str) -> None:
    """Prints lines of text on standard output, each as it is but for what `legible` replaces;
    flushed at once.
    """
    for line in lines:
        print(legible(line, sys.stdout.encoding), flush=True)


def say_wrapped(console: "Console", line: str) -> None:
    """Prints a sentence within the width of the console; square brackets and colons in it are no
    markup.
    """
    from rich.text import Text

    console.print(Text(legible(line, console.encoding)))


def say_json(document: Any) -> None:
    """Prints one JSON document on standard output, in ASCII."""
    print(json.dumps(document))


def flush_output() -> None:
    """Writes out what was printed, so that a full or closed output is noticed while there is
    still a way to tell.
    """
    sys.stdout.flush()


def silence_output() -> None:
    """Lets the interpreter's own last flush go nowhere: a broken output is already reported."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, sys.stdout.fileno())
            os.close(null)


def error_line(message: str, code: int = BAD_INPUT) -> int:
    """Prints `message` as one line on standard error and returns the exit code, by default that
    for bad input.
    """
    _to_stderr(f"error: {message}")
    return code


def note(message: str) -> None:
    """Prints a remark as one line on standard error, unless it is to be quiet."""
    if not _QUIET["is_quiet"]:
        _to_stderr(f"note: {message}")


def aside(message: str) -> None:
    """Prints a line on standard error beside the result, such as how long it took, unless it is to
    be quiet.
    """
    if not _QUIET["is_quiet"]:
        _to_stderr(message, prefix="")


def _to_stderr(message: str, prefix: str = "srt-jax: ") -> None:
    """Prints one line on standard error; where that is closed or full it does nothing, for the
    program must not end because of a message.
    """
    with contextlib.suppress(OSError, ValueError, AttributeError):
        encoding = getattr(sys.stderr, "encoding", None)
        print(
            f"{prefix}{legible(' '.join(message.split()), encoding)}", file=sys.stderr, flush=True
        )


@contextlib.contextmanager
def show_progress(
    what: str, total: int, *, quiet: bool, compiles: bool = False
) -> Iterator[Callable[[int], None]]:
    """Yields a function to call with the number of items finished; a bar with rate and time left
    appears once it takes long.

    Args:
      compiles: until the first items are finished the bar says so, for that is what takes long.
    """
    if not _may_be_shown(quiet):
        yield lambda _: None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    begin, done = time.perf_counter(), 0
    first = f"{what} (compiling first)" if compiles else what
    with _shown_when_long(first, total, columns, quiet) as update:

        def advance(count: int) -> None:
            nonlocal done
            done += count
            rate = done / max(time.perf_counter() - begin, 1e-9)
            left = datetime.timedelta(seconds=round((total - done) / rate)) if done else "?"
            update(description=what, completed=done, rate=f"{rate:.3g}/s", left=f"left {left}")

        yield advance


@contextlib.contextmanager
def waiting(what: str, *, quiet: bool) -> Iterator[None]:
    """Shows that something is being done, and for how long, once it takes long; for work whose end
    cannot be predicted.
    """
    if not _may_be_shown(quiet):
        yield
        return
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    with _shown_when_long(
        what, None, (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()), quiet
    ):
        yield


def _may_be_shown(quiet: bool) -> bool:
    """Whether a bar can appear: standard error is a terminal, or whoever reads it says that it
    shows colours.
    """
    stream = sys.stderr
    if quiet or _QUIET["is_quiet"] or stream is None or stream.closed:
        return False
    return stream.isatty() or bool(os.environ.get("FORCE_COLOR"))


@contextlib.contextmanager
def _shown_when_long(
    what: str, total: int | None, columns: Sequence, quiet: bool
) -> Iterator[Callable[..., None]]:
    """A timer, not the work, brings the bar up: the first step may be the long one (compiling)."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    bar = Progress(
        *columns, console=console, transient=True, disable=quiet or not console.is_terminal
    )
    shown = bar.add_task(what, total=total, rate="", left="")
    timer = threading.Timer(_PATIENCE, bar.start)
    timer.daemon = True
    if not bar.disable:
        timer.start()
    try:
        yield lambda **changes: bar.update(shown, **changes)
    finally:
        timer.cancel()
        if timer.is_alive():
            timer.join()
        if bar.live.is_started:
            bar.stop()


def fit_table(
    columns: Sequence[tuple[str, int]], rows: Sequence[Sequence[str]], width: int
) -> "Table":
    """Returns a table no wider than `width`: columns that find no room are left out, the
    dispensable first.

    Args:
      columns: (name, rank); rank 0 always stays, the highest goes first. From rank 2 on a column
        may be shortened to stay.
      rows: a text per column; long ones end in "...", none is broken, brackets in them are no
        markup.
    """
    from rich.table import Table
    from rich.text import Text

    encoding = getattr(sys.stdout, "encoding", None)
    rows = [[legible(text, encoding) for text in row] for row in rows]
    wide = [max([len(name), *(len(row[i]) for row in rows)]) for i, (name, _) in enumerate(columns)]
    least = [min(w, _SHORTENED if rank >= 2 else 24) for w, (_, rank) in zip(wide, columns)]
    kept = list(range(len(columns)))
    while sum(least[i] + 2 for i in kept) - 2 > width and any(columns[i][1] for i in kept):
        kept.remove(max(kept, key=lambda i: columns[i][1]))
    spare = width + 2 - sum(least[i] + 2 for i in kept)
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for i in kept:
        given = min(wide[i], least[i] + spare)  # what is to spare goes to the first that can use it
        spare -= given - least[i]
        table.add_column(columns[i][0], no_wrap=True, overflow="ellipsis", max_width=max(given, 1))
    for row in rows:
        table.add_row(*(Text(row[i]) for i in kept))
    return table
