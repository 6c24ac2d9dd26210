"""The objects of an OpenStreetMap file, in whatever order and numbering they come.

XML is read here, as programs write it that osmium does not read: JOSM (ids below 0, deleted objects
that are still in the file), Overpass (ways before nodes, corners written inside the ways). PBF
files are read by osmium. Either way the nodes come last, and only those that something needs.
"""

import array
import itertools
import xml.parsers.expat
import zlib
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.containers.packed import UnpacksTooFarError, unpack
from srt_jax.formats.shared.whole_files import PathLike, require_module

ENDINGS = (".osm", ".osm.gz", ".osm.bz2", ".pbf")
_NO_PLACE = (np.nan, np.nan)
_DEGREES = (180.0, 90.0)
"""Beyond these no longitude and no latitude lies."""

Location = tuple[float, float]
"""(longitude, latitude), degrees."""


class Way(NamedTuple):
    """nodes: ids, in order; the first again at the end of a closed way."""

    nodes: tuple[int, ...]
    tags: dict[str, str]


class Relation(NamedTuple):
    """members: (type "n", "w" or "r"; id; role)."""

    members: tuple[tuple[str, int, str], ...]
    tags: dict[str, str]


class Objects(NamedTuple):
    """What a file holds, without what was deleted.

    ways, relations: by id. nodes: where the nodes of the ways lie; those that are not in the file,
    or have no place, are missing. boxes: (west, south, east, north) in degrees, as the file states
    them. remarks: what the server that wrote the file had to say, such as that it ran out of time.
    """

    ways: dict[int, Way]
    relations: dict[int, Relation]
    nodes: dict[int, Location]
    boxes: list[tuple[float, float, float, float]]
    remarks: list[str]


def read_objects(path: PathLike, keys: Collection[str]) -> Objects:
    """Returns the objects in a file; of several versions of one object the newest counts.

    Args:
      keys: of the tags that matter; ways and relations without any of them may be missing, unless
        they are members of others.

    Raises:
      ValueError: the file is cut off, damaged, or of another kind than its ending says.
    """
    is_packed = str(path).lower().endswith(".pbf")
    osmium: Any = (
        require_module("osmium", extra="osm", what="reading OpenStreetMap") if is_packed else None
    )
    faults: tuple[type[Exception], ...] = (
        RuntimeError,
        OSError,
        EOFError,
        ValueError,
        OverflowError,
        zlib.error,
    )
    faults += (xml.parsers.expat.ExpatError, *([osmium.InvalidLocationError] if is_packed else []))
    try:
        return _read_pbf(osmium, str(path), keys) if is_packed else _read_xml(path)
    except UnpacksTooFarError:
        raise
    except faults as error:
        raise ValueError(
            f"{path}: no whole OpenStreetMap extract: it is cut off, damaged, or of another kind "
            f"than its ending says ({' '.join(str(error).split())})"
        ) from error


class _Nodes:
    """Nodes as they are read: by the million, so that they lie in plain arrays."""

    def __init__(self) -> None:
        self._ids, self._versions = array.array("q"), array.array("q")
        self._lons, self._lats = array.array("d"), array.array("d")

    def add(self, number: int, version: int, location: Location) -> None:
        self._ids.append(number)
        self._versions.append(version)
        self._lons.append(location[0])
        self._lats.append(location[1])

    def located(self, ways: Iterable[Way]) -> dict[int, Location]:
        """Returns where the nodes of these ways lie; of several versions the newest, then the
        last.
        """
        used = np.unique(np.fromiter((n for way in ways for n in way.nodes), np.int64))
        ids = np.frombuffer(self._ids, np.int64)
        order = np.lexsort((np.frombuffer(self._versions, np.int64), ids))
        order = order[np.isin(ids[order], used)]
        last = order[np.append(ids[order][1:] != ids[order][:-1], True)] if len(order) else order
        found = np.stack([np.frombuffer(a, np.float64)[last] for a in (self._lons, self._lats)], 1)
        is_there = np.isfinite(found).all(axis=1)
        numbers = ids[last][is_there].tolist()
        return dict(zip(numbers, map(tuple, found[is_there].tolist())))


