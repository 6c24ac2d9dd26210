"""Spatial signs: the fuzzy terms of a table as signs whose images lead down to elementary features,
in degrees and metres (PY16 §2).

| sign | image |
|---|---|
| `phi -22.5..22.5 deg`, `r 0..50 m`, `deviation <= 10 m` | elementary: a measurement |
| direction `ahead` | `phi -22.5..22.5 deg` |
| distance `close` | `r 0..50 m` |
| region `close, ahead` | `close` and `ahead` at one moment |
| relocation `moving closer on a curve` | `close` and `deviation <= 60 m` at one moment |

Measurements become elementary features, from which `recognise(..., levels=3)` recognises the rest.
"""

import numpy as np

from sign_model.foundation.records import Array
from sign_model.signs.sign import Sign, sequence, with_elementary
from sign_model.signs.world_model import WorldModel
from sign_model.space.fuzzy import direction_of, distance_of, region_names
from sign_model.space.fuzzy_table import Direction, Distance, FuzzyTable
from sign_model.space.polar import array_namespace, path_deviation, path_link


def spatial_signs(table: FuzzyTable) -> tuple[Sign, ...]:
    """Returns the signs of a table: regions, relocations, directions, distances, and the elementary
    features below them.
    """
    directions = tuple(
        Sign(row.name, image=(sequence(_measurement(row)),)) for row in table.directions
    )
    distances = tuple(
        Sign(row.name, image=(sequence(_measurement(row)),)) for row in table.distances
    )
    pairs = (
        {distance.name, direction.name}
        for distance in table.distances
        for direction in table.directions
    )
    regions = tuple(
        Sign(name, image=(sequence(pair),)) for name, pair in zip(region_names(table), pairs)
    )
    relocations = tuple(
        Sign(row.name, image=(sequence({row.distance, _bound(row.deviation)}),))
        for row in table.relocations
    )
    return with_elementary((*regions, *relocations, *directions, *distances))


def point_features(model: WorldModel, table: FuzzyTable, polar: Array) -> Array:
    """Returns the elementary features of points (r, phi): each point is one step of an input flow.

    Args:
      model: contains the signs of the table.
      table: the grounding.
      polar: float [..., 2], as of `polar.to_polar`.

    Returns:
      bool [..., S].
    """
    directions = _feature_rows(model, [_measurement(row) for row in table.directions])
    distances = _feature_rows(model, [_measurement(row) for row in table.distances])
    xp = array_namespace(polar)
    direction, distance = direction_of(polar[..., 1], table), distance_of(polar[..., 0], table)
    return xp.asarray(directions)[direction] | xp.asarray(distances)[distance]


def path_features(model: WorldModel, table: FuzzyTable, path: Array, num_points: Array) -> Array:
    """Returns the elementary features of paths: the distance they cover, and every permitted
    deviation that they do not exceed.

    Args:
      model: contains the signs of the table.
      table: the grounding.
      path: float [..., N, 2], (x, y), in metres.
      num_points: int [...], 1 or more.

    Returns:
      bool [..., S]; recognition finds every relocation that permits the path, and
      `fuzzy.relocation_of` the narrowest one.
    """
    xp = array_namespace(path)
    distances = xp.asarray(_feature_rows(model, [_measurement(row) for row in table.distances]))
    found = distances[distance_of(path_link(path, num_points), table)]
    deviations = path_deviation(path, num_points)
    for deviation in sorted({row.deviation for row in table.relocations}):
        (row,) = _feature_rows(model, [_bound(deviation)])
        found = found | (
            (deviations <= deviation)[..., None]
            & xp.asarray(row).reshape((1,) * deviations.ndim + (-1,))
        )
    return found


def _measurement(row: Direction | Distance) -> str:
    """Returns the name of the elementary feature below a direction or distance."""
    name, unit = ("phi", "deg") if isinstance(row, Direction) else ("r", "m")
    return f"{name} {row.start:g}..{row.end:g} {unit}"


def _bound(deviation: float) -> str:
    """Returns the name of the elementary feature of a permitted deviation."""
    return f"deviation <= {deviation:g} m"


def _feature_rows(model: WorldModel, names: list[str]) -> np.ndarray:
    """Returns one row per name that contains that sign alone, bool [names, S]."""
    return np.stack([model.features([name]) for name in names])
