"""Where things on the map are seen: cells in the agent's frame, in fuzzy words (PY16 §2).

The x axis runs to the right of the map, the y axis up; a cell's centre is its point. Lengths are in
metres where the side of a cell is known (`World.goal_side`), else in cell sides.
"""

from typing import Any

import numpy as np

from sign_model.space.fuzzy_table import DEFAULT_TABLE, FuzzyTable
from sign_model.space.view import Seen, View

__all__ = [
    "DEFAULT_TABLE",
    "FuzzyTable",
    "Seen",
    "View",
    "of_cells",
    "of_goal",
    "relocation",
    "view_from",
]


def view_from(cell: Any, *, heading: float, cell_side: float, table: FuzzyTable) -> View:
    """Returns the view from a cell; `heading` in degrees counter-clockwise from the right of the
    map, 90 is up.
    """
    return View(_points(cell, cell_side), float(np.deg2rad(heading)), table)


def of_goal(view: View, cell: Any, cell_side: float) -> Seen:
    """Returns how the goal square, one cell, is seen."""
    return view.of_square(_points(cell, cell_side), cell_side)


def of_cells(view: View, cells: Any, cell_side: float) -> Seen:
    """Returns how some cells, int [N, 2], are seen."""
    return view.of_points(_points(cells, cell_side))


def relocation(view: View, cells: Any, cell_side: float) -> dict:
    """Returns the relocation of which a stretch of route, int [N, 2], is an instance
    (`View.relocation`).
    """
    return view.relocation(_points(cells, cell_side))


def _points(cells: Any, cell_side: float) -> np.ndarray:
    return np.asarray(cells, float)[..., ::-1] * np.array([1.0, -1.0]) * cell_side
