"""How the kernels grow: time a map from small batches to large, on one core and on all, and memory
a map.

Measured in a process of its own, which moves itself from one core to all and back.
"""

import contextlib
import gc
import json
import os
import pathlib
from collections.abc import Callable, Iterator
from typing import Any
from unittest import mock

from srt_jax.bench.machine import spread
from srt_jax.bench.timing import in_turn, measured_apart

SMALL, LARGE = 64, 512
BATCHES = (16, 64, 256, 1024, 4096)


def run(quick: bool = False) -> list[dict[str, Any]]:
    """Returns a row a kernel: {kernel, size, batch_ms, flatness, small_ms, cores, cores_batch,
    cores_ms, cores_ratio, memory}.

    - batch_ms: {batch: ms a map}, eager calls on one core, maps of `size` cells a side; small_ms:
      inside jit, maps of SMALL.
    - cores_ms: [one, all], an eager call of `cores_batch` maps, the best of several.
    - memory: bytes a cell of that call: argument, result, temporary (as compiled), and peak, by
      which the process grew, result included; None where the system does not tell.
    """
    return measured_apart("srt_jax.bench.scaling", quick)


def table(rows: list[dict[str, Any]]) -> str:
    """Returns the rows as text."""
    size, cores, batch = rows[0]["size"], rows[0]["cores"], rows[0]["cores_batch"]
    lines = [
        f"Street maps of {size} x {size}, eager calls on one core: ms a map by batch; slowest over"
        " fastest"
    ]
    lines += _batch_lines(rows, "batch_ms", [f"{row['flatness']:8.2f}" for row in rows])
    lines += [
        f"Maps of {SMALL} x {SMALL} inside jit on one core: ms a map by batch; the start of a call"
        " counts in small ones"
    ]
    lines += _batch_lines(rows, "small_ms", [""] * len(rows))
    lines += [
        f"{batch} street maps of {size} x {size}: ms a map on one core and on {cores}; bytes a cell"
    ]
    heads = zip(
        ("one", "all", "ratio", "argument", "result", "temporary", "peak growth"),
        (9, 9, 8, 10, 8, 11, 13),
    )
    lines += [f"{'kernel':15s}" + "".join(f"{head:>{width}s}" for head, width in heads)]
    for row in rows:
        memory, (one, every) = row["memory"], row["cores_ms"]
        sizes = f"{memory['argument']:10.2f}{memory['result']:8.2f}{memory['temporary']:11.2f}"
        peak = f"{memory['peak']:13.2f}" if memory["peak"] is not None else f"{'-':>13s}"
        lines.append(
            f"{row['kernel']:15s}{one:9.4f}{every:9.4f}{row['cores_ratio']:8.2f}{sizes}{peak}"
        )
    return "\n".join(lines)


def _batch_lines(rows: list[dict[str, Any]], field: str, ends: list[str]) -> list[str]:
    head = f"{'kernel':15s}" + "".join(f"{batch:>9s}" for batch in rows[0][field])
    return [head] + [
        f"{row['kernel']:15s}{''.join(f'{ms:9.4f}' for ms in row[field].values())}{end}"
        for row, end in zip(rows, ends)
    ]


def _measure(quick: bool) -> list[dict[str, Any]]:
    import jax

    jax.devices()  # starts its threads, as many as there are cores now
    size, batches, batch, repeats = (
        (128, BATCHES[:3], 64, 3) if quick else (LARGE, BATCHES, 1024, 5)
    )
    with _on_one_core():
        batch_ms = _by_batch(size, batches, repeats, in_jit=False)
        small_ms = _by_batch(SMALL, batches, 2 * repeats, in_jit=True)
    rows = []
    for kernel, call in _calls(size, batch).items():
        one, every = _on_one_and_all(call, 2 * repeats)
        spent = batch_ms[kernel].values()
        rows.append(
            {
                "kernel": kernel,
                "size": size,
                "batch_ms": batch_ms[kernel],
                "flatness": max(spent) / min(spent),
                "small_ms": small_ms[kernel],
                "cores": os.cpu_count(),
                "cores_batch": batch,
                "cores_ms": [1e3 * one / batch, 1e3 * every / batch],
                "cores_ratio": one / every,
                "memory": _memory(call, batch * size**2),
            }
        )
    return rows


