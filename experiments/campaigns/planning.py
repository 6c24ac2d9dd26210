"""Every planning task with a known answer, and many without one, each answer judged: the bars of
MAP in one run.

    python -m experiments.campaigns.planning [--data DIR] [--random 2000] [--others 200] [--seconds
    30]

Prints a row per part: known optima (blocks, hanoi, ferry, goldminer of the outside data; `--data`
or SRT_SHARED_DATA/pddl), domains that are not in that folder against A* with h_max, random STRIPS
tasks against breadth-first search, and what experience does to other tasks. Exit code 1 if an
answer is wrong.
"""

import argparse
import csv
import dataclasses
import os
import pathlib
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator

import numpy as np

from experiments.data.pddl_domains import OTHER_DOMAINS
from sign_model import Memory, PlanStatus, load, plan, plan_batch, validate
from sign_model.blocks import random_blocks_tasks
from sign_model.experience.learn import learn
from sign_model.map_algorithm.heuristics import HeuristicSign
from sign_model.pddl.planning_task import PlanningTask, task_from_arrays

Problems = list[str]


def known_optima(
    folder: pathlib.Path, seconds: float, sign: HeuristicSign | None
) -> Iterator[tuple[str, Problems]]:
    """Blocks up to 20 blocks, hanoi to 8 discs, ferry and goldminer: solved, replayed, and how near
    the optimum.
    """
    optima: dict[str, int] = {}
    for name, column, prefix in (
        ("fd_optimal.csv", "optimal_steps_if_unit_cost", ""),
        ("blocks_optimal.csv", "optimal_steps", "blocks/"),
    ):
        with open(folder / name, encoding="utf-8") as file:
            optima |= {prefix + row["file"]: int(row[column]) for row in csv.DictReader(file)}
    for domain in ("blocks", "hanoi", "ferry", "goldminer") if sign is None else ("blocks",):
        wrong, ratios, slowest = [], [], 0.0
        for name, optimum in ((n, o) for n, o in optima.items() if n.startswith(domain)):
            task, began = load(folder / domain / "domain.pddl", folder / name), time.perf_counter()
            result = plan(task, heuristic=sign, max_seconds=seconds)
            slowest = max(slowest, time.perf_counter() - began)
            wrong += (
                [f"{name}: {problem}" for problem in validate(task, result.actions)]
                if result.is_solved
                else [f"{name}: not solved"]
            )
            if len(result.actions) < optimum and result.is_solved:
                wrong.append(
                    f"{name}: {len(result.actions)} steps, shorter than the proven optimum"
                    f" {optimum}"
                )
            if result.is_solved:
                ratios.append(len(result.actions) / optimum)
        used = "unlearned" if sign is None else "learned"
        yield (
            (
                f"{domain}, {used}: {len(ratios)} solved, length / optimum {np.mean(ratios):.3f},"
                f" worst {max(ratios):.2f}, optimal {np.mean(np.array(ratios) == 1):.0%}, slowest"
                f" {slowest:.2f} s"
            ),
            wrong,
        )


def large_blocks(folder: pathlib.Path) -> Iterator[tuple[str, Problems]]:
    """The tasks of 25 and more blocks: time and length."""
    for path in sorted(folder.glob("blocks/probBLOCKS-*.pddl")):
        blocks = int(path.stem.split("-")[1])
        if blocks >= 25:
            began = time.perf_counter()
            task = load(folder / "blocks" / "domain.pddl", path)
            result = plan(task)
            summary = (
                f"{path.stem}: {len(result.actions)} steps, {time.perf_counter() - began:.1f} s"
                " in all"
            )
            yield (
                summary,
                (
                    validate(task, result.actions)
                    if result.is_solved
                    else [f"{path.stem}: not solved"]
                ),
            )


def other_domains(seconds: float) -> Iterator[tuple[str, Problems]]:
    """Domains that are not in the outside data: lengths beside A* with h_max, one by one and in one
    batch.
    """
    tasks = {name: load(domain, problem) for name, (domain, problem) in OTHER_DOMAINS.items()}
    batch = dict(zip(tasks, plan_batch(list(tasks.values()))))
    for name, task in tasks.items():
        began = time.perf_counter()
        result = plan(task, max_seconds=seconds)
        took = time.perf_counter() - began
        best = plan(
            task, planner="astar", heuristic="hmax", max_expansions=50_000, max_seconds=seconds
        )
        wrong = [
            f"{name}: {problem}"
            for r in (result, batch[name])
            for problem in (validate(task, r.actions) if r.is_solved else [])
        ]
        if best.status != PlanStatus.BUDGET_SPENT:
            wrong += [
                f"{name}: {r.status.name}, A* says {best.status.name}"
                for r in (result, batch[name])
                if r.status != best.status
            ]
        elif not (result.is_solved and batch[name].is_solved):
            wrong.append(f"{name}: {result.status.name}, in a batch {batch[name].status.name}")
        optimum = len(best.actions) if best.is_solved else best.status.name
        lengths = (
            f"{len(result.actions)} steps, in a batch {len(batch[name].actions)}, A* {optimum}"
        )
        yield f"{name}: {result.status.name}, {lengths}, {took:.2f} s", wrong


