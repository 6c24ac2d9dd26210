"""What the agent sees, in words: goal area, obstacles and paths named by spatial signs of its own
frame (PY16 §2, Figure 1).

Going down and up again: an area is seen as a sector of the agent's frame, four pairs (r, phi), and
the square that holds that sector leads back to the plane. All on the host; points are (x, y) in
metres.
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
    spans: the regions of all its points that were looked at, by name, in the order of the table.
    sector: four pairs (r, phi), metres and radians leftwards: near right, near left, far left, far
      right.
    square: centre (x, y) and side of the square that holds the sector.
    """

    seen_as: tuple[str, str]
    spans: tuple[str, ...]
    sector: tuple[tuple[float, float], ...]
    square: tuple[tuple[float, float], float]


@dataclasses.dataclass(frozen=True)
class View:
    """The agent's frame: where it stands, where it looks (radians counter-clockwise from the x
    axis), and its words.
    """

    origin: np.ndarray
    heading: float = np.pi / 2
    table: FuzzyTable = DEFAULT_TABLE

    def of_square(self, centre: np.ndarray, side: float) -> Seen:
        """Returns how an upright square is seen; its signs are those of its centre."""
        sector = sector_of_square(
            np.asarray(centre, float), np.array(float(side)), self.origin, np.array(self.heading)
        )
        return self._seen(sector, np.asarray(centre, float)[None])

    def of_points(self, points: np.ndarray) -> Seen:
        """Returns how a set of points is seen, float [N, 2], such as a contour; ValueError where
        there is none.
        """
        points = np.asarray(points, float)
        if not len(points):
            raise ValueError("what has no point cannot be seen: give at least one")
        sector = sector_of_points(
            points, np.ones(len(points), bool), self.origin, np.array(self.heading)
        )
        return self._seen(sector, points)

    def relocation(self, path: np.ndarray) -> dict:
        """Returns the relocation that a path (float [N, 2], one point at least) is an instance of,
        as plain data.

        name: of the narrowest that permits it, None where the table has none; deviation: how far
          the path strays from the
        straight link; permitted: H of that relocation, None for any; change: the fuzzy distance
        covered; link: its length.
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

    def _seen(self, sector: Sector, points: np.ndarray) -> Seen:
        polar = to_polar(points, self.origin, np.array(self.heading))
        regions, names = region_of(polar, self.table), region_names(self.table)
        distance, direction = divmod(int(regions[polar[:, 0].argmin()]), len(self.table.directions))
        centre, side = square_of_sector(sector, self.origin, np.array(self.heading))
        return Seen(
            seen_as=(self.table.distances[distance].name, self.table.directions[direction].name),
            spans=tuple(names[number] for number in np.unique(regions)),
            sector=tuple((float(r), float(phi)) for r, phi in sector_corners(sector)),
            square=((float(centre[0]), float(centre[1])), float(side)),
        )
