"""One side of the comparison: a process that runs what it is asked for, on the device that JAX
finds, and answers in JSON lines.

Lines on standard input, one answer each; in either there is {"error": text, "is_memory": bool}
where something went wrong.
- {"do": "first", "job": name, "side": cells, "batch": maps, "folder": path} makes the inputs and
  calls once: {"first": seconds, compiling included, "digests": one for each array of the result,
  "files": their names in the folder, if they are small}.
- {"do": "again", "least": seconds} calls on for about so long: {"seconds": of one call, median}.
"""

import hashlib
import json
import pathlib
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from experiments.device.jobs import jobs

_LARGEST_KEPT = 1 << 26
"""Bytes of a result that is written to the folder, so that differences can be counted."""


class Worker:
    """What the process holds from one order to the next: a function and its inputs."""

    def __init__(self) -> None:
        self._call: Callable[[], Any] | None = None

    def answer(self, order: dict[str, Any]) -> dict[str, Any]:
        """Carries out an order."""
        try:
            return self._first(order) if order["do"] == "first" else self._again(order["least"])
        except Exception as error:  # whatever goes wrong on a device is a row of the table
            text = " ".join(str(error).split())
            is_memory = "RESOURCE_EXHAUSTED" in text or isinstance(error, MemoryError)
            return {"error": f"{type(error).__name__}: {text}"[:300], "is_memory": is_memory}

    def _first(self, order: dict[str, Any]) -> dict[str, Any]:
        self._call = None
        prepared = {job.name: job.prepare for job in jobs(order["side"])}[order["job"]]
        function, arguments = prepared(order["batch"])
        # On the device before any call; on a CPU the arrays stay the host's, as a user has them.
        if jax.default_backend() != "cpu":
            arguments = jax.device_put(arguments)
        began = time.perf_counter()
        result = jax.block_until_ready(function(*arguments))
        first = time.perf_counter() - began
        self._call = lambda: jax.block_until_ready(function(*arguments))
        arrays = {
            jax.tree_util.keystr(path): np.asarray(leaf)
            for path, leaf in jax.tree_util.tree_leaves_with_path(result)
        }
        files = {}
        if sum(array.nbytes for array in arrays.values()) <= _LARGEST_KEPT:
            files = {name: f"{number}.npy" for number, name in enumerate(arrays)}
            for name, array in arrays.items():
                np.save(pathlib.Path(order["folder"], files[name]), array)
        digests = {name: _digest(array) for name, array in arrays.items()}
        return {"first": first, "digests": digests, "files": files}

    def _again(self, least: float) -> dict[str, Any]:
        assert self._call is not None
        seconds: list[float] = []
        while sum(seconds) < least and len(seconds) < 50:
            began = time.perf_counter()
            self._call()
            seconds.append(time.perf_counter() - began)
        return {"seconds": statistics.median(seconds)}


def _digest(array: np.ndarray) -> str:
    described = f"{array.dtype}{array.shape}".encode()
    return hashlib.sha256(described + np.ascontiguousarray(array).tobytes()).hexdigest()


def main() -> None:
    worker, device = Worker(), jax.devices()[0]
    facts = {"platform": device.platform, "kind": device.device_kind, "jax": jax.__version__}
    print(json.dumps(facts), flush=True)
    for line in sys.stdin:
        print(json.dumps(worker.answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
