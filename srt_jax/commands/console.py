"""What the command line shows besides results: progress on long work, tables that fit, one-line
errors.
"""

import contextlib
import datetime
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

_PATIENCE = 2.0
"""Seconds after which work shows its progress."""

_SHORTENED = 10
"""Signs to which a column that may be shortened is, at most."""


def printer() -> Console:
    """Returns the console for results; as wide as the terminal, and never narrower than a table
    needs when there is none.
    """
    console = Console()
    return console if console.is_terminal else Console(width=max(120, console.width))


def error_line(message: str) -> int:
    """Prints `message` as one line on standard error and returns the exit code for bad input."""
    print(f"srt-jax: error: {' '.join(message.split())}", file=sys.stderr)
    return 2


def note(message: str) -> None:
    """Prints a remark as one line on standard error."""
    print(f"srt-jax: note: {' '.join(message.split())}", file=sys.stderr)


@contextlib.contextmanager
def counted(what: str, total: int, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Yields a function to call with the number of items finished; a bar with rate and time left
    appears once it takes long.
    """
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
    with _shown_when_long(what, total, columns, quiet) as update:

        def advance(count: int) -> None:
            nonlocal done
            done += count
            rate = done / max(time.perf_counter() - begin, 1e-9)
            left = datetime.timedelta(seconds=round((total - done) / rate)) if done else "?"
            update(completed=done, rate=f"{rate:.3g}/s", left=f"left {left}")

        yield advance


@contextlib.contextmanager
def waiting(what: str, *, quiet: bool) -> Iterator[None]:
    """Shows that something is being done, and for how long, once it takes long; for work whose
    end cannot be foretold.
    """
    with _shown_when_long(
        what, None, (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()), quiet
    ):
        yield


@contextlib.contextmanager
def _shown_when_long(
    what: str, total: int | None, columns: Sequence, quiet: bool
) -> Iterator[Callable[..., None]]:
    """A timer, not the work, brings the bar up: the first step may be the long one (compiling)."""
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


def fitted(columns: Sequence[tuple[str, int]], rows: Sequence[Sequence[str]], width: int) -> Table:
    """Returns a table no wider than `width`: columns that find no room are left out, the
    dispensable first.

    Args:
      columns: (name, rank); rank 0 always stays, the highest goes first. From rank 2 on a column
        may be shortened to stay.
      rows: a text per column; long ones end in "...", none is broken.
    """
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
        table.add_row(*(row[i] for i in kept))
    return table
