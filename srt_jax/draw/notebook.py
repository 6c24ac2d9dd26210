"""How records look in a notebook: a picture and a few facts, as HTML that needs nothing else."""

import base64
import html
from collections.abc import Iterable, Mapping
from typing import Any

import jax
import numpy as np

from srt_jax.draw.parts.colours import GOAL, PALETTE, START, Kind, shrunk
from srt_jax.draw.parts.content import headline
from srt_jax.draw.parts.tile import png_of, svg_tile
from srt_jax.engine.eager import fold
from srt_jax.formats.gridmap import GridMap
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle, World
from srt_jax.task import unstack
from srt_jax.types import Solution, Status, Task

_MOST_TILES = 6
"""Of a batch, more would fill the page."""

_FILLS = (Kind.DESTROYABLE, Kind.INDESTRUCTIBLE)

_MOST_ENTRIES = 6
"""Of a list in a table."""

_WIDTH = 280
"""Pixels of a picture."""

_Bounds = tuple[float, float, float, float]


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


def grid_map_html(grid_map: GridMap) -> str:
    """Returns a map of cells as a picture: what is blocked in the colour of obstacles, what is
    unknown grey.
    """
    kinds = np.full(grid_map.free.shape, Kind.UNREACHED, np.uint8)
    kinds[~grid_map.free] = Kind.DESTROYABLE
    kinds[grid_map.unknown] = Kind.INDESTRUCTIBLE
    style = f"width:{_WIDTH}px;image-rendering:pixelated;border:1px solid #888"
    image = picture_html(png_of(shrunk(kinds, _WIDTH)), "png", "the map", style=style)
    return _page(repr(grid_map), [image])


def place_html(place: Place) -> str:
    """Returns a place as a picture: y up, the obstacles in the colours of a task's."""
    return _page(repr(place), [_outlines(place.bounds, place.obstacles, "")])


def world_html(world: World) -> str:
    """Returns a world in metres as a picture: a place with agent and goal square."""
    x_min, y_max = world.bounds[0], world.bounds[3]
    thin = _thin(world.bounds)
    x, y = world.position
    marks = (
        f'<path d="{_ring(world.goal, world.bounds)}" fill="none" stroke="{GOAL}"'
        f' stroke-width="{thin * 2:.3g}"/>'
        f'<circle cx="{x - x_min:.6g}" cy="{y_max - y:.6g}" r="{max(world.radius, thin):.6g}"'
        f' fill="{START}"/>'
    )
    return _page(repr(world), [_outlines(world.bounds, world.obstacles, marks)])


def _outlines(bounds: _Bounds, obstacles: Iterable[Obstacle], marks: str) -> str:
    """An SVG of polygons in metres, with marks on top."""
    x_min, y_min, x_max, y_max = bounds
    colours = ["#" + bytes(PALETTE[kind]).hex() for kind in _FILLS]
    shapes = [
        f'<path fill-rule="evenodd" fill="{colours[not one.destroyable]}"'
        f' d="{"".join(_ring(r, bounds) for part in one.parts for r in part)}"/>'
        for one in obstacles
    ]
    return (
        '<svg xmlns="http://www.w3.org/2000/svg"'
        f' viewBox="0 0 {x_max - x_min:.6g} {y_max - y_min:.6g}">'
        '<rect width="100%" height="100%" fill="#fff" stroke="#888"'
        f' stroke-width="{_thin(bounds):.3g}"/>' + "".join(shapes) + marks + "</svg>"
    )


def _ring(points: Iterable[tuple[float, float]], bounds: _Bounds) -> str:
    return "M" + "L".join(f"{x - bounds[0]:.6g} {bounds[3] - y:.6g}" for x, y in points) + "Z"


def _thin(bounds: _Bounds) -> float:
    """The width of a thin line, in metres."""
    return max(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 300


def picture_html(picture: bytes, kind: str, name: str, *, style: str = "") -> str:
    """Returns a picture inside the page; kind: png or gif."""
    data = base64.b64encode(picture).decode()
    styled = f' style="{style}"' if style else ""
    return f'<img alt="{html.escape(name)}"{styled} src="data:image/{kind};base64,{data}"/>'


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
