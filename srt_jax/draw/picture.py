"""One task on one page: PNG, SVG or PDF."""

import contextlib
import os
import pathlib
import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np

from sign_model.ground.legible import legible
from srt_jax.draw.badges import draw_badges
from srt_jax.draw.colours import BADGE, PALETTE, leg_colour, shrunk
from srt_jax.draw.content import Scene, scene_of
from srt_jax.draw.legend import MARKS, handles
from srt_jax.draw.polar_frame import PolarFrame, caption, draw_frame
from srt_jax.formats.files import atomic_write
from srt_jax.types import Solution, Task

FORMATS = (".png", ".svg", ".pdf")
_SIDE = 7.0
"""Inches of the map's longer side."""

_MOST_CELLS = 1050
"""Cells a side that a picture can show: one per pixel."""

_GRID_UP_TO = 40
"""Cells a side up to which thin lines part them."""


def draw(
    task: Task,
    solution: Solution,
    path: str | os.PathLike,
    *,
    title: str = "",
    polar: PolarFrame | None = None,
) -> None:
    """Writes a picture of one task and its solution; the ending of `path` decides the format (.png,
    .svg, .pdf).

    Args:
      polar: draws the agent's frame with the fuzzy sectors over the map.

    Raises:
      ImportError: matplotlib is missing. ValueError: a batch was given, or the ending is none of
        these.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import draw
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> path = os.path.join(tempfile.mkdtemp(), "one.png")
      >>> draw(task, solution, path, title="a wall")
      >>> os.path.exists(path)
      True
    """
    scene = scene_of(task, solution)
    height, width = scene.kinds.shape
    heading = [
        *textwrap.wrap(legible(title), 76, max_lines=2, placeholder=" …"),
        *textwrap.wrap(scene.headline, 80),
        *([caption(scene, polar)] if polar else []),
    ]
    margins = 1.4 + 0.18 * len(heading)
    with page(path, size=(_SIDE, _SIDE * min(2.5, max(0.1, height / width)) + margins)) as figure:
        axes = figure.add_subplot()
        draw_map(axes, scene)
        axes.set_title("\n".join(heading), fontsize=10, parse_math=False)
        axes.set_xlabel("column")
        axes.set_ylabel("row")
        for axis in (axes.xaxis, axes.yaxis):
            axis.get_major_locator().set_params(integer=True)
        figure.legend(
            handles=handles([scene]), loc="outside lower center", ncols=4, fontsize=8, frameon=False
        )
        scale = settle(figure, axes, width)
        if polar:
            draw_frame(axes, scene, polar, scale)
        draw_badges(axes, scene, scale)


@contextlib.contextmanager
def page(path: str | os.PathLike, *, size: tuple[float, float]) -> Iterator[Any]:
    """Yields a figure of its own (no global state), in inches; saves it, whole or not at all, when
    all went well.
    """
    target = pathlib.Path(path)
    if target.suffix.lower() not in FORMATS:
        raise ValueError(
            f"{path}: cannot draw a picture with the ending {target.suffix!r}: use one of"
            f" {', '.join(FORMATS)}"
        )
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError("drawing needs matplotlib: pip install 'srt-jax[draw]'") from error
    figure = Figure(figsize=size, layout="constrained", dpi=150)
    yield figure
    target.parent.mkdir(parents=True, exist_ok=True)
    kind = target.suffix[1:].lower()
    # Nothing of the moment in the file: the same task gives the same bytes.
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    with (
        rc_context({"svg.hashsalt": "srt-jax", "svg.fonttype": "path"}),
        atomic_write(target, "wb") as file,
    ):
        figure.savefig(file, format=kind, metadata=metadata)


def settle(figure, axes, width: int) -> float:
    """Fixes the layout, and returns how many points a cell side has."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    box = axes.get_window_extent()
    return box.width * 72 / figure.dpi / width


def draw_map(axes, scene: Scene, *, zoom: float = 1.0, most_cells: int = _MOST_CELLS) -> None:
    """Draws cells, route and marks on axes whose data are columns and rows; `zoom` scales lines and
    marks.
    """
    height, width = scene.kinds.shape
    kinds = shrunk(scene.kinds, most_cells)
    n = -(-max(height, width) // most_cells)
    extent = (-0.5, kinds.shape[1] * n - 0.5, kinds.shape[0] * n - 0.5, -0.5)
    axes.imshow(PALETTE[kinds], interpolation="nearest", extent=extent)
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    if max(height, width) <= _GRID_UP_TO and zoom == 1:
        axes.vlines(
            np.arange(width - 1) + 0.5, -0.5, height - 0.5, color="0.8", linewidth=0.4, zorder=1.5
        )
        axes.hlines(
            np.arange(height - 1) + 0.5, -0.5, width - 0.5, color="0.8", linewidth=0.4, zorder=1.5
        )
    _draw_route(axes, scene, zoom)
    _draw_marks(axes, scene, zoom)


def _draw_route(axes, scene: Scene, zoom: float) -> None:
    for leg in scene.legs:
        axes.plot(
            leg[:, 1],
            leg[:, 0],
            color="white",
            linewidth=3.6 * zoom,
            solid_capstyle="round",
            zorder=3,
        )
    for index, leg in enumerate(scene.legs):
        axes.plot(
            leg[:, 1],
            leg[:, 0],
            color=leg_colour(index),
            linewidth=2 * zoom,
            solid_capstyle="round",
            zorder=3.5,
        )


def _draw_marks(axes, scene: Scene, zoom: float) -> None:
    places = [("goal", scene.goal), ("seed", scene.seed), ("start", scene.start)]
    options: dict[str, Any] = {
        "markeredgecolor": "white",
        "linestyle": "none",
        "clip_on": False,
        "markeredgewidth": zoom,
    }
    for name, cell in places:
        if cell:
            sign, colour, size = MARKS[name]
            axes.plot(
                cell[1], cell[0], sign, color=colour, markersize=size * zoom, zorder=5, **options
            )
    for removal in scene.removals:
        row, col = removal.standing
        axes.plot(col, row, "D", color=BADGE, markersize=5.5 * zoom, zorder=5.5, **options)
