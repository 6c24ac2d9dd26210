"""The front of lengths against removal costs as a plot, with its routes on the map."""

import os
import textwrap
from collections.abc import Sequence

import numpy as np

from sign_model.foundation.legible import legible
from srt_jax.draw.parts.colours import leg_colour
from srt_jax.draw.parts.content import scene_of
from srt_jax.draw.parts.legend import MARKS
from srt_jax.draw.picture import draw_cells, page
from srt_jax.tolls.pareto_front import Tradeoff
from srt_jax.types import Task

_SIDE = 5.0
_MOST_CELLS = 750


def draw_tradeoffs(
    task: Task, front: Sequence[Tradeoff], path: str | os.PathLike, *, title: str = ""
) -> None:
    """Writes a picture of a front: the routes on the map, and beside it length against removal
    cost, each point in the colour of its route; the ending of `path` decides the format, as in
    `draw`.

    Raises:
      ImportError: matplotlib is missing. ValueError: no point, a batch, or another ending.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import draw_tradeoffs
      >>> free = np.ones((21, 21), bool)
      >>> free[:20, 10] = False  # a wall with a gap far away
      >>> task = srt_jax.make_task(free, (0, 8), (0, 12))
      >>> path = os.path.join(tempfile.mkdtemp(), "front.png")
      >>> draw_tradeoffs(task, srt_jax.tradeoffs(task, tolls=(1, 100)), path)
      >>> os.path.exists(path)
      True
    """
    if not front:
        raise ValueError("the front is empty: there is no route to draw")
    # What would be gone on one route stands on another: the map is drawn with everything there.
    scene = scene_of(task, front[-1].solution)
    height, width = scene.kinds.shape
    tall = _SIDE * min(2.0, max(0.4, height / width))
    with page(path, size=(2 * _SIDE, max(3.0, tall) + 0.6)) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
        draw_cells(left, scene.kinds, _MOST_CELLS)
        # The longest route lies lowest: shorter ones leave it only where they break through.
        for index in reversed(range(len(front))):
            solution = front[index].solution
            cells = np.asarray(solution.cells)[: int(solution.num_cells)]
            left.plot(cells[:, 1], cells[:, 0], color="white", linewidth=3.4)
            left.plot(cells[:, 1], cells[:, 0], color=leg_colour(index), linewidth=2)
            at = np.asarray(solution.destroyed_at)[: int(solution.num_destroyed)]
            left.plot(cells[at, 1], cells[at, 0], "D", color=leg_colour(index), markersize=5)
        for name, cell in (("start", scene.start), ("goal", scene.goal)):
            sign, colour, size = MARKS[name]
            left.plot(
                cell[1], cell[0], sign, color=colour, markersize=size, markeredgecolor="white"
            )
        left.set_xlabel("column")
        left.set_ylabel("row")

        lengths, costs = ([point[i] for point in front] for i in (0, 1))
        right.plot(lengths, costs, color="0.7", linewidth=1, zorder=1)
        for index, point in enumerate(front):
            right.plot(point.length, point.removal_cost, "o", color=leg_colour(index), zorder=2)
            low, high = point.tolls
            tolls = f"{low:.3g}" if low == high else f"{low:.3g} to {high:.3g}"
            right.annotate(
                f"toll {tolls}",
                (point.length, point.removal_cost),
                xytext=(5, 4),
                textcoords="offset points",
                fontsize=7,
            )
        right.margins(x=0.2, y=0.1)
        right.set_xlabel("length of the route, cell sides")
        right.set_ylabel("removal cost")
        heading = textwrap.wrap(legible(title), 100, max_lines=2, placeholder=" …")
        if heading:
            figure.suptitle("\n".join(heading), fontsize=10, parse_math=False)
