"""A thousand generated tasks, solved in batches, each answer judged: replayed, and compared with SciPy.

    python -m experiments.campaign [--count 1000] [--size 64-500] [--seed 0] [--mode least|paper]

Prints a row per kind of task: statuses, problems found by `check`, reachability and lengths that differ from SciPy's (on the
map as it is, and on the map with the destroyed obstacles gone), the gap between removal cost and bound, and the proven optimum
where the generator knows it. Exit code 1 if anything differs.
"""

import argparse
import sys
import time
from collections import Counter, defaultdict

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from srt_jax import Status, check, solve_many
from srt_jax.generate import generate


def shortest(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """Returns SciPy's length of a shortest path, inf where there is none."""
    if not (free[start] and free[goal]):
        return np.inf
    regions = ndimage.label(free)[0]
    if regions[start] != regions[goal]:
        return np.inf
    height, width = free.shape
    cell = np.arange(height * width).reshape(height, width)
    whole = free[:-1, :-1] & free[1:, 1:] & free[:-1, 1:] & free[1:, :-1]
    moves = [
        (cell[:, :-1], cell[:, 1:], free[:, :-1] & free[:, 1:], 1.0),
        (cell[:-1], cell[1:], free[:-1] & free[1:], 1.0),
        (cell[:-1, :-1], cell[1:, 1:], whole, 2**0.5),
        (cell[:-1, 1:], cell[1:, :-1], whole, 2**0.5),
    ]
    ends = np.concatenate([np.stack([a[legal], b[legal]]) for a, b, legal, _ in moves], axis=1)
    costs = np.concatenate([np.full(legal.sum(), cost) for _, _, legal, cost in moves])
    graph = sparse.coo_matrix((costs, tuple(ends)), (height * width,) * 2).tocsr()
    return float(dijkstra(graph, directed=False, indices=cell[start])[cell[goal]])


def problems_with(task, solution, *, is_greedy: bool) -> list[str]:
    """Returns what `check` finds, and where SciPy disagrees; the greedy loop's route may be longer than the shortest."""
    start, goal = (tuple(np.asarray(end).tolist()) for end in (task.start, task.goal))
    status = Status(int(solution.status))
    found = check(task, solution)
    free = (task.labels == -1).all(axis=0)
    as_it_is = shortest(free, start, goal)
    if np.isfinite(as_it_is) != (status is Status.PATH_EXISTS):
        found.append(f"SciPy: {as_it_is}, status {status.name}")
    gone = solution.destroyed if status.is_solved else np.flatnonzero(task.destroyable)
    opened = ((task.labels == -1) | (np.isin(task.labels, gone[gone >= 0]) & (task.labels >= 0))).all(axis=0)
    length = shortest(opened, start, goal) if free[start] else np.inf
    if status.is_solved and not (np.isclose(length, solution.cost, rtol=1e-5) or (is_greedy and length < solution.cost)):
        found.append(f"SciPy: length {length}, ours {solution.cost}")
    if status in (Status.UNSOLVABLE, Status.GOAL_BLOCKED, Status.START_BLOCKED) and np.isfinite(length):
        found.append(f"SciPy finds a way of length {length}, status {status.name}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--size", default="64-500")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", default="least", choices=("least", "paper"))
    options = parser.parse_args()
    low, _, high = options.size.partition("-")
    begin = time.perf_counter()
    instances = generate("mixed", count=options.count, size=(int(low), int(high or low)), seed=options.seed)
    print(f"generated {len(instances)} tasks in {time.perf_counter() - begin:.1f} s", flush=True)
    begin = time.perf_counter()
    solutions = solve_many([task for _, task, _ in instances], mode=options.mode, max_destroyed=16)
    print(f"solved in {time.perf_counter() - begin:.1f} s, compiling included", flush=True)
    rows, num_wrong = defaultdict(Counter), 0
    for (name, task, optimum), solution in zip(instances, solutions):
        row, status = rows[name.rstrip("0123456789-")], Status(int(solution.status))
        row["tasks"] += 1
        row[status.name] += 1
        row["gap"] += status.is_solved and bool(solution.removal_cost > solution.removal_bound * (1 + 1e-6))
        problems = problems_with(task, solution, is_greedy=options.mode == "paper")
        if options.mode == "least" and np.isfinite(optimum) and status.is_solved:
            row["optimum known"] += 1
            row["above optimum"] += bool(solution.removal_cost > optimum * (1 + 1e-6))
            problems += [f"bound {solution.removal_bound} > optimum {optimum}"] * bool(
                solution.removal_bound > optimum * (1 + 1e-6)
            )
        if np.isinf(optimum) and status.is_solved:
            problems.append("solved, though proven unsolvable")
        row["wrong"] += bool(problems)
        num_wrong += bool(problems)
        for problem in problems:
            print(f"{name}: {problem}", file=sys.stderr)
    for kind, row in sorted(rows.items()):
        print(f"{kind:16s}", ", ".join(f"{count} {name}" for name, count in row.items() if count))
    print(f"{num_wrong} of {len(instances)} tasks with a problem")
    return int(num_wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
