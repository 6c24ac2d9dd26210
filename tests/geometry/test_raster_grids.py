"""Grids over a world: the way between metres and cells, and grids that cannot be."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from srt_jax.geometry.raster import Grid, cell_of, cover, grid_over, point_of, square_grid

GRID = Grid(origin=(0, 6), side=1, height=6, width=7)


def test_a_point_on_a_line_between_cells_belongs_to_the_lower_right_one():
    points = [(0, 6), (1, 5), (6.999999999, 0.000000001), (7, 0), (0.999999999, 5.000000001)]
    assert cell_of(GRID, points).tolist() == [[0, 0], [1, 1], [5, 6], [5, 6], [0, 0]]


@settings(deadline=None)
@given(
    row=st.integers(0, 499),
    col=st.integers(0, 999),
    side=st.floats(1e-3, 1e3),
    x=st.floats(-1e6, 1e6),
    y=st.floats(-1e6, 1e6),
)
def test_the_centre_of_a_cell_lies_in_that_cell(row, col, side, x, y):
    grid = Grid(origin=(x, y), side=side, height=500, width=1000)
    assert cell_of(grid, point_of(grid, (row, col))).tolist() == [row, col]


def test_cells_and_points_outside_the_grid_are_refused():
    for point in [(-1e-9, 3), (7.1, 3), (3, 6.1), (3, -1e-9), (np.nan, 1)]:
        with pytest.raises(ValueError):
            cell_of(GRID, point)
    for cell in [(-1, 0), (6, 0), (0, 7), (0,)]:
        with pytest.raises(ValueError, match="inside the grid"):
            point_of(GRID, cell)
    with pytest.raises(TypeError, match="integers"):
        point_of(GRID, (0.5, 1.0))


def test_the_square_grid_lies_in_the_middle_and_spans_the_shorter_side():
    grid = square_grid((0, 0, 10, 31), 4)
    assert (grid.height, grid.width, grid.side) == (4, 4, 2.5) and grid.origin == (0, 20.5)


@pytest.mark.parametrize(
    ("message", "call"),
    [
        ("rule 'corner' is unknown", lambda: cover([], GRID, rule="corner")),
        ("no cell with side 9 m fits", lambda: grid_over((0, 0, 10, 8), 9)),
        ("no cell with side 0 m fits", lambda: grid_over((0, 0, 10, 8), 0)),
        ("too large", lambda: grid_over((0, 0, 1e5, 1e5), 1e-3)),
        ("empty", lambda: Grid((0, 0), 1, 0, 3)),
        ("empty", lambda: Grid((0, 0), -1, 3, 3)),
        ("finite", lambda: Grid((0, np.nan), 1, 3, 3)),
        ("at least one cell", lambda: square_grid((0, 0, 1, 1), 0)),
    ],
)
def test_a_grid_that_cannot_be_is_refused(message, call):
    with pytest.raises(ValueError, match=message):
        call()
