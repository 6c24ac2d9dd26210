"""A thousand generated tasks, solved in batches, each answer judged: replayed, and compared with
SciPy.

    python -m experiments.campaigns.solver [--count 1000] [--size 64-500] [--seed 0] [--mode
    least|paper|literal] [--alone 64]

The tasks are those of `srt-jax generate mixed`, and overlapping obstacles in parts (scattered,
walled). Prints a row per kind: statuses, problems found by `check` (route, symbolic plan, proof),
reachability and lengths that differ from SciPy's (on the map as it is, and on the map with the
destroyed obstacles gone; for an unsolvable task, with all gone that can be destroyed), how often
cost exceeds the bound, and the proven optimum where the generator knows it. So many tasks are
solved once more, each
alone: every bit must be the same. Exit code 1 if anything differs.
"""

import argparse
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Sequence

import jax
import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from experiments.campaigns.inputs.labelled_maps import scattered, task_on, walled_tasks
from srt_jax import Solution, Status, Task, check, solve, solve_many
from srt_jax.instances.generate import Instance, generate

AT_ONCE = 2000
"""Tasks made, solved and judged at a time: their maps and answers fit the memory."""
OVERLAPS = 8
"""One in so many tasks has overlapping obstacles in parts."""


def shortest(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> float:
    """Returns SciPy's length of a shortest path, inf where there is none."""
    if not (free[start] and free[goal]):
        return np.inf
    regions = np.asarray(ndimage.label(free)[0])  # type: ignore[index]
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
    """Returns what `check` finds, and where SciPy disagrees; the greedy loop's route may be longer
    than the shortest.
    """
    start, goal = (tuple(np.asarray(end).tolist()) for end in (task.start, task.goal))
    status = Status(int(solution.status))
    found = check(task, solution)
    free = (task.labels == -1).all(axis=0)
    as_it_is = shortest(free, start, goal)
    if np.isfinite(as_it_is) != (status is Status.PATH_EXISTS):
        found.append(f"SciPy: {as_it_is}, status {status.name}")
    gone = solution.destroyed if status.is_solved else np.flatnonzero(task.destroyable)
    opened = (
        (task.labels == -1) | (np.isin(task.labels, gone[gone >= 0]) & (task.labels >= 0))
    ).all(axis=0)
    length = shortest(opened, start, goal) if free[start] else np.inf
    if status.is_solved and not (
        np.isclose(length, solution.cost, rtol=1e-5) or (is_greedy and length < solution.cost)
    ):
        found.append(f"SciPy: length {length}, ours {solution.cost}")
    if status in (Status.UNSOLVABLE, Status.GOAL_BLOCKED, Status.START_BLOCKED) and np.isfinite(
        length
    ):
        found.append(f"SciPy finds a way of length {length}, status {status.name}")
    return found


def make_tasks(first: int, count: int, size: tuple[int, int], seed: int) -> list[Instance]:
    """Returns the tasks from number `first` on: mixed ones, the last of each OVERLAPS with
    overlapping obstacles in parts.
    """
    others = count // OVERLAPS
    mixed = generate("mixed", count=count - others, size=size, seed=seed, first=first)
    rng, instances = np.random.default_rng([seed, first, 1]), []
    for index in range(first, first + others):
        side = int(rng.integers(size[0], size[1] + 1))
        if index % 2:
            (task,) = walled_tasks(
                [seed, index], 1, side=side, num_obstacles=12, num_walls=int(rng.integers(1, 7))
            )
        else:
            task = task_on(rng, scattered(rng, side, side, int(rng.integers(4, 17))))
        instances.append(
            (f"{'walled' if index % 2 else 'scattered'}-{index:04d}", task, float("nan"))
        )
    return [*mixed, *instances]


def differs_alone(task: Task, among: Solution, mode: str) -> bool:
    """Returns whether the task solved by itself has another answer than among others, in any
    bit.
    """
    alone = jax.tree.map(np.asarray, solve(task, mode=mode, max_destroyed=16))
    room = min(len(alone.cells), len(among.cells))
    pairs = (jax.tree.leaves(one.replace(cells=one.cells[:room])) for one in (alone, among))
    return any(a.tobytes() != np.asarray(b).tobytes() for a, b in zip(*pairs, strict=True))


def judge(
    instances: Sequence[Instance],
    solutions: Sequence[Solution],
    mode: str,
    rows: dict[str, Counter],
) -> int:
    """Counts into `rows`, tells what is wrong on standard error, and returns the number of answers
    with a problem.
    """
    num_wrong = 0
    for (name, task, optimum), solution in zip(instances, solutions):
        row, status = rows[name.rstrip("0123456789-")], Status(int(solution.status))
        row["tasks"] += 1
        row[status.name] += 1
        row["cost > bound"] += status.is_solved and bool(
            solution.removal_cost > solution.removal_bound * (1 + 1e-6)
        )
        problems = problems_with(task, solution, is_greedy=mode != "least")
        if mode == "least" and np.isfinite(optimum) and status.is_solved:
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
    return num_wrong


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--size", default="64-500")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", default="least", choices=("least", "paper", "literal"))
    parser.add_argument(
        "--alone", type=int, default=64, help="how many are solved once more, each alone"
    )
    options = parser.parse_args()
    low, _, high = options.size.partition("-")
    rows, num_wrong, num_alone, num_different = defaultdict(Counter), 0, 0, 0
    solving = judging = 0.0
    for first in range(0, options.count, AT_ONCE):
        # Solve many at once, and judge every answer.
        instances = make_tasks(
            first, min(AT_ONCE, options.count - first), (int(low), int(high or low)), options.seed
        )
        begin = time.perf_counter()
        solutions = solve_many(
            [task for _, task, _ in instances], mode=options.mode, max_destroyed=16
        )
        middle = time.perf_counter()
        num_wrong += judge(instances, solutions, options.mode, rows)
        solving, judging = solving + middle - begin, judging + time.perf_counter() - middle
        # Some of them once more, each alone: the same answer.
        answered = list(zip(instances, solutions))[
            :: max(1, options.count // max(1, options.alone))
        ]
        for (name, task, _), solution in answered[: max(0, options.alone - num_alone)]:
            num_alone += 1
            if differs_alone(task, solution, options.mode):
                num_different += 1
                print(f"{name}: another answer alone than among others", file=sys.stderr)
        print(
            f"{first + len(instances)} tasks: solved in {solving:.0f} s, judged in {judging:.0f} s",
            flush=True,
        )
    # The totals, by kind and altogether.
    for kind, row in sorted(rows.items()):
        print(f"{kind:16s}", ", ".join(f"{count} {name}" for name, count in row.items() if count))
    total = sum(rows.values(), Counter())
    print(f"{'all':16s}", ", ".join(f"{count} {name}" for name, count in total.items() if count))
    print(f"{num_different} of {num_alone} tasks have another answer alone than among others")
    print(f"{num_wrong} of {options.count} tasks with a problem")
    return int(num_wrong > 0 or num_different > 0)


if __name__ == "__main__":
    sys.exit(main())
