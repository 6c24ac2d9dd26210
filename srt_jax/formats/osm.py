"""OpenStreetMap extracts (`.osm`, `.osm.gz`, `.osm.bz2`, `.osm.pbf`): tagged areas and lines made
obstacles in metres.

An area is what osmium assembles: a closed way, or a multipolygon relation with its courtyards.
Coordinates are longitude and latitude; the bounds are the extract's box, which nodes and whole
objects may lie outside of.
"""

import contextlib
import pathlib
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.files import PathLike, needed
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.geometry import Shape, count_outside, obstacles_of_shapes, wall_parts
from srt_jax.formats.outlines.projection import Projection, projection_over
from srt_jax.formats.outlines.tag_rules import TagRule, default_rules, matching
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle

ENDINGS = (".osm", ".osm.gz", ".osm.bz2", ".pbf")
ATTRIBUTION = "(c) OpenStreetMap contributors, ODbL 1.0, openstreetmap.org/copyright"
LOST_NODES = "ways left out: nodes are missing from the file"
UNCLOSED_WAYS = "ways left out: they should be areas, but are not closed"
BROKEN_WAYS = "ways that cross themselves, made valid"
LOST_MEMBERS = "multipolygons left out: members or their nodes are missing from the file"
BROKEN_RELATIONS = "multipolygons left out: their members form no rings"
SHORTENED = "lines shortened: nodes are missing from the file"
_CROOKED = 1e-3
"""Share by which lengths may be off at the border before it is worth a note."""

_Name = tuple[str, int]
"""("way" or "relation", OpenStreetMap id)."""


class _Thing(NamedTuple):
    """parts: polygons in degrees, or one line. rule: which made it an obstacle. name: may be
    empty.
    """

    parts: list[list[Any]]
    rule: TagRule
    name: str
    is_line: bool = False


class _Found(NamedTuple):
    """What a file holds. lost: areas that osmium did not assemble, with their rule."""

    things: dict[_Name, _Thing]
    lost: dict[_Name, TagRule]


def read_osm(
    path: PathLike, *, rules: Sequence[TagRule] | None = None, notes: Notes | None = None
) -> Place:
    """Returns the obstacles in an extract: ways by id, then relations by id; needs osmium.

    Args:
      rules: which tags make an obstacle; without them `default_rules`. The first that fits decides.
      notes: receives what was odd and how often: missing nodes and members, unclosed and crossing
        rings, objects outside.

    Raises:
      ValueError: the file is missing, cut off or no extract, or it says neither how far it reaches
        nor has an obstacle.
    """
    osmium = needed("osmium", extra="osm", what="reading OpenStreetMap")
    rules = default_rules() if rules is None else tuple(rules)
    notes = Notes() if notes is None else notes
    if not pathlib.Path(path).is_file():
        raise ValueError(f"{path}: no such file; an OpenStreetMap extract was to be read from it")
    with _told(osmium, path):
        found = _found(osmium, str(path), rules, notes)
        _explain_losses(osmium, str(path), found, rules, notes)
    box = _box(osmium, str(path), found, notes)
    try:
        projection = projection_over(*box)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    names = sorted(found.things, key=_in_order)
    shapes = {name: _shape(name, found.things[name], projection, notes) for name in names}
    made = obstacles_of_shapes(list(shapes.values()), notes)
    kept = {name: obstacle for name, obstacle in zip(shapes, made) if obstacle is not None}
    x_min, y_min, x_max, y_max = projection.to_metres(box).ravel().tolist()
    place = Place((x_min, y_min, x_max, y_max), tuple(kept.values()), ATTRIBUTION)
    count_outside(place, notes)
    _summarise(kept, found, projection, box, notes)
    return place


def _found(osmium: Any, path: str, rules: Sequence[TagRule], notes: Notes) -> _Found:
    keys = osmium.filter.KeyFilter(*{rule.key for rule in rules})
    things: dict[_Name, _Thing] = {}
    tagged: dict[_Name, TagRule] = {}
    for item in osmium.FileProcessor(path).with_areas(keys).with_filter(keys):
        rule = matching(rules, item.tags)
        if rule is None or item.is_node():
            continue
        is_area = rule.width is None or item.tags.get("area") == "yes"
        if item.is_area() and is_area:
            name = ("way" if item.from_way() else "relation", item.orig_id())
            parts = [
                [_places(ring) for ring in (outer, *item.inner_rings(outer))]
                for outer in item.outer_rings()
            ]
            if parts:  # osmium makes an empty area of what it cannot assemble
                things[name] = _Thing(parts, rule, item.tags.get("name", ""))
        elif item.is_way() and is_area:
            tagged["way", item.id] = rule
        elif item.is_way():
            line = [(node.lon, node.lat) for node in item.nodes if node.location.valid()]
            notes.add(SHORTENED, int(len(line) < len(item.nodes)), example=f"way {item.id}")
            things["way", item.id] = _Thing([[line]], rule, item.tags.get("name", ""), is_line=True)
        elif item.is_relation() and is_area and item.tags.get("type") == "multipolygon":
            tagged["relation", item.id] = rule
    return _Found(things, {name: rule for name, rule in tagged.items() if name not in things})


