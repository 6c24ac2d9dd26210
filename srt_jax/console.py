"""What the command line shows besides results: progress on long work, one-line errors."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

_PATIENCE = 2.0
"""Seconds after which work shows its progress."""


def printer() -> Console:
    """Returns the console for results; as wide as the terminal, and never narrower than a table needs when there is none."""
    console = Console()
    return console if console.is_terminal else Console(width=max(120, console.width))


def error_line(message: str) -> int:
    """Prints `message` as one line on standard error and returns the exit code for bad input."""
    print(f"srt-jax: error: {' '.join(message.split())}", file=sys.stderr)
    return 2


@contextlib.contextmanager
def counted(what: str, total: int, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Yields a function to call with the number of items finished; shows a bar with rate and time left once it takes long."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    bar = Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal)
    begin, shown, done = time.perf_counter(), bar.add_task(what, total=total, rate=""), 0

    def advance(count: int) -> None:
        nonlocal done
        done += count
        taken = time.perf_counter() - begin
        bar.update(shown, completed=done, rate=f"{done / taken:.1f}/s")
        if taken > _PATIENCE and not bar.live.is_started:
            bar.start()

    try:
        yield advance
    finally:
        if bar.live.is_started:
            bar.stop()
