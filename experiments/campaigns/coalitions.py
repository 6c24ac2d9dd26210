"""Coalitions against slow twins, by the thousand, and how fast they are.

    python -m experiments.campaigns.coalitions [PART ...] [--seed 0] [--scale 1.0]

Parts; with none named all of them. Exit code 1 if anything differs.

- reach: 10,000 random tasks; what each agent reaches, alone and together, and what stands firm,
  against the slow twin.
- removal: 2,000 random tasks of 2 to 4 agents and up to 12 obstacles with overlaps against the
  enumeration of all sets: status, bound, optimum; every answer replayed.
- helpers: 1,000 generated tasks of 64x64 with 3 agents and 12 to 30 obstacles: every answer
  replayed, the plan valid in the exported domain, the messages those of the routes; MAP plans some.
- lone: 500 tasks of one agent against `solve`: status, costs, bound, length.
- alone: 40 tasks by themselves and in a batch: the same bits.
- planners: pyperplan and Fast Downward on the exported domains of the same 1,000 tasks, where
  installed (`pip install pyperplan up-fast-downward`): every plan replayed by ours, and by
  unified_planning where that is installed.
- speed: milliseconds of CPU time a task.
"""

import argparse
import importlib.util
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import jax
import numpy as np

import sign_model
from experiments.campaigns.inputs.coalition_tasks import lone_coalition, random_coalition
from experiments.campaigns.judges.tally import Tally
from srt_jax import Status, solve, stack
from srt_jax.coalition import (
    check_coalition,
    coalition_lines,
    coalition_messages,
    coalition_reach,
    coalition_texts,
    help_edges,
    helpers,
    make_coalition,
    planned_by_map,
    solve_coalition,
    stack_coalitions,
)
from srt_jax.coalition.task import on_one_map
from srt_jax.reference import coalition as twin

_BATCH = 500
_LIMIT = 60  # seconds that a planner has for a task
_STREETS = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data" / "street"


def reach(tally: Tally, seed: int, count: int) -> None:
    for first in range(0, count, _BATCH):
        rng = np.random.default_rng([seed, 0, first])
        tasks = [random_coalition(rng) for _ in range(min(_BATCH, count - first))]
        found = jax.tree.map(np.asarray, coalition_reach(stack_coalitions(tasks)))
        for index, task in enumerate(tasks):
            agents, obstacles = task.able.shape
            height, width = task.size
            title = f"task {first + index}"
            true = twin.coalition_reach(task.labels, task.able, task.start)
            cells = found.reached[index, :agents, :height, :width]
            tally.judge("cells reached together", (cells == true.reached).all(), title)
            who = found.destroys[index, :agents, :obstacles]
            tally.judge("who destroys what", (who == true.destroys).all(), title)
            firm = found.firm[index, :obstacles]
            tally.judge("what stands firm", (firm == true.firm).all(), title)
            for agent in range(agents):
                one = slice(agent, agent + 1)
                alone = twin.coalition_reach(task.labels, task.able[one], task.start[one])
                cells = found.alone[index, agent, :height, :width]
                tally.judge("cells reached alone", (cells == alone.reached[0]).all(), title)


def removal(tally: Tally, seed: int, count: int) -> None:
    proven = opened = 0
    for first in range(0, count, _BATCH):
        rng = np.random.default_rng([seed, 1, first])
        tasks = [
            random_coalition(rng, min_agents=2, max_obstacles=12, max_side=12)
            for _ in range(min(_BATCH, count - first))
        ]
        for index, (task, answer) in enumerate(answers(tasks)):
            title = f"task {first + index}"
            true = twin.coalition_removal(
                task.labels, task.able, task.removal_cost, task.start, task.goal
            )
            is_solved = Status(int(answer.status)).is_solved
            tally.judge("status", is_solved == np.isfinite(true.cost), title)
            tally.judge("bound", float(answer.removal_bound) <= true.cost, title)
            is_least = answer.removal_cost == answer.removal_bound
            proven, opened = proven + is_least, opened + (0 < true.cost < np.inf)
            if is_least:
                tally.judge("optimum where proven", float(answer.removal_cost) == true.cost, title)
            if is_solved and is_least:
                chosen = tuple(sorted(answer.destroyed[answer.destroyed >= 0].tolist()))
                tally.judge("set is one of the least", chosen in true.sets, title)
            problems = check_coalition(task, answer)
            tally.judge("replayed", not problems, f"{title}: {problems}")
    print(f"removal: proven {proven} of {count}; {opened} had to be opened", flush=True)


