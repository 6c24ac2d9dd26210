"""One task on one page: PNG, SVG or PDF."""

import contextlib
import io
import os
import pathlib
import textwrap
from collections.abc import Iterator
from typing import IO, Any, NamedTuple

import numpy as np

from sign_model.foundation.files import opened_for
from sign_model.foundation.legible import legible
from srt_jax.draw.parts.badges import draw_badges
from srt_jax.draw.parts.colours import APPROACH, BADGE, PALETTE, leg_colour, shrunk
from srt_jax.draw.parts.content import Scene, scene_of
from srt_jax.draw.parts.legend import MARKS, handles
from srt_jax.draw.parts.polar_frame import PolarFrame, caption, draw_frame
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.geometry.frame import Frame
from srt_jax.types import Approach, Solution, Task

FORMATS = (".png", ".svg", ".pdf")
_SIDE = 7.0
"""Inches of the map's longer side."""

_BESIDE, _AROUND = 0.62, 0.78
"""Inches of a page beside the map, for the numbers of its axis, and above and below it, for those
of the other axis, without what each line of the heading and the legend takes.
"""

_ENTRIES = 4
"""Entries in a line of the legend."""

_MOST_CELLS = 1050
"""Cells a side that a picture can show: one per pixel."""

_GRID_UP_TO = 40
"""Cells a side up to which thin lines part them."""


class Picture(NamedTuple):
    """A picture that a notebook shows.

    Attributes:
      png: the bytes of the file.
    """

    png: bytes

    def __repr__(self) -> str:
        return f"Picture({len(self.png)} bytes of PNG)"

    def _repr_png_(self) -> bytes:
        return self.png


