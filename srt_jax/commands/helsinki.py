"""The main job on a real city: Helsinki's centre, goals cut off in the paper's five ways, all
solved as one batch (PY16 §4).
"""

from typing import Any, NamedTuple

import numpy as np

from srt_jax.data import helsinki
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.instances.paper_blockers import BLOCKAGES, block, pick_start_goal
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.paths.reach import reach
from srt_jax.task import NamedTask, make_task
from srt_jax.types import FREE, Solution, Status

SIDE = 500
"""Cells a side, as in the paper."""

APART = 401
"""Cells between start and goal at least: the paper has "exceed 400"."""

_PATIENCE = 50
"""How many pairs of start and goal are drawn for each that is used: a ring may hold the start."""


class City(NamedTuple):
    """labels: int32 [L, H, W] of the buildings. cell_side: metres. attribution: to be shown beside
    whatever is made from it.
    """

    labels: np.ndarray
    cell_side: float
    attribution: str


def city() -> City:
    """Returns the largest square of Helsinki's centre on SIDE x SIDE cells; a cell is blocked where
    a building meets it.
    """
    place = helsinki()
    grid = square_grid(place.bounds, SIDE)
    return City(cover(place.obstacles, grid), grid.side, place.attribution)


def tasks_in(place: City, *, pairs: int, seed: int) -> list[NamedTask]:
    """Returns pairs x 5 tasks: start and goal on opposite sides of the largest free region, cut off
    in each of the five ways.

    The blocker can be destroyed, the buildings cannot.
    """
    free = (place.labels == FREE).all(axis=0)
    tasks: list[NamedTask] = []
    for draw in range(seed * _PATIENCE * pairs, (seed + 1) * _PATIENCE * pairs):
        start, goal = pick_start_goal(free, apart=APART, seed=draw)
        try:
            blocked = [(kind, *block(place.labels, start, goal, kind)) for kind in BLOCKAGES]
        except ValueError:  # no room for one of the blockers between these two
            continue
        pair = len(tasks) // len(BLOCKAGES)
        tasks += [
            NamedTask(f"{kind}-{pair}", make_task(labels, start, goal, destroyable=[blocker]))
            for kind, labels, blocker in blocked
        ]
        if pair + 1 == pairs:
            return tasks
    raise ValueError(
        f"no {pairs} pairs of start and goal in {_PATIENCE * pairs} draws: try fewer pairs or"
        " another seed"
    )


def summary(place: City, tasks: list[NamedTask], solutions: list[Solution]) -> list[dict[str, Any]]:
    """Returns a row per kind of blockage, means over its tasks.

    explored: share of the largest free region's cells that are reached before anything is
      destroyed. open route: length of a
    shortest path with no blocker, to compare the route with.
    """
    free = (place.labels == FREE).all(axis=0)
    rows = []
    for first, kind in enumerate(BLOCKAGES):
        answers = solutions[first :: len(BLOCKAGES)]
        ours = [named.task for named in tasks[first :: len(BLOCKAGES)]]
        starts, goals = (
            np.stack([getattr(task, end) for task in ours]) for end in ("start", "goal")
        )
        unblocked = np.asarray(
            cost_to_come(np.broadcast_to(free, (len(ours), *free.shape)), starts)
        )
        reached = np.asarray(
            reach(np.stack([(task.labels == FREE).all(axis=0) for task in ours]), starts)
        )
        means = {
            "explored": np.mean(reached.sum(axis=(1, 2)) / np.isfinite(unblocked).sum(axis=(1, 2))),
            "contour cells": np.mean([np.sum(answer.contour) for answer in answers]),
            "objects on contour": np.mean([np.sum(answer.blocking >= 0) for answer in answers]),
            "destroyed": np.mean([answer.num_destroyed for answer in answers]),
            "proven least": np.mean(
                [answer.removal_cost == answer.removal_bound for answer in answers]
            ),
            "route": np.mean([answer.cost for answer in answers]),
            "open route": np.mean(unblocked[np.arange(len(ours)), goals[:, 0], goals[:, 1]]),
        }
        solved = sum(Status(int(answer.status)).is_solved for answer in answers)
        rows.append(
            {"blockage": kind, "tasks": len(ours), "solved": solved}
            | {name: float(mean) for name, mean in means.items()}
        )
    return rows


_FORMS = {
    "explored": "{:.1%}",
    "contour cells": "{:.0f}",
    "destroyed": "{:.2f}",
    "proven least": "{:.0%}",
}
"""How means are written; else with one digit after the point."""


def heading(place: City) -> str:
    """Returns what the summary is of."""
    return (
        f"Helsinki, {SIDE} x {SIDE} cells of {place.cell_side:.2f} m; means over each row's tasks;"
        " lengths in cell sides."
    )


def as_text(row: dict[str, Any]) -> dict[str, str]:
    """Returns a row of the summary as texts."""
    return {
        key: _FORMS.get(key, "{:.1f}").format(v) if isinstance(v, float) else str(v)
        for key, v in row.items()
    }


def as_markdown(rows: list[dict[str, Any]], place: City) -> str:
    """Returns the summary as a Markdown table with the attribution that the data requires."""
    lines = ["| " + " | ".join(rows[0]) + " |", "|" + "---|" * len(rows[0])]
    lines += ["| " + " | ".join(as_text(row).values()) + " |" for row in rows]
    return "\n".join([heading(place), "", *lines, "", f"Map data: {place.attribution}", ""])
