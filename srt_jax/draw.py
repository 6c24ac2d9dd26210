"""Pictures of a task and its solution: map, reached region, seed, contour, destroyed obstacles, route. Needs matplotlib."""

import os
import pathlib
import tempfile

import numpy as np

from srt_jax.types import FREE, Solution, Status, Task

# Okabe and Ito's palette, which colour-blind people can tell apart, and greys.
_PAPER, _FIRM, _DESTROYABLE = (1.0, 1.0, 1.0), (0.45, 0.45, 0.48), (0.90, 0.62, 0.00)
_REACHED, _CONTOUR, _DESTROYED = (0.80, 0.91, 0.97), (0.84, 0.37, 0.00), (0.80, 0.47, 0.65)
_ROUTE, _START, _GOAL, _SEED = "#0072b2", "#009e73", "#d55e00", "#000000"


def draw(task: Task, solution: Solution, path: str | os.PathLike, *, title: str = "") -> None:
    """Writes a picture of one task and its solution; the ending of `path` decides the format (.png, .svg, .pdf).

    Raises:
      ImportError: matplotlib is missing. ValueError: a batch was given.
    """
    figure_of(task, solution, title=title, save_to=pathlib.Path(path))


def figure_of(task: Task, solution: Solution, *, title: str, save_to: pathlib.Path) -> None:
    """Draws on a figure of its own (no global pyplot state) and saves it by an atomic rename."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("drawing needs matplotlib: pip install 'srt-jax[draw]'") from error
    if np.ndim(task.labels) != 3:
        raise ValueError(f"draw takes one task, got labels of shape {list(np.shape(task.labels))}: call unstack first")
    height, width = np.asarray(task.size).tolist()
    figure = Figure(figsize=(7, 7 * min(2.5, max(0.4, height / width)) + 1.1), layout="constrained", dpi=150)
    axes = figure.add_subplot()
    axes.imshow(_raster(task, solution)[:height, :width], interpolation="nearest")
    _draw_route(axes, solution)
    _draw_places(axes, task, solution)
    axes.set_title(f"{title}\n{_headline(solution)}".strip(), fontsize=10)
    axes.set_xlabel("column")
    axes.set_ylabel("row")
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    handles = [*_patches(task, solution), *axes.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    save_to.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=save_to.parent) as folder:
        whole = pathlib.Path(folder) / save_to.name
        figure.savefig(whole)
        os.replace(whole, save_to)


def _raster(task: Task, solution: Solution) -> np.ndarray:
    """Returns the colour of every cell: float [H, W, 3]."""
    labels, destroyable = np.asarray(task.labels), np.asarray(task.destroyable)
    destroyed = np.asarray(solution.destroyed)
    destroyed = destroyed[destroyed >= 0]
    free = (labels == FREE).all(axis=0)
    picture = np.empty((*free.shape, 3))
    picture[:] = _PAPER
    picture[_reached(task, free)] = _REACHED
    picture[~free] = _FIRM
    can_go = np.where(labels >= 0, destroyable[labels.clip(0)], labels == FREE).all(axis=0) & ~free
    picture[can_go] = _DESTROYABLE
    picture[np.isin(labels, destroyed).any(axis=0)] = _DESTROYED
    picture[np.asarray(solution.contour)] = _CONTOUR
    return picture


def _reached(task: Task, free: np.ndarray) -> np.ndarray:
    from srt_jax.reach import reach

    return np.asarray(reach(free, np.asarray(task.start)))


def _draw_route(axes, solution: Solution) -> None:
    cells = np.asarray(solution.cells)[: int(solution.num_cells)]
    if Status(int(solution.status)).is_solved:
        axes.plot(cells[:, 1], cells[:, 0], color="white", linewidth=3.2, solid_capstyle="round")
        axes.plot(cells[:, 1], cells[:, 0], color=_ROUTE, linewidth=1.6, label="route", solid_capstyle="round")


def _draw_places(axes, task: Task, solution: Solution) -> None:
    """Marks, the larger ones below, so that two in one cell both show."""
    at = np.asarray(solution.destroyed_at)[: int(solution.num_destroyed)]
    places: list[tuple] = [("start", "o", _START, 9, [task.start]), ("goal", "*", _GOAL, 15, [task.goal])]
    if np.asarray(solution.seed)[0] >= 0:
        places.append(("seed", "X", _SEED, 11, [solution.seed]))
    if len(at):
        places.append(("destroys from here", "D", _ROUTE, 5, np.asarray(solution.cells)[at]))
    for name, sign, colour, size, cells in places:
        rows, cols = np.asarray(cells).T
        axes.plot(cols, rows, sign, color=colour, markersize=size, markeredgecolor="white", linestyle="none", label=name)


def _patches(task: Task, solution: Solution) -> list:
    from matplotlib.patches import Patch

    shown = [("reached at first", _REACHED), ("firm obstacle", _FIRM)]
    remaining = np.setdiff1d(np.flatnonzero(task.destroyable), np.asarray(solution.destroyed))
    if np.isin(task.labels, remaining).any():
        shown.append(("destroyable obstacle", _DESTROYABLE))
    if int(solution.num_destroyed):
        shown.append(("destroyed", _DESTROYED))
    if np.asarray(solution.contour).any():
        shown.append(("contour", _CONTOUR))
    return [Patch(facecolor=colour, edgecolor="0.6", linewidth=0.5, label=name) for name, colour in shown]


def _headline(solution: Solution) -> str:
    status = Status(int(solution.status))
    if not status.is_solved:
        return status.meaning
    return f"{status.name}: route {float(solution.cost):.1f} cell sides, {int(solution.num_destroyed)} destroyed"
