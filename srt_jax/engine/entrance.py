"""Which records may come in: a task, a batch of them, a solution; each refusal says what was given
and what takes it.

Whatever has the fields of the record passes, so that nothing else than the two classes has to be
told apart from lists, arrays and generators.
"""

import os
from collections.abc import Iterable, Mapping
from typing import Any

import jax
import numpy as np
from jax import core

from sign_model.foundation.legible import counted
from srt_jax.types import Solution, Task

ONE_OR_MANY = "a task or a batch"
A_BATCH = "a batch of tasks or of solutions"
_UNSTACK = "srt_jax.unstack takes a batch of tasks or of solutions apart"


def require_task(caller: str, task: object, *, takes: str = ONE_OR_MANY) -> None:
    """Raises TypeError where what `caller` is given as a task is none.

    Args:
      takes: what `caller` takes, in words.
    """
    if not hasattr(task, "labels"):
        raise TypeError(f"{caller} takes {takes}, got {_given(task)}: {_remedy(task, takes)}")


def _remedy(task: object, takes: str) -> str:
    """Returns what to do with something that is no task."""
    if isinstance(task, Solution):
        return "the task comes first, then its solution"
    if _is_array(task):
        return "write srt_jax.make_task(free, start, goal) first"
    if not _is_list(task):
        return how_to_make_a_task(task) or "srt_jax.make_task makes one"
    if takes == ONE_OR_MANY:
        return "srt_jax.solve_many solves a list, srt_jax.stack makes one batch of it"
    if takes in (A_BATCH, "one batch"):
        return "srt_jax.stack makes one batch of a list"
    return "call it for each, or make a batch with srt_jax.stack where it takes batches"


def how_to_make_a_task(given: object) -> str:
    """Returns how a task is made of something that a reader returns; "" of anything else."""
    if hasattr(given, "obstacles"):
        is_world = hasattr(given, "goal")
        return (
            "srt_jax.rasterize makes a task of a World"
            if is_world
            else "it has no start and no goal: srt_jax.World(...) with its obstacles has, and"
            " srt_jax.rasterize makes a task of that"
        )
    if hasattr(given, "free"):
        return "write srt_jax.make_task(map.free, start, goal)"
    if isinstance(given, str | os.PathLike):
        return "a file is read by srt_jax.formats.task_files.read_tasks"
    return ""


def require_tasks(caller: str, tasks: object) -> None:
    """Raises TypeError where what should be a list of tasks, or another iterable, is one record or
    an array.
    """
    if hasattr(tasks, "labels"):
        whole = "a single task" if np.ndim(tasks.labels) == 3 else "one batch"  # pyright: ignore
        remedy = "solve takes either, [task] and srt_jax.unstack(batch) are lists"
    elif isinstance(tasks, Solution) or not isinstance(tasks, Iterable):
        whole, remedy = _given(tasks), "srt_jax.make_task makes a task"
    elif _is_array(tasks):
        whole, remedy = "an array", "write srt_jax.make_task(free, start, goal) for each map first"
    else:
        return
    raise TypeError(f"{caller} takes a list of single tasks, got {whole}: {remedy}")


def require_listed(caller: str, task: Any, number: int) -> None:
    """Raises TypeError or ValueError where an entry of a list of tasks is no single task."""
    if not hasattr(task, "labels"):
        raise TypeError(
            f"{caller} takes single tasks, but task {number} is {_given(task)}:"
            f" {'give tasks' if isinstance(task, Solution) else _remedy(task, '')}"
        )
    if np.ndim(task.labels) != 3:
        raise ValueError(
            f"task {number} has labels of shape {list(np.shape(task.labels))}, not [L, H, W]:"
            f" {caller} takes single tasks, call unstack on a batch first"
        )


def require_listed_solution(caller: str, solution: Any, number: int) -> None:
    """Raises TypeError or ValueError where an entry of a list of solutions is no single one."""
    require_solution(caller, solution, takes="single solutions")
    require_values(caller, solution.status)
    if np.ndim(solution.status):
        raise ValueError(
            f"solution {number} is {_batch_of(np.shape(solution.status))}: {caller} takes single"
            " solutions, call unstack on a batch first"
        )


