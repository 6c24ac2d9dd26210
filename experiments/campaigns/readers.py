"""Every reader on damaged files: each file is read, or refused in one sentence; nothing crashes,
hangs or fills the memory.

    python -m experiments.campaigns.readers [--count 100000] [--seed 0] [--formats map,npz,...]
    [--seconds 20] [--gigabytes 2]

Small right files of every format are damaged: bytes turned, pieces cut, doubled and moved, odd
numbers and brackets put in; arrays of an .npz file also one by one, so that the archive stays
whole. Each is read in a child process that may take so much more memory, and so many seconds a
file. Other endings than a result or a ValueError of one line are printed on standard error, with
what makes the file again. The last line: `N mutations, C crashes, H hangs`; exit code 1 unless both
are 0.
"""

import argparse
import contextlib
import enum
import json
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator

from experiments.campaigns.inputs.damage import mutate
from experiments.campaigns.inputs.seed_files import DOMAIN, MAP, PGM, PROBLEM, SEEDS

AT_ONCE = 500
"""Mutations that one child process reads."""


class Outcome(enum.Enum):
    """How the reading of a file ended."""

    READ = "read"
    REFUSED = "refused"
    CRASHED = "crashed"
    HUNG = "hung"


def read_one(path: pathlib.Path) -> tuple[Outcome, str]:
    """Reads a file by the reader that its name in `SEEDS` stands for; returns how that ended,
    and its message.
    """
    for name, content in (("seed.map", MAP), ("seed.pgm", PGM)):
        if not (path.parent / name).exists():
            (path.parent / name).write_bytes(content)
    try:
        _reader(path)
    except (ValueError, ImportError) as error:
        message = str(error)
        return (
            (Outcome.REFUSED, message)
            if "\n" not in message and message
            else (Outcome.CRASHED, f"not one line: {message!r}")
        )
    except _TooLong:
        return Outcome.HUNG, ""
    except Exception as error:
        return Outcome.CRASHED, f"{type(error).__name__}: {error}"
    return Outcome.READ, ""


def _reader(path: pathlib.Path) -> None:
    import sign_model
    from sign_model.experience.memory import load_memory
    from sign_model.map_algorithm.heuristics import load_signs
    from sign_model.signs.model_file import load_model
    from sign_model.space.fuzzy_table import load_table
    from srt_jax.answers.results_file import read_results
    from srt_jax.formats.outlines.tag_rules import read_rules
    from srt_jax.formats.reading import Reading
    from srt_jax.formats.task_files import read_tasks

    ends = Reading(start=(0, 0), goal=(3, 5))
    readers: dict[str, Callable[[], object]] = {
        "rules.json": lambda: read_rules(path),
        "signs.json": lambda: load_signs(path),
        "model.json": lambda: load_model(path),
        "table.json": lambda: load_table(path),
        "memory.json": lambda: load_memory(path),
        "domain.pddl": lambda: sign_model.load(path, PROBLEM.decode()),
        "problem.pddl": lambda: sign_model.load(DOMAIN.decode(), path),
        "a.parquet": lambda: read_results(path),
        "a.map": lambda: read_tasks(str(path), reading=ends),
        "a.geojson": lambda: read_tasks(str(path), reading=Reading(size=20)),
        "a.osm": lambda: read_tasks(str(path), reading=Reading(size=20)),
        "a.osm.gz": lambda: read_tasks(str(path), reading=Reading(size=20)),
    }
    readers.get(path.name, lambda: read_tasks(str(path)))()


class _TooLong(BaseException):
    """The seconds of a file are over."""


