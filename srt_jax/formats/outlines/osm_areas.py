"""Areas from the ways and multipolygon relations of OpenStreetMap, as whole as the file has them.

Whether a ring fills or is a hole is seen where it lies: a ring within what is filled is a hole, and
a ring in a hole an island, whatever role it has; only where rings cross does the role decide. So
does osmium. What lies beyond the border of an extract is missing from it: the rest is closed across
the gaps, so that an obstacle is never lost without need.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.outlines.osm_objects import Location, Objects, Relation, Way
from srt_jax.formats.shared.whole_files import require_module


class Area(NamedTuple):
    """parts: polygons, the outer ring first, in degrees; [] where nothing encloses anything.

    has_losses: nodes or members are missing from the file. is_open: something does not close,
      though
    nothing of it is missing. crosses: a ring crossed itself, and was made valid.
    """

    parts: list[list[list[Location]]]
    has_losses: bool = False
    is_open: bool = False
    crosses: bool = False


class _Chain(NamedTuple):
    """Ways end to end. nodes: those that are missing included. is_inner: by their roles."""

    nodes: list[int]
    is_inner: bool

    @property
    def is_closed(self) -> bool:
        return len(self.nodes) > 3 and self.nodes[0] == self.nodes[-1]


def area_of_way(way: Way, nodes: Mapping[int, Location]) -> Area:
    """Returns the area a way encloses, of the nodes that are there."""
    places = [nodes[node] for node in way.nodes if node in nodes]
    has_losses = len(places) < len(way.nodes)
    # Some programs close a ring by a second node at the place of the first.
    if (
        way.nodes[0] != way.nodes[-1]
        and not (has_losses and _may_close(way, nodes))
        and places[0] != places[-1]
    ):
        return Area([], has_losses, is_open=True)
    if len(set(places)) < 3:
        return Area([], has_losses, is_open=not has_losses)
    return _area_of_rings([(places, False)], has_losses, False)


def _may_close(way: Way, nodes: Mapping[int, Location]) -> bool:
    """Whether one end of a way is missing, so that it may have lain where the other is."""
    return way.nodes[0] not in nodes or way.nodes[-1] not in nodes


def area_of_relation(relation: Relation, objects: Objects) -> Area:
    """Returns the area a multipolygon encloses, of the ways and nodes that are there."""
    members = [(ref, role) for kind, ref, role in relation.members if kind == "w"]
    there = [
        (objects.ways[ref].nodes, role)
        for ref, role in dict.fromkeys(members)
        if ref in objects.ways
    ]
    has_losses = len(there) < len(set(members)) or any(
        n not in objects.nodes for way, _ in there for n in way
    )
    chains = _chains([_Chain(list(nodes), role == "inner") for nodes, role in there if nodes])
    closed = [chain for chain in chains if chain.is_closed]
    broken = [chain for chain in chains if not chain.is_closed]
    rings = [(_located(chain, objects.nodes), chain.is_inner) for chain in closed]
    if has_losses:
        # An open inner chain would take away what may well be blocked: only the outer ones are
        # joined.
        rest = [_located(chain, objects.nodes) for chain in broken if not chain.is_inner]
        rings.append((_join([places for places in rest if places]), False))
    rings = [(places, is_inner) for places, is_inner in rings if len(set(places)) >= 3]
    return _area_of_rings(rings, has_losses, bool(broken) or not rings)


def _located(chain: _Chain, nodes: Mapping[int, Location]) -> list[Location]:
    return [nodes[node] for node in chain.nodes if node in nodes]


def _chains(ways: Sequence[_Chain]) -> list[_Chain]:
    """Returns ways joined end to end, as long as an end meets another; every way is used once."""
    waiting = [way for way in ways if not way.is_closed]
    done = [way for way in ways if way.is_closed]
    by_end: dict[int, list[int]] = {}
    for index, way in enumerate(waiting):
        for end in (way.nodes[0], way.nodes[-1]):
            by_end.setdefault(end, []).append(index)
    is_used = [False] * len(waiting)
    for first, way in enumerate(waiting):
        if is_used[first]:
            continue
        is_used[first] = True
        nodes, is_inner = list(way.nodes), way.is_inner
        for _ in range(2):  # onwards from the last node, then from the first
            while (
                nodes[0] != nodes[-1]
                and (after := _next(by_end[nodes[-1]], is_used, waiting, is_inner)) is not None
            ):
                is_used[after] = True
                further = waiting[after].nodes
                nodes += further[1:] if further[0] == nodes[-1] else further[-2::-1]
            nodes.reverse()
        done.append(_Chain(nodes, is_inner))
    return done


def _next(
    candidates: Sequence[int], is_used: Sequence[bool], ways: Sequence[_Chain], is_inner: bool
) -> int | None:
    """Returns the way to continue with, one of the same role before others."""
    free = [index for index in candidates if not is_used[index]]
    return min(free, key=lambda index: (ways[index].is_inner != is_inner, index), default=None)


def _join(chains: list[list[Location]]) -> list[Location]:
    """Returns one ring through all chains, each joined at the end that is nearest."""
    ring: list[Location] = list(chains.pop(0)) if chains else []
    while chains:
        ends = np.array([(chain[0], chain[-1]) for chain in chains])
        away = np.hypot(*np.moveaxis(ends - np.array(ring[-1]), -1, 0))
        index, side = np.unravel_index(int(np.argmin(away)), away.shape)
        chain = chains.pop(int(index))
        ring += chain if side == 0 else chain[::-1]
    return ring


def _area_of_rings(
    rings: Sequence[tuple[list[Location], bool]], has_losses: bool, is_open: bool
) -> Area:
    """Returns what rings enclose, from the largest to the smallest."""
    shapely = require_module("shapely", extra="osm", what="reading areas of OpenStreetMap")
    polygons = [(shapely.Polygon(_without_wrap(places)), is_inner) for places, is_inner in rings]
    crosses = not all(polygon.is_valid for polygon, _ in polygons)
    if len(rings) == 1 and not crosses:
        return Area([[_without_wrap(rings[0][0]).tolist()]], has_losses, is_open)
    polygons = [
        (_polygonal(shapely, shapely.make_valid(polygon)), is_inner)
        for polygon, is_inner in polygons
    ]
    polygons.sort(key=lambda each: -each[0].area)
    area = shapely.Polygon()
    for polygon, is_inner in polygons:
        if is_inner or area.covers(polygon):
            area = area.difference(polygon)
        else:
            area = area.union(polygon)
    parts = [
        [
            list(map(tuple, np.asarray(ring.coords).tolist()))
            for ring in (part.exterior, *part.interiors)
        ]
        for part in getattr(area, "geoms", [area])
        if isinstance(part, shapely.Polygon) and not part.is_empty
    ]
    return Area(parts, has_losses, is_open, crosses)


def _without_wrap(places: Sequence[Location]) -> np.ndarray:
    """Returns the places with longitudes beyond 180 where the ring lies across that meridian."""
    points = np.array(places, np.float64)
    if np.ptp(points[:, 0]) > 180:
        points[:, 0] += 360.0 * (points[:, 0] < 0)
    return points


def _polygonal(shapely: Any, shape: Any) -> Any:
    """Returns the polygons of what make_valid returns, without the lines and points."""
    polygons = [
        one
        for one in shapely.get_parts(shapely.get_parts(shape))
        if isinstance(one, shapely.Polygon)
    ]
    return shapely.union_all(polygons)
