"""OpenStreetMap extracts (`.osm`, `.osm.gz`, `.osm.bz2`, `.osm.pbf`): tagged areas and lines made
obstacles in metres.

An area is a closed way, or a multipolygon relation with its courtyards. Coordinates are longitude
and latitude; the bounds are the extract's box, which nodes and whole objects may lie outside of.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.geometry import Shape, count_outside, obstacles_of_shapes, wall_parts
from srt_jax.formats.outlines.osm_areas import Area, area_of_relation, area_of_way
from srt_jax.formats.outlines.osm_objects import ENDINGS as ENDINGS
from srt_jax.formats.outlines.osm_objects import Objects, read_objects
from srt_jax.formats.outlines.tag_rules import TagRule, default_rules, is_passed_over, matching
from srt_jax.formats.shared.whole_files import PathLike, require_regular
from srt_jax.geometry.place import Place
from srt_jax.geometry.projection import Projection, joined_box, projection_over
from srt_jax.geometry.world import Obstacle

ATTRIBUTION = "(c) OpenStreetMap contributors, ODbL 1.0, openstreetmap.org/copyright"
LOST_NODES = "ways left out: nodes are missing from the file"
CUT_WAYS = "ways cut short to the nodes that are there: nodes are missing from the file"
NO_NODES = "ways left out: they have no nodes"
UNCLOSED_WAYS = "ways left out: they should be areas, but are not closed"
BROKEN_WAYS = "ways that cross themselves, made valid"
LOST_MEMBERS = "multipolygons left out: members or their nodes are missing from the file"
CUT_RELATIONS = "multipolygons closed across gaps: members or their nodes are missing from the file"
BROKEN_RELATIONS = "multipolygons left out: their members form no rings"
SHORTENED = "lines shortened: nodes are missing from the file"
NOT_IN_THE_WAY = "objects passed over by a tag rule: they are in nobody's way"
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


def read_osm(
    path: PathLike, *, rules: Sequence[TagRule] | None = None, notes: Notes | None = None
) -> Place:
    """Returns the obstacles in an extract: ways by id, then relations by id; `.pbf` needs osmium.

    The objects may come in any order and be numbered below 0. What is cut off at the border of the
    extract is kept as far as it is there, and noted.

    Args:
      rules: which tags make an obstacle; without them `default_rules`. The first that fits decides.
      notes: receives what was odd and how often: missing nodes and members, unclosed and crossing
        rings, objects outside.

    Raises:
      ValueError: the file is missing, cut off or no extract, or it says neither how far it reaches
        nor has an obstacle.
    """
    rules = default_rules() if rules is None else tuple(rules)
    notes = Notes() if notes is None else notes
    require_regular(path, what="OpenStreetMap extract")
    objects = read_objects(path, {rule.key for rule in rules})
    for remark in objects.remarks:
        notes.tell(
            f"the server that wrote the file says, so that some may be missing from it: {remark}"
        )
    things = _things(objects, rules, notes)
    box = _box(str(path), objects, things, notes)
    try:
        projection = projection_over(*box)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    names = sorted(things, key=_in_order)
    shapes = {name: _shape(name, things[name], projection, notes) for name in names}
    made = obstacles_of_shapes(list(shapes.values()), notes)
    kept = {name: obstacle for name, obstacle in zip(shapes, made) if obstacle is not None}
    x_min, y_min, x_max, y_max = projection.to_metres(box).ravel().tolist()
    place = Place((x_min, y_min, x_max, y_max), tuple(kept.values()), ATTRIBUTION, projection)
    count_outside(place, notes)
    _summarise(kept, things, projection, box, notes)
    return place


def _things(objects: Objects, rules: Sequence[TagRule], notes: Notes) -> dict[_Name, _Thing]:
    """Returns what is an obstacle by the rules; notes what was left out, or is not whole."""
    things: dict[_Name, _Thing] = {}
    for number, way in sorted(objects.ways.items()):
        rule, called = matching(rules, way.tags), f"way {number}"
        notes.add(
            NOT_IN_THE_WAY, int(rule is None and is_passed_over(rules, way.tags)), example=called
        )
        if rule is None:
            continue
        places = [objects.nodes[node] for node in way.nodes if node in objects.nodes]
        if not places:
            notes.add(LOST_NODES if way.nodes else NO_NODES, example=called)
        elif rule.width is None or way.tags.get("area") == "yes":
            area = area_of_way(way, objects.nodes)
            _note_area(area, called, (UNCLOSED_WAYS, LOST_NODES, CUT_WAYS), notes)
            if area.parts:
                things["way", number] = _Thing(area.parts, rule, way.tags.get("name", ""))
        else:
            notes.add(SHORTENED, int(len(places) < len(way.nodes)), example=called)
            things["way", number] = _Thing([[places]], rule, way.tags.get("name", ""), is_line=True)
    for number, relation in sorted(objects.relations.items()):
        rule, called = matching(rules, relation.tags), f"relation {number}"
        if relation.tags.get("type") not in ("multipolygon", "boundary"):
            continue
        notes.add(
            NOT_IN_THE_WAY,
            int(rule is None and is_passed_over(rules, relation.tags)),
            example=called,
        )
        if rule is None:
            continue
        area = area_of_relation(relation, objects)
        _note_area(area, called, (BROKEN_RELATIONS, LOST_MEMBERS, CUT_RELATIONS), notes)
        if area.parts:
            things["relation", number] = _Thing(area.parts, rule, relation.tags.get("name", ""))
    return things


def _note_area(area: Area, called: str, texts: tuple[str, str, str], notes: Notes) -> None:
    """Notes what was odd: texts are for open rings, for a loss without a rest, and with one."""
    unclosed, lost, cut = texts
    notes.add(BROKEN_WAYS, int(area.crosses and called.startswith("way")), example=called)
    if area.has_losses:
        notes.add(cut if area.parts else lost, example=called)
    else:
        notes.add(unclosed, int(area.is_open), example=called)


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


def _in_order(name: _Name) -> tuple[bool, int]:
    return name[0] == "relation", name[1]


def _box(path: str, objects: Objects, things: dict[_Name, _Thing], notes: Notes) -> np.ndarray:
    """Returns the corners [2, 2] of the extract in degrees, south-west first.

    The eastern longitude is the larger one, beyond 180 where the box lies across that meridian.
    """
    boxes = [box for box in objects.boxes if box[0] != box[2] and box[1] != box[3]]
    if boxes:
        (
            notes.tell("the file names several bounds: the box around all of them is taken")
            if len(boxes) > 1
            else None
        )
        return joined_box(boxes)
    places = [
        place
        for thing in things.values()
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
    return joined_box(np.tile(places, 2))


def _summarise(
    kept: dict[_Name, Obstacle],
    things: dict[_Name, _Thing],
    projection: Projection,
    box: np.ndarray,
    notes: Notes,
) -> None:
    counts = Counter(things[name].rule.key for name in kept)
    relations = Counter(things[name].rule.key for name in kept if name[0] == "relation")
    for key, count in counts.items():
        several = f" ({relations[key]} of them multipolygons)" if relations[key] else ""
        num_indestructible = sum(
            not kept[name].destroyable for name in kept if things[name].rule.key == key
        )
        notes.tell(
            f"{count} obstacles by the tag {key}{several}, {num_indestructible} of them"
            " indestructible"
        )
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
