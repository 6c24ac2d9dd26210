"""Pictures and animations of a coalition's task: one colour an agent, what is destroyed numbered in
order.
"""

import os
import pathlib
import textwrap
from typing import Any

import numpy as np

from sign_model.foundation.legible import legible
from srt_jax.coalition.task import CoalitionTask
from srt_jax.coalition.types import CoalitionSolution
from srt_jax.draw.parts.canvas import save_gif
from srt_jax.draw.parts.colours import PALETTE, Kind, shrunk
from srt_jax.draw.picture import page
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.types import Status

AGENTS = ("#0072b2", "#d55e00", "#009e73", "#000000", "#cc79a7", "#7a4a00")
"""Colours of agents, in turn."""

_SIDE, _COLUMNS = 7.0, 4
_PIXELS, _FRAMES = 480, 48
_QUICK, _LAST = 110, 2500
_APART = 3.2
"""Points between the routes of two agents who walk the same way."""


def draw_coalition(
    task: CoalitionTask,
    solution: CoalitionSolution,
    path: str | os.PathLike,
    *,
    title: str = "",
) -> None:
    """Writes a picture of one task and its answer; the ending of `path` decides the format (.png,
    .svg, .pdf).

    Each agent has a colour: a circle where it starts, a star where its goal is, its route, and a
    numbered diamond where it destroys an obstacle.

    Raises:
      ImportError: matplotlib is missing. ValueError: a batch was given, or another ending.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, solve_coalition
      >>> from srt_jax.draw.coalition import draw_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> path = os.path.join(tempfile.mkdtemp(), "one.png")
      >>> draw_coalition(task, solve_coalition(task), path)
      >>> os.path.exists(path)
      True
    """
    kinds = _kinds(task, solution)
    height, width = kinds.shape
    heading = [
        *textwrap.wrap(legible(title), 76, max_lines=2, placeholder=" …"),
        _headline(solution),
    ]
    agents = _agents(task)
    # the numbers beside the axes, and the legend, take the same room whatever the map
    side = (_SIDE - 0.7) * min(2.5, max(0.1, height / width))
    size = (_SIDE, side + 0.9 + 0.18 * (len(heading) + -(-(len(agents) + 6) // _COLUMNS)))
    with page(path, size=size) as figure:
        axes = figure.add_subplot()
        small = shrunk(kinds, 1050)
        n = -(-max(height, width) // 1050)
        extent = (-0.5, small.shape[1] * n - 0.5, small.shape[0] * n - 0.5, -0.5)
        axes.imshow(PALETTE[small], interpolation="nearest", extent=extent)
        axes.set_xlim(-0.5, width - 0.5)
        axes.set_ylim(height - 0.5, -0.5)
        for place, agent in enumerate(agents):
            _draw_agent(axes, task, solution, agent, place - (len(agents) - 1) / 2)
        for number, (agent, cell) in enumerate(_places(solution)):
            axes.plot(
                cell[1],
                cell[0],
                "D",
                color=_colour(agent),
                markersize=11,
                markeredgecolor="white",
                clip_on=False,
                zorder=6,
            )
            axes.text(
                cell[1],
                cell[0],
                str(number + 1),
                color="white",
                fontsize=7,
                ha="center",
                va="center",
                zorder=7,
            )
        axes.set_title("\n".join(heading), fontsize=10, parse_math=False)
        axes.set_xlabel("column")
        axes.set_ylabel("row")
        for axis in (axes.xaxis, axes.yaxis):
            axis.get_major_locator().set_params(integer=True)
        figure.legend(
            handles=_legend(task, solution, kinds),
            loc="outside lower center",
            ncols=_COLUMNS,
            fontsize=8,
            frameon=False,
        )


def animate_coalition(
    task: CoalitionTask,
    solution: CoalitionSolution,
    path: str | os.PathLike,
    *,
    title: str = "",
) -> None:
    """Writes an animated GIF: all agents walk at one pace, wait where they must, and what is
    destroyed disappears.

    Raises:
      ImportError: Pillow is missing. ValueError: a batch was given, another ending than .gif, or an
        answer without routes.
    """
    if pathlib.Path(path).suffix.lower() != ".gif":
        raise ValueError(f"{path}: an animation is a GIF: end the name in .gif")
    kinds = _kinds(task, solution)
    if not Status(int(solution.status)).is_solved:
        raise ValueError("the answer has no routes to animate: draw a picture of it instead")
    require_module("PIL", extra="draw", what="an animation")
    from PIL import Image, ImageDraw, ImageFont

    times, when = _clock(solution)
    ids = np.asarray(solution.destroyed)[: int(solution.num_destroyed)].tolist()
    labels = np.asarray(task.labels)[:, : kinds.shape[0], : kinds.shape[1]]
    n = -(-max(kinds.shape) // (2 * _PIXELS))
    scale = max(1, _PIXELS // -(-max(kinds.shape) // n))
    font = ImageFont.load_default(12)

    def at(cell: Any) -> tuple[float, float]:
        return (cell[1] + 0.5) / n * scale, 24 + (cell[0] + 0.5) / n * scale

    shown, goals = [], np.asarray(task.goal).tolist()
    end = float(np.max(np.asarray(solution.finish)))
    for now in np.linspace(0, end, _FRAMES).tolist():
        gone = [i for i, time in zip(ids, when) if time <= now + 1e-6]
        here = np.where(
            np.isin(labels, gone).any(axis=0) & (np.isin(labels, [-1, *gone]).all(axis=0)),
            np.uint8(Kind.UNREACHED),
            kinds,
        )
        small = shrunk(here, -(-max(kinds.shape) // n))
        cells = PALETTE[small.repeat(scale, axis=0).repeat(scale, axis=1)]
        image = Image.new("RGB", (cells.shape[1], cells.shape[0] + 24), "white")
        image.paste(Image.fromarray(cells), (0, 24))
        pen = ImageDraw.Draw(image)
        text = f"{legible(title)}  time {now:.1f}, {len(gone)} of {len(ids)} destroyed".strip()
        pen.text((4, 6), text, fill="black", font=font)
        for agent in _agents(task):
            if min(goals[agent]) >= 0:
                pen.polygon(_star(*at(goals[agent]), 8), fill=_colour(agent), outline="white")
            route = np.asarray(solution.cells)[agent, : int(solution.num_cells[agent])]
            if not len(route):
                continue
            index = int(np.searchsorted(times[agent], now + 1e-6, side="right")) - 1
            if index > 0:
                pen.line([at(c) for c in route[: index + 1]], fill=_colour(agent), width=2)
            x, y = at(route[index])
            pen.ellipse((x - 5, y - 5, x + 5, y + 5), fill=_colour(agent), outline="white")
        shown.append((image.quantize(64), _QUICK))
    shown[-1] = (shown[-1][0], _LAST)
    save_gif(path, shown)


def _star(x: float, y: float, radius: float) -> list[tuple[float, float]]:
    """The corners of a star with five points."""
    turns = np.arange(10) * (np.pi / 5)
    radii = np.where(np.arange(10) % 2, 0.45, 1.0) * radius
    return list(zip((x + radii * np.sin(turns)).tolist(), (y - radii * np.cos(turns)).tolist()))


def _kinds(task: CoalitionTask, solution: CoalitionSolution) -> np.ndarray:
    if np.ndim(solution.status):
        raise ValueError("a picture shows one task and its answer, not a batch")
    height, width = np.asarray(task.size).tolist()
    labels = np.asarray(task.labels)[:, :height, :width]
    number = int(solution.num_destroyed) if Status(int(solution.status)).is_solved else 0
    destroyed = np.asarray(solution.destroyed)[:number]
    able = np.flatnonzero(np.asarray(task.able).any(axis=0))
    kinds = np.full((height, width), Kind.UNREACHED, np.uint8)
    kinds[(labels != -1).any(axis=0)] = Kind.DESTROYABLE
    kinds[np.isin(labels, destroyed).any(axis=0)] = Kind.DESTROYED
    kinds[((labels != -1) & ~np.isin(labels, able)).any(axis=0)] = Kind.INDESTRUCTIBLE
    return kinds


def _agents(task: CoalitionTask) -> list[int]:
    return [a for a, cell in enumerate(np.asarray(task.start).tolist()) if min(cell) >= 0]


def _colour(agent: int) -> str:
    return AGENTS[agent % len(AGENTS)]


def _headline(solution: CoalitionSolution) -> str:
    status = Status(int(solution.status))
    if not status.is_solved:
        return f"{status.name}: {status.meaning}"
    return (
        f"{status.name}: {int(solution.num_destroyed)} destroyed, removal cost"
        f" {float(solution.removal_cost):g} (bound {float(solution.removal_bound):g}), done at"
        f" {float(np.max(np.asarray(solution.finish))):.1f}"
    )


def _places(solution: CoalitionSolution) -> list[tuple[int, list[int]]]:
    if not Status(int(solution.status)).is_solved:
        return []
    cells = np.asarray(solution.cells)
    pairs = zip(
        np.asarray(solution.destroyed_by).tolist(), np.asarray(solution.destroyed_at).tolist()
    )
    return [(agent, cells[agent, at].tolist()) for agent, at in pairs if agent >= 0]


def _draw_agent(
    axes: Any, task: CoalitionTask, solution: CoalitionSolution, agent: int, place: float
) -> None:
    """Draws where an agent starts and ends, and its route, shifted by `place` times a little, so
    that those who walk the same way are all seen.
    """
    from matplotlib.transforms import ScaledTranslation

    colour = _colour(agent)
    options = {"markeredgecolor": "white", "linestyle": "none", "clip_on": False, "zorder": 5}
    route = np.asarray(solution.cells)[agent]
    route = route[route[:, 0] >= 0]
    if len(route) > 1:
        # in a direction that none of the eight moves has
        angle, inches = np.pi / 8, place * _APART / 72
        shift = ScaledTranslation(
            inches * np.cos(angle), inches * np.sin(angle), axes.figure.dpi_scale_trans
        )
        look = {"transform": axes.transData + shift, "clip_on": False}
        for tint, wide, over in (("white", 3.2, 3), (colour, 1.8, 3.5)):
            axes.plot(route[:, 1], route[:, 0], color=tint, linewidth=wide, zorder=over, **look)
    (row, col), (to_row, to_col) = np.asarray(task.start)[agent], np.asarray(task.goal)[agent]
    axes.plot(col, row, "o", color=colour, markersize=9, **options)
    if to_row >= 0:
        axes.plot(to_col, to_row, "*", color=colour, markersize=15, **options)


def _legend(task: CoalitionTask, solution: CoalitionSolution, kinds: np.ndarray) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shown: list[Any] = [
        Patch(
            facecolor=kind.colour,
            edgecolor="0.55",
            linewidth=0.5,
            label="free" if kind is Kind.UNREACHED else kind.called,
        )
        for kind in map(Kind, np.unique(kinds).tolist())
    ]
    for agent in _agents(task):
        shown.append(
            Line2D(
                [],
                [],
                color=_colour(agent),
                linewidth=2.2,
                label=f"agent {agent}",
            )
        )
    signs = [("o", 8, "start")]
    if (np.asarray(task.goal) >= 0).any():
        signs.append(("*", 12, "goal"))
    if _places(solution):
        signs.append(("D", 8, "destroys (in order)"))
    for sign, size, called in signs:
        shown.append(
            Line2D(
                [], [], color="0.45", marker=sign, markersize=size, linestyle="none", label=called
            )
        )
    return shown


def _clock(solution: CoalitionSolution) -> tuple[dict[int, np.ndarray], list[float]]:
    """When each agent is at each cell of its route, and when each obstacle is gone."""
    cells, needed = np.asarray(solution.cells), np.asarray(solution.needed)
    by, at = np.asarray(solution.destroyed_by), np.asarray(solution.destroyed_at)
    when: list[float] = []

    def times(agent: int) -> np.ndarray:
        route = cells[agent, : int(solution.num_cells[agent])]
        steps = np.where(abs(np.diff(route, axis=0)).sum(axis=1) == 2, 2**0.5, 1.0)
        now = [0.0]
        for index, step in enumerate(steps.tolist()):
            waits = [time for k, time in enumerate(when) if needed[agent, k] == index]
            now.append(max([now[-1], *waits]) + step)
        return np.array(now[: max(1, len(route))])

    for k in range(int(solution.num_destroyed)):
        when.append(float(times(int(by[k]))[int(at[k])]))
    return {agent: times(agent) for agent in range(len(cells))}, when
