"""MAP and, where it is installed, Fast Downward's lama-first on series of generated tasks, side by
side: what stalls, and how long the plans are.

    python -m experiments.campaigns.stalls [--seconds 30] [--only transport] [--first 3]

Prints a row per task and a summary per series: solved by each, ratio of lengths, seconds of each
(reading and grounding included, and for lama-first the start of its process). Every plan is
replayed. Exit code 1 if a plan is wrong, a solvable task is called unsolvable, or MAP finds no plan
where lama-first does.
"""

import argparse
import importlib.util
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

from experiments.campaigns.inputs.vehicle_tasks import Pddl, vehicle_tasks
from experiments.campaigns.inputs.workshop_tasks import workshop_tasks
from sign_model import OutOfTime, PlanningTask, PlanStatus, load, plan, validate


@dataclass(frozen=True)
class Row:
    """What both planners made of one task; None where there is no plan."""

    name: str
    length: int | None
    seconds: float
    peer_length: int | None
    peer_seconds: float
    wrong: tuple[str, ...]


def tried(name: str, texts: Pddl, seconds: float, driver: pathlib.Path | None) -> Row:
    """Returns what both planners make of one task, each within its seconds."""
    began = time.perf_counter()
    task, length, wrong = None, None, ()
    try:
        task = load(*texts, max_seconds=seconds)
        result = plan(task, max_seconds=max(0.0, seconds - (time.perf_counter() - began)))
        if result.is_solved:
            length = len(result.actions)
            wrong = tuple(validate(task, result.actions))
        elif result.status == PlanStatus.UNSOLVABLE:
            wrong = ("called unsolvable, but every generated task has a plan",)
    except OutOfTime:
        pass
    spent = time.perf_counter() - began
    task = task or load(*texts)
    peer_length, peer_seconds = (
        (None, 0.0) if driver is None else peer(task, texts, seconds, driver)
    )
    if length is None and peer_length is not None:
        wrong += ("no plan, but lama-first has one",)
    return Row(name, length, spent, peer_length, peer_seconds, wrong)


def peer(
    task: PlanningTask, texts: Pddl, seconds: float, driver: pathlib.Path
) -> tuple[int | None, float]:
    """Returns (the length of lama-first's plan, replayed, or None; its seconds)."""
    with tempfile.TemporaryDirectory() as folder:
        place, began = pathlib.Path(folder), time.perf_counter()
        for file, text in zip(("domain.pddl", "problem.pddl"), texts):
            (place / file).write_text(text, encoding="utf-8")
        command = [sys.executable, str(driver), "--alias", "lama-first", "--plan-file", "plan"]
        # A group of its own: the driver starts the search as another process.
        process = subprocess.Popen(
            [*command, "domain.pddl", "problem.pddl"],
            cwd=place,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return None, time.perf_counter() - began
        spent = time.perf_counter() - began
        if not (place / "plan").is_file():
            return None, spent
        lines = (place / "plan").read_text(encoding="utf-8").splitlines()
        actions = [line for line in lines if line.startswith("(")]
        return (None if validate(task, actions) else len(actions)), spent


def fast_downward() -> pathlib.Path | None:
    """Returns the driver of Fast Downward, or None where it is not installed."""
    found = importlib.util.find_spec("up_fast_downward")
    if found is None or not found.origin:
        return None
    driver = pathlib.Path(found.origin).parent / "downward" / "fast-downward.py"
    return driver if driver.is_file() else None


def summary(series: str, rows: list[Row]) -> str:
    """Returns one line on the tasks of a series."""
    both = [(row.length, row.peer_length) for row in rows if row.length and row.peer_length]
    ratio = f"{statistics.mean(one / other for one, other in both):.3f}" if both else "-"
    ours, theirs = (
        [row.seconds for row in rows],
        [row.peer_seconds for row in rows if row.peer_seconds],
    )
    times = f"median {statistics.median(ours):.2f} s"
    times += f" and {statistics.median(theirs):.2f} s" if theirs else ""
    return (
        f"{series}: MAP {sum(row.length is not None for row in rows)}, lama-first"
        f" {sum(row.peer_length is not None for row in rows)} of {len(rows)}; length / lama-first"
        f" {ratio}; {times}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=30.0, help="for each planner and task")
    parser.add_argument("--only", default="", help="the series whose name begins so")
    parser.add_argument("--first", type=int, default=1000, help="the first tasks of each series")
    given = parser.parse_args()
    driver = fast_downward()
    if driver is None:
        print("lama-first is left out: pip install 'srt-jax[bench]'")

    series: dict[str, list[Row]] = {}
    for name, texts in (*vehicle_tasks(), *workshop_tasks()):
        kind, number = name.rsplit("-", 1)
        if not kind.startswith(given.only) or int(number) > given.first:
            continue
        row = tried(name, texts, given.seconds, driver)
        series.setdefault(kind, []).append(row)
        print(
            f"{name}: {row.length} steps in {row.seconds:.2f} s; lama-first {row.peer_length} in"
            f" {row.peer_seconds:.2f} s",
            *row.wrong,
            sep="\n  ",
            flush=True,
        )
    for kind, rows in series.items():
        print(summary(kind, rows))
    return int(any(row.wrong for rows in series.values() for row in rows))


if __name__ == "__main__":
    sys.exit(main())