def helpers_of_64(tally: Tally, seed: int, count: int) -> None:
    proven = solved = mapped = 0
    for index, (task, answer) in enumerate(answers(tasks_of_64(seed, count), 30)):
        title = f"task {index}"
        problems = check_coalition(task, answer)
        tally.judge("replayed", not problems, f"{title}: {problems}")
        proven += answer.removal_cost == answer.removal_bound
        if not Status(int(answer.status)).is_solved:
            continue
        solved += 1
        told = {
            (m.speaker, m.listener, m.obstacle)
            for m in coalition_messages(task, answer)
            if m.act == "tell"
        }
        tally.judge("messages are those of the routes", told == set(help_edges(answer)), title)
        problem = sign_model.load(*coalition_texts(task, answer))
        wrong = sign_model.validate(problem, coalition_lines(task, answer))
        tally.judge("plan valid in the domain", not wrong, f"{title}: {wrong}")
        if index < 100:
            plan = planned_by_map(task, answer, max_expansions=20_000)
            mapped += bool(plan)
            if plan:
                tally.judge("MAP's plan valid", not sign_model.validate(problem, plan), title)
    print(
        f"helpers: {solved} solved, {proven} of {count} proven; MAP planned {mapped} of the first"
        " 100",
        flush=True,
    )


def lone(tally: Tally, seed: int, count: int) -> None:
    rng = np.random.default_rng([seed, 3])
    tasks = [lone_coalition(rng) for _ in range(count)]
    batch = stack([on_one_map(task) for task in tasks])
    single = jax.tree.map(np.asarray, solve(batch))
    for index, (_, answer) in enumerate(answers(tasks)):
        title = f"task {index}"
        for name in ("status", "removal_cost", "removal_bound"):
            same = getattr(answer, name) == getattr(single, name)[index]
            tally.judge(f"{name} as `solve` has it", bool(same), title)
        if Status(int(answer.status)).is_solved:
            tally.judge("length as `solve` has it", answer.cost[0] == single.cost[index], title)


def alone(tally: Tally, seed: int, count: int) -> None:
    rng = np.random.default_rng([seed, 4])
    tasks = [random_coalition(rng, min_agents=2) for _ in range(count)]
    batch = stack_coalitions(tasks)
    whole = jax.tree.map(np.asarray, solve_coalition(batch))
    for index in range(count):
        one = jax.tree.map(lambda array: array[index], batch)  # noqa: B023
        answer = jax.tree.map(np.asarray, solve_coalition(one))
        for name, array in answer.items():
            same = (array == getattr(whole, name)[index]).all()
            tally.judge("alone as in the batch", bool(same), f"task {index}: {name}")


def planners(tally: Tally, seed: int, count: int) -> None:
    pairs = list(answers(tasks_of_64(seed, count), 30))
    solved = [(t, a) for t, a in pairs if Status(int(a.status)).is_solved]
    by_other = _other_validator()
    for name, run in (("pyperplan", _pyperplan), ("Fast Downward", _fast_downward)):
        planned, late, most = 0, 0, 0.0
        for index, (task, answer) in enumerate(solved):
            domain, problem = coalition_texts(task, answer)
            begin = time.perf_counter()
            try:
                plan = run(domain, problem)
            except TimeoutError:
                late += 1
                continue
            if plan is None:
                print(f"planners: {name} is not installed: skipped", flush=True)
                break
            planned, most = planned + 1, max(most, time.perf_counter() - begin)
            wrong = sign_model.validate(sign_model.load(domain, problem), plan)
            tally.judge(f"{name}'s plan valid", not wrong, f"task {index}: {wrong}")
            if by_other is not None:
                is_valid = by_other(domain, problem, plan)
                tally.judge(f"{name}'s plan valid for unified_planning", is_valid, f"task {index}")
        print(
            f"planners: {name} planned {planned} of {len(solved)} solved of {count} tasks, {late}"
            f" past the limit of {_LIMIT} s; the slowest took {most:.1f} s",
            flush=True,
        )


def speed(tally: Tally, seed: int, count: int) -> None:
    rng = np.random.default_rng([seed, 6])
    streets = [_on_street(path, rng) for path in sorted(_STREETS.glob("*_256.map"))]
    if streets:
        batch = stack_coalitions((streets * 13)[:64])
        cost = _milliseconds(lambda: coalition_reach(batch), len(batch.size))
        print(f"speed: reach, 4 agents, streets of 256x256: {cost:.2f} ms of CPU a task")
    batch = stack_coalitions(tasks_of_64(seed, count))
    cost = _milliseconds(lambda: solve_coalition(batch, max_destroyed=16), count)
    print(
        f"speed: complete answers at 64x64, 3 agents: {cost:.2f} ms of CPU a task, that is"
        f" {2000 / cost:.0f} tasks a second on two cores",
        flush=True,
    )


def answers(tasks: list, max_destroyed: int = 12) -> Iterator[tuple]:
    """Yields each task with its answer, without the padding of the batch."""
    batch = stack_coalitions(tasks)
    whole = jax.tree.map(np.asarray, solve_coalition(batch, max_destroyed=max_destroyed))
    for index, task in enumerate(tasks):
        agents, obstacles = task.able.shape
        one = jax.tree.map(lambda array: array[index], whole)  # noqa: B023
        cut = {
            n: getattr(one, n)[:agents]
            for n in ("help", "cells", "num_cells", "needed", "cost", "finish")
        }
        yield task, one.replace(firm=one.firm[:obstacles], **cut)


