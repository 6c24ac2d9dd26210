"""Thousands of random tasks: every answer without a route to the goal has an approach that `check`
walks.

    python -m experiments.campaigns.approach [--count 10000] [--seed 0] [--truth 500]

The tasks are small ones with obstacles connected, overlapping or in segments of walls, and those of
`srt-jax generate mixed` (64 to 256 cells a side); in some the start, the goal or both lie inside
obstacles or outside the map. `check` walks the approach of every task, solved or not, on floods of
its own. Of so many tasks the route is compared cell by cell with the slow twin in
`srt_jax.reference`, and found once more alone: every bit must be the same. Prints a row per
status.
Exit code 1 if anything differs.
"""

import argparse
import sys
import time
from collections import Counter

import jax
import numpy as np

from experiments.campaigns.inputs.labelled_maps import random_tasks, walled_tasks
from experiments.campaigns.judges.tally import progress
from srt_jax import Status, Task, approach, check, solve, stack
from srt_jax.instances.generate import generate
from srt_jax.reference.approach import approach as slow_approach
from srt_jax.types import FREE

AT_ONCE = 250
LARGE = 5
"""One in so many batches holds large maps."""
_MOST_CELLS = 1 << 12
"""Of a map that the slow twin takes."""


def make_batch(number: int, count: int, seed: int) -> Task:
    """Returns so many tasks as one batch; every fourth has ends that lie anywhere."""
    rng = np.random.default_rng([seed, number])
    if number % LARGE == LARGE - 1:
        made = generate("mixed", count=count, size=(64, 256), seed=seed, first=number * AT_ONCE)
        batch = stack([task for _, task, _ in made])
    else:
        tasks = random_tasks(
            [seed, number], count // 3, overlap=False, max_side=32, can_destroy=0.3
        )
        tasks += random_tasks([seed, number, 1], count // 3, overlap=True, max_side=32)
        tasks += walled_tasks([seed, number, 2], count - len(tasks), side=24)
        batch = stack(tasks)
    is_moved = np.arange(count) % 4 == 0
    anywhere = rng.integers(-3, batch.size + 3, (2, count, 2)).astype(np.int32)
    which = rng.random((2, count, 1)) < 0.7
    return batch.replace(
        start=np.where(is_moved[:, None] & which[0], anywhere[0], batch.start),
        goal=np.where(is_moved[:, None] & which[1], anywhere[1], batch.goal),
        # as it may be: some tasks cannot be solved at all
        destroyable=batch.destroyable & (rng.random(batch.destroyable.shape) < 0.6),
    )


def differs_from_truth(task: Task, near) -> str:
    """Returns what the slow twin or the same task alone has otherwise; "" where nothing."""
    free = (np.asarray(task.labels) == FREE).all(axis=0)
    start, goal = tuple(task.start.tolist()), tuple(task.goal.tolist())
    if free.size <= _MOST_CELLS:
        cells = [tuple(cell) for cell in near.cells[: near.num_cells].tolist()]
        if cells != slow_approach(free, start, goal):
            return "the slow twin has another route"
    alone = jax.tree.map(np.asarray, approach(task, max_cells=len(near.cells)))
    same = jax.tree.map(lambda a, b: a.tobytes() == b.tobytes(), alone, near)
    return "" if all(jax.tree.leaves(same)) else "another route alone than among others"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--truth", type=int, default=500, help="tasks compared with the slow twin")
    options = parser.parse_args(argv)
    rows, moved, num_wrong, compared = Counter[str](), Counter[str](), 0, 0
    begin = time.process_time()
    firsts = range(0, options.count, AT_ONCE)
    every = max(1, options.count // max(1, options.truth))
    for first in progress("batches", firsts, len(firsts)):
        # All answers of a batch, replayed together with their approaches.
        count = min(AT_ONCE, options.count - first)
        batch = make_batch(first // AT_ONCE, count, options.seed)
        solutions, near = jax.tree.map(np.asarray, (solve(batch), approach(batch)))
        wrong = check(batch, solutions, mode="least", approach=near)
        num_wrong += len(wrong)
        for problem in wrong:
            print(f"from {first} on, {problem}", file=sys.stderr)
        for index in range(count):
            status = Status(int(solutions.status[index]))
            rows[status.name] += 1
            moved[status.name] += bool((near.begin[index] != batch.start[index]).any())
            if not status.is_solved and near.num_cells[index] == 0:
                is_free = (batch.labels[index] == FREE).all(axis=0).any()
                num_wrong += bool(is_free)
                rows["without a free cell"] += 1
        # Some against the slow twin, and alone.
        for index in range(0, count, every):
            task, found = jax.tree.map(lambda array, i=index: array[i], (batch, near))
            problem = differs_from_truth(task, found)
            compared, num_wrong = compared + 1, num_wrong + bool(problem)
            if problem:
                print(f"task {first + index}: {problem}", file=sys.stderr)
    for name, number in sorted(rows.items()):
        print(f"{name:20s}{number:7d}  begins elsewhere than in the start: {moved[name]}")
    seconds = time.process_time() - begin
    print(f"{compared} tasks compared with the slow twin and alone")
    print(f"{num_wrong} problems in {options.count} tasks, {seconds:.0f} s of processor time")
    return int(num_wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
