"""The least removal against two exact solvers, on random labelled maps.

    python -m experiments.campaigns.removal [--count 2000] [--parts 200] [--seed 0]

Brute force over all sets of obstacles: `--count` maps up to 20x20 with up to 8 connected, disjoint
obstacles, where cost and bound must both be the optimum, and the route the shortest of all least
sets; as many with overlaps and obstacles in parts. Integer programming (SciPy's milp with cuts):
`--parts` such maps of 24x24 with 16 obstacles. There the optimum must lie between bound and cost,
and a gap is printed. Exit code 1 if anything differs.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from experiments.campaigns.inputs.labelled_maps import random_tasks, walled_tasks
from experiments.campaigns.judges.integer_programming import exact_removal
from srt_jax import Solution, Status, Task, check, solve_many
from srt_jax.reference.brute_force import brute_force_removal

Twin = Callable[[Task], tuple[float, float]]
"""Tells the least cost, and the length of the shortest route of such a set (NaN: unknown)."""


def by_brute_force(task: Task) -> tuple[float, float]:
    ends = (tuple(np.asarray(end).tolist()) for end in (task.start, task.goal))
    found = brute_force_removal(task.labels, task.destroyable, task.removal_cost, *ends)
    return found.cost, found.length


def by_milp(task: Task) -> tuple[float, float]:
    return exact_removal(task), float("nan")


def problems_with(task: Task, solution: Solution, optimum: float) -> list[str]:
    """Returns what is wrong with an answer of mode "least", given the optimum: bound <= optimum <=
    cost, a solution if any.
    """
    problems = check(task, solution)
    is_solved = Status(int(solution.status)).is_solved
    if is_solved != np.isfinite(optimum):
        problems.append(f"status {Status(int(solution.status)).name}, optimum {optimum}")
    if not solution.removal_bound <= optimum:
        problems.append(f"bound {solution.removal_bound} > optimum {optimum}")
    if is_solved and not solution.removal_cost >= optimum:
        problems.append(f"cost {solution.removal_cost} < optimum {optimum}")
    return problems


def compare(name: str, tasks: Sequence[Task], twin: Twin, *, is_exact: bool) -> int:
    """Prints how the answers compare, and returns how many are wrong; `is_exact`: cost and bound
    have to be the optimum.
    """
    begin = time.perf_counter()
    solutions = solve_many(tasks, max_destroyed=16)
    middle = time.perf_counter()
    optima = [twin(task) for task in tasks]
    end = time.perf_counter()
    wrong = 0
    for index, (task, solution, (optimum, _)) in enumerate(zip(tasks, solutions, optima)):
        problems = problems_with(task, solution, optimum)
        if (
            is_exact
            and np.isfinite(optimum)
            and not solution.removal_cost == solution.removal_bound == optimum
        ):
            problems.append(
                f"bound {solution.removal_bound}, cost {solution.removal_cost}, optimum {optimum}"
            )
        wrong += bool(problems)
        for problem in problems:
            print(f"{name} {index}: {problem}", file=sys.stderr)
    least, length = np.array(optima).T
    cost, bound, route = (
        np.array([getattr(s, f) for s in solutions])
        for f in ("removal_cost", "removal_bound", "cost")
    )
    is_solvable = np.isfinite(least)
    is_blocked = is_solvable & (least > 0)
    summary = (
        f"{len(tasks)} tasks, {(least == 0).sum()} open, {is_blocked.sum()} to be opened,"
        f" {(~is_solvable).sum()} unsolvable"
    )
    summary += (
        f"; cost is the optimum in {(cost == least)[is_blocked].sum()}, the bound in"
        f" {(bound == least)[is_blocked].sum()}"
    )
    summary += f", both proven in {(cost == bound)[is_blocked].sum()}"
    if np.isfinite(length[is_solvable]).all():
        longer = is_solvable & (cost == least) & (route > length * (1 + 1e-6))
        summary += f"; a route longer than that of the best least set in {longer.sum()}"
    print(
        f"{name}: {summary}; {wrong} wrong. Solved in {middle - begin:.1f} s, the other in"
        f" {end - middle:.1f} s",
        flush=True,
    )
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--parts", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    # Connected and disjoint obstacles: the answer is exact.
    sizes = {"max_side": 20, "max_obstacles": 8}
    seed, half = options.seed, options.count // 2
    whole = [
        *random_tasks([seed, 0], half, overlap=False, unit_costs=True, **sizes),
        *random_tasks([seed, 1], options.count - half, overlap=False, **sizes),
    ]
    wrong = compare("connected and disjoint, brute force", whole, by_brute_force, is_exact=True)
    # Overlaps and parts: the bound holds and the answer is no dearer than it says.
    parts = random_tasks([seed, 2], options.count, overlap=True, **sizes)
    wrong += compare("overlaps and parts, brute force", parts, by_brute_force, is_exact=False)
    # More obstacles than brute force can try: an integer program judges.
    scattered = random_tasks(
        [seed, 3], options.parts // 2, overlap=True, max_side=24, max_obstacles=20
    )
    walled = walled_tasks([seed, 4], options.parts - len(scattered))
    wrong += compare("overlaps and parts, milp", [*scattered, *walled], by_milp, is_exact=False)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
