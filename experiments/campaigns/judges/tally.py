"""What a campaign keeps while it runs: checks made and failed, and a bar."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import nullcontext
from typing import Any


class Tally:
    """How often each check was made and failed, and its largest relative error; what fails is
    printed as it comes.
    """

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], list[Any]] = {}
        self.part = ""

    def judge(self, check: str, is_right: bool, title: str, error: float | None = None) -> None:
        row = self.rows.setdefault((self.part, check), [0, 0, None])
        row[0] += 1
        row[1] += not is_right
        if error is not None:
            row[2] = max(row[2] or 0.0, float(error))
        if not is_right:
            print(f"{self.part}, {check}: {title}", file=sys.stderr, flush=True)

    def near(self, check: str, error: float, limit: float, title: str) -> None:
        self.judge(
            check,
            error <= limit,
            f"{title}: relative error {error:.2e}, at most {limit:.2e}",
            error,
        )

    @property
    def num_wrong(self) -> int:
        return sum(wrong for _, wrong, _ in self.rows.values())

    def __str__(self) -> str:
        lines = [f"{'part':8s} {'check':52s} {'count':>7s} {'wrong':>6s}  largest error"]
        for (part, check), (count, wrong, error) in self.rows.items():
            lines.append(
                f"{part:8s} {check:52s} {count:7d} {wrong:6d} "
                f" {'' if error is None else f'{error:.2e}'}".rstrip()
            )
        return "\n".join(lines)


def progress(what: str, items: Iterable, total: int) -> Iterator:
    """Yields the items; with a bar where rich is installed and standard error is a terminal."""
    try:
        from srt_jax.commands.shared.console import show_progress
    except ImportError:
        context: Any = nullcontext(lambda count: None)
    else:
        context = show_progress(what, total, quiet=False)
    with context as advance:
        for item in items:
            yield item
            advance(1)
