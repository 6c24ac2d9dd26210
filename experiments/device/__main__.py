"""Every public function on this machine's accelerator, held against its CPU bit for bit and timed
beside it by the size of the batch; the command ends within eight minutes.

    python -m experiments.device [--minutes 8] [--batches 64,4096,1,512] [--side 64]
    [--only NAME...] [--out FILE.json]

Two processes compile side by side and are timed in turn: one on the device that JAX finds, one on
the CPU. All functions run with the first size of batch, then all with the next, as long as there is
time; a call that takes too long is ended with its process, and the rest goes on. Where there is no
accelerator the command is rehearsed: the first process then runs the code that an accelerator would
get, on the CPU.

A row gives the milliseconds of one call (arrays on the device already; the CPU uses all cores), the
seconds of the first call, which compiles, and whether every bit of every result is equal. Peers
where installed: labelling and distances of cuCIM and CuPy. Exit code 1 where a bit differs or a
call failed for another reason than memory or time.
"""

import argparse
import contextlib
import json
import os
import pathlib
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.device.labelling_peers import peers
from sign_model.foundation.files import atomic_write

_NAMES = ("device", "cpu")

_LONGEST_FIRST = 150.0
"""Seconds that a first call may take, compiling included."""

_SHORTEST_FIRST = 3.0
"""Seconds left with which nothing more is begun."""

_LEAST = 0.3
"""Seconds that one function with one size of batch is measured for, about."""


