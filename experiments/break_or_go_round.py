"""How often it pays to break through a building on the streets of cities, by the price of one.

    python -m experiments.break_or_go_round [--routes 210] [--tolls 50 20 10 5 2] [--seed 0]

Tasks between random free cells of the largest part of MovingAI's street maps of 256 x 256, farther
apart than 0.8 of the side: the first 12 maps by name of those in the folder street/ of the
directory that SRT_SHARED_DATA names, or all where there are fewer, which it says. Every building is
an 8-connected obstacle of removal cost 1. A row per toll: the share of routes that are cheaper with
something destroyed, what is saved on average, how many buildings a route destroys, how many totals
are proven, and the time of a task beside that of a complete answer of mode "least" in the same run.
"""

import argparse
import os
import pathlib
import time
from typing import Any, NamedTuple

import jax
import numpy as np

from srt_jax import Solution, Task, check, make_task, solve, stack
from srt_jax.components import largest_region
from srt_jax.formats.movingai import read_map

SIDE, MOST_MAPS, APART = 256, 12, 0.8


class Row(NamedTuple):
    """One toll. share: of routes that destroy something. saving: mean, of the way round's length.
    broken: per route. proven: share. milliseconds: a task; ratio: to mode "least".
    """

    toll: float
    share: float
    saving: float
    broken: float
    proven: float
    milliseconds: float
    ratio: float


def street_maps() -> list[pathlib.Path]:
    """Returns the files, in the order of their names; none where the data is absent."""
    folder = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data")) / "street"
    return sorted(folder.glob(f"*_{SIDE}.map"))[:MOST_MAPS]


def tasks_on(free: np.ndarray, number: int, rng: np.random.Generator) -> list[Task]:
    """Returns tasks between far cells of the largest free part of a map."""
    cells = np.argwhere(largest_region(free))
    tasks: list[Task] = []
    while len(tasks) < number:
        start, goal = cells[rng.integers(len(cells), size=2)]
        if abs(start - goal).max() > APART * max(free.shape):
            tasks.append(make_task(free, start, goal))
    return tasks


def measure(tasks: list[Task], tolls: list[float]) -> list[Row]:
    """Returns a row per toll; every answer is replayed."""
    batch = stack(tasks)
    least, _ = _timed(batch)
    way_round = np.asarray(least.cost)
    rows = []
    for toll in tolls:
        answers, seconds = _timed(batch, mode="shortest", toll=toll)
        _, base = _timed(batch)  # beside it, when the machine is as it was
        problems = check(batch, answers, mode="shortest", toll=toll)
        if problems:
            raise AssertionError(f"toll {toll}: {problems[0]}")
        total, broken = np.asarray(answers.total), np.asarray(answers.num_destroyed)
        rows.append(
            Row(
                toll=toll,
                share=float((broken > 0).mean()),
                saving=float((1 - total / way_round).mean()),
                broken=float(broken.mean()),
                proven=float((total == np.asarray(answers.total_bound)).mean()),
                milliseconds=1e3 * seconds / len(tasks),
                ratio=seconds / base,
            )
        )
    return rows


def _timed(batch: Task, **options: Any) -> tuple[Solution, float]:
    """The answers, and the least CPU time of nine compiled runs."""
    answers = jax.block_until_ready(solve(batch, max_destroyed=16, **options))
    taken = []
    for _ in range(9):
        begin = time.process_time()
        jax.block_until_ready(solve(batch, max_destroyed=16, **options))
        taken.append(time.process_time() - begin)
    return answers, min(taken)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--routes", type=int, default=210, help="in all")
    parser.add_argument("--tolls", type=float, nargs="+", default=[50, 20, 10, 5, 2])
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    paths = street_maps()
    if not paths:
        print(
            f"no street map of {SIDE} x {SIDE} is here: name the folder that holds street/ in"
            " SRT_SHARED_DATA"
        )
        return 0
    rng = np.random.default_rng(options.seed)
    each = -(-options.routes // len(paths))
    tasks = [task for path in paths for task in tasks_on(np.asarray(read_map(path)), each, rng)]
    fewer = "" if len(paths) == MOST_MAPS else f" (there are no more; {MOST_MAPS} are meant)"
    names = ", ".join(path.stem for path in paths)
    print(f"{len(tasks)} routes on {len(paths)} maps{fewer}: {names}")
    print(
        "| toll | cheaper by breaking | mean saving | broken per route | proven | CPU ms a task |"
        " beside mode least |\n|---|---|---|---|---|---|---|"
    )
    for row in measure(tasks, options.tolls):
        print(
            f"| {row.toll:g} | {row.share:.1%} | {row.saving:.2%} | {row.broken:.2f} |"
            f" {row.proven:.0%} | {row.milliseconds:.2f} | {row.ratio:.1f} |",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
