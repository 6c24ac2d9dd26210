"""The table that grounds fuzzy directions, distances and relocation actions in degrees and metres
(PY16 §2). It is data and can be replaced.

    {"directions": [["ahead", -45, 45], ...], "distances": [["close", 0, 50], ...],
     "relocations": [["moving closer on a curve", "close", 60], ["moving closer by a detour",
     "close", null], ...], "soft_degrees": 10, "soft_metres": 5}

is a table as a JSON file; null permits any deviation.
"""

import dataclasses
import itertools
import json
import math
import pathlib
from typing import Any

from sign_model.foundation.files import atomic_write, read_text


@dataclasses.dataclass(frozen=True)
class Direction:
    """A fuzzy direction: from `start` to `end`, degrees leftwards from the heading; the next row
    starts where this one ends.
    """

    name: str
    start: float
    end: float


@dataclasses.dataclass(frozen=True)
class Distance:
    """A fuzzy distance: from `start` to `end`, metres; points beyond the last row belong to it
    too.
    """

    name: str
    start: float
    end: float


@dataclasses.dataclass(frozen=True)
class Relocation:
    """A kind of relocation: the fuzzy distance it covers, and the deviation H from the straight
    link that it permits, in metres.
    """

    name: str
    distance: str
    deviation: float


@dataclasses.dataclass(frozen=True)
class FuzzyTable:
    """The table that grounds the fuzzy signs.

    directions, distances: the rows, in ascending order.
    relocations: the kinds of relocations.
    soft_degrees, soft_metres: the width over which one term passes into the next.

    Raises:
      ValueError: a row does not start where the previous one ends, the directions do not close the
        circle, the distances do not start at 0, a name occurs twice, or a relocation has an unknown
        distance or a negative deviation.
    """

    directions: tuple[Direction, ...]
    distances: tuple[Distance, ...]
    relocations: tuple[Relocation, ...]
    soft_degrees: float = 10.0
    soft_metres: float = 5.0

    def __post_init__(self) -> None:
        if not self.directions or not self.distances:
            raise ValueError("a table needs at least one direction and one distance")
        # Each row ends after it starts, and the next one starts there.
        for rows, kind in ((self.directions, "direction"), (self.distances, "distance")):
            for row, following in itertools.pairwise(rows):
                if row.end != following.start:
                    raise ValueError(
                        f"{kind} {following.name!r} must start at {row.end}, where {row.name!r}"
                        " ends"
                    )
            for row in rows:
                if not row.start < row.end < math.inf:
                    raise ValueError(
                        f"{kind} {row.name!r} must end after it starts, got {row.start} to"
                        f" {row.end}"
                    )
        # The directions cover the circle, the distances everything from 0 on.
        if self.directions[-1].end - self.directions[0].start != 360:
            raise ValueError(
                "the directions must close the circle: the last must end 360 degrees after the"
                " first starts"
            )
        if self.distances[0].start != 0:
            raise ValueError(
                f"the first distance, {self.distances[0].name!r}, must start at 0 metres"
            )
        if self.soft_degrees <= 0 or self.soft_metres <= 0:
            raise ValueError("soft_degrees and soft_metres must be positive")
        self._check_relocations()

    def _check_relocations(self) -> None:
        """Raises ValueError where a name is not unique or a relocation refers to no distance."""
        names = [row.name for row in (*self.directions, *self.distances, *self.relocations)]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(
                f"the name {twice!r} occurs twice in the table: names of signs must be unique"
            )
        for row in self.relocations:
            if row.distance not in [distance.name for distance in self.distances]:
                raise ValueError(
                    f"relocation {row.name!r} has the distance {row.distance!r}, which is no row of"
                    " the table: use the name of one"
                )
            if not row.deviation >= 0:
                raise ValueError(
                    f"relocation {row.name!r} must permit a deviation of 0 metres or more, got"
                    f" {row.deviation}"
                )

    @property
    def num_regions(self) -> int:
        """How many pairs of a distance and a direction there are."""
        return len(self.distances) * len(self.directions)


_COMPASS = (
    "ahead",
    "ahead-left",
    "leftward",
    "behind-left",
    "behind",
    "behind-right",
    "rightward",
    "ahead-right",
)
_MANNERS = (("in a straight line", 10.0), ("on a curve", 60.0), ("by a detour", math.inf))

DEFAULT_TABLE = FuzzyTable(
    directions=tuple(
        Direction(name, 45.0 * i - 22.5, 45.0 * i + 22.5) for i, name in enumerate(_COMPASS)
    ),
    distances=(
        Distance("close", 0.0, 50.0),
        Distance("midway", 50.0, 200.0),
        Distance("afar", 200.0, 1000.0),
    ),
    relocations=tuple(
        Relocation(f"moving {change} {manner}", distance, deviation)
        for change, distance in (("closer", "close"), ("midway", "midway"), ("afar", "afar"))
        for manner, deviation in _MANNERS
    ),
)
"""Eight directions of 45 degrees, three distances, and for each distance three permitted deviations
(H1, H2, any).
"""


def save_table(table: FuzzyTable, path: str | pathlib.Path) -> None:
    """Writes the table as JSON."""
    payload = dataclasses.asdict(table)
    for part in ("directions", "distances", "relocations"):
        payload[part] = [
            [None if value == math.inf else value for value in row.values()]
            for row in payload[part]
        ]
    text = json.dumps(payload, indent=1)
    with atomic_write(path) as file:
        file.write(text + "\n")


def load_table(path: str | pathlib.Path) -> FuzzyTable:
    """Returns the table of a JSON file.

    Raises:
      ValueError: the file is not JSON, a row is not a name and two values, or the rows break a rule
        of `FuzzyTable`; the message names the file.
    """
    # Each part is removed from the payload once it is read; what is left over is unknown, and
    # FuzzyTable refuses it.
    try:
        payload = json.loads(read_text(path, what="table of fuzzy terms"))
        numbers = {
            part: float(payload.pop(part))
            for part in ("soft_degrees", "soft_metres")
            if part in payload
        }
        return FuzzyTable(
            directions=tuple(
                Direction(str(name), float(start), float(end))
                for name, start, end in _rows(payload, "directions")
            ),
            distances=tuple(
                Distance(str(name), float(start), float(end))
                for name, start, end in _rows(payload, "distances")
            ),
            relocations=tuple(
                Relocation(
                    str(name), str(distance), math.inf if deviation is None else float(deviation)
                )
                for name, distance, deviation in _rows(payload, "relocations")
            ),
            **numbers,
            **payload,
        )
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(
            f"{path}: not JSON ({error}): write the table as in the docstring of"
            " sign_model.space.fuzzy_table"
        ) from None
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(
            f"{path}: not a table of fuzzy terms ({error}): see the docstring of"
            " sign_model.space.fuzzy_table"
        ) from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _rows(payload: dict[str, Any], part: str) -> list[list]:
    """Removes one part from the payload of a file and returns its rows."""
    rows = payload.pop(part)
    if not isinstance(rows, list) or not all(
        isinstance(row, list) and len(row) == 3 for row in rows
    ):
        raise ValueError(f"{part}: each row needs a name and two values")
    return rows