@contextlib.contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def stop(number: int, frame: object) -> None:
        raise _TooLong

    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _child(
    names: list[str], seed: int, first: int, count: int, seconds: float, gigabytes: float
) -> None:
    """Reads the mutations from `first` on; prints the number of each before, and a line of JSON
    after it.
    """
    warm = pathlib.Path(tempfile.mkdtemp())
    seeds = {name: SEEDS[name]() for name in names}
    for name, content in seeds.items():  # imports and compiles before memory is limited
        (warm / name).write_bytes(content)
        read_one(warm / name)
    now = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    most = now + int(gigabytes * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as folder:
        for number in range(first, first + count):
            name = names[number % len(names)]
            path = pathlib.Path(folder) / name
            path.write_bytes(mutate(seeds[name], seed=(seed, number)))
            print(number, flush=True)
            outcome, message = Outcome.HUNG, ""
            with contextlib.suppress(_TooLong), _time_limit(seconds):
                outcome, message = read_one(path)
            print(json.dumps([outcome.name, message]), flush=True)


def _run_child(
    options: argparse.Namespace, names: list[str], first: int, count: int
) -> list[tuple[int, Outcome, str]]:
    """Returns what became of each mutation; where the child dies, of that one, and the rest goes
    to another child.
    """
    command = [sys.executable, "-m", "experiments.campaigns.readers", "--child", f"{first},{count}"]
    command += ["--seed", str(options.seed), "--formats", ",".join(names)]
    command += ["--seconds", str(options.seconds), "--gigabytes", str(options.gigabytes)]
    done = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace"
    )
    try:
        out, err = done.communicate(timeout=600 + count * options.seconds / 10)
        died = Outcome.CRASHED
    except subprocess.TimeoutExpired:
        done.kill()
        out, err = done.communicate()
        died = Outcome.HUNG
    found: list[tuple[int, Outcome, str]] = []
    number = None
    for line in out.splitlines():
        if line.startswith("["):
            name, message = json.loads(line)
            found.append((number if number is not None else first, Outcome[name], message))
            number = None
        elif line.isdigit():
            number = int(line)
    if len(found) < count:
        if number is None and not found:
            raise RuntimeError(f"a child process cannot start: {err[-2000:]}")
        place = first + len(found)
        found.append((place, died, f"the process ended with code {done.returncode}: {err[-300:]}"))
        if (rest := first + count - place - 1) > 0:
            found += _run_child(options, names, place + 1, rest)
    return found


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--formats", default=",".join(SEEDS), help="names, or parts of them, separated by commas"
    )
    parser.add_argument(
        "--seconds", type=float, default=20.0, help="that the reading of one file may take"
    )
    parser.add_argument(
        "--gigabytes", type=float, default=2.0, help="of memory beyond what the libraries take"
    )
    parser.add_argument("--child", help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> int:
    options = _options()
    names = [name for name in SEEDS if any(part in name for part in options.formats.split(","))]
    # A child process reads its share of the mutations and ends.
    if options.child:
        first, count = map(int, options.child.split(","))
        _child(names, options.seed, first, count, options.seconds, options.gigabytes)
        return 0
    # The parent shares them out, and prints what ended badly as it comes.
    totals: dict[str, Counter[Outcome]] = {name: Counter() for name in names}
    for first in range(0, options.count, AT_ONCE):
        for number, outcome, message in _run_child(
            options, names, first, min(AT_ONCE, options.count - first)
        ):
            name = names[number % len(names)]
            totals[name][outcome] += 1
            if outcome in (Outcome.CRASHED, Outcome.HUNG):
                print(
                    f"{name}, mutate(..., seed=({options.seed}, {number})): {outcome.value}"
                    f" {message}",
                    file=sys.stderr,
                )
        print(f"{min(first + AT_ONCE, options.count)} mutations", file=sys.stderr, flush=True)
    # The totals, by format and altogether.
    for name, counts in totals.items():
        print(f"{name:14s}", ", ".join(f"{counts[outcome]} {outcome.value}" for outcome in Outcome))
    crashes, hangs = (
        sum(counts[outcome] for counts in totals.values())
        for outcome in (Outcome.CRASHED, Outcome.HUNG)
    )
    print(f"{options.count} mutations, {crashes} crashes, {hangs} hangs")
    return int(crashes + hangs > 0)


if __name__ == "__main__":
    sys.exit(main())
