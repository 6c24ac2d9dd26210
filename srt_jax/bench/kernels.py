"""`srt-jax bench kernels`: each kernel beside its native peers, in one run, one thread each, taken
in turn.
"""

import argparse
import json
import os
from collections.abc import Callable
from typing import Any

from srt_jax.bench import scaling
from srt_jax.bench.machine import machine, machine_line, spread
from srt_jax.bench.timing import in_turn, measured_apart

PACKAGES = (
    "opencv-python-headless",
    "connected-components-3d",
    "scipy",
    "dijkstra3d",
    "scikit-image",
)


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "fast_form", "rows", "scaling"}; each in a process of its own.

    A row: {kernel, kind, size, batch, ms, quartiles [low, high], peers {name: ms}, ratio}, kept on
    one core; medians. The ratio is the best native peer's time over ours; for cost_to_come the
    C++ peer's. For "scaling" see `scaling`.
    """
    alone = {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false", "OMP_NUM_THREADS": "1"}
    return {
        **measured_apart("srt_jax.bench.kernels", quick, **alone),
        "scaling": scaling.run(quick),
    }


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text, ratios first: over 1 means faster than the best native
    peer.
    """
    lines = [
        (
            f"{machine_line(result['machine'])}, one thread; loops compiled whole:"
            f" {'yes' if result['fast_form'] > 2 else 'NO'} ({result['fast_form']:.1f}x the plain"
            " form)"
        ),
        (
            f"{'kernel':15s}{'map':12s}{'size':>6s}{'ratio':>8s}{'ours ms':>10s}{'quartiles':>16s}"
            "  peers, ms (their time over ours)"
        ),
    ]
    for row in result["rows"]:
        peers = ", ".join(
            f"{name} {ms:.3f} ({ms / row['ms']:.1f}x)" for name, ms in row["peers"].items()
        )
        ratio = f"{row['ratio']:.2f}" if row["ratio"] else "-"
        place = f"{row['kernel']:15s}{row['kind']:12s}{row['size']:6d}"
        low, high = row["quartiles"]
        between = f"{low:.3f}-{high:.3f}"
        lines.append(
            f"{place}{ratio:>8s}{row['ms']:10.3f}{between:>16s}  {peers or 'none installed'}"
        )
    if result.get("scaling"):
        lines += ["", scaling.table(result["scaling"])]
    return "\n".join(lines)


def _measure(quick: bool) -> dict[str, Any]:
    from srt_jax.bench.measured_maps import KINDS

    repeats = 3 if quick else 7
    rows = []
    for size in (64, 256) if quick else (512, 64, 256, 1024):
        for kind in ("street", "noise 35 %", "maze 1") if quick else KINDS:
            rows += _measure_maps(kind, size, repeats)
    return {"machine": machine(*PACKAGES), "fast_form": _fast_form(), "rows": rows}