def require_single(caller: str, task: Any) -> None:
    """Raises TypeError or ValueError where `task` is no single task, or is traced."""
    require_task(caller, task, takes="one task")
    if np.ndim(task.labels) != 3:
        raise ValueError(
            f"{caller} takes one task, got {_batch_of(np.shape(task.labels)[:-3])}: {_UNSTACK}"
        )
    require_values(caller, task)


def require_answer(caller: str, task: Any, solution: Any) -> None:
    """Raises TypeError or ValueError where `solution` cannot be the answer to `task`, or to each
    task of a batch: another kind of thing, other batch dimensions, another map.
    """
    require_task(caller, task, takes="a task and its solution")
    require_solution(caller, solution, takes="a task and its solution")
    require_values(caller, task, solution)
    batch, of_task = np.shape(solution.status), np.shape(task.start)[:-1]
    if of_task != batch:
        raise ValueError(
            f"the task has batch dimensions {list(of_task)}, the solution {list(batch)}: {_UNSTACK}"
        )
    shapes = [
        [*np.shape(task.labels)[-2:], np.shape(task.destroyable)[-1]],
        [*np.shape(solution.contour)[-2:], np.shape(solution.blocking)[-1]],
    ]
    # the entry of a batch may still be padded: more room is no fault, if nothing stands in it
    if any(own > there for own, there in zip(*shapes)) or _reaches_beyond(solution, shapes[0]):
        (height, width, obstacles), (H, W, M) = shapes
        raise ValueError(
            f"the task has {height} x {width} cells and {counted(obstacles, 'obstacle')}, the"
            f" solution is of {H} x {W} cells and {counted(M, 'obstacle')}: give the task's own"
            " solution (of a batch with padding, the entries of srt_jax.unstack(solutions, tasks))"
        )


def _reaches_beyond(solution: Any, shape: list[int]) -> bool:
    """Whether a solution names cells or obstacles that a task of this height, width and number of
    obstacles has not.
    """
    height, width, obstacles = shape
    contour = np.asarray(solution.contour)
    ids = (solution.destroyed, solution.blocking, solution.separating)
    return bool(
        contour[..., height:, :].any()
        or contour[..., width:].any()
        or (np.asarray(solution.cells) >= (height, width)).any()
        or any((np.asarray(one) >= obstacles).any() for one in ids)
    )


def require_one_answer(caller: str, task: Any, solution: Any) -> None:
    """`require_answer` of one task and its solution; ValueError for a batch."""
    for given in (solution, task):
        record = "status" if hasattr(given, "status") else "start"
        shape = np.shape(getattr(given, record, ()))[: None if record == "status" else -1]
        if shape:
            raise ValueError(
                f"{caller} takes one task and its solution, got {_batch_of(shape)}: {_UNSTACK}"
            )
    require_answer(caller, task, solution)


def require_solution(caller: str, solution: object, *, takes: str = "a solution") -> None:
    """Raises TypeError where what `caller` is given as a solution is none."""
    if hasattr(solution, "status"):
        return
    remedy = "give what solve returns"
    if isinstance(solution, Task):
        remedy = "give what solve(task) returns"
    elif _is_list(solution):
        remedy = "call it for each task with its own"
    raise TypeError(f"{caller} takes {takes}, got {_given(solution)} as the solution: {remedy}")


def require_values(caller: str, *given: object, inside: str = "") -> None:
    """Raises TypeError where anything given to a function that runs on the host is traced.

    Args:
      inside: what to do inside jit instead.
    """
    if any(isinstance(leaf, core.Tracer) for leaf in jax.tree.leaves(given)):
        remedy = inside or "call it outside jit, on what the jitted function returns"
        raise TypeError(f"{caller} runs on the host and cannot be traced: {remedy}")


def _batch_of(shape: tuple[int, ...]) -> str:
    return f"a batch of {' x '.join(map(str, shape))}"


def _is_array(value: object) -> bool:
    return hasattr(value, "dtype") and hasattr(value, "shape")


def _is_list(value: object) -> bool:
    return isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)


def _given(value: object) -> str:
    if _is_array(value):
        return "an array"
    name = type(value).__name__
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"
