"""`srt-jax bench solve`: complete answers beside the paper's pipeline in C++ and what other
libraries give of them.

A task is a street map with a goal cut off by a ring of side 10 (PY16 §4, Bagel-10): an answer is
the proof that there is no path, seed, contour, the objects on it, what to destroy, and the route.
The peers are given what to destroy. One core, all in turn; then two threads, each with half of the
tasks.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from srt_jax.bench.machine import machine, machine_line, spread
from srt_jax.types import FREE, Task

AUTHORS_MS = 240.0
"""JPS, then A* until nothing is left, by the authors' C++ planner on a city of 500 x 500, Bagel-10,
2 shared x86-64 cores.
"""

CASES = {"bagel-10": "ring", "bagel-10, all can go": "all", "half": "ring"}
"""Blockage, and what can be destroyed: the blocker alone ("ring"), or the buildings too."""


class Case(NamedTuple):
    """tasks: one a map. free, opened: bool [H, W] each, without and with the blocker gone."""

    name: str
    size: int
    tasks: list[Task]
    free: list[np.ndarray]
    opened: list[np.ndarray]


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "authors_ms", "rows": [{case, size, tasks, one_core, two_threads, stages,
    peers, agrees}]}.

    Times are {"median", "low", "high", "count"} in milliseconds a task. Measured in processes of
    their own, so that the caller's threads and settings are not touched.
    """
    one, two = (_process(threads, quick) for threads in (1, 2))
    for row, other in zip(one, two):
        row["two_threads"] = other["two_threads"]
    facts = machine("scipy", "opencv-python-headless", "scikit-image")
    return {"machine": facts, "authors_ms": AUTHORS_MS, "rows": one}


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text, ratios first: over 1 means faster than the peer."""
    lines = [machine_line(result["machine"]), "milliseconds a task: median (quartiles)"]
    for row in result["rows"]:
        lines += [
            f"\n{row['case']}, {row['tasks']} street maps of {row['size']} x {row['size']}",
            *_lines(row, result),
        ]
    return "\n".join(lines)


def _lines(row: dict[str, Any], result: dict[str, Any]) -> list[str]:
    one, two = row["one_core"], row["two_threads"]
    is_measure = (row["case"], row["size"]) == ("bagel-10", 512)
    lines = [
        f"  ours, one core     {_times_text(one)}, {1e3 / one['median']:,.0f} tasks/s",
        f"  ours, two threads  {_times_text(two)}, {1e3 / two['median']:,.0f} tasks/s",
    ]
    if is_measure:
        lines.append(
            f"  {result['authors_ms'] / one['median']:6.1f}x  the authors' C++ planner,"
            f" {result['authors_ms']:.0f} ms"
        )
    for name, peer in row["peers"].items():
        if peer["ms"]:
            lines.append(
                f"  {peer['ms']['median'] / one['median']:6.1f}x  {name} {_times_text(peer['ms'])}:"
                f" {peer['gives']}"
            )
        else:
            lines.append(f"          {name}: not installed")
    shares = ", ".join(f"{stage} {ms / one['median']:.0%}" for stage, ms in row["stages"].items())
    same = {
        True: "the same as the C++ pipeline's",
        False: "NOT the same as the C++ pipeline's",
        None: "not compared",
    }
    return [*lines, f"  stages: {shares}", f"  seeds, contours, lengths: {same[row['agrees']]}"]


def _times_text(times: dict[str, float]) -> str:
    return f"{times['median']:.2f} ({times['low']:.2f}-{times['high']:.2f})"


def _process(threads: int, quick: bool) -> list[dict[str, Any]]:
    """Measures in a new process, whose standard error, where it tells what it is at, is the
    caller's.
    """
    settings = {
        "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
        "OMP_NUM_THREADS": "1",
        "JAX_PLATFORMS": "cpu",
    }
    command = [
        sys.executable,
        "-m",
        "srt_jax.bench.solve",
        "--threads",
        str(threads),
        *(["--quick"] if quick else []),
    ]
    done = subprocess.run(command, env=os.environ | settings, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise RuntimeError(f"the measuring process ended with code {done.returncode}")
    return json.loads(done.stdout)


def _cases(quick: bool) -> list[Case]:
    from srt_jax.bench.measured_maps import maps_of

    size, count = (256, 4) if quick else (512, 16)
    maps, _ = maps_of("street", size, count)
    return [
        _case(name, maps, what)
        for name, what in (list(CASES.items())[:1] if quick else CASES.items())
    ]


def _case(name: str, maps: np.ndarray, what: str) -> Case:
    from srt_jax.components import label
    from srt_jax.instances.paper_blockers import block, pick_start_goal
    from srt_jax.task import make_task

    case = Case(name, maps.shape[1], [], [], [])
    for number, free in enumerate(maps):
        start, goal = pick_start_goal(free, apart=free.shape[0] * 4 // 5, seed=number)
        labels, blocker = block(
            np.asarray(label(~free), np.int32), start, goal, name.partition(",")[0]
        )
        case.tasks.append(
            make_task(labels, start, goal, destroyable=True if what == "all" else [blocker])
        )
        case.free.append((labels == FREE).all(axis=0))
        case.opened.append(
            np.ascontiguousarray(((labels == FREE) | (labels == blocker)).all(axis=0))
        )
    return case


def _measure(threads: int, quick: bool) -> list[dict[str, Any]]:
    rows = []
    for case in _cases(quick):
        print(
            f"bench solve: {case.name}, {case.size} x {case.size}, {threads} at once",
            file=sys.stderr,
            flush=True,
        )
        rows.append(
            _one_core(case, 3 if quick else 5)
            if threads == 1
            else _two_threads(case, 3 if quick else 9)
        )
    return rows


def _one_core(case: Case, repeats: int) -> dict[str, Any]:
    import jax

    import srt_jax
    from srt_jax.bench.pipelines import GIVES, pipelines

    batch = jax.device_put(srt_jax.stack(case.tasks))
    room = 16 * case.size
    peers = pipelines(
        case.free, case.opened, [(_cell(task.start), _cell(task.goal)) for task in case.tasks]
    )
    works: dict[str, Callable[[], Any]] = {"ours": lambda: srt_jax.solve(batch, max_cells=room)}
    works |= {f"stage {name}": work for name, work in _stages(batch, room).items()}
    works |= {name: work for name, work in peers.items() if work}
    times, answers = _in_turn(works, repeats, len(case.tasks))
    stages = {
        name.removeprefix("stage "): ms["median"]
        for name, ms in times.items()
        if name.startswith("stage ")
    }
    stages["the rest"] = times["ours"]["median"] - sum(stages.values())
    return {
        "case": case.name,
        "size": case.size,
        "tasks": len(case.tasks),
        "one_core": times["ours"],
        "stages": stages,
        "peers": {name: {"ms": times.get(name), "gives": GIVES[name]} for name in peers},
        "agrees": _agrees(
            answers["ours"], answers.get("PY16 in C++"), is_same_removal="all" not in case.name
        ),
    }


def _stages(batch: Task, room: int) -> dict[str, Callable[[], Any]]:
    """What `solve` is made of, each stage jitted on its own: about what it costs inside."""
    import jax
    import jax.numpy as jnp

    from srt_jax.obstacles import all_open_cells
    from srt_jax.paths.blockage import find_blockage
    from srt_jax.removal.branch_and_bound import search_least

    among = jnp.ones(len(batch.start), bool)
    rooms = jnp.full(len(batch.start), room, jnp.int32)

    def removal(task: Task) -> Any:
        return search_least(task, rooms, among, capacity=room, max_nodes=64)

    def report(task: Task, reached: Any) -> Any:
        free = all_open_cells(task.labels, jnp.zeros_like(task.destroyable))
        num_obstacles = task.destroyable.shape[1]
        return find_blockage(
            task.labels,
            free,
            reached,
            task.goal,
            task.size,
            num_obstacles=num_obstacles,
            among=among,
        )

    removal_of, report_of = jax.jit(removal), jax.jit(report)
    reached = removal_of(batch).reached
    return {
        "proof, least removal, route": lambda: removal_of(batch),
        "seed, contour, objects": lambda: report_of(batch, reached),
    }


def _two_threads(case: Case, repeats: int) -> dict[str, Any]:
    import jax

    import srt_jax

    # an eager call cuts it into parts for all cores
    batch = jax.device_put(srt_jax.stack(case.tasks * 4))

    def work() -> Any:
        return jax.block_until_ready(srt_jax.solve(batch, max_cells=16 * case.size))

    times, _ = _in_turn({"two": work}, repeats, 4 * len(case.tasks))
    return {"two_threads": times["two"]}


def _in_turn(
    works: dict[str, Callable[[], Any]], repeats: int, tasks: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns milliseconds a task of each, taken in turn so that a busy machine hits all alike, and
    what each returned.
    """
    import jax

    from srt_jax.engine.reuse import only_own_shapes

    taken: dict[str, list[float]] = {name: [] for name in works}
    with only_own_shapes():
        answers = {name: jax.block_until_ready(work()) for name, work in works.items()}
        for _ in range(repeats):
            for name, work in works.items():
                began = time.perf_counter()
                jax.block_until_ready(work())
                taken[name].append(1e3 * (time.perf_counter() - began) / tasks)
    return {name: spread(times) for name, times in taken.items()}, answers


def _agrees(solution: Any, native: Any, *, is_same_removal: bool) -> bool | None:
    """Whether all tasks are solved and seed, contour and length are the C++ pipeline's; None where
    there is none.
    """
    if native is None:
        return None
    is_solved = (np.asarray(solution.status) == 1).all()
    seeds, contours, lengths = zip(*native)
    is_same = (np.asarray(solution.seed) == seeds).all() and (
        np.asarray(solution.contour) == np.stack(contours)
    ).all()
    if is_same_removal:
        is_same &= np.allclose(np.asarray(solution.cost), lengths, rtol=1e-5)
    return bool(is_solved and is_same)


def _cell(place: Any) -> tuple[int, int]:
    row, col = np.asarray(place).tolist()
    return row, col


def main() -> None:
    """Measures in this process and prints JSON: what `run` starts."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--threads",
        type=int,
        choices=(1, 2),
        default=1,
        help="1: one core, peers too; 2: ours alone",
    )
    parser.add_argument("--quick", action="store_true", help="small maps, few repeats")
    given = parser.parse_args()
    if given.threads == 1 and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    print(json.dumps(_measure(given.threads, given.quick)))


if __name__ == "__main__":
    main()
