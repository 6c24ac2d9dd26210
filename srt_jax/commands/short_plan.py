"""What `srt-jax plan` does, and a way to it that loads neither JAX nor the parser of the command
line.

Both take longer to load than a small task takes to plan. Whatever is not spelt plainly is left to
the parser, which knows every form and tells every mistake.
"""

import functools
import pathlib
import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sign_model.foundation.collector import paused_collector
from sign_model.foundation.legible import counted
from srt_jax.commands.shared.console import aside, say, say_json, waiting

if TYPE_CHECKING:
    from sign_model import Memory, PlanningTask, PlanResult


def plan_files(
    domain: str,
    problem: str,
    planner: str,
    max_expansions: int,
    max_seconds: float | None,
    as_json: bool,
    experience: pathlib.Path | None = None,
    is_remembered: bool = False,
    signs: pathlib.Path | None = None,
    rule: pathlib.Path | None = None,
) -> int:
    """Plans the task of two PDDL files, prints the plan once it was replayed, and returns the
    exit code.

    Args:
      experience: a file of `save_memory`, or None.
      is_remembered: whether the plan is added to that file, which need not be there yet.
      signs, rule: files of `save_signs` and `save_rule`, or None.
    """
    with waiting("planning", quiet=as_json), paused_collector():
        memory = _memory_of(experience, is_remembered)
        paths = pathlib.Path(domain), pathlib.Path(problem)
        options = {"planner": planner, "max_expansions": max_expansions, "memory": memory}
        if signs is not None or rule is not None:
            options |= _of_files(signs, rule)
        task, result = _read_and_plan(*paths, max_seconds, options)
    is_kept = is_remembered and result.is_solved
    if is_kept and task is not None and memory is not None and experience is not None:
        from sign_model import save_memory

        save_memory(memory.learned(task, result.actions), experience)
    if as_json:
        document = {
            "status": result.status.name,
            "actions": list(result.actions),
            "cost": result.cost,
            "expansions": result.expansions,
        }
        say_json(document | {"seconds": result.seconds})
    else:
        say(*result.actions)
        took = ", ".join(f"{stage} {seconds:.3f} s" for stage, seconds in result.seconds.items())
        steps = f"{counted(len(result.actions), 'step')}, " if result.is_solved else ""
        steps += "" if result.cost is None else f"cost {result.cost}, "
        effort = counted(result.expansions, "expansion")
        aside(f"; {result.status.name}: {steps}{effort}; {took}")
        if hint := _hint(result, planner, max_seconds):
            aside(f"; {hint}")
    if result.cost is not None and (aim := _NOT_CHEAPEST.get(planner)):
        aside(
            f"; the problem asks for the least total cost, but {planner} {aim}: --planner astar"
            " finds the cheapest plan"
        )
    return int(result.status)


_NOT_CHEAPEST = {
    "map": "minimises the number of steps",
    "gbfs": "takes the first plan that it finds",
}


def _read_and_plan(
    domain: pathlib.Path,
    problem: pathlib.Path,
    max_seconds: float | None,
    options: Mapping[str, Any],
) -> "tuple[PlanningTask | None, PlanResult]":
    """Reads and plans; one time limit holds for both. Without a task where it ended before there
    was one.
    """
    from sign_model import OutOfTime, PlanResult, PlanStatus, load, plan

    began = time.perf_counter()
    try:
        task = load(domain, problem, max_seconds=max_seconds)
    except OutOfTime as error:
        seconds = error.seconds | {"search": 0.0, "validate": 0.0}
        return None, PlanResult(PlanStatus.BUDGET_SPENT, (), 0, seconds)
    left = None if max_seconds is None else max(0.0, max_seconds - (time.perf_counter() - began))
    return task, plan(task, max_seconds=left, **options)


def _memory_of(experience: pathlib.Path | None, is_remembered: bool) -> "Memory | None":
    """What is known before; nothing yet where a file is to be made."""
    if experience is None:
        return None
    from sign_model import Memory, load_memory

    return Memory() if is_remembered and not experience.exists() else load_memory(experience)


def _of_files(signs: pathlib.Path | None, rule: pathlib.Path | None) -> dict[str, Any]:
    """How MAP is to plan, as options of `sign_model.plan`."""
    from sign_model import load_rule, load_signs

    return {
        "heuristic": None if signs is None else load_signs(signs),
        "rule": None if rule is None else load_rule(rule),
    }


def _hint(result: "PlanResult", planner: str, max_seconds: float | None) -> str:
    """What to try after a spent budget; "" after an answer."""
    if result.status.name != "BUDGET_SPENT":
        return ""
    if not result.seconds["search"]:
        return "the time ended before the search began: raise --max-seconds"
    limits = "--max-expansions" if max_seconds is None else "--max-expansions or --max-seconds"
    other = "map" if planner == "gbfs" else "gbfs"
    return f"try another planner, --planner {other}, or raise {limits}"


_PLAIN = {
    "--planner": ("planner", re.compile(r"[a-z]+"), str),
    "--max-expansions": ("max_expansions", re.compile(r"[1-9][0-9]{0,17}"), int),
    "--max-seconds": ("max_seconds", re.compile(r"[0-9]+(\.[0-9]+)?"), float),
}


def plain_call(
    arguments: Sequence[str], environment: Mapping[str, str]
) -> Callable[[], int] | None:
    """Returns what to call for `plan DOMAIN PROBLEM` with options spelt plainly; None where the
    parser has to look at it.
    """
    if not arguments or arguments[0] != "plan" or "_SRT_JAX_COMPLETE" in environment:
        return None
    options: dict[str, Any] = {
        "planner": "map",
        "max_expansions": 200_000,
        "max_seconds": None,
        "as_json": False,
    }
    files, waiting_words = [], list(arguments[:0:-1])
    while waiting_words:
        word = waiting_words.pop()
        if word == "--json":
            options["as_json"] = True
        elif word in _PLAIN:
            name, form, kind = _PLAIN[word]
            value = waiting_words.pop() if waiting_words else ""
            if not form.fullmatch(value):
                return None
            options[name] = kind(value)
        elif word.startswith("-") or not word:
            return None
        else:
            files.append(word)
    return functools.partial(plan_files, *files, **options) if len(files) == 2 else None
