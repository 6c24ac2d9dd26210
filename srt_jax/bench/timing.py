"""How times are taken: functions in turn, so that a busy machine hits all alike, in a process of
its own.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any


def in_turn(functions: dict[str, Callable[[], Any]], repeats: int) -> dict[str, list[float]]:
    """Returns the seconds each call took, `repeats` of each after one that is not counted."""
    taken: dict[str, list[float]] = {name: [] for name in functions}
    for function in functions.values():
        function()
    for _ in range(repeats):
        for name, function in functions.items():
            begin = time.perf_counter()
            function()
            taken[name].append(time.perf_counter() - begin)
    return taken


def measured_apart(module: str, quick: bool, **environment: str) -> Any:
    """Returns what `python -m module --json [--quick]` prints, on a CPU; the caller's threads and
    settings stay untouched.

    Raises:
      RuntimeError: the process failed.
    """
    command = [sys.executable, "-m", module, "--json", *(["--quick"] if quick else [])]
    done = subprocess.run(
        command,
        env={**os.environ, "JAX_PLATFORMS": "cpu", **environment},
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(
            f"the measuring process ended with code {done.returncode}: {done.stderr.strip()[-500:]}"
        )
    return json.loads(done.stdout)
