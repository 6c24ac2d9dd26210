"""The planners of Figure 2: ours in this process, others in processes of their own; plans are
replayed before they count.
"""

import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import NamedTuple

from experiments.figures.blocks_tasks import BlocksTask
from sign_model import PlanningTask, PlanResult, load, plan, validate, world_model_of
from sign_model.map_algorithm.authors_rule import plan_by_authors_rule


class Answer(NamedTuple):
    """length: steps of a plan that was replayed, None without one. seconds: the whole. parts: of
    it, by stage, where known.
    """

    length: int | None
    seconds: float
    parts: dict[str, float]
    expansions: int | None = None


Planner = Callable[[BlocksTask], Answer]


def own_planners(budget: int) -> dict[str, Planner]:
    """Returns the paper's three and the authors' own A-step rule; `budget`: the most states a
    search may expand.
    """
    return {
        "MAP": lambda task: _ours(task, lambda grounded: plan(grounded), has_network=True),
        "A*": lambda task: _ours(
            task,
            # by name, so that MAP has no part in it
            lambda grounded: plan(
                grounded, planner="astar", heuristic="hmax", max_expansions=budget
            ),
        ),
        "W*": lambda task: _ours(
            task, lambda grounded: plan(grounded, planner="wastar", max_expansions=budget)
        ),
        "authors' rule": lambda task: _ours(
            task, lambda grounded: plan_by_authors_rule(grounded, max_iterations=budget)
        ),
    }


def peers(most_seconds: float) -> dict[str, Planner | None]:
    """Returns what others' planners do within that time, process start included; None for one that
    is not installed.
    """
    found: dict[str, Planner | None] = dict.fromkeys(
        ("pyperplan A* hmax", "pyperplan W* hff", "FD A* lmcut", "FD lama-first")
    )
    if importlib.util.find_spec("pyperplan"):
        start = [sys.executable, "-m", "pyperplan"]
        found["pyperplan A* hmax"] = _peer(
            [*start, "-s", "astar", "-H", "hmax", "DOMAIN", "PROBLEM"], most_seconds
        )
        found["pyperplan W* hff"] = _peer(
            [*start, "-s", "wastar", "-H", "hff", "DOMAIN", "PROBLEM"], most_seconds
        )
    if driver := _fast_downward():
        start = [sys.executable, str(driver), "--plan-file", "problem.pddl.soln"]
        lmcut = [*start, "DOMAIN", "PROBLEM", "--search", "astar(lmcut())"]
        found["FD A* lmcut"] = _peer(lmcut, most_seconds)
        found["FD lama-first"] = _peer(
            [*start, "--alias", "lama-first", "DOMAIN", "PROBLEM"], most_seconds
        )
    return found


def _ours(
    task: BlocksTask, search: Callable[[PlanningTask], PlanResult], *, has_network: bool = False
) -> Answer:
    """From the text to the replayed plan. MAP's semiotic network is built too, as the paper's
    planner did; its search reads the grounded matrices, of which the network is another form."""
    began = time.perf_counter()
    grounded = load(task.domain, task.problem)
    loaded = time.perf_counter()
    if has_network:
        world_model_of(grounded)
    built = time.perf_counter()
    result = search(grounded)
    searched = time.perf_counter()
    problems = validate(grounded, result.actions) if result.is_solved else []
    ended = time.perf_counter()
    if problems:
        raise AssertionError(f"{task.name}: a plan failed its replay: {problems[0]}")
    replayed = result.seconds.get("validate", 0.0)  # `plan` replays once itself
    parts = {
        "parse": grounded.seconds["parse"],
        "ground": loaded - began - grounded.seconds["parse"],
        "network": built - loaded,
        "search": searched - built - replayed,
        "validate": replayed + ended - searched,
    }
    return Answer(
        len(result.actions) if result.is_solved else None, ended - began, parts, result.expansions
    )


def _fast_downward() -> pathlib.Path | None:
    found = importlib.util.find_spec("up_fast_downward")
    driver = (
        pathlib.Path(found.origin).parent / "downward" / "fast-downward.py"
        if found and found.origin
        else None
    )
    return driver if driver and driver.is_file() else None


def _peer(command: list[str], most_seconds: float) -> Planner:
    settings = os.environ | {"PYTHONHASHSEED": "0"}  # else pyperplan's plans differ from run to run

    def run(task: BlocksTask) -> Answer:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "domain.pddl").write_text(task.domain, encoding="utf-8")
            (folder / "problem.pddl").write_text(task.problem, encoding="utf-8")
            arguments = [
                {"DOMAIN": "domain.pddl", "PROBLEM": "problem.pddl"}.get(word, word)
                for word in command
            ]
            began = time.perf_counter()
            try:
                subprocess.run(
                    arguments,
                    cwd=folder,
                    env=settings,
                    capture_output=True,
                    timeout=most_seconds,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                return Answer(None, most_seconds, {})
            seconds = time.perf_counter() - began
            plan_file = folder / "problem.pddl.soln"
            lines = (
                plan_file.read_text(encoding="utf-8").splitlines() if plan_file.is_file() else []
            )
        actions = [line.lower() for line in lines if line.startswith("(")]
        is_plan = bool(actions) and not validate(load(task.domain, task.problem), actions)
        return Answer(len(actions) if is_plan else None, seconds, {})

    return run
