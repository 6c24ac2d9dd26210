"""Break or go round against brute force over all sets of obstacles, on random labelled maps.

    python -m experiments.campaigns.tolls [--count 2000] [--seed 0]

A fifth each of maps up to 12 x 12 with rectangles, connected obstacles, combs and frames, obstacles
that overlap or lie in pieces, and rectangles among combs; up to 7 of them, tolls from 0 to 20 cell
sides. A search of its own for every set gives the optimum. Judged are the status, the bound, the
total where it says that it is proven, the bound after one search (which must be tight on
rectangles), the replay by `check`; that the answer is the shortest path with everything gone where
tolls are 0, and the least removal where they are high; that a task alone has the bits of the batch;
the field of sums, cell by cell; and the derivatives. Exit code 1 if anything differs.
"""

import argparse
import sys
import time

import jax
import numpy as np

from experiments.campaigns.inputs.tolled_maps import KINDS, tolled_tasks
from experiments.campaigns.judges.tally import Tally, progress
from srt_jax import Solution, Status, Task, check, shortest_path, solve, solve_many, toll_to_come
from srt_jax.reference.tolls import Best, brute_force_total, least_sums

_NEAR = 2e-5
"""Relative: a float32, and tolls rounded to units."""

_HIGH = 1000.0
_SAME = ("status", "cost", "total", "total_bound", "removal_cost", "removal_bound", "destroyed")


def is_near(one: float, other: float) -> bool:
    """Whether two lengths agree up to rounding; both may be inf."""
    return bool(one == other or abs(one - other) <= _NEAR * max(1.0, abs(other)))


def judge(tally: Tally, title: str, task: Task, toll: float, answer: Solution, best: Best) -> None:
    """Judges one answer by the optimum."""
    status = Status(int(answer.status))
    tally.judge(
        "replay", not (p := check(task, answer, mode="shortest", toll=toll)), f"{title} {p}"
    )
    tally.judge(
        "status", status.is_solved == bool(np.isfinite(best.total)), f"{title} {status.name}"
    )
    total, bound = float(answer.total), float(answer.total_bound)
    if not status.is_solved:
        tally.judge("bound is inf without a way", bound == np.inf, title)
        return
    slack = _NEAR * max(1.0, best.total)
    words = f"{title}: bound {bound}, total {total}, optimum {best.total} by {best.destroyed}"
    tally.judge("bound <= optimum <= total", bound - slack <= best.total <= total + slack, words)
    tally.judge("bound <= total", bound <= total, words)
    if bound == total:
        tally.judge("optimum where proven", is_near(total, best.total), words)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    tally, proven, broken, took = Tally(), 0, 0, [0.0, 0.0]
    each = -(-options.count // len(KINDS))
    for number, kind in enumerate(KINDS):
        tally.part = kind
        tasks, tolls = tolled_tasks([options.seed, number], each, kind)
        # The answers, and those of the limits.
        begin = time.perf_counter()
        room = {"max_destroyed": 8}
        answers = solve_many(tasks, mode="shortest", toll=tolls, **room)
        took[0] += time.perf_counter() - begin
        firsts = solve_many(tasks, mode="shortest", toll=tolls, max_branches=1, **room)
        frees = solve_many(tasks, mode="shortest", toll=0.0, **room)
        highs = solve_many(tasks, mode="shortest", toll=_HIGH, **room)
        leasts = solve_many(tasks, **room)
        for index in progress(kind, range(len(tasks)), len(tasks)):
            task, toll, answer = tasks[index], float(tolls[index]), answers[index]
            title = f"task {index}, toll {toll:g}"
            ends = (tuple(end.tolist()) for end in (task.start, task.goal))
            price = (task.removal_cost * tolls[index]).astype(float)
            begin = time.perf_counter()
            best = brute_force_total(task.labels, task.destroyable, price, *ends)
            took[1] += time.perf_counter() - begin
            judge(tally, title, task, toll, answer, best)
            proven += bool(answer.total == answer.total_bound)
            broken += int(answer.status) == Status.BROKE_THROUGH
            judge_first(tally, title, kind, firsts[index], best)
            judge_limits(tally, title, task, frees[index], highs[index], leasts[index])
            judge_sums(tally, title, task, price)
            if index % 20 == 0:
                alone = solve(task, mode="shortest", toll=toll, **room)
                same = all(
                    (np.asarray(getattr(alone, n)) == getattr(answer, n)).all() for n in _SAME
                )
                tally.judge("alone as in the batch", same, title)
    print(tally)
    number = each * len(KINDS)
    print(
        f"{number} tasks: {proven} totals proven, {broken} times broken through though a path"
        f" exists. Solved in {took[0]:.1f} s, brute force in {took[1]:.1f} s"
    )
    return int(tally.num_wrong > 0)


def judge_first(tally: Tally, title: str, kind: str, first: Solution, best: Best) -> None:
    """The bound after one search."""
    if np.isfinite(best.total):
        slack = _NEAR * max(1.0, best.total)
        words = f"{title}: {first.total_bound}, optimum {best.total}"
        tally.judge("bound of one search", float(first.total_bound) <= best.total + slack, words)
        if kind == "rectangles":
            is_tight = is_near(float(first.total_bound), best.total)
            tally.judge("tight at once on rectangles", is_tight, words)


def judge_limits(
    tally: Tally, title: str, task: Task, free: Solution, high: Solution, least: Solution
) -> None:
    """Tolls of 0 give the shortest path with everything gone, high ones the least removal."""
    gone = np.append(task.destroyable, [False, True])  # entries of -2 and -1 at the end
    openable = gone[task.labels].all(axis=0)
    is_free = (task.labels == -1).all(axis=0)[tuple(task.start)]
    length = float(shortest_path(openable, task.start, task.goal).cost) if is_free else np.inf
    tally.judge("tolls of 0: shortest path", float(free.cost) == length, f"{title}: {free.cost}")
    same = high.removal_cost == least.removal_cost
    tally.judge("high tolls: mode least", bool(same), f"{title}: {high.removal_cost}")
    tally.judge("high tolls: length", high.cost <= least.cost, f"{title}: {high.cost}")
    tally.judge("removal bound of mode least", high.removal_bound <= least.removal_cost, title)


def judge_sums(tally: Tally, title: str, task: Task, price: np.ndarray) -> None:
    """The field of sums, in whole units."""
    toll = np.where(task.destroyable, price, np.inf).astype(np.float32)
    found = jax.device_get(toll_to_come(task.labels, toll, task.start))
    true = least_sums(task.labels, toll, tuple(task.start.tolist()))
    units = [np.where(np.isfinite(x), np.round(x.astype(float) * 5741), -1) for x in (found, true)]
    tally.judge("sums of every cell", bool((units[0] == units[1]).all()), title)


if __name__ == "__main__":
    sys.exit(main())
