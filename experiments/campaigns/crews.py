"""What workers gain and what an engine costs, by the clock: whole commands in turn.

    python -m experiments.campaigns.crews [--crews 1 2 dask ray] [--job dataset|solve]
    [--shards 8 16] [--rounds 1] [--size 64] [--shard-size 4096] [--seed 0]

A crew is a number of plain workers, or an engine with two of its own. One shard is made first and
not timed: then all crews find the compiled programs on disk. Each run starts in a folder of its own
and is timed from the start of the command to its end, imports and the start of the engine included.
The last columns compare: how many times as fast as the first crew, and what remains of a crew's
time where it is taken apart into a constant and so much for each shard (with several --shards).
Only an idle machine gives numbers that mean something: the load is told.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

from experiments.campaigns.kills import command, digest, generate

_ENGINES = ("dask", "ray")


def timed(folder: pathlib.Path, given: argparse.Namespace, crew: str, shards: int) -> float:
    """Returns the seconds of one run."""
    own = vars(given) | {"engine": crew if crew in _ENGINES else "none"}
    own |= {"count": shards * given.shard_size}
    run = argparse.Namespace(**own)
    if given.job == "solve":
        subprocess.run(generate(folder, run), stdout=subprocess.DEVNULL, check=True)
    words = command(folder, run, 2 if crew in _ENGINES else int(crew))
    begin = time.monotonic()
    done = subprocess.run(words, stdout=subprocess.DEVNULL)
    assert done.returncode in (0, 1, 3)  # some tasks are unsolvable, or beyond the budget
    return time.monotonic() - begin


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--crews", nargs="+", default=["1", "2", *_ENGINES])
    parser.add_argument("--job", choices=["dataset", "solve"], default="dataset")
    parser.add_argument("--shards", type=int, nargs="+", default=[8, 16])
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--shard-size", type=int, default=4096)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Runs the crews in turn and prints a table; the exit code is 1 where their bytes differ."""
    given = parse(arguments)
    seconds: dict[tuple[str, int], list[float]] = {}
    digests: dict[int, set[str]] = {}
    with tempfile.TemporaryDirectory() as place:
        timed(pathlib.Path(place, "out"), given, given.crews[0], 1)
    for number in range(given.rounds):
        for shards in given.shards:
            for crew in given.crews:
                with tempfile.TemporaryDirectory() as place:
                    folder = pathlib.Path(place, "out")
                    one = timed(folder, given, crew, shards)
                    digests.setdefault(shards, set()).add(digest(folder))
                seconds.setdefault((crew, shards), []).append(one)
                load = os.getloadavg()[0]
                print(f"{number} {crew} {shards} shards: {one:.2f} s, load {load:.1f}", flush=True)
    print(f"\n| crew | {' | '.join(f'{n} shards, s' for n in given.shards)} | against", end=" ")
    print(f"{given.crews[0]} | constant, s | a shard, s |\n{'|---' * (len(given.shards) + 4)}|")
    medians = {key: statistics.median(values) for key, values in seconds.items()}
    for crew in given.crews:
        own = [medians[crew, shards] for shards in given.shards]
        ratios = [medians[given.crews[0], n] / medians[crew, n] for n in given.shards]
        slope, constant = np.polyfit(given.shards, own, 1) if len(own) > 1 else (np.nan, np.nan)
        row = [*(f"{value:.1f}" for value in own), ", ".join(f"{one:.3f}" for one in ratios)]
        print(f"| {crew} | {' | '.join(row)} | {constant:.1f} | {slope:.2f} |")
    return int(any(len(found) > 1 for found in digests.values()))


if __name__ == "__main__":
    sys.exit(main())
