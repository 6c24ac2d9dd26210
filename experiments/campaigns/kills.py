"""Workers killed at random moments: are the bytes those of a run that nobody disturbed?

    python -m experiments.campaigns.kills [--kills 100] [--workers 1 2 4] [--engine none|dask|ray]
    [--how kill|term|int|hosts] [--job dataset|solve] [--count 1536] [--size 64] [--shard-size 64]
    [--seed 0]

A data set, or a folder of answers, is written again and again while a random worker is killed at
random moments (`kill`); or the whole run is ended as by the system or by Ctrl-C, and called again
(`term`, `int`); or two runs under different host names, each with processes of its own, share the
folder, and one of these "hosts" is killed as a whole (`hosts`, which needs the right to `unshare`,
so on Linux as root).

For each round: the digest of all files against that of an undisturbed run, shards that were made a
second time after they were there, drafts and claims that were left, and the seconds it took, which
are bounded. The exit code is 1 where anything is wrong.
"""

import argparse
import dataclasses
import hashlib
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence

_LONGEST = 400.0
"""Seconds after which a round counts as hanging."""
_MARKS = {
    "none": "srt_jax.scale.crews.worker",
    "dask": "multiprocessing.spawn",
    "ray": "ray::",
}
"""How a worker of each engine shows in the list of processes."""
_ENDS = (b"workers ended with code", b"workers died at", b"workers of Dask die", b"of Ray die")
"""What a run says that gives up because its workers die again and again."""
_HOSTS = ("node-a", "node-b")


@dataclasses.dataclass
class Tally:
    """What a round, or all of them, came to. at_work: kills while a shard was being made. calls: of
    the command. left: drafts, claims and processes that were left.
    """

    rounds: int = 0
    kills: int = 0
    at_work: int = 0
    calls: int = 0
    wrong_bytes: int = 0
    made_again: int = 0
    left: int = 0
    wrong_codes: int = 0
    hung: int = 0
    longest: float = 0.0

    def add(self, other: "Tally") -> None:
        """Adds a round."""
        for field in dataclasses.fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            is_time = field.name == "longest"
            setattr(self, field.name, max(mine, theirs) if is_time else mine + theirs)

    @property
    def is_clean(self) -> bool:
        """Whether nothing was wrong."""
        return not (
            self.wrong_bytes or self.made_again or self.left or self.wrong_codes or self.hung
        )


def digest(folder: pathlib.Path) -> str:
    """Returns a digest of the names and contents of a folder's files."""
    whole = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.is_file() and not path.name.startswith("."):
            whole.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return whole.hexdigest()[:16]


def command(folder: pathlib.Path, given: argparse.Namespace, workers: int | None) -> list[str]:
    """Returns the command that writes the folder; the answers are those to `tasks_beside` it."""
    words = f"solve {tasks_beside(folder)}"
    if given.job == "dataset":
        words = f"dataset mixed --count {given.count} --size {given.size} --seed {given.seed}"
    words += f" --shard-size {given.shard_size} --out {folder} --json"
    words += f" --workers {workers}" if workers else ""
    words += f" --engine {given.engine}" if workers and given.engine != "none" else ""
    return [sys.executable, "-m", "srt_jax", *words.split()]


def tasks_beside(folder: pathlib.Path) -> pathlib.Path:
    """Returns the file of the tasks that are solved."""
    return folder.with_name("tasks.npz")


def generate(folder: pathlib.Path, given: argparse.Namespace) -> list[str]:
    """Returns the command that writes the tasks to be solved."""
    words = f"generate mixed --count {given.count} --size {given.size} --seed {given.seed}"
    return [sys.executable, "-m", "srt_jax", *words.split(), "--out", str(tasks_beside(folder))]


def start(words: Sequence[str], log: pathlib.Path, **more: str) -> subprocess.Popen:
    """Starts a command; what it says goes to `log`."""
    with open(log, "ab") as out:
        return subprocess.Popen(words, stdout=out, stderr=out, env=os.environ | more)


def below(pid: int) -> list[int]:
    """Returns the processes that a process has started, and theirs."""
    parents: dict[int, list[int]] = {}
    for name in os.listdir("/proc"):
        if name.isdecimal():
            try:
                text = pathlib.Path(f"/proc/{name}/stat").read_text()
            except OSError:
                continue
            state, parent = text.rpartition(")")[2].split()[:2]
            if state not in "ZX":
                parents.setdefault(int(parent), []).append(int(name))
    found, new = [], [pid]
    while new:
        new = [child for one in new for child in parents.get(one, [])]
        found += new
    return found


