"""How many branches the least removal needs where obstacles overlap or lie in parts.

    python -m experiments.campaigns.branches [--count 100] [--side 64] [--seed 0] [--branches 1 16
    64 256 1024]

A row per kind of task and number of branches: tasks to be opened, in how many cost exceeds the
proven bound, by how much on average over these, and the time of a second, compiled run for each
task of the kind.
"""

import argparse
import time

import numpy as np

from experiments.campaigns.inputs.labelled_maps import scattered, task_on, walled_tasks
from srt_jax import Task, solve_many
from srt_jax.instances.generate import generate


def tasks_of(count: int, side: int, seed: int) -> dict[str, list[Task]]:
    """Returns tasks by kind: those of the mixed kind in which obstacles overlap or lie in parts,
    and three harder ones.
    """
    kinds: dict[str, list[Task]] = {}
    for name, task, _ in generate("mixed", count=14 * count, size=side, seed=seed):
        kinds.setdefault(name[:-5], []).append(task)
    rng = np.random.default_rng([seed, 1])
    chosen = {
        kind: kinds[kind]
        for kind in ("rooms", "fences", "rings", "double-wall", "patched", "noise-in-parts")
    }
    chosen["scattered"] = [task_on(rng, scattered(rng, side, side, 16)) for _ in range(count)]
    for num_walls in (4, 6, 10):
        name = f"walls-{num_walls}"
        chosen[name] = walled_tasks(
            [seed, num_walls], count, side=side, num_obstacles=16, num_walls=num_walls
        )
    return chosen


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100, help="of each kind")
    parser.add_argument("--side", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--branches", type=int, nargs="+", default=[1, 16, 64, 256, 1024])
    options = parser.parse_args()
    # The tasks of each kind, and the head of the table.
    chosen = tasks_of(options.count, options.side, options.seed)
    print(
        "| kind | branches | to be opened | cost > bound | mean gap of these | ms a task"
        " |\n|---|---|---|---|---|---|"
    )
    for kind, tasks in chosen.items():
        for branches in options.branches:
            # The first run compiles, the second is timed.
            solve_many(tasks, max_destroyed=16, max_branches=branches)
            begin = time.perf_counter()
            solutions = solve_many(tasks, max_destroyed=16, max_branches=branches)
            each = 1e3 * (time.perf_counter() - begin) / len(tasks)
            cost, bound = (
                np.array([getattr(s, f) for s in solutions])
                for f in ("removal_cost", "removal_bound")
            )
            # How many answers are left without a proof, and by how much.
            is_blocked = np.isfinite(cost) & (cost > 0)
            is_open = is_blocked & (cost > bound * (1 + 1e-6))
            gap = (
                f"{100 * np.mean(cost[is_open] / bound[is_open] - 1):.0f} %"
                if is_open.any()
                else "-"
            )
            print(
                f"| {kind} | {branches} | {is_blocked.sum()} | {is_open.sum()} | {gap} |"
                f" {each:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