def tasks_of_64(seed: int, count: int) -> list:
    """Tasks of 64x64, 3 agents, 12 to 30 obstacles."""
    kinds = ((3, 0.0), (3, 0.5), (4, 0.0), (4, 0.2))
    drawn = []
    for number, (rooms, doubled) in enumerate(kinds):
        part = (count + len(kinds) - 1 - number) // len(kinds)
        if part:
            made = helpers(count=part, size=64, seed=seed + number, rooms=rooms, doubled=doubled)
            drawn += [task for _, task, _ in made]
    return drawn


def _on_street(path: pathlib.Path, rng: np.random.Generator):
    rows = path.read_text().split("\n")[4:]
    free = np.array([[sign == "." for sign in row] for row in rows if row])
    cells = np.argwhere(free)
    ends = cells[rng.integers(0, len(cells), 8)]
    task = make_coalition(free, ends[:4], ends[4:])
    return task.replace(able=rng.random(task.able.shape) < 0.5)


def _milliseconds(run, count: int) -> float:
    """The median of five calls, of CPU time a task."""
    jax.block_until_ready(run())
    times = []
    for _ in range(5):
        begin = time.process_time()
        jax.block_until_ready(run())
        times.append((time.process_time() - begin) / count * 1e3)
    return sorted(times)[2]


def _pyperplan(domain: str, problem: str) -> list[str] | None:
    try:
        from pyperplan import planner  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None

    def too_late(*_: object) -> None:
        raise TimeoutError

    with tempfile.TemporaryDirectory() as folder:
        files = [pathlib.Path(folder, name) for name in ("domain.pddl", "problem.pddl")]
        for file, text in zip(files, (domain, problem)):
            file.write_text(text)
        before = signal.signal(signal.SIGALRM, too_late)
        signal.alarm(_LIMIT)
        try:
            found = planner.search_plan(
                *map(str, files), planner.SEARCHES["gbf"], planner.HEURISTICS["hff"]
            )
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, before)
    return [operator.name for operator in found]


def _fast_downward(domain: str, problem: str) -> list[str] | None:
    # the package itself needs unified_planning, the driver in it does not
    found = importlib.util.find_spec("up_fast_downward")
    if found is None or found.origin is None:
        return None
    (driver,) = list(pathlib.Path(found.origin).parent.rglob("fast-downward.py"))[:1]
    with tempfile.TemporaryDirectory() as folder:
        for name, text in (("domain.pddl", domain), ("problem.pddl", problem)):
            pathlib.Path(folder, name).write_text(text)
        command = [sys.executable, str(driver), "domain.pddl", "problem.pddl"]
        command += ["--search", "lazy_greedy([ff()])"]
        try:
            subprocess.run(command, cwd=folder, capture_output=True, check=True, timeout=_LIMIT)
        except subprocess.TimeoutExpired:
            raise TimeoutError from None
        lines = pathlib.Path(folder, "sas_plan").read_text().split("\n")
    return [line for line in lines if line.startswith("(")]


def _other_validator() -> Callable[[str, str, list[str]], bool] | None:
    """Whether a plan is valid, by unified_planning, which shares nothing with ours."""
    try:
        from unified_planning.engines import SequentialPlanValidator
        from unified_planning.io import PDDLReader
    except ImportError:
        return None

    def is_valid(domain: str, problem: str, plan: list[str]) -> bool:
        reader = PDDLReader()
        task = reader.parse_problem_string(domain, problem)
        found = reader.parse_plan_string(task, "\n".join(plan))
        return bool(SequentialPlanValidator().validate(task, found))

    return is_valid


_PARTS = {
    "reach": (reach, 10_000),
    "removal": (removal, 2_000),
    "helpers": (helpers_of_64, 1_000),
    "lone": (lone, 500),
    "alone": (alone, 40),
    "planners": (planners, 1_000),
    "speed": (speed, 256),
}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(_PARTS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scale", type=float, default=1.0, help="of the counts")
    options = parser.parse_args()
    unknown = [part for part in options.parts if part not in _PARTS]
    if unknown:
        parser.error(f"there is no part {unknown[0]!r}: choose from {', '.join(_PARTS)}")
    # Run the parts one after the other; each adds its checks to the tally.
    tally = Tally()
    for name in options.parts or _PARTS:
        part, count = _PARTS[name]
        tally.part = name
        begin = time.process_time()
        part(tally, options.seed, max(1, round(count * options.scale)))
        print(f"{name}: {time.process_time() - begin:.1f} s of CPU", flush=True)
    print(tally)
    return int(tally.num_wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
