"""How records look in a notebook: a picture and a few facts, as HTML that needs nothing else."""

import base64
import html
from collections.abc import Iterable, Mapping
from typing import Any

import jax
import numpy as np

from srt_jax.draw.parts.colours import GOAL, PALETTE, START, Kind
from srt_jax.draw.parts.content import headline
from srt_jax.draw.parts.tile import svg_tile
from srt_jax.engine.eager import fold
from srt_jax.geometry.world import World
from srt_jax.task import unstack
from srt_jax.types import Solution, Status, Task

_MOST_TILES = 6
"""Of a batch, more would fill the page."""

_FILLS = (Kind.DESTROYABLE, Kind.INDESTRUCTIBLE)

_MOST_ENTRIES = 6
"""Of a list in a table."""

_WIDTH = 280
"""Pixels of a picture."""


def task_html(task: Task) -> str:
    """Returns a task as a picture, a batch as the pictures of its first tasks."""
    if np.ndim(task.labels) < 3:
        return f"<pre>{html.escape(repr(task))}</pre>"
    ranks = Task(labels=3, destroyable=1, removal_cost=1, start=1, goal=1, size=1)
    flat = jax.tree.map(fold, task, ranks)
    shown = jax.tree.map(lambda array: np.asarray(array)[:_MOST_TILES], flat)
    return _page(repr(task), [svg_tile(one) for one in unstack(shown)])


def solution_html(solution: Solution) -> str:
    """Returns what a solution says as a table, a batch as how many ended in which way."""
    if np.ndim(solution.status):
        statuses, counts = np.unique(np.asarray(solution.status), return_counts=True)
        named = ((Status(s), int(n)) for s, n in zip(statuses.tolist(), counts.tolist()))
        return _table(("status", "tasks", "meaning"), ((s.name, n, s.meaning) for s, n in named))
    is_solved = Status(int(solution.status)).is_solved
    gone = np.asarray(solution.destroyed)[: int(solution.num_destroyed)].tolist()
    blocking = np.asarray(solution.blocking)
    seed = np.asarray(solution.seed).tolist()
    rows = [
        ("outcome", headline(solution)),
        ("blocked at", f"{tuple(seed)}" if seed[0] >= 0 else "nothing blocks"),
        ("blocked by", _ids(blocking[blocking >= 0].tolist())),
        ("destroyed", _ids(gone) if is_solved else ""),
        ("removal cost", f"{float(solution.removal_cost):g}"),
        ("at least", f"{float(solution.removal_bound):g}"),
        ("cells of the route", int(solution.num_cells)),
    ]
    return _table(("", "solution"), rows)


def explanation_html(data: Mapping[str, Any], shown: tuple[Task, Solution] | None) -> str:
    """Returns what is known of an answer as a table, below its picture if the task and solution
    that it tells of are given.
    """
    rows = [(key, _short(value)) for key, value in data.items() if value not in (None, [], {})]
    table = _table(("", "explanation"), rows)
    if shown is None:
        return table
    return _page(data["meaning"], [svg_tile(*shown)]) + table


def _short(value: Any) -> str:
    """JSON in a line, numbers with four digits; of a long list the first entries."""
    if isinstance(value, dict):
        known = ((key, one) for key, one in value.items() if one is not None)
        return ", ".join(f"{key} {_short(one)}" for key, one in known)
    if isinstance(value, list | tuple):
        more = [f"{len(value) - _MOST_ENTRIES} more"] if len(value) > _MOST_ENTRIES else []
        return f"[{', '.join([*map(_short, value[:_MOST_ENTRIES]), *more])}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def world_html(world: World) -> str:
    """Returns a world in metres as a picture: y up, the obstacles in the colours of a task's."""
    x_min, y_min, x_max, y_max = world.bounds
    across, down = x_max - x_min, y_max - y_min
    thin = max(across, down) / 300

    def ring(points: Iterable[tuple[float, float]]) -> str:
        return "M" + "L".join(f"{x - x_min:.6g} {y_max - y:.6g}" for x, y in points) + "Z"

    colours = ["#" + bytes(PALETTE[kind]).hex() for kind in _FILLS]
    shapes = [
        f'<path fill-rule="evenodd" fill="{colours[not one.destroyable]}"'
        f' d="{"".join(ring(r) for part in one.parts for r in part)}"/>'
        for one in world.obstacles
    ]
    x, y = world.position
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {across:.6g} {down:.6g}">'
        f'<rect width="100%" height="100%" fill="#fff" stroke="#888" stroke-width="{thin:.3g}"/>'
        + "".join(shapes)
        + f'<path d="{ring(world.goal)}" fill="none" stroke="{GOAL}"'
        f' stroke-width="{thin * 2:.3g}"/>'
        f'<circle cx="{x - x_min:.6g}" cy="{y_max - y:.6g}" r="{max(world.radius, thin):.6g}"'
        f' fill="{START}"/></svg>'
    )
    return _page(repr(world), [svg])


def picture_html(picture: bytes, kind: str, name: str) -> str:
    """Returns a picture inside the page; kind: png or gif."""
    data = base64.b64encode(picture).decode()
    return f'<img alt="{html.escape(name)}" src="data:image/{kind};base64,{data}"/>'


def _page(title: str, tiles: list[str]) -> str:
    shown = "".join(
        f'<div style="width:{_WIDTH}px;display:inline-block;margin:4px">{tile}</div>'
        for tile in tiles
    )
    return f"<div><div><code>{html.escape(title)}</code></div>{shown}</div>"


def _table(head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> str:
    def line(cells: tuple[Any, ...], tag: str) -> str:
        return "".join(
            f'<{tag} style="text-align:left">{html.escape(str(cell))}</{tag}>' for cell in cells
        )

    body = "".join(f"<tr>{line(row, 'td')}</tr>" for row in rows)
    return f"<table><thead><tr>{line(head, 'th')}</tr></thead><tbody>{body}</tbody></table>"


def _ids(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers)) if numbers else "none"