def workers_of(pid: int, engine: str) -> list[int]:
    """Returns the workers of a run."""
    found = []
    for one in below(pid):
        try:
            words = pathlib.Path(f"/proc/{one}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        # Ray's workers have a title, its agents too; Python starts a tracker beside each worker
        if words.startswith("ray::") != (engine == "ray") or "Agent" in words:
            continue
        if _MARKS[engine] in words and "resource_tracker" not in words:
            found.append(one)
    return found


class Watch:
    """Which files are there, each by its number on the disk: a file made again has another."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder, self.seen = folder, dict[str, int]()
        self.made_again = 0

    def look(self) -> None:
        """Notes new files, and counts those that were made again."""
        if not self.folder.is_dir():
            return
        for entry in os.scandir(self.folder):
            if entry.name.startswith(("shard-", "answers-")):
                number = entry.inode()
                self.made_again += self.seen.setdefault(entry.name, number) != number
                self.seen[entry.name] = number

    def left(self) -> int:
        """Returns how many drafts and claims there are."""
        return sum(path.is_file() for path in self.folder.rglob(".*")) + sum(
            path.is_file() for path in self.folder.glob(".claims/*")
        )


def round_of_kills(
    folder: pathlib.Path, given: argparse.Namespace, workers: int, most: int, rng: random.Random
) -> Tally:
    """Kills workers of one run until it has written all."""
    tally, watch, log = Tally(rounds=1, calls=1), Watch(folder), folder.with_suffix(".log")
    running, begin = start(command(folder, given, workers), log), time.monotonic()
    due, at_work_only = begin + rng.uniform(2, 8), True
    while True:
        watch.look()
        now = time.monotonic()
        if now - begin > _LONGEST:
            tally.hung += 1
            for pid in (*below(running.pid), running.pid):
                os.kill(pid, signal.SIGKILL)
            break
        if running.poll() is not None:
            # several deaths at one unit, or while an engine starts, end a run, as they should: it
            # is called again
            said = log.read_bytes()[-600:]
            if running.returncode == 70 and any(text in said for text in _ENDS):
                tally.calls += 1
                running = start(command(folder, given, workers), log)
                continue
            tally.wrong_codes += running.returncode != given.code
            break
        there = workers_of(running.pid, given.engine) if now > due else []
        is_at_work = any(folder.glob(".claims/*.claim"))
        if there and tally.kills < most and (is_at_work or not at_work_only):
            tally.at_work += is_at_work
            try:
                os.kill(rng.choice(there), signal.SIGKILL)
                tally.kills += 1
            except ProcessLookupError:
                pass
            # some while they start, however long an engine takes for that
            due, at_work_only = now + rng.uniform(0.5, 8), rng.random() < 0.7
        time.sleep(0.02)
    watch.look()
    tally.made_again, tally.left, tally.longest = watch.made_again, watch.left(), now - begin
    return tally


def round_of_signals(
    folder: pathlib.Path, given: argparse.Namespace, workers: int, most: int, rng: random.Random
) -> Tally:
    """Ends runs by a signal, and calls them again, until all is written."""
    number = signal.SIGTERM if given.how == "term" else signal.SIGINT
    tally, watch, log = Tally(rounds=1), Watch(folder), folder.with_suffix(".log")
    begin = time.monotonic()
    while True:
        running = start(command(folder, given, workers or None), log)
        tally.calls += 1
        # the signal comes while shards are made, however long the start takes
        while running.poll() is None and not any(folder.glob(".claims/*.claim")):
            time.sleep(0.02)
        wait = rng.uniform(0, 3) if tally.kills < most else _LONGEST
        try:
            running.wait(wait)
        except subprocess.TimeoutExpired:
            children = below(running.pid)
            tally.at_work += any(folder.glob(".claims/*.claim"))
            running.send_signal(number)
            tally.kills += 1
            code = running.wait(60)
            tally.wrong_codes += code not in (128 + number, given.code)
            time.sleep(0.2)
            tally.left += watch.left() + sum(os.path.exists(f"/proc/{one}") for one in children)
        watch.look()
        if running.returncode == given.code:
            break
        if time.monotonic() - begin > _LONGEST:
            tally.hung += 1
            break
    tally.left += watch.left()
    tally.made_again, tally.longest = watch.made_again, time.monotonic() - begin
    return tally


def has_claim(folder: pathlib.Path, host: str) -> bool:
    """Returns whether a process of that host is at work on a shard."""
    for claim in folder.glob(".claims/*.claim"):
        try:
            if json.loads(claim.read_text())["host"] == host:
                return True
        except (OSError, ValueError):
            continue
    return False


def round_of_hosts(
    folder: pathlib.Path, given: argparse.Namespace, workers: int, most: int, rng: random.Random
) -> Tally:
    """Two hosts share a folder; one of them is killed as a whole, the other takes over."""
    tally, watch, log = Tally(rounds=1, calls=2), Watch(folder), folder.with_suffix(".log")
    begin = time.monotonic()
    room = ["unshare", "--uts", "--pid", "--fork", "--mount-proc", "--kill-child", "sh", "-c"]
    quick = {"SRT_JAX_STALE": "6", "SRT_JAX_BEAT": "1"}
    hosts = [
        start(
            [*room, f'hostname {name}; exec "$@"', "sh", *command(folder, given, workers)],
            log,
            **quick,
        )
        for name in _HOSTS
    ]
    dying = rng.randrange(2)
    victim, survivor = hosts[dying], hosts[1 - dying]
    due = None
    while survivor.poll() is None and time.monotonic() - begin < _LONGEST:
        watch.look()
        is_at_work = has_claim(folder, _HOSTS[dying])
        if due is None and is_at_work:
            due = time.monotonic() + rng.uniform(0, 3)
        is_due = due is not None and time.monotonic() > due and is_at_work
        if is_due and not tally.kills and victim.poll() is None:
            tally.at_work += 1
            for pid in (*below(victim.pid), victim.pid):
                os.kill(pid, signal.SIGKILL)
            tally.kills += 1
        time.sleep(0.02)
    tally.hung += survivor.poll() is None
    tally.wrong_codes += survivor.poll() != given.code
    victim.wait(60)
    watch.look()
    tally.made_again, tally.left = watch.made_again, watch.left()
    tally.longest = time.monotonic() - begin
    return tally


Round = Callable[[pathlib.Path, argparse.Namespace, int, int, random.Random], Tally]
ROUNDS: dict[str, Round] = {
    "kill": round_of_kills,
    "term": round_of_signals,
    "int": round_of_signals,
    "hosts": round_of_hosts,
}


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=100, help="for each number of workers")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--engine", choices=list(_MARKS), default="none")
    parser.add_argument("--how", choices=list(ROUNDS), default="kill")
    parser.add_argument("--job", choices=["dataset", "solve"], default="dataset")
    parser.add_argument("--count", type=int, default=1536)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--shard-size", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Runs the campaign, prints a table, and returns its exit code."""
    given = parse(arguments)
    # started as a shell's background job this process ignores Ctrl-C, and all that it starts would
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with tempfile.TemporaryDirectory() as place:
        reference = pathlib.Path(place, "reference")
        if given.job == "solve":
            subprocess.run(generate(reference, given), stdout=subprocess.DEVNULL, check=True)
        # 1 where some tasks are unsolvable
        given.code = subprocess.run(
            command(reference, given, None), stdout=subprocess.DEVNULL
        ).returncode
        assert given.code in (0, 1, 3), given.code
        expected = digest(reference)
        names = [field.name for field in dataclasses.fields(Tally)]
        print(f"reference: {expected}\n| how | job | engine | workers | {' | '.join(names)} |")
        print("|---" * (len(names) + 4) + "|", flush=True)
        is_clean = True
        for workers in given.workers:
            total, rng = Tally(), random.Random(f"{given.seed} {workers}")
            while total.kills < given.kills:
                folder = pathlib.Path(place, f"{given.how}-{workers}-{total.rounds}")
                most = given.kills - total.kills
                one = ROUNDS[given.how](folder, given, workers, most, rng)
                one.wrong_bytes += digest(folder) != expected
                if not one.is_clean:
                    log = folder.with_suffix(".log").read_text(errors="replace")
                    print(f"{folder.name}: {one}\n{log[-3000:]}", file=sys.stderr)
                total.add(one)
            values = " | ".join(f"{getattr(total, name):.4g}" for name in names)
            run = f"{given.how} | {given.job} | {given.engine} | {workers}"
            print(f"| {run} | {values} |", flush=True)
            is_clean &= total.is_clean
    return int(not is_clean)


if __name__ == "__main__":
    sys.exit(main())