class _Newest:
    """Ways or relations by id, each in its newest version; what was deleted is None."""

    def __init__(self) -> None:
        self._kept: dict[int, tuple[int, Any]] = {}

    def add(self, number: int, version: int, item: Any) -> None:
        if number not in self._kept or version >= self._kept[number][0]:
            self._kept[number] = version, item

    def items(self) -> dict[int, Any]:
        return {n: item for n, (_, item) in self._kept.items() if item is not None}


class _XmlReader:
    """Takes the elements of an OSM file one by one from expat."""

    def __init__(self, parser: xml.parsers.expat.XMLParserType) -> None:
        self.nodes, self.ways, self.relations = _Nodes(), _Newest(), _Newest()
        self.inside = _Nodes()
        self.boxes: list[tuple[float, float, float, float]] = []
        self.remarks: list[str] = []
        self._parser, self._path = parser, []
        self._open: dict[str, str] = {}
        self._refs: list[Any] = []
        self._tags: dict[str, str] = {}
        self._text: list[str] = []
        parser.buffer_text = True
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.CharacterDataHandler = self._characters
        parser.EntityDeclHandler = self._refuse_entity

    def _start(self, name: str, given: dict[str, str]) -> None:
        depth = len(self._path)
        self._path.append(name)
        if depth == 0 and name != "osm":
            raise ValueError(f"its first element is <{name[:40]}>, not <osm>")
        if depth == 1 and name in ("node", "way", "relation"):
            self._open, self._refs, self._tags = given, [], {}
        elif depth == 1 and name == "bounds":
            box = [float(given[side]) for side in ("minlon", "minlat", "maxlon", "maxlat")]
            self.boxes.append(_checked_box(box))
        elif depth == 1 and name == "bound":  # the older form
            south, west, north, east = map(float, given["box"].split(","))
            self.boxes.append(_checked_box([west, south, east, north]))
        elif depth == 1 and name == "remark":
            self._text = []
        elif depth == 2 and name == "tag":
            self._tags[given["k"]] = given["v"]
        elif depth == 2 and name == "nd" and self._path[1] == "way":
            self._refs.append(int(given["ref"]))
            if "lat" in given:
                self.inside.add(self._refs[-1], 0, _location(given))
        elif depth == 2 and name == "member":
            self._refs.append((given["type"][:1], int(given["ref"]), given.get("role", "")))

    def _end(self, name: str) -> None:
        self._path.pop()
        if len(self._path) != 1:
            return
        if name == "remark":
            self.remarks.append(" ".join("".join(self._text).split()))
        if name not in ("node", "way", "relation"):
            return
        given = self._open
        number, version = int(given["id"]), int(given.get("version", 0))
        is_gone = given.get("visible") == "false" or given.get("action") == "delete"
        if name == "node":
            self.nodes.add(number, version, _NO_PLACE if is_gone else _location(given))
        elif name == "way":
            self.ways.add(number, version, None if is_gone else Way(tuple(self._refs), self._tags))
        else:
            kept = None if is_gone else Relation(tuple(self._refs), self._tags)
            self.relations.add(number, version, kept)

    def _characters(self, text: str) -> None:
        if self._path[1:] == ["remark"]:
            self._text.append(text)

    def _refuse_entity(self, *given: Any) -> None:
        raise ValueError("it defines entities of its own, which are not read: write its text out")


def _read_xml(path: PathLike) -> Objects:
    parser = xml.parsers.expat.ParserCreate()
    reader = _XmlReader(parser)
    for chunk in itertools.chain(unpack(path), [b""]):
        _parse(parser, chunk)
    ways, relations = reader.ways.items(), reader.relations.items()
    nodes = reader.inside.located(ways.values()) | reader.nodes.located(ways.values())
    return Objects(ways, relations, nodes, reader.boxes, reader.remarks)