def _measure_maps(kind: str, size: int, repeats: int) -> list[dict[str, Any]]:
    import jax
    import numpy as np

    import srt_jax
    from srt_jax.bench import peers
    from srt_jax.bench.measured_maps import maps_of
    from srt_jax.engine import packing
    from srt_jax.paths.contour import obstacle_ahead
    from srt_jax.paths.reach import reach_words

    # The maps of a batch, and what the later kernels take from the earlier ones.
    batch = max(4, min(64, 2**22 // size**2))
    maps, starts = maps_of(kind, size, batch)
    goals = np.tile(np.array([[size - 1, size // 2]], np.int32), (batch, 1))
    free, start, goal = jax.device_put((maps, starts, goals))
    words = jax.jit(packing.pack)(free)
    reached = srt_jax.reach(free, start)
    seeds = srt_jax.seed_cell(reached, goal)
    walls = np.stack([np.argwhere(~one)[len(np.argwhere(~one)) // 2] for one in maps]).astype(
        np.int32
    )
    beside, towards = _beside(maps, walls)
    ahead = np.asarray(obstacle_ahead(free, jax.device_put(beside), jax.device_put(towards)))
    far = _reached_cells(np.asarray(reached))
    owners, toll = _tolled(maps)
    labels, tolls = jax.device_put((owners[:, None], toll))
    # Every kernel beside its peers, on the same maps.
    packed = jax.jit(lambda words, start: reach_words(words, start, width=size))
    ours = {
        "reach, packed": (lambda: packed(words, start), peers.floods(maps, starts)),
        "reach": (lambda: srt_jax.reach(free, start), peers.floods(maps, starts)),
        "cost_to_come": (lambda: srt_jax.cost_to_come(free, start), peers.distances(maps, starts)),
        "shortest_path": (
            lambda: srt_jax.shortest_path(free, start, far),
            peers.routes(maps, starts, far),
        ),
        "path_cost": (
            lambda: srt_jax.path_cost(free, start, far),
            peers.routes(maps, starts, far),
        ),
        "contour": (
            lambda: srt_jax.contour(free, beside, towards),
            peers.contours(maps, beside, ahead),
        ),
        "seed_cell": (
            lambda: srt_jax.seed_cell(reached, goal),
            peers.nearest(np.asarray(reached), goals),
        ),
        "critical_cells": (
            lambda: srt_jax.critical_cells(free, start, far),
            peers.cuts(maps, starts, far),
        ),
        "toll_to_come": (
            lambda: srt_jax.toll_to_come(labels, tolls, start),
            peers.tolled(owners, toll, starts),
        ),
    }
    assert seeds.shape == (batch, 2)
    out = []
    for name, (function, others) in ours.items():
        functions = {"ours": lambda function=function: jax.block_until_ready(function()), **others}
        out.append(
            {"kernel": name, "kind": kind, "size": size, "batch": batch}
            | _in_milliseconds(name, functions, batch, repeats)
        )
    return out


def _in_milliseconds(
    name: str, functions: dict[str, Callable[[], Any]], batch: int, repeats: int
) -> dict[str, Any]:
    """Returns what a map takes, ours and by each peer, and the ratio to the fastest peer; lengths
    are compared with C++ alone.
    """
    spreads = {
        key: spread([1e3 * value / batch for value in taken])
        for key, taken in in_turn(functions, repeats).items()
    }
    own = spreads.pop("ours")
    times = {key: value["median"] for key, value in spreads.items()}
    against = [times[key] for key in times if name != "cost_to_come" or key.startswith("C++")]
    return {
        "ms": own["median"],
        "quartiles": [own["low"], own["high"]],
        "peers": times,
        "ratio": min(against) / own["median"] if against else None,
    }


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


def _reached_cells(reached: Any) -> Any:
    """Returns a random cell that is reached in each map, int32 [B, 2]."""
    import numpy as np

    rng = np.random.default_rng(0)
    cells = [np.argwhere(one) for one in reached]
    return np.array([some[rng.integers(len(some))] for some in cells], np.int32)


def _tolled(maps: Any) -> tuple[Any, Any]:
    """What is blocked in each map as obstacles, one a piece, and a toll of 10 for each: int32 [B,
    H, W] and float32 [B, M].
    """
    import numpy as np

    from srt_jax.components import label

    owners = np.stack([label(~free) for free in maps])
    return owners, np.full((len(maps), owners.max() + 1), 10, np.float32)


def _fast_form() -> float:
    """How many times faster a flood is with the compiler's marks than without: about 1 where they
    are not in force.
    """
    import jax
    import numpy as np

    from srt_jax.paths.reach import reach_maps

    free = jax.device_put(np.random.default_rng(0).random((16, 256, 256)) > 0.2)
    start = jax.device_put(np.zeros((16, 2), np.int32))
    marked = jax.jit(lambda free, start: reach_maps(free, start)).lower(free, start).compile()
    os.environ["SRT_JAX_PLAIN"] = "1"
    plain = jax.jit(lambda free, start: reach_maps(free, start)).lower(free, start).compile()
    del os.environ["SRT_JAX_PLAIN"]
    forms = {"marked": marked, "plain": plain}
    times = in_turn(
        {
            name: lambda form=form: jax.block_until_ready(form(free, start))
            for name, form in forms.items()
        },
        5,
    )
    return spread(times["plain"])["median"] / spread(times["marked"])["median"]


def main() -> None:
    """Measures on one core and prints a table, or JSON with --json."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps, few repeats")
    parser.add_argument("--json", action="store_true", help="one JSON document instead of a table")
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    import jax

    # A thread of JAX's that is about to sleep spins: nothing beside other cores, but half a light
    # kernel on this one.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    print(json.dumps(_measure(options.quick)) if options.json else table(_measure(options.quick)))


if __name__ == "__main__":
    main()
