"""Fragments of cities on square grids: windows of the shipped Helsinki, crops of MovingAI's street maps, OSM extracts."""

import importlib
import os
import pathlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from srt_jax.components import label
from srt_jax.data import Place, helsinki
from srt_jax.formats.movingai import read_map
from srt_jax.raster import cover, square_grid
from srt_jax.types import FREE

SHARED = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data"))
"""Outside maps, used where they are there."""


class Fragment(NamedTuple):
    """labels: int32 [L, H, W], the building on each cell, -1 on streets. attribution: to be shown beside what comes of it."""

    name: str
    labels: np.ndarray
    attribution: str


def helsinki_windows(count: int, size: int, *, seed: int) -> Iterator[Fragment]:
    """Yields `count` windows of size x size cells, 600 to 1000 m a side, at places and scales drawn by `seed`."""
    place, rng = helsinki(), np.random.default_rng(seed)
    x_min, y_min, x_max, y_max = place.bounds
    for number in range(count):
        side = rng.uniform(600, min(1000, x_max - x_min, y_max - y_min))
        x, y = rng.uniform(x_min, x_max - side), rng.uniform(y_min, y_max - side)
        yield _window(f"Helsinki-{number}", place, (x, y, x + side, y + side), size)


def street_maps(size: int, folder: pathlib.Path = SHARED / "street") -> Iterator[Fragment]:
    """Yields the middle size x size cells of MovingAI's street maps of 512 cells a side; none where the folder is absent."""
    for path in sorted(folder.glob("*_512.map")):
        free = read_map(path)
        margin = (free.shape[0] - size) // 2
        middle = free[margin : margin + size, margin : margin + size]
        labels = np.asarray(label(~middle), np.int32)[None]
        yield Fragment(path.stem, labels, "MovingAI street maps; (c) OpenStreetMap contributors, ODbL 1.0")


def extracts(paths: Iterable[pathlib.Path], size: int) -> Iterator[Fragment]:
    """Yields the largest square in the middle of each OpenStreetMap extract.

    Raises:
      ValueError: this version has no reader for such files, or a file cannot be read.
    """
    paths = list(paths)
    if not paths:
        return
    try:
        read = importlib.import_module("srt_jax.formats.osm").read_osm
    except (ImportError, AttributeError) as error:
        raise ValueError(f"{paths[0]}: there is no reader for OpenStreetMap extracts here: {error}") from error
    for path in paths:
        found = read(path)
        place = getattr(found, "place", found)
        yield _window(pathlib.Path(path).name.split(".")[0], place, place.bounds, size)


def _window(name: str, place: Place, bounds: tuple[float, float, float, float], size: int) -> Fragment:
    return Fragment(name, cover(place.obstacles, square_grid(bounds, size)), place.attribution)


def free_cells(labels: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the cells that nothing covers."""
    return (labels == FREE).all(axis=0)
