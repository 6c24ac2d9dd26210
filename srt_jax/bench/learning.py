"""`srt-jax bench learning`: what training loops wait for: exact labels of small maps, whole answers
as an oracle, and signs.

Labels are lengths to the goal, for every cell; the oracle tells the least removal. Both on batches
such as learning code feeds, called directly, under vmap and inside a scan, beside C++ and SciPy map
by map. Signs: `sign_model.learn` on blocks tasks, and how short plans are before and after.
"""

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from srt_jax.bench.machine import machine, machine_line, spread
from srt_jax.bench.pipelines import pipelines


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "rows": [{what, batch, size, per_second: {make: spread}}], "signs":
    [{sign, ...}]}.
    """
    repeats, sizes = (3, (32,)) if quick else (9, (16, 32, 64))
    rows = []
    for size in sizes:
        for what, measure in (("labels", _labels), ("oracle", _oracle)):
            print(f"bench learning: {what}, {size} x {size}", file=sys.stderr, flush=True)
            batch = min(256, 2**18 // size**2)
            rows.append(
                {
                    "what": what,
                    "batch": batch,
                    "size": size,
                    "per_second": measure(size, batch, repeats),
                }
            )
    print("bench learning: heuristic signs", file=sys.stderr, flush=True)
    return {"machine": machine("scipy"), "rows": rows, "signs": _signs(quick)}


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text: maps or tasks a second, median (quartiles), and ours over
    each peer.
    """
    lines = [
        machine_line(result["machine"]),
        "a second: median (quartiles); peers do one map after the other",
    ]
    for row in result["rows"]:
        lines.append(f"\n{row['what']}, {row['batch']} maps of {row['size']} x {row['size']}")
        ours = row["per_second"]["batch"]["median"]
        for make, rate in row["per_second"].items():
            text = (
                f"{rate['median']:,.0f} ({rate['low']:,.0f}-{rate['high']:,.0f})"
                if rate
                else "not installed"
            )
            ratio = (
                ""
                if rate is None or make == "batch"
                else f", batch is {ours / rate['median']:.1f}x"
            )
            lines.append(f"  {make:14s} {text}{ratio}")
    lines.append("")
    for row in result["signs"]:
        lines.append(
            f"{row['sign']:9s} sign, {row['tasks']} tasks of {row['blocks']} blocks: solved"
            f" {row['solved']:.1%}, {row['mean_length']:.2f} steps"
            + (f", learned in {row['seconds']:.1f} s" if row["seconds"] else "")
        )
    return "\n".join(lines)


def _labels(size: int, batch: int, repeats: int) -> dict[str, Any]:
    import jax

    import srt_jax
    from srt_jax.bench import peers
    from srt_jax.bench.measured_maps import maps_of

    maps, starts = maps_of("noise 20 %", size, batch)
    free, start = jax.device_put((maps, starts))
    under_vmap = jax.jit(jax.vmap(srt_jax.cost_to_come))
    parts = jax.tree.map(
        lambda array: array.reshape(4, batch // 4, *array.shape[1:]), (free, start)
    )
    in_scan = jax.jit(
        lambda parts: jax.lax.scan(
            lambda carry, part: (carry, srt_jax.cost_to_come(*part)), 0, parts
        )[1]
    )
    native = peers.distances(maps, starts)
    return _rates(
        {
            "batch": lambda: srt_jax.cost_to_come(free, start),
            "vmap": lambda: under_vmap(free, start),
            "scan of 4": lambda: in_scan(parts),
            "C++ Dijkstra": native.get("C++ bucket Dijkstra"),
            "SciPy": native.get("scipy csgraph, graph given"),
        },
        batch,
        repeats,
    )


def _oracle(size: int, batch: int, repeats: int) -> dict[str, Any]:
    import jax

    import srt_jax
    from srt_jax.instances.generate import generate
    from srt_jax.types import FREE

    tasks = [task for _, task, _ in generate("rooms", count=batch, size=size, seed=0)]
    stacked = jax.device_put(srt_jax.stack(tasks))
    under_vmap = jax.jit(jax.vmap(srt_jax.solve))
    free = [np.ascontiguousarray((task.labels == FREE).all(axis=0)) for task in tasks]
    opened = [
        np.ascontiguousarray(
            ((task.labels == FREE) | np.isin(task.labels, np.flatnonzero(task.destroyable))).all(
                axis=0
            )
        )
        for task in tasks
    ]
    ends = [(tuple(task.start.tolist()), tuple(task.goal.tolist())) for task in tasks]
    native = pipelines(free, opened, ends)["PY16 in C++"]
    works = {
        "batch": lambda: srt_jax.solve(stacked),
        "vmap": lambda: under_vmap(stacked),
        "PY16 in C++": native,
    }
    return _rates(works, batch, repeats)


def _rates(works: dict[str, Callable[[], Any] | None], count: int, repeats: int) -> dict[str, Any]:
    """Returns how many a second each does, taken in turn; None for one that is not installed."""
    import jax

    from srt_jax.engine.reuse import only_own_shapes

    present = {name: work for name, work in works.items() if work}
    rates: dict[str, list[float]] = {name: [] for name in present}
    with only_own_shapes():
        for work in present.values():
            jax.block_until_ready(work())
        for _ in range(repeats):
            for name, work in present.items():
                began = time.perf_counter()
                jax.block_until_ready(work())
                rates[name].append(count / (time.perf_counter() - began))
    return {name: spread(rates[name]) if name in rates else None for name in works}


def _signs(quick: bool) -> list[dict[str, Any]]:
    """Plans of 8 blocks before and after learning on 6: what `learn` is for."""
    from sign_model import learn, plan_batch
    from sign_model.blocks import random_blocks_tasks

    tasks = random_blocks_tasks(8, 128 if quick else 512, seed=1)
    began = time.perf_counter()
    learned = learn(
        random_blocks_tasks(6, 256 if quick else 1024, seed=100), generations=10 if quick else 30
    )
    seconds = time.perf_counter() - began
    rows = []
    for name, sign, spent in (("unlearned", None, 0.0), ("learned", learned, seconds)):
        results = plan_batch(tasks, heuristic=sign, together=64)
        lengths = [len(result.actions) for result in results if result.is_solved]
        row = {
            "sign": name,
            "blocks": 8,
            "tasks": len(tasks),
            "solved": len(lengths) / len(tasks),
            "seconds": spent,
        }
        rows.append(row | {"mean_length": float(np.mean(lengths))})
    return rows
