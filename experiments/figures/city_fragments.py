"""Fragments of cities on square grids: windows of the shipped Helsinki, crops of MovingAI's
street maps, OSM extracts.
"""

import math
import os
import pathlib
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from srt_jax.components import label
from srt_jax.data import Place, helsinki
from srt_jax.formats.movingai import read_map
from srt_jax.formats.osm import read_osm
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.types import FREE

SHARED = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data"))
"""Outside maps, used where they are there."""


Bounds = tuple[float, float, float, float]

_LEAST_CELL = 0.1
"""Metres: an extract with smaller cells is no city."""


class Fragment(NamedTuple):
    """labels: int32 [L, H, W], the building on each cell, -1 on streets. attribution: to be
    shown beside what comes of it.
    """

    name: str
    labels: np.ndarray
    attribution: str


def helsinki_windows(count: int, size: int, *, seed: int) -> Iterator[Fragment]:
    """Yields `count` windows of size x size cells, 600 to 1000 m a side, at places and scales
    drawn by `seed`.
    """
    place, rng = helsinki(), np.random.default_rng(seed)
    x_min, y_min, x_max, y_max = place.bounds
    for number in range(count):
        side = rng.uniform(600, min(1000, x_max - x_min, y_max - y_min))
        x, y = rng.uniform(x_min, x_max - side), rng.uniform(y_min, y_max - side)
        yield _window(f"Helsinki-{number}", place, (x, y, x + side, y + side), size)


def street_maps(size: int, folder: pathlib.Path = SHARED / "street") -> Iterator[Fragment]:
    """Yields the middle size x size cells of MovingAI's street maps of 512 cells a side; none
    where the folder is absent.
    """
    for path in sorted(folder.glob("*_512.map")):
        free = read_map(path)
        margin = (free.shape[0] - size) // 2
        middle = free[margin : margin + size, margin : margin + size]
        labels = np.asarray(label(~middle), np.int32)[None]
        yield Fragment(
            path.stem, labels, "MovingAI street maps; (c) OpenStreetMap contributors, ODbL 1.0"
        )


def extracts(
    paths: Iterable[pathlib.Path], size: int, log: Callable[[str], None]
) -> Iterator[Fragment]:
    """Yields a window of each OpenStreetMap extract, at most 1000 m a side: that with the most
    buildings.

    Raises:
      ValueError: a file cannot be read, or holds no building, or is too small for so many cells.
    """
    for path in paths:
        log(f"reading {path}")
        place = read_osm(path)
        if not place.obstacles:
            raise ValueError(f"{path}: no building in it: name an extract of a built-up area")
        bounds = _densest(place)
        side = bounds[2] - bounds[0]
        if side / size < _LEAST_CELL:
            raise ValueError(
                f"{path}: {side:.3g} m a side is too small for {size} x {size} cells: name a larger"
                " extract"
            )
        log(f"{path}: {len(place.obstacles)} obstacles; a window of {side:.0f} m is taken")
        yield _window(pathlib.Path(path).name.split(".")[0], place, bounds, size)


def _densest(place: Place) -> Bounds:
    """Returns the square, at most 1000 m a side, that holds the most middles of obstacles; the
    first of a row-wise lattice.
    """
    x_min, y_min, x_max, y_max = place.bounds
    side = min(1000.0, x_max - x_min, y_max - y_min)
    middles = np.array(
        [
            np.mean([point for part in obstacle.parts for point in part[0]], axis=0)
            for obstacle in place.obstacles
        ]
    )

    def starts(low: float, high: float) -> np.ndarray:
        return np.linspace(low, high - side, max(1, math.ceil(4 * (high - low) / side) - 3))

    corners = [(x, y) for y in starts(y_min, y_max) for x in starts(x_min, x_max)]
    counts = [
        ((middles >= corner) & (middles < np.add(corner, side))).all(axis=1).sum()
        for corner in corners
    ]
    x, y = corners[int(np.argmax(counts))]
    return float(x), float(y), float(x + side), float(y + side)


def _window(name: str, place: Place, bounds: Bounds, size: int) -> Fragment:
    return Fragment(name, cover(place.obstacles, square_grid(bounds, size)), place.attribution)


def free_cells(labels: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the cells that nothing covers."""
    return (labels == FREE).all(axis=0)