class Side:
    """One of the two processes; started again after a call that did not end."""

    def __init__(self, environment: dict[str, str]) -> None:
        self._environment = {**os.environ, **environment}
        self._process: subprocess.Popen | None = None
        self.facts: dict[str, Any] = {}

    def give(self, order: dict[str, Any]) -> None:
        """Gives an order; `answer` has to be called for each."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(OSError):  # the process has ended: the answer says so
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()

    def answer(self, ends: float) -> dict[str, Any]:
        """Returns the answer to the order given, {"error": ...} if there is none at the time
        `ends`.
        """
        assert self._process is not None
        seconds = max(1.0, ends - time.monotonic())
        try:
            line = self._lines.get(timeout=seconds)
        except queue.Empty:
            self.stop()
            return {"error": f"no answer within {seconds:.0f} s", "is_time": True}
        if line is None:
            return {"error": f"the process ended with code {self._process.wait()}"}
        return json.loads(line)

    def stop(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.kill()
            self._reader.join()  # it reads to the end of what the process wrote
            self._process.communicate()
            self._process = None

    def _start(self) -> None:
        command = [sys.executable, "-m", "experiments.device.one_side"]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self._environment,
        )
        self._lines: queue.Queue[str | None] = queue.Queue()
        streams = (self._process.stdout, self._lines)
        self._reader = threading.Thread(target=_read_lines, args=streams, daemon=True)
        self._reader.start()
        line = self._lines.get()
        if line is None:
            raise RuntimeError("the measuring process did not start: see the lines above")
        self.facts = json.loads(line)


def _read_lines(stream: Any, lines: queue.Queue) -> None:
    for line in stream:
        lines.put(line)
    lines.put(None)


def measure(given: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """Returns {"device", "cpu": facts, "rehearsed": bool, "rows": [...]}."""
    ends = time.monotonic() + 60 * given.minutes
    is_there = _finds_accelerator()
    # the code that an accelerator would get, on the CPU
    rehearsal = {} if is_there else {"SRT_JAX_PLAIN": "1", "JAX_PLATFORMS": "cpu"}
    sides = {
        "device": Side({"SRT_JAX_PROGRAMS": "off", **rehearsal}),
        "cpu": Side({"SRT_JAX_PROGRAMS": "off", "JAX_PLATFORMS": "cpu"}),
    }
    rows = []
    try:
        for batch in given.batches:
            for name in names:
                row = _row(sides, name, batch, given.side, ends)
                rows.append(row)
                print(line_of(row), flush=True)
    finally:
        for side in sides.values():
            side.stop()
    facts = {name: sides[name].facts for name in _NAMES}
    more = peers(given.side, given.batches) if is_there else []
    return {"rehearsed": not is_there, **facts, "side": given.side, "rows": rows, "peers": more}


def _finds_accelerator() -> bool:
    """Returns whether JAX finds something other than a CPU; asked in a process of its own, since
    the answer takes a part of its memory.
    """
    asked = "import jax; print(jax.devices()[0].platform)"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True)
    return done.returncode == 0 and done.stdout.strip() not in ("", "cpu")


def _row(sides: dict[str, Side], name: str, batch: int, side: int, ends: float) -> dict[str, Any]:
    """Runs one function with one size of batch on both sides, and compares."""
    row: dict[str, Any] = {"job": name, "batch": batch, "device": {}, "cpu": {}}
    if ends - time.monotonic() < _SHORTEST_FIRST:
        row["device"] = {"error": "no time was left", "is_time": True}
        return row
    with tempfile.TemporaryDirectory() as place:
        for which in _NAMES:
            folder = pathlib.Path(place, which)
            folder.mkdir()
            order = {"do": "first", "job": name, "batch": batch, "side": side}
            sides[which].give({**order, "folder": str(folder)})
        ends = min(ends, time.monotonic() + _LONGEST_FIRST)
        for which in _NAMES:
            row[which] = sides[which].answer(ends)
        if any("error" in row[which] for which in _NAMES):
            return row
        row["differences"] = _differences(row, pathlib.Path(place))
    for which in _NAMES:
        sides[which].give({"do": "again", "least": _LEAST})
        row[which] = {"first": row[which]["first"], **sides[which].answer(ends)}
    return row


def _differences(row: dict[str, Any], place: pathlib.Path) -> list[str]:
    """Returns what differs between the two results: a line for each array."""
    ours, theirs = (row[which]["digests"] for which in _NAMES)
    found = []
    for name in sorted({*ours, *theirs}):
        if ours.get(name) == theirs.get(name):
            continue
        files = [row[which]["files"].get(name) for which in _NAMES]
        if None in files:
            found.append(f"{name or 'result'} differs")
            continue
        one, other = (np.load(place / which / file) for which, file in zip(_NAMES, files))
        if one.shape != other.shape or one.dtype != other.dtype:
            found.append(f"{name}: {one.dtype}{one.shape} and {other.dtype}{other.shape}")
            continue
        unequal = (one != other) & ~((one != one) & (other != other))
        found.append(f"{name or 'result'}: {int(unequal.sum())} of {one.size} entries")
    return found


def line_of(row: dict[str, Any]) -> str:
    """Returns a row of the table as text."""
    head = f"{row['job']:<26}{row['batch']:>6}"
    for which in _NAMES:
        if "error" in row[which]:
            return f"{head}  {which}: {row[which]['error']}"
    device, cpu = row["device"], row["cpu"]
    same = "equal" if not row["differences"] else "; ".join(row["differences"])
    return (
        f"{head}{1e3 * device['seconds']:>12.2f}{1e3 * cpu['seconds']:>12.2f}"
        f"{cpu['seconds'] / device['seconds']:>9.2f}{device['first']:>10.1f}{cpu['first']:>8.1f}"
        f"  {same}"
    )


HEAD = (
    f"{'function':<26}{'maps':>6}{'device ms':>12}{'CPU ms':>12}{'CPU/dev.':>9}{'first s':>10}"
    f"{'CPU s':>8}  bits"
)


def summary(result: dict[str, Any]) -> str:
    """Returns the last lines: how many rows are equal, differ, failed or found no time."""
    kinds = {"equal": 0, "different": 0, "too large": 0, "no time": 0, "failed": 0}
    for row in result["rows"]:
        kinds[kind_of(row)] += 1
    device = result["device"]
    what = f"{device['kind']} ({device['platform']}, JAX {device['jax']})" if device else "?"
    if result["rehearsed"]:
        what = f"no accelerator: the code for one, rehearsed on the CPU, JAX {device['jax']}"
    lines = [
        f"{peer['name']:<26}{peer['batch']:>6}{1e3 * peer['seconds']:>12.2f}"
        for peer in result["peers"]
    ]
    counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
    return "\n".join([*lines, f"{what}; maps of {result['side']} x {result['side']}: {counts}"])


def kind_of(row: dict[str, Any]) -> str:
    """Returns how a row ended: equal, different, too large, no time or failed."""
    wrong = [row[which] for which in _NAMES if "error" in row[which]]
    if not wrong:
        return "different" if row["differences"] else "equal"
    if wrong[0].get("is_memory"):
        return "too large"
    return "no time" if wrong[0].get("is_time") else "failed"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures, prints the table and writes the file; the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.device",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--minutes", type=float, default=8.0)
    parser.add_argument("--batches", default="64,4096,1,512", help="sizes, in the order they run")
    parser.add_argument("--side", type=int, default=64, help="cells of a side of the maps")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="functions, or parts of names")
    parser.add_argument("--out", help="a JSON file for the rows")
    given = parser.parse_args(arguments)
    given.batches = [int(size) for size in given.batches.split(",")]
    from experiments.device.jobs import jobs

    names = [job.name for job in jobs(given.side)]
    if given.only:
        names = [name for name in names if any(part in name for part in given.only)]
        if not names:
            parser.error(f"no function has {' or '.join(given.only)} in its name")
    print(HEAD, flush=True)
    result = measure(given, names)
    print(summary(result))
    if given.out:
        with atomic_write(given.out) as file:
            json.dump(result, file, indent=1)
    return int(any(kind_of(row) in ("different", "failed") for row in result["rows"]))


if __name__ == "__main__":
    sys.exit(main())
