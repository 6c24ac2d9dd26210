"""Start and goal where nobody names them: on opposite sides of the largest free region."""

import numpy as np

from srt_jax.components import largest_region
from srt_jax.types import Cell


def opposite_cells(free: np.ndarray) -> tuple[Cell, Cell]:
    """Returns two cells of the largest free region, at its two ends along its longer side; the same
    for the same map.

    Of the cells at an end the one nearest the middle of that end is taken, of equally near ones the
    first in row order. Of equally large regions the first counts; of equally long sides, west to
    east.

    Args:
      free: bool [H, W].

    Raises:
      ValueError: nothing is free.
    """
    cells = np.argwhere(largest_region(np.asarray(free, bool)))
    if not len(cells):
        raise ValueError(
            "no cell is free, so that there is no place for a start: take smaller cells"
        )
    spans = np.ptp(cells, axis=0)
    along = int(spans[0] > spans[1]) ^ 1
    ends = []
    for place in (cells[:, along].min(), cells[:, along].max()):
        at_end = cells[cells[:, along] == place]
        across = at_end[:, 1 - along]
        row, col = at_end[np.argmin(np.abs(2 * across - (across.min() + across.max())))].tolist()
        ends.append((row, col))
    return ends[0], ends[1]
