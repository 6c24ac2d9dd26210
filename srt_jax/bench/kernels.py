"""`srt-jax bench kernels`: each kernel beside its native peers, in one run, one thread each, taken in turn."""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

BARS = {"reach, packed": 4.0, "reach": 2.5, "cost_to_come": 1.5, "contour": 1.5, "seed_cell": 5.0}
"""What the best native peer's time over ours is to be, on streets of 512 x 512; for cost_to_come the C++ peer's."""


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "fast_form", "rows": [{kernel, kind, size, batch, ms, peers {name: ms}, ratio, bar}...]}.

    In a process of its own, kept on one core, so that the caller's threads and settings are not touched.
    """
    environment = {
        **os.environ,
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
        "OMP_NUM_THREADS": "1",
        "JAX_PLATFORMS": "cpu",
    }
    command = [sys.executable, "-m", "srt_jax.bench.kernels", "--json", *(["--quick"] if quick else [])]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"the measuring process ended with code {done.returncode}: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout)


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text, ratios first: over 1 means faster than the best native peer."""
    lines = [
        f"jax {result['machine']['jax']} on {result['machine']['device']}, one thread; "
        f"loops compiled whole: {'yes' if result['fast_form'] > 2 else 'NO'} ({result['fast_form']:.1f}x the plain form)",
        f"{'kernel':15s}{'map':12s}{'size':>6s}{'ratio':>8s}{'bar':>6s}{'ours ms':>10s}  peers, ms (their time over ours)",
    ]
    for row in result["rows"]:
        peers = ", ".join(f"{name} {ms:.3f} ({ms / row['ms']:.1f}x)" for name, ms in row["peers"].items())
        bar = f"{row['bar']:.1f}" if row["bar"] else ""
        ratio = f"{row['ratio']:.2f}" if row["ratio"] else "-"
        place = f"{row['kernel']:15s}{row['kind']:12s}{row['size']:6d}"
        lines.append(f"{place}{ratio:>8s}{bar:>6s}{row['ms']:10.3f}  {peers or 'none installed'}")
    return "\n".join(lines)


def medians(functions: dict[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """Returns the median seconds of each, taken in turn so that a busy machine hits all alike."""
    taken: dict[str, list[float]] = {name: [] for name in functions}
    for function in functions.values():
        function()
    for _ in range(repeats):
        for name, function in functions.items():
            begin = time.perf_counter()
            function()
            taken[name].append(time.perf_counter() - begin)
    return {name: sorted(times)[len(times) // 2] for name, times in taken.items()}


def _measure(quick: bool) -> dict[str, Any]:
    import jax

    from srt_jax.bench.maps import KINDS

    repeats = 3 if quick else 7
    rows = []
    for size in (64, 256) if quick else (512, 64, 256, 1024):
        for kind in ("street", "noise 35 %", "maze 1") if quick else KINDS:
            rows += _measure_maps(kind, size, repeats)
    machine = {"jax": jax.__version__, "device": jax.devices()[0].device_kind, "cores": os.cpu_count()}
    return {"machine": machine, "fast_form": _fast_form(), "rows": rows}


def _measure_maps(kind: str, size: int, repeats: int) -> list[dict[str, Any]]:
    import jax
    import numpy as np

    import srt_jax
    from srt_jax import packing
    from srt_jax.bench import peers
    from srt_jax.bench.maps import maps_of
    from srt_jax.contour import obstacle_ahead
    from srt_jax.reach import reach_words

    batch = max(4, min(64, 2**22 // size**2))
    maps, starts = maps_of(kind, size, batch)
    goals = np.tile(np.array([[size - 1, size // 2]], np.int32), (batch, 1))
    free, start, goal = jax.device_put((maps, starts, goals))
    words = jax.jit(packing.pack)(free)
    reached = srt_jax.reach(free, start)
    seeds = srt_jax.seed_cell(reached, goal)
    walls = np.stack([np.argwhere(~one)[len(np.argwhere(~one)) // 2] for one in maps]).astype(np.int32)
    beside, towards = _beside(maps, walls)
    ahead = np.asarray(obstacle_ahead(free, jax.device_put(beside), jax.device_put(towards)))
    packed = jax.jit(lambda words, start: reach_words(words, start, width=size))
    ours = {
        "reach, packed": (lambda: packed(words, start), peers.floods(maps, starts)),
        "reach": (lambda: srt_jax.reach(free, start), peers.floods(maps, starts)),
        "cost_to_come": (lambda: srt_jax.cost_to_come(free, start), peers.distances(maps, starts)),
        "contour": (lambda: srt_jax.contour(free, beside, towards), peers.contours(maps, beside, ahead)),
        "seed_cell": (lambda: srt_jax.seed_cell(reached, goal), peers.nearest(np.asarray(reached), goals)),
    }
    assert seeds.shape == (batch, 2)
    out = []
    for name, (function, others) in ours.items():
        functions = {"ours": lambda function=function: jax.block_until_ready(function()), **others}
        times = {key: 1e3 * value / batch for key, value in medians(functions, repeats).items()}
        mine = times.pop("ours")
        bar = BARS[name] if (kind, size) == ("street", 512) else None
        against = [times[key] for key in times if name != "cost_to_come" or key.startswith("C++")]
        ratio = min(against) / mine if against else None
        out.append(
            {"kernel": name, "kind": kind, "size": size, "batch": batch, "ms": mine, "peers": times, "ratio": ratio, "bar": bar}
        )
    return out


def _beside(maps: Any, walls: Any) -> tuple[Any, Any]:
    """A free cell next to a blocked one in each map, and that blocked cell as the goal."""
    import numpy as np

    seeds, goals = [], []
    for free, wall in zip(maps, walls):
        cells = np.argwhere(free)
        order = np.abs(cells - wall).max(1).argmin()
        seeds.append(cells[order])
        goals.append(wall)
    return np.array(seeds, np.int32), np.array(goals, np.int32)


def _fast_form() -> float:
    """How many times faster a flood is with the marks of `kernel` than without: about 1 where they are not in force."""
    import jax
    import numpy as np

    from srt_jax.reach import reach_maps

    free = jax.device_put(np.random.default_rng(0).random((16, 256, 256)) > 0.2)
    start = jax.device_put(np.zeros((16, 2), np.int32))
    marked = jax.jit(lambda free, start: reach_maps(free, start)).lower(free, start).compile()
    os.environ["SRT_JAX_PLAIN"] = "1"
    plain = jax.jit(lambda free, start: reach_maps(free, start)).lower(free, start).compile()
    del os.environ["SRT_JAX_PLAIN"]
    times = medians({name: lambda f=f: jax.block_until_ready(f(free, start)) for name, f in (("m", marked), ("p", plain))}, 5)
    return times["p"] / times["m"]


def main() -> None:
    """Measures on one core and prints a table, or JSON with --json."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps, few repeats")
    parser.add_argument("--json", action="store_true", help="one JSON document instead of a table")
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    import jax

    jax.config.update("jax_cpu_enable_async_dispatch", False)  # no thread to wake: the call is what is measured
    result = _measure(options.quick)
    print(json.dumps(result) if options.json else table(result))


if __name__ == "__main__":
    main()
