"""How long one kernel takes to compile, in a process of its own without a cache on disk; prints one
line of JSON.

    python -m experiments.campaigns.compile_seconds KERNEL SIDE BATCH

Of a new size in the same buckets, and a smaller batch, the number of programs compiled is printed:
it must be 0.
"""

import json
import sys
import time
from typing import Any

import jax
import numpy as np

import srt_jax

ROOM = 2048
"""Cells of a path: a static number, compiled again where it is another."""


def call_kernel(kernel: str, free: np.ndarray) -> Any:
    """Calls a kernel on maps bool [B, H, W], with arguments made without JAX."""
    first, last = (
        np.zeros((len(free), 2), np.int32),
        np.full((len(free), 2), free.shape[1] - 1, np.int32),
    )
    match kernel:
        case "reach" | "cost_to_come":
            return getattr(srt_jax, kernel)(free, first)
        case "seed_cell":
            return srt_jax.seed_cell(free, last)
        case "contour":
            return srt_jax.contour(free, first, last)
    rows, cols = np.indices(free.shape[1:], np.float32)
    cost = np.maximum(rows, cols) + np.float32(2**0.5 - 1) * np.minimum(rows, cols)
    return srt_jax.trace_path(np.repeat(cost[None], len(free), 0), last, max_cells=ROOM)


def main() -> None:
    kernel, side, batch = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    jax.config.update("jax_enable_compilation_cache", False)
    compiled: list[float] = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, duration_secs, **_: (
            compiled.append(duration_secs) if event.endswith("backend_compile_duration") else None
        )
    )
    # JAX itself has started
    jax.block_until_ready(jax.jit(lambda x: x + 1)(np.ones(3, np.float32)))
    # and what all kernels share
    call_kernel("seed_cell" if kernel == "reach" else "reach", np.ones((1, 8, 8), bool))
    compiled.clear()
    free = np.ones((batch, side, side), bool)
    begin = time.perf_counter()
    jax.block_until_ready(call_kernel(kernel, free))
    first, num_first, in_xla = time.perf_counter() - begin, len(compiled), sum(compiled)
    begin = time.perf_counter()
    jax.block_until_ready(call_kernel(kernel, free))
    second = time.perf_counter() - begin
    compiled.clear()
    jax.block_until_ready(call_kernel(kernel, free[: batch // 2 + 1, : side - 3, : side - 5]))
    record = {
        "seconds": first - second,
        "in_xla": in_xla,
        "programs": num_first,
        "programs_for_new_sizes": len(compiled),
    }
    print(json.dumps(record))


if __name__ == "__main__":
    main()
