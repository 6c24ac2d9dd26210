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
    """
    longitude, latitude = (np.asarray(low, np.float64) + np.asarray(high, np.float64)) / 2
    return Projection(float(longitude), float(latitude))
