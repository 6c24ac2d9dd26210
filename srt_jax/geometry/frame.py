"""Where the cells of one map lie in the world: metres from a corner, turned, and perhaps degrees.

A `Frame` comes with every map and place that is read (`formats.reading.Source.frame`,
`GridMap.frame`). On maps that are not turned all is decided in whole nanometres (`raster`).
"""

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike

from srt_jax.geometry import raster
from srt_jax.geometry.projection import Projection
from srt_jax.geometry.raster import Grid
from srt_jax.geometry.rings import as_metres


@dataclasses.dataclass(frozen=True)
class Frame:
    """Where the cells of a map lie.

    Attributes:
      grid: of the cells, before it is turned.
      yaw: by how much the map is turned about the outer corner of its lower left cell, in radians
        counter-clockwise.
      projection: from the metres of the frame to longitude and latitude, where that is known.
      has_metres: whether the unit is the metre; else it is the side of a cell, of which the map
        does not say how long it is.

    Examples:
      >>> import srt_jax
      >>> frame = srt_jax.Frame.over((-10.0, -5.0), 0.05, height=384, width=400)
      >>> frame.cell_of((1.5, -2.0)).tolist()
      [324, 230]
      >>> frame.point_of((324, 230)).tolist()  # the centre
      [1.525, -2.025]
    """

    grid: Grid
    yaw: float = 0.0
    projection: Projection | None = None
    has_metres: bool = True

    def __post_init__(self) -> None:
        if not math.isfinite(self.yaw):
            raise ValueError(f"the yaw of a map is {self.yaw}: it must be finite, in radians")

    @classmethod
    def over(
        cls,
        corner: tuple[float, float],
        side: float,
        *,
        height: int,
        width: int,
        yaw: float = 0.0,
        projection: Projection | None = None,
        has_metres: bool = True,
    ) -> "Frame":
        """Returns the frame of height x width cells of this side.

        Args:
          corner: (x, y) of the outer corner of the lower left cell, the `origin` of a ROS map.
        """
        x, y = corner
        return cls(Grid((x, y + height * side), side, height, width), yaw, projection, has_metres)

    @classmethod
    def of_cells(cls, height: int, width: int) -> "Frame":
        """Returns the frame of a map without a resolution: cells of side 1, (0, 0) in its lower
        left corner.
        """
        return cls.over((0.0, 0.0), 1.0, height=height, width=width, has_metres=False)

    @property
    def side(self) -> float:
        """The side of a cell."""
        return self.grid.side

    @property
    def unit(self) -> str:
        """What lengths are in: "m", or "cells"."""
        return "m" if self.has_metres else "cells"

    @property
    def corner(self) -> tuple[float, float]:
        """The outer corner of the lower left cell, (x, y); the map is turned about it."""
        x, y = self.grid.origin
        return x, y - self.grid.height * self.grid.side

    def cell_of(self, point: ArrayLike) -> np.ndarray:
        """Returns the cell (row, col) that holds a point; on a line between cells the lower, right
        one, on the outer border the last.

        Args:
          point: float [..., 2], (x, y) in the map's frame.

        Returns:
          int32 [..., 2].

        Raises:
          ValueError: a point outside the map.
        """
        points = as_metres("point", point, (*np.shape(point)[:-1], 2))
        try:
            return raster.cell_of(self.grid, self._turned(points, -self.yaw))
        except ValueError:
            corners = np.array([(0, 0), (0, 1), (1, 1), (1, 0)]) * (
                self.grid.width * self.side,
                self.grid.height * self.side,
            )
            reach = self._turned(corners + self.corner, self.yaw)
            (west, south), (east, north) = reach.min(axis=0), reach.max(axis=0)
            turned = f", turned by {self.yaw:g} radians" if self.yaw else ""
            named = ", ".join(f"({x:g}, {y:g})" for x, y in points.reshape(-1, 2)[:3].tolist())
            raise ValueError(
                f"the point {named} lies outside the map: x goes from {west:g} to {east:g}, y from"
                f" {south:g} to {north:g} {self.unit}{turned}"
            ) from None

    def point_of(self, cell: ArrayLike) -> np.ndarray:
        """Returns the centre of a cell, float64 [..., 2], (x, y) in the map's frame.

        Args:
          cell: integer [..., 2], (row, col), inside the map.
        """
        points = self._turned(raster.point_of(self.grid, cell), self.yaw)
        return np.round(points, 10) + 0.0  # finer than a nanometre there is nothing but noise

    def cell_at(self, place: ArrayLike) -> np.ndarray:
        """Returns the cell that holds a place on the globe.

        Args:
          place: float [..., 2], (longitude, latitude) in degrees.

        Raises:
          ValueError: the map does not say where it lies on the globe, or the place is outside it.
        """
        return self.cell_of(self._projection().to_metres(place))

    def place_of(self, cell: ArrayLike) -> np.ndarray:
        """Returns (longitude, latitude) of the centre of a cell, float64 [..., 2], in degrees."""
        return self._projection().to_degrees(self.point_of(cell))

    def _projection(self) -> Projection:
        if self.projection is None:
            raise ValueError(
                "the map does not say where it lies on the globe, so degrees mean nothing on it:"
                " give metres in its own frame, such as 1.5m,-2m, or a cell, such as 3,5"
            )
        return self.projection

    def _turned(self, points: np.ndarray, angle: float) -> np.ndarray:
        """Returns points turned about the corner; untouched where there is no angle."""
        if not angle:
            return points
        cosine, sine = math.cos(angle), math.sin(angle)
        x, y = np.moveaxis(points - self.corner, -1, 0)
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1) + self.corner