def draw(
    task: Task,
    solution: Solution | None = None,
    path: str | os.PathLike | IO[bytes] | None = None,
    *,
    title: str = "",
    polar: PolarFrame | None = None,
    axes: Any = None,
    kind: str = "png",
    frame: Frame | None = None,
    approach: Approach | None = None,
) -> Picture | None:
    """Draws one task and its solution: into a file, into a buffer, onto axes, or as what a notebook
    shows.

    Args:
      solution: None draws the task alone.
      path: a name, whose ending decides the format (.png, .svg, .pdf), or a file open for bytes.
        None returns the picture. Matplotlib axes are taken as `axes`.
      title: written above it.
      polar: draws the agent's frame with the fuzzy sectors over the map.
      axes: matplotlib axes to draw on, without title and legend; nothing is written then.
      kind: png, svg or pdf: the format where `path` is an open file.
      frame: where the map lies: axes and lengths are in metres, where it has any.
      approach: the way as near as one gets, of an unsolved task, where it is known; else it is
        found.

    Raises:
      ImportError: matplotlib is missing. ValueError: a batch was given, the format is none of
        these, or both `path` and `axes` were given.

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
      >>> draw(task, solution).png[:4]  # a notebook shows it
      b'\x89PNG'
    """
    options = {"frame": frame, "approach": approach}
    if axes is None and is_axes(path):
        path, axes = None, path
    if axes is not None:
        if path is not None:
            raise ValueError("a picture goes onto axes or to a path: give one of them")
        draw_map(axes, scene_of(task, solution, **options))
        return None
    if path is None:
        buffer = io.BytesIO()
        draw(task, solution, buffer, title=title, polar=polar, **options)
        return Picture(buffer.getvalue())
    scene = scene_of(task, solution, **options)
    polar = polar and polar.over(frame)
    height, width = scene.kinds.shape
    heading = [
        *textwrap.wrap(legible(title), 76, max_lines=2, placeholder=" …"),
        *textwrap.wrap(scene.headline, 80),  # no line where it is empty
        *([caption(scene, polar)] if polar else []),
    ]
    require_module("matplotlib", extra="draw", what="drawing")
    entries = handles([scene])
    margins = _AROUND + 0.18 * (len(heading) + -(-len(entries) // _ENTRIES))
    size = (_SIDE, (_SIDE - _BESIDE) * min(2.5, max(0.1, height / width)) + margins)
    with page(path, size=size, kind=kind) as figure:
        axes = figure.add_subplot()
        draw_map(axes, scene)
        axes.set_title("\n".join(heading), fontsize=10, parse_math=False)
        label_axes(axes, scene)
        figure.legend(
            handles=entries,
            loc="outside lower center",
            ncols=_ENTRIES,
            fontsize=8,
            frameon=False,
        )
        scale = settle(figure, axes, width)
        if polar:
            draw_frame(axes, scene, polar, scale)
        draw_badges(axes, scene, scale)
    return None


def is_axes(place: Any) -> bool:
    """Whether a place to draw at is matplotlib's axes, and no file."""
    return hasattr(place, "imshow") and hasattr(place, "set_xlim")


@contextlib.contextmanager
def page(
    path: str | os.PathLike | IO[bytes], *, size: tuple[float, float], kind: str = "png"
) -> Iterator[Any]:
    """Yields a figure of its own (no global state), in inches; saves it, whole or not at all, when
    all went well: under a name, or as `kind` into an open file.
    """
    target = pathlib.Path(path) if isinstance(path, str | os.PathLike) else None
    ending = f".{kind}" if target is None else target.suffix
    if ending.lower() not in FORMATS:
        raise ValueError(
            f"{path}: cannot draw a picture with the ending {ending!r}: use one of"
            f" {', '.join(FORMATS)}"
        )
    require_module("matplotlib", extra="draw", what="drawing")
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained", dpi=150)
    yield figure
    kind = ending[1:].lower()
    if target is not None:
        target.parent.mkdir(parents=True, exist_ok=True)
    # Nothing of the moment in the file: the same task gives the same bytes.
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
    with rc_context({"svg.hashsalt": "srt-jax", "svg.fonttype": "path"}), opened_for(path) as file:
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
    draw_cells(axes, scene.kinds, most_cells)
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


def draw_cells(axes, kinds: np.ndarray, most_cells: int) -> None:
    """Draws the cells of a map, uint8 [H, W] of `Kind`, on axes whose data are columns and rows;
    maps of more cells a side than `most_cells` are shrunk.
    """
    n = -(-max(kinds.shape) // most_cells)
    small = shrunk(kinds, most_cells)
    extent = (-0.5, small.shape[1] * n - 0.5, small.shape[0] * n - 0.5, -0.5)
    axes.imshow(PALETTE[small], interpolation="nearest", extent=extent)


def label_axes(axes, scene: Scene) -> None:
    """Names the axes: rows and columns, or metres where the map has them."""
    frame = scene.frame
    if frame is None:
        axes.set_xlabel("column")
        axes.set_ylabel("row")
        for axis in (axes.xaxis, axes.yaxis):
            axis.get_major_locator().set_params(integer=True)
        return
    from matplotlib.ticker import MaxNLocator

    # Of a turned map metres go along its sides, from its own corner.
    x, y = (0.0, 0.0) if frame.yaw else frame.corner
    turned = f", turned by {np.degrees(frame.yaw):g} degrees" if frame.yaw else ""
    axes.set_xlabel(f"x, metres{turned}")
    axes.set_ylabel("y, metres")
    height, width = scene.kinds.shape
    for axis, low, count, is_up in ((axes.xaxis, x, width, False), (axes.yaxis, y, height, True)):
        locator = MaxNLocator(7, steps=[1, 2, 5, 10])
        ticks = np.asarray(locator.tick_values(low, low + count * frame.side))
        places = (ticks - low) / frame.side - 0.5
        is_inside = (places >= -0.5 - 1e-6) & (places <= count - 0.5 + 1e-6)
        places = count - 1 - places if is_up else places
        labels = [f"{tick:.6g}" for tick in ticks[is_inside]]
        axis.set_ticks(places[is_inside], labels=labels)


def _draw_route(axes, scene: Scene, zoom: float) -> None:
    if scene.approach is not None and len(scene.approach) > 1:
        for colour, width, dashes in (("white", 3.6, "-"), (APPROACH, 2.0, (0, (2.2, 1.4)))):
            axes.plot(
                scene.approach[:, 1],
                scene.approach[:, 0],
                color=colour,
                linewidth=width * zoom,
                linestyle=dashes,
                zorder=3,
            )
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
