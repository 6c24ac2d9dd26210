"""Fuzzy directions, distances and relocations of points, areas and paths in the agent's frame (PY16
§2, Figure 1).

Each direction or distance belongs to each fuzzy term to a degree between 0 and 1, which is 0.5 at
the borders of the term's row of the table. The term of greatest degree names a point, so the sign
of a point is the row in which it lies (the lower border belongs to the row). A region is a pair of
terms, a distance and a direction: a sector.

A path is an instance of the narrowest relocation that permits it: the fuzzy distance from its start
to its end is that of the relocation, and it never deviates from the straight link by more than the
permitted deviation H of the relocation.

All functions take NumPy or JAX arrays with any batch dimensions, as in `polar`.
"""

import math

from sign_model.foundation.records import Array
from sign_model.space.fuzzy_table import FuzzyTable
from sign_model.space.polar import (
    FULL_TURN,
    Sector,
    array_namespace,
    path_deviation,
    path_link,
    wrap,
)

_DEGREES = 180 / math.pi


def direction_membership(phi: Array, table: FuzzyTable) -> Array:
    """Returns the degree, 0 to 1, to which each direction belongs to each fuzzy direction: float
    [...] (radians, leftwards from the heading) -> float [..., directions].
    """
    # How far inside each row a direction lies, in degrees.
    middles = [(row.start + row.end) / 2 for row in table.directions]
    halves = [(row.end - row.start) / 2 for row in table.directions]
    inside = [
        half - abs(wrap(phi - middle / _DEGREES)) * _DEGREES
        for middle, half in zip(middles, halves)
    ]
    return _degree(inside, table.soft_degrees)


def distance_membership(r: Array, table: FuzzyTable) -> Array:
    """Returns the degree, 0 to 1, to which each distance belongs to each fuzzy distance: float
    [...] (metres) -> float [..., distances].
    """
    xp = array_namespace(r)
    rows, inside = table.distances, []
    for number, row in enumerate(rows):
        # The first row has no lower border, the last row no upper one.
        above = xp.full_like(r, math.inf) if number == 0 else r - row.start
        below = xp.full_like(r, math.inf) if number == len(rows) - 1 else row.end - r
        inside.append(xp.minimum(above, below))
    return _degree(inside, table.soft_metres)


def direction_of(phi: Array, table: FuzzyTable) -> Array:
    """Returns the row of each direction (radians, leftwards from the heading), int32 [...]."""
    first = table.directions[0].start
    return _row((phi * _DEGREES - first) % 360, [row.start - first for row in table.directions])


def distance_of(r: Array, table: FuzzyTable) -> Array:
    """Returns the row of each distance in metres, int32 [...]."""
    return _row(r, [row.start for row in table.distances])


def region_of(polar: Array, table: FuzzyTable) -> Array:
    """Returns the region of each point (r, phi): the row of its distance times the number of
    directions, plus its direction.

    Args:
      polar: float [..., 2], as of `to_polar`.

    Returns:
      int32 [...].
    """
    return distance_of(polar[..., 0], table) * len(table.directions) + direction_of(
        polar[..., 1], table
    )


def sector_of(region: Array, table: FuzzyTable) -> Sector:
    """Returns the sectors of regions, int [...]: `region_of` maps every point of a sector to its
    region.
    """
    xp = array_namespace(region)
    number, direction = region // len(table.directions), region % len(table.directions)
    starts = xp.asarray([math.radians(row.start) for row in table.directions])
    widths = xp.asarray([math.radians(row.end - row.start) for row in table.directions])
    near = xp.asarray([row.start for row in table.distances])
    far = xp.asarray([row.end for row in table.distances])
    return Sector(
        near=near[number],
        far=far[number],
        start=wrap(starts[direction]),
        width=widths[direction],
    )


def regions_touched(sector: Sector, table: FuzzyTable) -> Array:
    """Returns which regions share points with an area, such as an obstacle seen as a sector; bool
    [..., regions].
    """
    # The area and all regions, with one more axis for the regions.
    xp = array_namespace(sector.near)
    every = sector_of(xp.arange(table.num_regions), table)
    near, far, start, width = (
        part[..., None] for part in (sector.near, sector.far, sector.start, sector.width)
    )
    rank = (1,) * (near.ndim - 1)
    other_near, other_far, other_start, other_width = (
        part.reshape(*rank, -1).astype(near.dtype)
        for part in (every.near, every.far, every.start, every.width)
    )

    # Distances overlap; the regions of the last distance have no upper border.
    is_last = xp.arange(table.num_regions).reshape(*rank, -1) >= table.num_regions - len(
        table.directions
    )
    at_distance = (far >= other_near) & ((near < other_far) | is_last)

    # Two arcs overlap if one starts within the other; a row of the table does not include its upper
    # border.
    meets = ((other_start - start) % FULL_TURN <= width) | (
        (start - other_start) % FULL_TURN < other_width
    )
    return at_distance & meets


def region_names(table: FuzzyTable) -> tuple[str, ...]:
    """Returns the names of the regions in order, such as "afar, ahead-left"."""
    return tuple(
        f"{distance.name}, {direction.name}"
        for distance in table.distances
        for direction in table.directions
    )


def relocation_of(path: Array, num_points: Array, table: FuzzyTable) -> Array:
    """Returns the narrowest relocation of which each path is an instance; -1 if the table has none
    or the path has no point.

    Args:
      path: float [..., N, 2], (x, y), in metres.
      num_points: int [...].
      table: the grounding.

    Returns:
      int32 [...], a row of `table.relocations`; ties go to the earlier row.
    """
    xp = array_namespace(path)
    deviation = path_deviation(path, num_points)
    distance = distance_of(path_link(path, num_points), table)
    names = [row.name for row in table.distances]
    chosen = xp.full(deviation.shape, -1, xp.int32)
    # From the widest to the narrowest: a narrower one that fits replaces a wider one.
    for number in sorted(
        range(len(table.relocations)), key=lambda i: (-table.relocations[i].deviation, -i)
    ):
        row = table.relocations[number]
        fits = (
            (distance == names.index(row.distance))
            & (deviation <= row.deviation)
            & (num_points > 0)
        )
        chosen = xp.where(fits, xp.int32(number), chosen)
    return chosen


def _row(value: Array, starts: list[float]) -> Array:
    """Returns the last row whose start does not exceed each value, int32 [...]; `starts` ascend,
    and the first row has no lower border.
    """
    xp = array_namespace(value)
    row = xp.zeros(value.shape, xp.int32)
    for start in starts[1:]:
        row = row + (value >= start).astype(xp.int32)
    return row


def _degree(inside: list[Array], softness: float) -> Array:
    """Returns degrees of membership, float [..., rows], from how far inside each row the values
    lie, float [...] per row: 0.5 at a border, and from 0 to 1 over a width of `softness`.
    """
    xp = array_namespace(*inside)
    return xp.clip(0.5 + xp.stack(inside, axis=-1) / softness, 0, 1)
