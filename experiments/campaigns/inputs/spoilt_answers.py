"""Right answers made wrong, in every field: what `check` has to notice."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from srt_jax import Solution, Status, Task

_WITH_ROUTE = (Status.PATH_EXISTS, Status.SOLVED)
_FLOATS = ("cost", "removal_cost", "removal_bound")


def spoilt(
    rng: np.random.Generator, task: Task, solution: Solution, most: int
) -> Iterator[tuple[str, tuple[str, ...], Solution]]:
    """Returns `most` wrong answers to a task, drawn from all that are made from the right one by
    mode "least".

    Each with what was changed, in words and as names of fields.
    """
    with np.errstate(invalid="ignore"):  # inf as an integer
        found = list(_changes(rng, task, solution))
    for place in rng.permutation(len(found))[:most]:
        what, changes = found[place]
        yield what, tuple(changes), solution.replace(**changes)


def _changes(
    rng: np.random.Generator, task: Task, solution: Solution
) -> Iterator[tuple[str, dict[str, Any]]]:
    status = Status(int(solution.status))
    for other in set(Status) - {status}:
        yield f"status {other.name}", {"status": np.int32(other)}
    yield "status 99", {"status": np.int32(99)}
    for name, array in solution.items():
        yield (
            f"{name} of another type",
            {name: np.asarray(array).astype(np.int64 if array.dtype != np.int64 else np.int32)},
        )
        yield f"{name} with one dimension more", {name: np.asarray(array)[..., None]}
    yield from _floats(solution, status)
    yield from _entries(rng, solution)
    if status in _WITH_ROUTE:
        yield from _routes(rng, task, solution)
    if status is Status.SOLVED:
        yield from _removals(task, solution)
    yield from _reports(rng, task, solution, status)


def _floats(solution: Solution, status: Status) -> Iterator[tuple[str, dict[str, Any]]]:
    for name in _FLOATS:
        old = np.asarray(getattr(solution, name))
        values = {"nan": np.nan, "-1": -1, "-inf": -np.inf}
        if name != "removal_bound":  # a lower bound is no less true
            values["half"] = old / 2 if np.isfinite(old) and old else 1
        if status in _WITH_ROUTE:
            values |= {"inf": np.inf, "more": old * 1.001 + 1e-3 if old < 1e38 else np.inf}
        if name == "removal_cost" and status in _WITH_ROUTE:
            values["one step more"] = np.nextafter(old, np.float32(np.inf))
            values["one step less"] = np.nextafter(old, np.float32(-np.inf))
        if name == "removal_bound" and solution.removal_cost == old and status is Status.SOLVED:
            values["one step more"] = np.nextafter(old, np.float32(np.inf))
        for kind, value in values.items():
            yield f"{name} {kind}", {name: np.float32(value)}


def _entries(rng: np.random.Generator, solution: Solution) -> Iterator[tuple[str, dict[str, Any]]]:
    """Single entries that are wrong whatever stands beside them."""
    for name in ("num_cells", "num_destroyed"):
        old = int(getattr(solution, name))
        for value in {-1, old + 1, old - 1, 2**31 - 1} - {old}:
            # how much is needed, nobody knows
            is_stated = Status(int(solution.status)) is Status.BUDGET_SPENT and value > 0
            if not is_stated:
                yield f"{name} {value}", {name: np.int32(value)}
    for name in (
        "cells",
        "destroyed",
        "destroyed_at",
        "plan",
        "plan_at",
        "seed",
        "blocking",
        "separating",
    ):
        for value in (-3, 2**30):
            changed = np.array(getattr(solution, name))
            place = tuple(int(rng.integers(side)) for side in changed.shape)
            changed[place] = value
            yield f"{name}{list(place)} = {value}", {name: changed}
    contour = np.array(solution.contour)
    place = tuple(int(rng.integers(side)) for side in contour.shape)
    contour[place] ^= True
    yield f"contour{list(place)}", {"contour": contour}


def _routes(
    rng: np.random.Generator, task: Task, solution: Solution
) -> Iterator[tuple[str, dict[str, Any]]]:
    number = int(solution.num_cells)
    if number > 1:
        cells = np.array(solution.cells)
        cells[0] = cells[1]
        yield "the route begins elsewhere", {"cells": cells}
        cells = np.array(solution.cells)
        cells[number - 1] = cells[0]
        yield "the route ends elsewhere", {"cells": cells}
        cells = np.array(solution.cells)
        cells[number - 1] = -1
        yield "the last cell is missing", {"cells": cells, "num_cells": np.int32(number - 1)}
        plan = np.array(solution.plan)
        plan[0] = -1
        yield "the plan has no first step", {"plan": plan}
        plan_at = np.array(solution.plan_at)
        plan_at[int((plan_at >= 0).sum()) - 1] -= 1
        yield "the plan ends early", {"plan_at": plan_at}
    if number > 3:
        cells = np.array(solution.cells)
        place = int(rng.integers(1, number - 2))
        cells[place : place + 2] = cells[place : place + 2][::-1].copy()
        yield "two cells of the route change places", {"cells": cells}


def _removals(task: Task, solution: Solution) -> Iterator[tuple[str, dict[str, Any]]]:
    number, room = int(solution.num_destroyed), len(solution.destroyed)
    gone = set(solution.destroyed[:number].tolist())
    for other in sorted(set(range(len(task.destroyable))) - gone)[:3]:
        ids = np.array(solution.destroyed)
        ids[0] = other
        yield f"{other} is destroyed instead", {"destroyed": ids}
        if number < room:
            more, at = np.array(solution.destroyed), np.array(solution.destroyed_at)
            more[number], at[number] = other, at[number - 1]
            cost = np.float32(solution.removal_cost + task.removal_cost[other])
            changes = {
                "destroyed": more,
                "destroyed_at": at,
                "num_destroyed": np.int32(number + 1),
                "removal_cost": cost,
            }
            yield f"{other} is destroyed as well", changes
    less, at = np.array(solution.destroyed), np.array(solution.destroyed_at)
    less[number - 1] = at[number - 1] = -1
    yield (
        "the last obstacle is not destroyed",
        {"destroyed": less, "destroyed_at": at, "num_destroyed": np.int32(number - 1)},
    )
    late = np.array(solution.destroyed_at)
    late[0] += 1
    yield "the first obstacle is destroyed too late", {"destroyed_at": late}


def _reports(
    rng, task: Task, solution: Solution, status: Status
) -> Iterator[tuple[str, dict[str, Any]]]:
    seed = np.array(solution.seed)
    yield "the seed lies elsewhere", {"seed": seed + 1}
    if solution.contour.any():
        yield "no contour", {"contour": np.zeros_like(solution.contour)}
    blocking = np.array(solution.blocking)
    number = int((blocking >= 0).sum())
    if number:
        blocking[number - 1] = -1
        yield "one that blocks is missing", {"blocking": blocking}
    if number < len(blocking):
        blocking = np.array(solution.blocking)
        blocking[number] = next(i for i in range(len(blocking)) if i not in blocking)
        yield "one too many blocks", {"blocking": blocking}
    separating = np.array(solution.separating)
    if status in (Status.UNSOLVABLE, Status.GOAL_BLOCKED) and (separating >= 0).any():
        yield "nothing separates", {"separating": np.full_like(separating, -1)}
        fixed, soft = int(separating[0]), np.flatnonzero(task.destroyable)
        if len(soft):
            separating[:] = -1
            separating[:2] = (fixed, int(rng.choice(soft)))
            yield "what can be destroyed separates", {"separating": separating}
