"""The constants behind docs/scale.md: what a labelled task costs, and so 10^6, 10^9 and 10^12.

    python -m experiments.scale [--size 64] [--shard-size 4096] [--shards 4] [--workers 2]
    [--kind mixed] [--replay 100]
    python -m experiments.scale --replay-only DIR [--replay 100]

Writes that many shards in worker processes, after a first one for each worker that loads or
compiles what all need. Processor seconds are what counts: they are the same on a machine that
others share, whereas the time by the clock is told with the load beside it. Every so many tasks of
what was written are solved again and replayed by `check`; with --replay-only those of a data set
that is there.
"""

import argparse
import os
import pathlib
import tempfile
import time

import numpy as np

from srt_jax import check, scale, solve_many
from srt_jax.dataset import read_plan
from srt_jax.dataset.specification import DatasetJob, Plan
from srt_jax.instances.generate import generate

_POWERS = (6, 9, 12)


def planned(given: argparse.Namespace) -> Plan:
    """Returns the data set that is written."""
    count = (given.shards + given.workers) * given.shard_size
    return Plan(given.kind, count, (given.size, given.size), 0, given.shard_size, "npz")


def measure(folder: pathlib.Path, given: argparse.Namespace) -> dict[str, float]:
    """Writes the shards and returns the constants: per task in milliseconds and bytes, per worker
    in megabytes and seconds.
    """
    plan = planned(given)
    begin = time.perf_counter()
    made = scale.run(DatasetJob(folder, plan), workers=given.workers).outcomes
    wall = time.perf_counter() - begin
    made.sort(key=lambda outcome: outcome.cpu)
    warm, first = made[: given.shards], made[given.shards :]
    a_task = sum(outcome.cpu for outcome in warm) / (given.shards * given.shard_size)
    size = sum(path.stat().st_size for path in folder.glob("shard-*"))
    return {
        "CPU ms a task": 1e3 * a_task,
        "bytes a task": size / plan.count,
        "peak MB a worker": max(outcome.peak for outcome in made) / 1e6,
        "CPU s more in a worker's first shard": float(
            np.mean([outcome.cpu for outcome in first]) - a_task * given.shard_size
        ),
        "seconds by the clock": wall,
        "load": os.getloadavg()[0],
    }


def replayed(folder: pathlib.Path, plan: Plan, every: int) -> int:
    """Makes and solves every so many tasks of the shards again, compares them with what was
    written, and replays them; returns how many.
    """
    count = 0
    for shard in range(plan.num_shards()):
        with np.load(plan.file(folder, shard)) as arrays:
            index = arrays["index"]
            chosen = np.flatnonzero(index % every == 0)
            told = {name: arrays[name][chosen] for name in ("status", "length", "least_cost")}
        tasks = [
            generate(plan.kind, count=1, size=plan.size, seed=plan.seed, first=int(number))[0][1]
            for number in index[chosen]
        ]
        for place, solution in enumerate(solve_many(tasks, max_destroyed=32)):
            assert not check(tasks[place], solution), index[chosen[place]]
            assert solution.status == told["status"][place]
            assert solution.cost == told["length"][place]
            assert solution.removal_cost == told["least_cost"][place]
            count += 1
    return count


def arithmetic(constants: dict[str, float], shard_size: int) -> list[str]:
    """Returns a table of what 10^6, 10^9 and 10^12 tasks take."""
    lines = ["| tasks | core-hours | on 64 cores | bytes | shards |", "|---|---|---|---|---|"]
    for power in _POWERS:
        hours = 10**power * constants["CPU ms a task"] / 3.6e6
        size = 10**power * constants["bytes a task"]
        lines.append(
            f"| 10^{power} | {hours:,.3g} | {hours / 64:,.3g} h | {size / 1e9:,.3g} GB |"
            f" {-(-(10**power) // shard_size):,} |"
        )
    return lines


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Measures, prints the tables, and returns the constants."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kind", default="mixed")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--shard-size", type=int, default=4096)
    parser.add_argument("--shards", type=int, default=4)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--replay", type=int, default=100, help="every so many tasks")
    parser.add_argument("--replay-only", type=pathlib.Path, metavar="DIR", help="a data set")
    given = parser.parse_args(arguments)
    if given.replay_only:
        count = replayed(given.replay_only, read_plan(given.replay_only), given.replay)
        print(f"{given.replay_only}: {count} tasks solved again and replayed")
        return {"replayed": count}
    with tempfile.TemporaryDirectory() as place:
        constants = measure(pathlib.Path(place), given)
        count = replayed(pathlib.Path(place), planned(given), given.replay)
        print(f"{given.kind}, {given.size} x {given.size}, shards of {given.shard_size} tasks")
        for name, value in constants.items():
            print(f"{name:40s}{value:12.4g}")
        print(f"{'tasks solved again and replayed':40s}{count:12d}")
    print("\n".join(["", *arithmetic(constants, given.shard_size)]))
    return constants


if __name__ == "__main__":
    main()
