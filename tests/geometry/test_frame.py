"""Where cells lie in the world: against the formula of ROS, turned and not, and on the globe."""

import math

import numpy as np
import pytest

from srt_jax import Frame
from srt_jax.geometry.projection import Projection


@pytest.mark.parametrize("yaw", [0.0, 0.3, -2.0, math.pi / 2])
def test_a_cell_lies_where_the_map_server_has_it(yaw):
    height, width, side, corner = 7, 11, 0.05, (-1.25, 3.5)
    frame = Frame.over(corner, side, height=height, width=width, yaw=yaw)
    for row in range(height):
        for col in range(width):
            # the map's own axes: x along the columns, y up from the lowest row
            along, up = (col + 0.5) * side, (height - 1 - row + 0.5) * side
            x = corner[0] + math.cos(yaw) * along - math.sin(yaw) * up
            y = corner[1] + math.sin(yaw) * along + math.cos(yaw) * up
            assert frame.point_of((row, col)) == pytest.approx((x, y), abs=1e-9)
            assert frame.cell_of((x, y)).tolist() == [row, col]


def test_points_in_a_cell_belong_to_it_and_those_outside_are_told_the_extent():
    frame = Frame.over((-10.0, -9.6), 0.05, height=384, width=400)
    rng = np.random.default_rng(0)
    cells = np.stack([rng.integers(384, size=200), rng.integers(400, size=200)], axis=1)
    points = frame.point_of(cells) + rng.uniform(-0.0249, 0.0249, (200, 2))
    assert np.array_equal(frame.cell_of(points), cells)
    assert frame.cell_of((10.0, -9.6)).tolist() == [383, 399]  # the outer corner
    with pytest.raises(
        ValueError, match=r"\(10\.1, 0\) lies outside the map: x goes from -10 to 10"
    ):
        frame.cell_of((10.1, 0))
    turned = Frame.over((0.0, 0.0), 1.0, height=2, width=4, yaw=math.pi / 2)
    with pytest.raises(ValueError, match=r"x goes from -2 to .* turned by 1\.5708 radians"):
        turned.cell_of((1.0, 1.0))
    with pytest.raises(ValueError, match="holds nan"):
        frame.cell_of((math.nan, 0.0))


def test_degrees_lead_to_the_same_cell_as_metres():
    projection = Projection(24.94, 60.17)
    frame = Frame.over((-300.0, -200.0), 2.0, height=200, width=300, projection=projection)
    place = frame.place_of((20, 30))
    assert frame.cell_at(place).tolist() == [20, 30]
    # a degree of longitude there is 55.5 km (WGS 84), of latitude 111.4 km
    assert place[0] == pytest.approx(24.94 + frame.point_of((20, 30))[0] / 55_519, abs=1e-5)
    assert place[1] == pytest.approx(60.17 + frame.point_of((20, 30))[1] / 111_416, abs=1e-5)
    with pytest.raises(ValueError, match="does not say where it lies on the globe"):
        Frame.of_cells(3, 3).cell_at((24.9, 60.1))
    with pytest.raises(ValueError, match="yaw of a map is nan"):
        Frame.over((0.0, 0.0), 1.0, height=1, width=1, yaw=math.nan)
