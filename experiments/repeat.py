"""Runs experiments twice with the same seed and holds together what they found: plan lengths,
counts, answers; not times.

Each run is a process of its own with another hash seed, so that no order of a set or dictionary can
decide anything unseen. --quick runs are compared unless --full is given.

examples:
  python -m experiments.repeat
  python -m experiments.repeat figure2 --full --seed 3
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from typing import Any

from experiments.figures.outcome import run

NAMES = ("figure3", "figure2", "figure1")

TIMES = frozenset(("seconds", "parts", "kernels", "reference", "C++"))
"""Members of an experiment's data that hold times; as checks, which are no numbers, "kernels" and
"C++" are compared.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is requested twice; exit code 1 where two runs differ."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.repeat",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"{', '.join(NAMES)} (default: all)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of both runs (default: 0)")
    parser.add_argument("--full", action="store_true", help="the full runs instead of --quick")
    given = parser.parse_args(arguments)
    if unknown := sorted(set(given.names) - set(NAMES)):
        raise ValueError(f"no experiment is called {unknown[0]!r}: choose from {', '.join(NAMES)}")
    # Each experiment twice with one seed, and with another order of Python's sets.
    num_different = 0
    for name in given.names or NAMES:
        first, second = (_data(name, given, hash_seed) for hash_seed in (0, 1))
        found = list(differences(first, second))
        num_different += bool(found)
        print(
            f"{name}: "
            + (
                "the same, times apart"
                if not found
                else f"{len(found)} differences, first {found[0]}"
            ),
            flush=True,
        )
    return int(num_different > 0)


def differences(one: Any, other: Any, place: str = "data") -> Iterator[str]:
    """Yields where two records differ, times left out."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in sorted(one.keys() | other.keys()):
            if name not in TIMES or isinstance(one.get(name), bool):
                yield from differences(one.get(name), other.get(name), f"{place}.{name}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, pair in enumerate(zip(one, other)):
            yield from differences(*pair, f"{place}[{number}]")
    elif one != other:
        yield f"{place}: {one!r} and {other!r}"


def _data(name: str, given: argparse.Namespace, hash_seed: int) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        quick = [] if given.full else ["--quick"]
        command = [
            sys.executable,
            "-m",
            f"experiments.{name}",
            *quick,
            "--seed",
            str(given.seed),
            "--out",
            folder,
        ]
        settings = os.environ | {"PYTHONHASHSEED": str(hash_seed)}
        done = subprocess.run(command, env=settings, stdout=subprocess.DEVNULL)
        if done.returncode:
            raise ValueError(f"{name} ended with code {done.returncode}: see above")
        return json.loads((pathlib.Path(folder) / f"{name}.json").read_text(encoding="utf-8"))[
            "data"
        ]


if __name__ == "__main__":
    run(main)
