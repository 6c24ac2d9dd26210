"""Many tasks on one page, small, with one legend."""

import io
import math
import os
from collections.abc import Iterable, Sequence
from typing import IO

from sign_model.foundation.legible import legible
from srt_jax.draw.parts.content import length_in, scene_of
from srt_jax.draw.parts.legend import handles
from srt_jax.draw.picture import Picture, draw_map, page
from srt_jax.geometry.frame import Frame
from srt_jax.types import Solution, Status, Task

MOST_ON_SHEET = 120
"""Tasks on one sheet."""

_WIDTH = 10.0
_LONGEST_NAME = 24


def contact_sheet(
    named: Iterable[tuple[str, Task, Solution]],
    path: str | os.PathLike | IO[bytes] | None = None,
    *,
    title: str = "",
    frames: Sequence[Frame | None] | None = None,
) -> Picture | None:
    """Writes a sheet with a small picture of each (name, task, solution); the ending decides the
    format, as in `draw`.

    Args:
      path: as in `draw`; None returns the sheet for a notebook.
      frames: where the map of each task lies, None where that is not known; then its route's length
        is told in metres.

    Raises:
      ImportError: matplotlib is missing. ValueError: no task, more than MOST_ON_SHEET, or what
        `draw` refuses.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import contact_sheet
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> path = os.path.join(tempfile.mkdtemp(), "sheet.svg")
      >>> contact_sheet([("a wall", task, solution)] * 2, path)
      >>> os.path.exists(path)
      True
    """
    named = list(named)
    if path is None:
        buffer = io.BytesIO()
        contact_sheet(named, buffer, title=title, frames=frames)
        return Picture(buffer.getvalue())
    if not 0 < len(named) <= MOST_ON_SHEET:
        raise ValueError(
            f"a contact sheet holds 1 to {MOST_ON_SHEET} tasks, got {len(named)}: make several"
            " sheets"
        )
    known = [None] * len(named) if frames is None else frames
    scenes = [
        scene_of(task, solution, frame=frame) for (_, task, solution), frame in zip(named, known)
    ]
    columns = min(len(named), 8, max(3, math.ceil(math.sqrt(1.2 * len(named)))))
    rows = math.ceil(len(named) / columns)
    width = _WIDTH if columns > 2 else 3.4 * columns
    cell = width / columns
    tallest = min(1.2, max(scene.kinds.shape[0] / scene.kinds.shape[1] for scene in scenes))
    with page(path, size=(width, rows * (cell * max(0.15, tallest) + 0.42) + 1.0)) as figure:
        for place, ((name, _, solution), scene) in enumerate(zip(named, scenes)):
            axes = figure.add_subplot(rows, columns, place + 1)
            draw_map(axes, scene, zoom=max(0.4, min(0.75, cell / 4)), most_cells=int(cell * 150))
            axes.set_xticks([])
            axes.set_yticks([])
            outcome = _outcome(scene.status, len(scene.removals))
            if scene.frame is not None and scene.status is not None and scene.status.is_solved:
                outcome += f", {length_in(solution.cost, scene.frame)}"
            heading = f"{_shortened(legible(name), int(cell * 15))}\n{outcome}"
            axes.set_title(heading, fontsize=6.5, parse_math=False)
        if title:
            figure.suptitle(legible(title), fontsize=10, parse_math=False)
        figure.legend(
            handles=handles(scenes),
            loc="outside lower center",
            ncols=6 if columns > 2 else 3,
            fontsize=7,
            frameon=False,
        )
    return None


def _outcome(status: Status | None, num_removals: int) -> str:
    if status is None:
        return ""
    is_breaking = num_removals and status.is_solved
    return f"{status.name}, {num_removals} destroyed" if is_breaking else status.name


def _shortened(name: str, most: int) -> str:
    most = min(most, _LONGEST_NAME) if most < _LONGEST_NAME else most
    return name if len(name) <= most else f"{name[: most // 2 - 1]}…{name[-(most - most // 2) :]}"
