"""`srt-jax bench plan`: lengths against known optima, throughput, learning, cold start, beside
peers in own processes.
"""

import csv
import importlib.util
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import numpy as np

from sign_model.blocks import DOMAIN, optimal_length, problem_text, random_blocks_tasks, state_of
from sign_model.experience.learn import learn
from sign_model.map_algorithm.heuristics import HeuristicSign
from sign_model.map_batch.ladder import TOGETHER, plan_batch
from sign_model.pddl.grounding import load
from sign_model.pddl.lifted import Problem
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan

_SECONDS_A_ROW = 15.0


def run(
    quick: bool = False,
    *,
    data: str | os.PathLike | None = None,
    log: Callable[[str], None] = lambda message: None,
) -> dict[str, Any]:
    """Returns {"machine", "learning", "random_blocks" [...], "known_optima" [...], "cold_start",
    "peers" [...], "missing": names of peers not installed}.

    Args:
      quick: fewer and smaller tasks, under a minute on idle cores; else about three.
      data: a folder with blocks/, hanoi/, ferry/ and goldminer/ and `fd_optimal.csv`; the
        environment's SRT_SHARED_DATA/pddl where None. Without it the known optima are those of
        random blocks tasks alone.
      log: receives a line on each step of the work.
    """
    began = time.perf_counter()
    training = random_blocks_tasks(6, 256 if quick else 1024, seed=100)
    sign = learn(training, generations=10 if quick else 30, log=log)
    learning = {
        "seconds": time.perf_counter() - began,
        "tasks": len(training),
        "blocks": 6,
        "sign": _as_dict(sign),
    }
    sizes = {8: 1024} if quick else {8: 4096, 10: 4096, 15: 2048}
    folder = (
        pathlib.Path(data)
        if data is not None
        else pathlib.Path(os.environ.get("SRT_SHARED_DATA", "")) / "pddl"
    )
    return {
        "machine": {
            "jax": jax.__version__,
            "numpy": np.__version__,
            "python": platform.python_version(),
            "cores": os.cpu_count(),
        },
        "learning": learning,
        "random_blocks": [
            _throughput(n, count, chosen, log)
            for n, count in sizes.items()
            for chosen in (sign, None)
        ],
        "known_optima": (
            list(_known_optima(folder, sign, quick, log))
            if (folder / "fd_optimal.csv").is_file()
            else []
        ),
        "cold_start": _cold_start(),
        "peers": list(_peers(3 if quick else 10, log)),
        "missing": [
            peer
            for peer in ("pyperplan", "Fast Downward")
            if not any(name.startswith(peer) for name in _peer_commands())
        ],
    }


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text."""
    learning = result["learning"]
    facts = result["machine"]
    lines = [
        (
            f"jax {facts['jax']}, numpy {facts['numpy']}, Python {facts['python']},"
            f" {facts['cores']} cores; medians (quartiles)"
        ),
        (
            f"learning on {learning['tasks']} tasks of {learning['blocks']} blocks:"
            f" {learning['seconds']:.1f} s"
        ),
    ]
    for row in result["random_blocks"]:
        lines.append(
            f"{row['blocks']:3d} blocks, {row['sign']:9s} {row['tasks_a_second']:9,.0f} tasks/s"
            f" ({row['quartiles'][0]:,.0f}-{row['quartiles'][1]:,.0f}),"
            f" {row['tasks_a_cpu_second']:,.0f} a second of CPU, solved {row['solved']:.2%}, length"
            f" / optimum {row['ratio']:.3f}, optimal {row['optimal']:.1%}, compile"
            f" {row['compile_seconds']:.1f} s"
        )
    for row in result["known_optima"]:
        lines.append(
            f"{row['domain']:10s} {row['sign']:9s} solved {row['solved']} of {row['tasks']}, length"
            f" / optimum {row['ratio']:.3f} (worst {row['worst']:.2f}), optimal"
            f" {row['optimal']:.0%}, slowest {row['slowest_seconds']:.2f} s"
        )
    cold = result["cold_start"]
    lines.append(
        f"cold start (import, parse, plan, replay; 6 blocks): {cold['seconds']:.2f} s,"
        f" {cold['cpu_seconds']:.2f} s of CPU"
    )
    for row in result["peers"]:
        lines.append(
            f"{row['blocks']} blocks, {row['name']:28s} solved {row['solved']} of {row['tasks']}, "
            f"length / optimum {row['ratio']:.2f}, {row['seconds']:.3f} s each "
            f"({row['quartiles'][0]:.3f}-{row['quartiles'][1]:.3f})"
        )
    lines += [
        f"{name} is not installed and left out (the extra bench brings it)"
        for name in result["missing"]
    ]
    return "\n".join(lines)


def _as_dict(sign: HeuristicSign) -> dict[str, Any]:
    return {"landmarks": dict(sign.landmarks), "held": dict(sign.held), "unmet": dict(sign.unmet)}


def _problem(task: PlanningTask) -> Problem:
    assert task.problem is not None  # random tasks have one
    return task.problem


def _optima(tasks: list[PlanningTask], num_blocks: int) -> np.ndarray:
    problems = map(_problem, tasks)
    return np.array(
        [
            optimal_length(state_of(p.start, num_blocks), state_of(p.goal, num_blocks))
            for p in problems
        ]
    )


def _throughput(
    num_blocks: int, count: int, sign: HeuristicSign | None, log: Callable[[str], None]
) -> dict[str, Any]:
    """Random tasks through `plan_batch`: packing, search, replay and results counted, compilation
    apart; the median run.
    """
    tasks, seconds, cpu_seconds = random_blocks_tasks(num_blocks, count, seed=1), [], []
    while len(seconds) < 3 or (len(seconds) < 7 and sum(seconds) < _SECONDS_A_ROW):
        began, cpu_began = time.perf_counter(), time.process_time()
        results = plan_batch(tasks, heuristic=sign, together=TOGETHER)
        seconds.append(time.perf_counter() - began)
        cpu_seconds.append(time.process_time() - cpu_began)
    if any(
        validate(task, result.actions) for task, result in zip(tasks, results) if result.is_solved
    ):
        raise AssertionError("a plan failed its independent replay")
    sample = list(range(0, count, max(1, count // 512)))
    lengths, optima = (
        np.array([len(results[i].actions) for i in sample]),
        _optima([tasks[i] for i in sample], num_blocks),
    )
    row = {
        "blocks": num_blocks,
        "sign": "unlearned" if sign is None else "learned",
        "tasks_a_second": count / float(np.median(seconds[1:])),
        "quartiles": (count / np.percentile(seconds[1:], (75, 25))).tolist(),
        "best_tasks_a_second": count / min(seconds[1:]),
        "tasks_a_cpu_second": count / float(np.median(cpu_seconds[1:])),
        "compile_seconds": seconds[0] - min(seconds[1:]),
        "solved": float(np.mean([result.is_solved for result in results])),
        "ratio": float(lengths.sum() / optima.sum()),
        "optimal": float((lengths == optima).mean()),
    }
    log(
        f"{num_blocks} blocks, {row['sign']}: {row['tasks_a_second']:,.0f} tasks/s, length /"
        f" optimum {row['ratio']:.3f}"
    )
    return row


def _optima_in(folder: pathlib.Path) -> dict[str, int]:
    """Returns the known optimal lengths by the file of the problem."""
    optima: dict[str, int] = {}
    for name, column, prefix in (
        ("fd_optimal.csv", "optimal_steps_if_unit_cost", ""),
        ("blocks_optimal.csv", "optimal_steps", "blocks/"),
    ):
        if (folder / name).is_file():
            with open(folder / name, encoding="utf-8") as file:
                optima |= {prefix + row["file"]: int(row[column]) for row in csv.DictReader(file)}
    return optima


def _known_optima(
    folder: pathlib.Path, sign: HeuristicSign, quick: bool, log: Callable[[str], None]
) -> Iterator[dict[str, Any]]:
    optima = _optima_in(folder)
    most = {"blocks": 40 if quick else 60, "hanoi": 63 if quick else 255}
    for domain in ("blocks", "hanoi", "ferry", "goldminer"):
        chosen = {
            name: optimum
            for name, optimum in optima.items()
            if name.startswith(domain) and optimum <= most.get(domain, 1000)
        }
        for used in (None, sign) if domain == "blocks" else (None,):
            results = []
            for name in chosen:
                task = load(folder / domain / "domain.pddl", folder / name)
                began = time.perf_counter()
                results.append(
                    (plan(task, heuristic=used, max_seconds=30.0), time.perf_counter() - began)
                )
                if len(results) % 10 == 0:
                    log(f"{domain}: {len(results)} of {len(chosen)} tasks")
            ratios = [
                len(r.actions) / optimum
                for (r, _), optimum in zip(results, chosen.values())
                if r.is_solved
            ]
            row = {
                "domain": domain,
                "sign": "unlearned" if used is None else "learned",
                "tasks": len(chosen),
                "solved": len(ratios),
                "ratio": float(np.mean(ratios)),
                "worst": float(max(ratios)),
                "optimal": float(np.mean([ratio == 1 for ratio in ratios])),
                "slowest_seconds": max(seconds for _, seconds in results),
            }
            log(
                f"{domain}: {row['solved']} of {row['tasks']} solved, length / optimum"
                f" {row['ratio']:.3f}"
            )
            yield row


def _cold_start() -> dict[str, float]:
    """A fresh process that loads one task of 6 blocks and plans it: the best of three, on the clock
    and of CPU.
    """
    with tempfile.TemporaryDirectory() as place:
        domain, problem = _write_pddl(pathlib.Path(place), random_blocks_tasks(6, 1, seed=3)[0])
        code = (
            f"import sign_model as s, time; t = s.load({str(domain)!r}, {str(problem)!r}); assert"
            " s.plan(t).is_solved"
        )
        seconds, cpu_seconds = [], []
        for _ in range(3):
            began = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-c", code + "; print(time.process_time())"],
                check=True,
                capture_output=True,
                text=True,
            )
            seconds.append(time.perf_counter() - began)
            cpu_seconds.append(float(done.stdout))
    return {"seconds": min(seconds), "cpu_seconds": min(cpu_seconds)}


def _write_pddl(place: pathlib.Path, task: PlanningTask) -> tuple[pathlib.Path, pathlib.Path]:
    domain, problem = place / "domain.pddl", place / "problem.pddl"
    domain.write_text(DOMAIN, encoding="utf-8")
    problem.write_text(problem_text(_problem(task)), encoding="utf-8")
    return domain, problem


def _peers(count: int, log: Callable[[str], None]) -> Iterator[dict[str, Any]]:
    """Each peer that is installed, and MAP, one by one on the same random tasks; a peer's process
    start is in its time.
    """
    num_blocks, tasks = 8, random_blocks_tasks(8, count, seed=7)
    optima = _optima(tasks, num_blocks)
    for name, command in {"MAP, one by one": None, **_peer_commands()}.items():
        lengths, taken = [], []
        for task in tasks:
            began = time.perf_counter()
            lengths.append(
                len(plan(task).actions) if command is None else _peer_length(command, task)
            )
            taken.append(time.perf_counter() - began)
        quartiles = np.percentile(taken, (25, 75)).tolist()
        spent = float(np.median(taken))
        solved = [
            (length, optimum)
            for length, optimum in zip(lengths, optima.tolist())
            if length is not None
        ]
        ratio = (
            float(np.mean([length / optimum for length, optimum in solved]))
            if solved
            else float("nan")
        )
        log(
            f"{name}: solved {len(solved)} of {count}, length / optimum {ratio:.2f}, {spent:.2f} s"
            " each"
        )
        row = {
            "name": name,
            "blocks": num_blocks,
            "tasks": count,
            "solved": len(solved),
            "ratio": ratio,
        }
        yield row | {"seconds": spent, "quartiles": quartiles}


def _peer_commands() -> dict[str, list[str]]:
    commands: dict[str, list[str]] = {}
    if importlib.util.find_spec("pyperplan"):
        for search, heuristic in (("gbf", "hff"), ("wastar", "hadd")):
            commands[f"pyperplan {search} {heuristic}"] = [
                sys.executable,
                "-m",
                "pyperplan",
                "-s",
                search,
                "-H",
                heuristic,
            ]
    found = importlib.util.find_spec("up_fast_downward")
    if found is not None and found.origin:
        driver = pathlib.Path(found.origin).parent / "downward" / "fast-downward.py"
        if driver.is_file():
            commands["Fast Downward lama-first"] = [
                sys.executable,
                str(driver),
                "--alias",
                "lama-first",
                "--plan-file",
                "problem.pddl.soln",
            ]
    return commands


def _peer_length(command: list[str], task: PlanningTask, seconds: float = 30.0) -> int | None:
    """The length of a peer's plan, replayed; None where it finds none in time."""
    with tempfile.TemporaryDirectory() as place:
        domain, problem = _write_pddl(pathlib.Path(place), task)
        try:
            subprocess.run(
                [*command, str(domain), str(problem)],
                cwd=place,
                capture_output=True,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return None
        solution = pathlib.Path(place) / "problem.pddl.soln"
        if not solution.is_file():
            return None
        actions = [
            line
            for line in solution.read_text(encoding="utf-8").splitlines()
            if line.startswith("(")
        ]
        return len(actions) if not validate(task, actions) else None