def _parse(parser: xml.parsers.expat.XMLParserType, chunk: bytes) -> None:
    """Parses the next piece of a file, an empty one at its end; errors name the line."""
    try:
        parser.Parse(chunk, not chunk)
    except KeyError as error:
        where = f"line {parser.CurrentLineNumber}"
        raise ValueError(f"{where}: an element lacks {error}") from error
    except OverflowError as error:
        raise ValueError(f"line {parser.CurrentLineNumber}: an id has more than 64 bits") from error
    except ValueError as error:
        raise ValueError(f"line {parser.CurrentLineNumber}: {error}") from error


def _location(given: dict[str, str]) -> Location:
    """Returns where a node lies; no place where it names none, as in a list of what was deleted."""
    if "lon" not in given and "lat" not in given:
        return _NO_PLACE
    location = float(given["lon"]), float(given["lat"])
    if not all(abs(value) <= most for value, most in zip(location, _DEGREES)):
        raise ValueError(f"longitude {given['lon']}, latitude {given['lat']} lie on no globe")
    return location


def _checked_box(box: list[float]) -> tuple[float, float, float, float]:
    west, south, east, north = box
    if not (max(abs(west), abs(east)) <= 180 and -90 <= south <= north <= 90):
        raise ValueError(f"the bounds {box} are no box of longitudes and latitudes")
    return west, south, east, north


def _read_pbf(osmium: Any, path: str, keys: Collection[str]) -> Objects:
    """Reads relations first, then the ways among them and those with a key, then their nodes."""
    file, osm = osmium.io.File(path, "pbf"), osmium.osm
    header = osmium.io.Reader(file).header()
    # A filter by keys would hide that the newest version of an object has lost them.
    tagged = [] if header.has_multiple_object_versions else [osmium.filter.KeyFilter(*keys)]
    relations, ways, nodes, inside = _Newest(), _Newest(), _Nodes(), _Nodes()
    for item in _filtered(osmium, file, osm.RELATION, tagged):
        members = tuple((member.type, member.ref, member.role) for member in item.members)
        relation = Relation(members, {tag.k: tag.v for tag in item.tags})
        relations.add(item.id, item.version, relation if item.visible else None)
    kept_relations = relations.items()
    members = {
        ref for kept in kept_relations.values() for kind, ref, _ in kept.members if kind == "w"
    }
    for filters in [tagged, [members]] if tagged else [[]]:
        for item in _filtered(osmium, file, osm.WAY, filters):
            way = Way(tuple(node.ref for node in item.nodes), {tag.k: tag.v for tag in item.tags})
            ways.add(item.id, item.version, way if item.visible else None)
            for node in item.nodes:
                if node.location.valid():
                    inside.add(node.ref, 0, (node.lon, node.lat))
    kept = ways.items()
    for item in _filtered(
        osmium, file, osm.NODE, [{n for way in kept.values() for n in way.nodes}]
    ):
        is_there = item.visible and item.location.valid()
        nodes.add(item.id, item.version, (item.lon, item.lat) if is_there else _NO_PLACE)
    places = inside.located(kept.values()) | nodes.located(kept.values())
    box, boxes = header.box(), []
    if box.valid():
        west, south, east, north = (
            getattr(c, d) for c in (box.bottom_left, box.top_right) for d in ("lon", "lat")
        )
        boxes = [(west, south, east, north)]
    return Objects(kept, kept_relations, places, boxes, [])


def _filtered(osmium: Any, file: Any, kind: Any, filters: Sequence[Any]) -> Iterator[Any]:
    """Yields the objects of a kind that pass; a set among the filters holds the ids that pass."""
    objects = osmium.FileProcessor(file, kind)
    for one in filters:
        if not isinstance(one, set):
            objects = objects.with_filter(one)
        elif all(number >= 0 for number in one):  # osmium filters no others
            objects = objects.with_filter(osmium.filter.IdFilter(one))
    yield from objects