def random_strips(count: int) -> Iterator[tuple[str, Problems]]:
    """Solvability of random tasks as breadth-first search finds it, alone and in batches; plans
    replayed.
    """
    tasks, wrong, solvable = [random_task(seed) for seed in range(count)], [], 0
    batch = plan_batch(tasks)
    for seed, (task, together) in enumerate(zip(tasks, batch)):
        has_plan = is_solvable(task)
        solvable += has_plan
        for where, result in (("alone", plan(task)), ("in a batch", together)):
            if result.is_solved != has_plan or (
                not has_plan and result.status != PlanStatus.UNSOLVABLE
            ):
                wrong.append(
                    f"random task {seed} {where}: {result.status.name}, breadth-first search:"
                    f" {has_plan}"
                )
            if result.is_solved:
                wrong += [
                    f"random task {seed} {where}: {problem}"
                    for problem in validate(task, result.actions)
                ]
    yield (
        (
            f"{count} random STRIPS tasks, {solvable} of them solvable, agree with breadth-first"
            " search"
        ),
        wrong,
    )


def random_task(seed: int) -> PlanningTask:
    """A task of up to 12 features and 10 actions with few conditions and effects."""
    rng = np.random.default_rng(seed)
    num_features, num_actions = int(rng.integers(1, 13)), int(rng.integers(0, 11))

    def few(most: int) -> np.ndarray:
        rows = np.zeros((num_actions, num_features), bool)
        for row in rows:
            row[rng.integers(0, num_features, rng.integers(0, most + 1))] = True
        return rows

    goal = np.zeros(num_features, bool)
    goal[rng.integers(0, num_features, rng.integers(1, 4))] = True
    return task_from_arrays(few(3), few(2), few(3), rng.random(num_features) < 0.3, goal)


def is_solvable(task: PlanningTask) -> bool:
    """Returns what breadth-first search over sets of features finds."""
    rows = [
        [frozenset(np.flatnonzero(row)) for row in m]
        for m in (task.conditions, task.adds, task.deletes)
    ]
    start, goal = frozenset(np.flatnonzero(task.start)), frozenset(np.flatnonzero(task.goal))
    queue, seen = deque([start]), {start}
    while queue:
        state = queue.popleft()
        if goal <= state:
            return True
        for needs, gives, takes in zip(*rows):
            after = (state - takes) | gives
            if needs <= state and after not in seen:
                seen.add(after)
                queue.append(after)
    return False


def experience(count: int) -> Iterator[tuple[str, Problems]]:
    """Repeated tasks take one iteration; other tasks are solved no worse and no less often than
    without a memory.
    """
    memory, wrong, one = Memory(), [], 0
    known = random_blocks_tasks(5, count, seed=1)
    for task in known:
        memory = memory.learned(task, plan(task).actions)
    for number, task in enumerate(known):
        again = plan(task, memory=memory)
        one += again.expansions == 1 or not again.actions
        wrong += [f"repeated task {number}: {problem}" for problem in validate(task, again.actions)]
    worse = shorter = 0
    for number, task in enumerate(
        random_blocks_tasks(5, count // 2, seed=2)
        + random_blocks_tasks(6, count - count // 2, seed=3)
    ):
        without, result = plan(task), plan(task, memory=memory)
        wrong += [f"other task {number}: {problem}" for problem in validate(task, result.actions)]
        is_worse = result.status > without.status or len(result.actions) > len(without.actions)
        worse, shorter = worse + is_worse, shorter + (len(result.actions) < len(without.actions))
        wrong += [f"other task {number}: worse after experience"] if is_worse else []
    yield (
        (
            f"experience of {count} tasks: repeated in one iteration {one}; {count} others: {worse}"
            f" worse, {shorter} shorter"
        ),
        wrong,
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--data",
        type=pathlib.Path,
        default=pathlib.Path(os.environ.get("SRT_SHARED_DATA", "")) / "pddl",
    )
    parser.add_argument("--random", type=int, default=2000)
    parser.add_argument("--others", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=30.0)
    given = parser.parse_args()
    # The parts that need no data; then those on tasks with known optima, where these are there.
    parts: list[Callable[[], Iterator[tuple[str, Problems]]]] = [
        lambda: other_domains(given.seconds)
    ]
    parts += [lambda: random_strips(given.random), lambda: experience(given.others)]
    if (given.data / "fd_optimal.csv").is_file():
        began = time.perf_counter()
        sign = learn(random_blocks_tasks(6, 1024, seed=100))
        print(
            f"learned on 1,024 tasks of 6 blocks in {time.perf_counter() - began:.1f} s:"
            f" {dataclasses.asdict(sign)}",
            flush=True,
        )
        parts += [
            lambda: known_optima(given.data, given.seconds, None),
            lambda: known_optima(given.data, given.seconds, sign),
        ]
        parts += [lambda: large_blocks(given.data)]
    # Each part yields summaries with what was wrong.
    total = 0
    for part in parts:
        for summary, wrong in part():
            print(summary, *wrong[:5], sep="\n  ", flush=True)
            total += len(wrong)
    print(f"{total} problems")
    return int(total > 0)


if __name__ == "__main__":
    sys.exit(main())
