"""The picture of joined regions: the map, the region that then holds them all, and what is
destroyed.
"""

import os
import textwrap
from collections.abc import Sequence
from typing import IO

import numpy as np

from sign_model.foundation.legible import legible
from srt_jax.connecting.connect import Connection
from srt_jax.draw.parts.colours import Kind
from srt_jax.draw.parts.content import Scene, cell_kinds, free_without, own_labels
from srt_jax.draw.parts.legend import MARKS
from srt_jax.draw.picture import draw_cells, label_axes, page
from srt_jax.geometry.frame import Frame
from srt_jax.types import Array, Cell, Task

_SIDE = 7.0
_MOST_CELLS = 1050


def draw_connection(
    task: Task,
    connection: Connection,
    path: str | os.PathLike | IO[bytes],
    *,
    cells: Array | Sequence[Cell] | None = None,
    title: str = "",
    frame: Frame | None = None,
) -> None:
    """Writes a picture of what `connect` found: in the colour of what is reached the region that
    holds all, what is destroyed in its own, and a mark on each of `cells`; the ending of `path`
    decides the format, as in `draw`.

    Args:
      task: the single task that `connect` was given.
      connection: what it returned.
      path: a name, or a file open for bytes.
      cells: integer [k, 2], (row, col), as given to `connect`.
      title: written above it. frame: where the map lies, for metres on the axes.

    Raises:
      ImportError: matplotlib is missing. ValueError: another ending.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import draw_connection
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> path = os.path.join(tempfile.mkdtemp(), "joined.png")
      >>> draw_connection(task, srt_jax.connect(task), path)
      >>> os.path.exists(path)
      True
    """
    height, width = own_labels(task).shape[1:]
    gone = np.isin(np.arange(len(task.destroyable)), connection.destroyed)
    # Drawn as the map stands, so that what is destroyed shows.
    kinds = cell_kinds(task)
    free = free_without(task)
    joined = np.asarray(connection.joined)[:height, :width]
    kinds[free] = np.where(joined, Kind.REACHED, Kind.UNREACHED)[free]
    kinds[free_without(task, gone) & ~free] = Kind.DESTROYED
    here = (0, 0)
    shown = frame if frame is not None and frame.has_metres else None
    scene = Scene(kinds, here, here, None, [], [], None, "", frame=shown)
    tall = _SIDE * min(2.0, max(0.4, height / width))
    with page(path, size=(_SIDE, max(3.0, tall) + 0.6)) as figure:
        axes = figure.subplots()
        draw_cells(axes, kinds, _MOST_CELLS)
        sign, colour, size = MARKS["start"]
        for row, col in [] if cells is None else np.asarray(cells).tolist():
            axes.plot(col, row, sign, color=colour, markersize=size, markeredgecolor="white")
        label_axes(axes, scene)
        ids = ", ".join(map(str, connection.destroyed)) or "nothing"
        lines = textwrap.wrap(legible(title), 80, max_lines=2, placeholder=" …")
        lines += textwrap.wrap(f"destroyed: {ids}", 80, max_lines=2, placeholder=" …")
        axes.set_title("\n".join(lines), fontsize=10, parse_math=False)
