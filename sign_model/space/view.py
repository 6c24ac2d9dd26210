"""What the agent sees, in words: goal area, obstacles and paths named by spatial signs of its own
frame (PY16 §2, Figure 1).

The conversion goes both ways: an area is seen as a sector of the agent's frame, four pairs (r,
phi), and the square that contains that sector is an area of the plane again. Everything runs on the
host; points are (x, y) in metres.
"""

import dataclasses

import numpy as np

from sign_model.space.fuzzy import distance_of, region_names, region_of, relocation_of
from sign_model.space.fuzzy_table import DEFAULT_TABLE, FuzzyTable, Relocation
from sign_model.space.polar import (
    Sector,
    path_deviation,
    path_link,
    sector_corners,
    sector_of_points,
    sector_of_square,
    square_of_sector,
    to_polar,
)


@dataclasses.dataclass(frozen=True)
class Seen:
    """How an area is seen.

    seen_as: the spatial signs, a distance and a direction, of its nearest point.
    nearest: that point, (r, phi) in metres and radians leftwards.
    spans: the names of the regions of all given points of the area, in the order of the table.
    sector: four pairs (r, phi), metres and radians leftwards: near right, near left, far left, far
      right.
    square: centre (x, y) and side of the square that contains the sector.
    """

    seen_as: tuple[str, str]
    nearest: tuple[float, float]
    spans: tuple[str, ...]
    sector: tuple[tuple[float, float], ...]
    square: tuple[tuple[float, float], float]


@dataclasses.dataclass(frozen=True)
class View:
    """The frame of an agent.

    origin: float64 [2], its position (x, y).
    heading: where it looks, radians counter-clockwise from the x axis.
    table: the grounding of its spatial signs.
    """

    origin: np.ndarray
    heading: float = np.pi / 2
    table: FuzzyTable = DEFAULT_TABLE

    def of_square(self, centre: np.ndarray, side: float) -> Seen:
        """Returns how an axis-aligned square is seen; its signs are those of its centre, (x, y)."""
        sector = sector_of_square(
            np.asarray(centre, float), np.array(float(side)), self.origin, np.array(self.heading)
        )
        return self._describe(sector, np.asarray(centre, float)[None])

    def of_points(self, points: np.ndarray) -> Seen:
        """Returns how a set of points, float [N, 2], such as a contour, is seen; ValueError without
        points.
        """
        points = np.asarray(points, float)
        if not len(points):
            raise ValueError("an area without points cannot be seen: give at least one point")
        sector = sector_of_points(
            points, np.ones(len(points), bool), self.origin, np.array(self.heading)
        )
        return self._describe(sector, points)

    def relocation(self, path: np.ndarray) -> dict[str, str | float | None]:
        """Returns the relocation of which a path is an instance, as plain data.

        Args:
          path: float [N, 2], at least one point.

        Returns:
          name: of the narrowest relocation that permits the path, None if the table has none.
          deviation: the greatest distance of the path from the straight link, metres.
          permitted: H of that relocation, None if it permits any deviation.
          change: the fuzzy distance covered.
          link: the length of the straight link, metres.
        """
        path = np.asarray(path, float)
        count = np.array(len(path))
        number = int(relocation_of(path, count, self.table))
        row: Relocation | None = self.table.relocations[number] if number >= 0 else None
        link = float(path_link(path, count))
        return {
            "name": row.name if row else None,
            "deviation": float(path_deviation(path, count)),
            "permitted": row.deviation if row and np.isfinite(row.deviation) else None,
            "change": self.table.distances[int(distance_of(np.array(link), self.table))].name,
            "link": link,
        }

    def _describe(self, sector: Sector, points: np.ndarray) -> Seen:
        """Returns how an area is seen that fills a sector and contains the points."""
        polar = to_polar(points, self.origin, np.array(self.heading))
        regions, names = region_of(polar, self.table), region_names(self.table)
        nearest = int(polar[:, 0].argmin())
        distance, direction = divmod(int(regions[nearest]), len(self.table.directions))
        centre, side = square_of_sector(sector, self.origin, np.array(self.heading))
        return Seen(
            seen_as=(self.table.distances[distance].name, self.table.directions[direction].name),
            nearest=(float(polar[nearest, 0]), float(polar[nearest, 1])),
            spans=tuple(names[number] for number in np.unique(regions)),
            sector=tuple((float(r), float(phi)) for r, phi in sector_corners(sector)),
            square=((float(centre[0]), float(centre[1])), float(side)),
        )
