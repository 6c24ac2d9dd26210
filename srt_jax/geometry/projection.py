"""From degrees to metres and back, about one point: flat, local, and good for a town (WGS 84)."""

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike

EQUATOR_RADIUS, ECCENTRICITY_SQUARED = 6378137.0, 0.00669437999014
"""Of the WGS 84 ellipsoid, metres."""
_STEEPEST = 85.0
"""Degrees of latitude beyond which a degree of longitude is too short for a flat picture."""


@dataclasses.dataclass(frozen=True)
class Projection:
    """Metres east and north of a point: degrees away from it times the length of a degree there.

    longitude, latitude: of that point, degrees. The scale from east to west is right on its
      parallel alone; towards the poles
    and the equator it is off by the latitudes' difference times the tangent of the latitude
    (`error_at`).
    """

    longitude: float
    latitude: float

    def __post_init__(self) -> None:
        if not (abs(self.longitude) <= 180 and abs(self.latitude) <= _STEEPEST):
            raise ValueError(
                f"longitude {self.longitude:g}, latitude {self.latitude:g} is no middle of a map:"
                f" longitudes go from -180 to 180, latitudes from -{_STEEPEST:g} to {_STEEPEST:g}"
                " here; put longitude first, or give metres"
            )

    @property
    def metres_per_degree(self) -> np.ndarray:
        """The length of a degree of longitude and of latitude at the point, float64 [2]."""
        sine, cosine = math.sin(math.radians(self.latitude)), math.cos(math.radians(self.latitude))
        bend = 1 - ECCENTRICITY_SQUARED * sine**2
        across = EQUATOR_RADIUS / math.sqrt(bend)
        along = across * (1 - ECCENTRICITY_SQUARED) / bend
        return np.array([across * cosine, along]) * math.radians(1)

    def to_metres(self, places: ArrayLike) -> np.ndarray:
        """Returns (longitude, latitude) [..., 2] as (x, y) in metres, to the nearest tenth of a
        millimetre.
        """
        away = np.asarray(places, np.float64) - (self.longitude, self.latitude)
        # across the meridian of 180 degrees the short way counts
        turns = np.rint(away[..., 0] / 360)
        away = away - np.stack([360 * turns, np.zeros_like(turns)], axis=-1)
        return np.round(away * self.metres_per_degree, 4)

    def to_degrees(self, points: ArrayLike) -> np.ndarray:
        """Returns (x, y) [..., 2] in metres as (longitude, latitude)."""
        return np.asarray(points, np.float64) / self.metres_per_degree + (
            self.longitude,
            self.latitude,
        )

    def error_at(self, latitude: float) -> float:
        """Returns by what share of itself a length from east to west at `latitude` comes out
        wrong.
        """
        return abs(math.tan(math.radians(self.latitude)) * math.radians(latitude - self.latitude))


def projection_over(low: ArrayLike, high: ArrayLike) -> Projection:
    """Returns the projection about the middle of the box from `low` to `high`, (longitude,
    latitude) each.

    A box across the meridian of 180 degrees has its eastern side beyond 180 (`joined_box`).
    """
    longitude, latitude = (
        (np.asarray(low, np.float64) + np.asarray(high, np.float64)) / 2
    ).tolist()
    is_across = longitude > 180 and np.asarray(high)[0] <= 360
    return Projection(longitude - 360.0 * is_across, latitude)


def joined_box(boxes: ArrayLike) -> np.ndarray:
    """Returns the corners [2, 2] of the smallest box around all, (longitude, latitude), south-west
    first.

    Across the meridian of 180 degrees the eastern longitude comes out beyond 180.

    Args:
      boxes: float [..., 4], (west, south, east, north) in degrees; a box whose west is larger than
        its east lies across that meridian. Points are boxes without an extent.
    """
    west, south, east, north = np.moveaxis(np.asarray(boxes, np.float64).reshape(-1, 4), -1, 0)
    east = east + 360.0 * (west > east)
    turned = 360.0 * (west < 0)
    straight, across = ((np.min(west + turn), np.max(east + turn)) for turn in (0.0, turned))
    # Only what is spread over more than half the globe is taken to lie across.
    left, right = (
        straight
        if straight[1] - straight[0] <= 180
        else min(straight, across, key=lambda side: side[1] - side[0])
    )
    return np.array([(left, south.min()), (right, north.max())])