def _by_batch(
    size: int, batches: tuple[int, ...], repeats: int, *, in_jit: bool
) -> dict[str, dict[str, float]]:
    """Returns the median milliseconds a map, of each kernel by batch; the largest batches take
    gigabytes, so one at a time.
    """
    out: dict[str, dict[str, float]] = {}
    for batch in batches:
        for kernel, call in _calls(size, batch).items():
            taken = in_turn(
                {kernel: _in_jit(call) if in_jit else call}, repeats if batch < 1024 else 3
            )[kernel]
            out.setdefault(kernel, {})[str(batch)] = 1e3 * spread(taken)["median"] / batch
    return out


def _in_jit(call: Any) -> Callable[[], Any]:
    import jax

    form = jax.jit(lambda *args: call.kernel(*args, **call.options))
    return lambda: jax.block_until_ready(form(*call.args))


def _calls(size: int, batch: int) -> dict[str, Callable[[], Any]]:
    """An eager call of each kernel on a batch of street maps; the arrays are JAX's already."""
    import jax
    import numpy as np

    import srt_jax
    from srt_jax.bench.measured_maps import maps_of

    kinds, starts = maps_of("street", size, min(batch, 16))
    maps, starts = (
        np.tile(array, (batch // len(array), *[1] * (array.ndim - 1))) for array in (kinds, starts)
    )
    goals = np.tile(np.array([[size - 1, size // 2]], np.int32), (batch, 1))
    free, start, goal = jax.device_put((maps, starts, goals))
    reached, cost = srt_jax.reach(free, start), srt_jax.cost_to_come(free, start)
    seed = srt_jax.seed_cell(reached, goal)

    def call(kernel: Callable, *args: Any, **options: Any) -> Callable[[], Any]:
        run = lambda: jax.block_until_ready(kernel(*args, **options))  # noqa: E731
        run.kernel, run.args, run.options = kernel, args, options  # pyright: ignore
        return run

    return {
        "reach": call(srt_jax.reach, free, start),
        "cost_to_come": call(srt_jax.cost_to_come, free, start),
        "seed_cell": call(srt_jax.seed_cell, reached, goal),
        "contour": call(srt_jax.contour, free, seed, goal),
        "trace_path": call(srt_jax.trace_path, cost, goal, max_cells=4 * size),
    }


def _on_one_and_all(call: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Seconds of a call with every thread of the process on one core, and free to use all; taken in
    turn, the best of each.

    The best, since a core that a neighbour of this machine takes away for a while only ever slows a
    call.
    """

    def alone() -> None:
        with _on_one_core():
            call()

    times = in_turn({"one": alone, "all": call}, repeats)
    return min(times["one"]), min(times["all"])


@contextlib.contextmanager
def _on_one_core() -> Iterator[None]:
    """Keeps all threads of the process on one core; where the system cannot, eager calls only use
    one thread.
    """
    tasks = pathlib.Path("/proc/self/task")
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") and tasks.is_dir() else None
    with mock.patch.dict(os.environ, SRT_JAX_CORES="1"):
        try:
            if cores:
                _keep(tasks, {max(cores)})
            yield
        finally:
            if cores:
                _keep(tasks, cores)


def _keep(tasks: pathlib.Path, cores: set[int]) -> None:
    for task in tasks.iterdir():
        with contextlib.suppress(ProcessLookupError):  # a thread that has just ended
            os.sched_setaffinity(int(task.name), cores)


def _memory(call: Any, cells: int) -> dict[str, float | None]:
    """Bytes a cell."""
    import jax

    form = (
        jax.jit(lambda *args: call.kernel(*args, **call.options))
        .lower(*call.args)
        .compile()
        .memory_analysis()
    )
    sizes = (
        {}
        if form is None
        else {
            "argument": form.argument_size_in_bytes,
            "result": form.output_size_in_bytes,
            "temporary": form.temp_size_in_bytes,
        }
    )
    sizes["peak"] = _growth(call)
    return {name: None if size is None else size / cells for name, size in sizes.items()}


def _growth(call: Callable[[], Any]) -> int | None:
    """By how many bytes the process grows at most while it calls: Linux tells."""
    call()
    gc.collect()
    try:
        # the peak starts again from what is in use now
        pathlib.Path("/proc/self/clear_refs").write_text("5")
        before = _status("VmRSS")
        call()
        return _status("VmHWM") - before
    except (OSError, StopIteration):
        return None


def _status(name: str) -> int:
    lines = pathlib.Path("/proc/self/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith(name)).split()[1])


if __name__ == "__main__":
    import sys

    print(json.dumps(_measure("--quick" in sys.argv)))