def _explain_losses(
    osmium: Any, path: str, found: _Found, rules: Sequence[TagRule], notes: Notes
) -> None:
    """Notes why areas could not be assembled; ways that only cross themselves become things
    after all.
    """
    ways = {number for kind, number in found.lost if kind == "way"}
    relations = {number for kind, number in found.lost if kind == "relation"}
    if not (ways or relations):
        return
    members: dict[int, list[int]] = {}
    if relations:
        for item in osmium.FileProcessor(path, osmium.osm.RELATION).with_filter(
            osmium.filter.IdFilter(relations)
        ):
            members[item.id] = [member.ref for member in item.members if member.type == "w"]
    wanted = ways | {way for refs in members.values() for way in refs}
    whole = set()
    for item in (
        osmium.FileProcessor(path).with_locations().with_filter(osmium.filter.IdFilter(wanted))
    ):
        if item.is_way() and all(node.location.valid() for node in item.nodes):
            whole.add(item.id)
            if item.id in ways and item.is_closed():
                rule = found.lost["way", item.id]
                found.things["way", item.id] = _Thing(
                    [[_places(item.nodes)]], rule, item.tags.get("name", "")
                )
    for number in sorted(ways):
        why = (
            LOST_NODES
            if number not in whole
            else BROKEN_WAYS
            if ("way", number) in found.things
            else UNCLOSED_WAYS
        )
        notes.add(why, example=f"way {number}")
    for number, refs in sorted(members.items()):
        notes.add(
            BROKEN_RELATIONS if whole.issuperset(refs) else LOST_MEMBERS,
            example=f"relation {number}",
        )


def _shape(name: _Name, thing: _Thing, projection: Projection, notes: Notes) -> Shape:
    called = f"{name[0]} {name[1]}"
    options = {
        "destroyable": thing.rule.destroyable,
        "removal_cost": thing.rule.removal_cost,
        "name": thing.name or f"{thing.rule.key} {called}",
    }
    parts = [[projection.to_metres(ring) for ring in part] for part in thing.parts]
    if thing.is_line and thing.rule.width is not None:
        parts = wall_parts(parts[0][0].reshape(-1, 2), thing.rule.width, called=called, notes=notes)
    return Shape(parts, called, options)


def _places(nodes: Any) -> list[tuple[float, float]]:
    return [(node.lon, node.lat) for node in nodes]


def _in_order(name: _Name) -> tuple[bool, int]:
    return name[0] == "relation", name[1]


def _box(osmium: Any, path: str, found: _Found, notes: Notes) -> np.ndarray:
    """Returns the corners [2, 2] of the extract in degrees, south-west first."""
    box = osmium.io.Reader(path).header().box()
    if box.valid() and box.size() > 0:
        return np.array([(corner.lon, corner.lat) for corner in (box.bottom_left, box.top_right)])
    places = [
        place
        for thing in found.things.values()
        for part in thing.parts
        for ring in part
        for place in ring
    ]
    if not places:
        raise ValueError(
            f"{path}: it names no bounds, and nothing in it is an obstacle by the tag rules: give"
            " other rules"
        )
    notes.tell("the file names no bounds: taken is the box around its obstacles")
    return np.array([np.min(places, axis=0), np.max(places, axis=0)])


def _summarise(
    kept: dict[_Name, Obstacle],
    found: _Found,
    projection: Projection,
    box: np.ndarray,
    notes: Notes,
) -> None:
    counts = Counter(found.things[name].rule.key for name in kept)
    relations = Counter(found.things[name].rule.key for name in kept if name[0] == "relation")
    for key, count in counts.items():
        several = f" ({relations[key]} of them multipolygons)" if relations[key] else ""
        firm = sum(
            not kept[name].destroyable for name in kept if found.things[name].rule.key == key
        )
        notes.tell(f"{count} obstacles by the tag {key}{several}, {firm} of them firm")
    crooked = max(projection.error_at(latitude) for latitude in box[:, 1])
    notes.tell(
        f"metres east and north of longitude {projection.longitude:.7f}, latitude"
        f" {projection.latitude:.7f}"
    )
    if crooked > _CROOKED:
        notes.tell(
            f"the extract is large: lengths from east to west are off by up to {crooked:.1%} at its"
            " border"
        )
    notes.tell(f"map data {ATTRIBUTION}")


@contextlib.contextmanager
def _told(osmium: Any, path: PathLike) -> Iterator[None]:
    """Makes whatever osmium finds wrong with a file one ValueError."""
    try:
        yield
    except (RuntimeError, OSError, ValueError, osmium.InvalidLocationError) as error:
        raise ValueError(
            f"{path}: no whole OpenStreetMap extract: it is cut off, damaged, or of another kind"
            f" than its ending says ({error})"
        ) from error
