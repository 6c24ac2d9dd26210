"""Real places shipped with the package: polygons in metres without a start or a goal."""

import importlib.resources

import numpy as np

from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle

_UNITS_PER_METRE = 100
"""The files hold whole centimetres, the precision of the survey."""


def helsinki() -> Place:
    """Returns the 446 buildings, 61 of them with courtyards, of 1.0 x 1.7 km in the centre of
    Helsinki.

    All are destroyable at cost 1. Data: (c) OpenStreetMap contributors, ODbL 1.0; see
    data/HELSINKI.md.
    """
    with (
        importlib.resources.files(__name__).joinpath("helsinki.npz").open("rb") as file,
        np.load(file) as data,
    ):
        fields = {name: data[name] for name in data.files}
    points = np.split(fields["points"] / _UNITS_PER_METRE, np.cumsum(fields["points_of_ring"])[:-1])
    parts = _grouped(points, fields["rings_of_part"])
    obstacles = _grouped(parts, fields["parts_of_obstacle"])
    x_min, y_min, x_max, y_max = (fields["bounds"] / _UNITS_PER_METRE).tolist()
    return Place(
        bounds=(x_min, y_min, x_max, y_max),
        obstacles=tuple(
            Obstacle(parts=parts, name=name)
            for parts, name in zip(obstacles, fields["names"].tolist())
        ),
        attribution=str(fields["attribution"]),
    )


def _grouped(items: list, sizes: np.ndarray) -> list[tuple]:
    ends = np.cumsum(sizes).tolist()
    return [tuple(items[end - size : end]) for end, size in zip(ends, sizes.tolist())]
