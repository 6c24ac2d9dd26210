"""The sign world model: names above, prediction matrices below (PY16 §3.1), and the conversion
between the two without loss.
"""

import dataclasses
import functools
from collections.abc import Iterable

import jax
import numpy as np

from sign_model.foundation.sizes import next_power_of_two
from sign_model.signs import matrix as tables
from sign_model.signs.matrix import ColumnKind, Component, Matrices
from sign_model.signs.sign import Column, PredictionMatrix, Sign


@dataclasses.dataclass(frozen=True, eq=False)
class WorldModel:
    """What an agent knows: the names of its signs and all their prediction matrices.

    names: names[i] is the name of sign i; names are unique.
    matrices: the arrays that `recognition`, `activation` and `network` work on.
    """

    names: tuple[str, ...]
    matrices: Matrices

    def __repr__(self) -> str:
        """What it is in a line; `sign_model.describe` tells it all."""
        shown = ", ".join(map(repr, self.names[:3])) + (", ..." if len(self.names) > 3 else "")
        return f"WorldModel({len(self.names)} signs: {shown})"

    @functools.cached_property
    def _index(self) -> dict[str, int]:
        return {name: index for index, name in enumerate(self.names)}

    def index(self, name: str) -> int:
        """Returns the number of the sign with this name; ValueError if there is none."""
        if name not in self._index:
            raise ValueError(
                f"no sign is called {name!r}: the world model has {len(self.names)} signs,"
                f" the first are {self.names[:3]}"
            )
        return self._index[name]

    def features(self, names: Iterable[str]) -> np.ndarray:
        """Returns the set of the named signs as bool [S]: a situation, or one step of an input
        flow.
        """
        is_member = np.zeros(self.matrices.is_sign.shape[0], bool)
        is_member[[self.index(name) for name in names]] = True
        return is_member

    def named(self, is_member: np.ndarray) -> tuple[str, ...]:
        """Returns the names of the signs in a set, bool [S]: the inverse of `features`."""
        return tuple(self.names[index] for index in np.flatnonzero(np.asarray(is_member)))

    def sign(self, name: str) -> Sign:
        """Returns the symbolic view of one sign."""
        index = self.index(name)
        return _decode(self, index, np.flatnonzero(np.asarray(self.matrices.owner) == index))

    def signs(self) -> tuple[Sign, ...]:
        """Returns the symbolic view of all signs, in order; `from_signs` is its inverse."""
        owner = np.asarray(self.matrices.owner)
        slots: list[list[int]] = [[] for _ in self.names]
        for slot in np.flatnonzero(owner >= 0):
            slots[owner[slot]].append(int(slot))
        return tuple(_decode(self, index, own) for index, own in enumerate(slots))

    def with_signs(self, signs: Iterable[Sign]) -> "WorldModel":
        """Returns a model with these signs after its own; ValueError if a name is taken."""
        return from_signs((*self.signs(), *signs))

    def grown(self, name: str, component: Component, matrix: PredictionMatrix) -> "WorldModel":
        """Returns a model in which an experience has added a matrix to a component of one sign;
        this model is unchanged.

        The table doubles when it is full, so few shapes are compiled.

        Args:
          name: of the sign.
          component: to which the matrix is added.
          matrix: its features must be signs of the model.
        """
        # Make room for one more matrix of this size.
        rows = sorted(self.index(feature) for feature in matrix.features)
        num_signs, num_slots, num_rows, num_columns = tables.capacity(self.matrices)
        needed = (
            num_signs,
            int(tables.num_matrices(self.matrices)) + 1,
            len(rows),
            len(matrix.columns),
        )
        larger = tuple(
            max(have, _capacity(need))
            for have, need in zip((num_signs, num_slots, num_rows, num_columns), needed)
        )
        table = (
            self.matrices
            if larger == tables.capacity(self.matrices)
            else tables.with_capacity(self.matrices, *larger)
        )

        # Insert it.
        encoded = _encode(matrix, self._index, *larger[2:])
        extended = tables.insert(table, np.int32(self.index(name)), np.int32(component), *encoded)
        return WorldModel(self.names, jax.tree.map(np.asarray, extended))


def from_signs(
    signs: Iterable[Sign], *, capacity: tuple[int, int, int, int] | None = None
) -> WorldModel:
    """Returns the world model of these signs; `WorldModel.signs` returns them again.

    Args:
      signs: every feature of a matrix must be one of them (`with_elementary` adds missing ones).
      capacity: numbers of signs, slots, rows and columns to reserve; by default powers of two, at
        least 4.

    Raises:
      ValueError: two signs have the same name, a feature is not a sign, or the capacity is too
        small.
    """
    # Names are unique.
    signs = tuple(signs)
    names = tuple(sign.name for sign in signs)
    index = {name: number for number, name in enumerate(names)}
    if len(index) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"two signs are called {twice!r}: names must be unique")

    # An empty table that is large enough; signs and their matrices in order are canonical.
    stored = [
        (number, component, matrix)
        for number, sign in enumerate(signs)
        for component, matrix in sign
    ]
    needed = (
        len(signs),
        len(stored),
        max((len(matrix.features) for _, _, matrix in stored), default=0),
        max((len(matrix.columns) for _, _, matrix in stored), default=0),
    )
    table = tables.with_capacity(
        tables.empty_matrices(*needed), *(capacity or tuple(map(_capacity, needed)))
    )
    table.is_sign[: len(signs)] = True
    for slot, (number, component, matrix) in enumerate(stored):
        table.owner[slot], table.component[slot] = number, component
        _fill(table, slot, matrix, index, names[number])
    return WorldModel(names, table)


def _fill(
    table: Matrices, slot: int, matrix: PredictionMatrix, index: dict[str, int], owner: str
) -> None:
    """Writes one matrix into a slot of a NumPy table under construction; ValueError if a feature is
    not a sign. `owner` names the sign in that message.
    """
    try:
        rows = sorted(index[feature] for feature in matrix.features)
    except KeyError as missing:
        raise ValueError(
            f"sign {owner!r} has the feature {missing.args[0]!r}, which is not a sign: add it, or"
            " call with_elementary first"
        ) from None
    row_of = {sign: row for row, sign in enumerate(rows)}
    table.feature[slot, : len(rows)] = rows
    for moment, column in enumerate(matrix.columns):
        table.kind[slot, moment] = column.kind
        table.bits[slot, [row_of[index[feature]] for feature in column.features], moment] = True


def _encode(
    matrix: PredictionMatrix, index: dict[str, int], num_rows: int, num_columns: int
) -> tuple[np.ndarray, ...]:
    """Returns feature [R], bits [R, T] and kind [T] of one matrix."""
    single = tables.empty_matrices(0, 1, num_rows, num_columns)
    _fill(single, 0, matrix, index, "?")
    return single.feature[0], single.bits[0], single.kind[0]


def _decode(model: WorldModel, index: int, slots: Iterable[int]) -> Sign:
    """Returns the symbolic view of sign `index`, whose matrices lie in `slots`."""
    table = model.matrices
    components: tuple[list[PredictionMatrix], ...] = ([], [], [])
    for slot in slots:
        feature, bits, kind = (
            np.asarray(part[slot]) for part in (table.feature, table.bits, table.kind)
        )
        columns = (
            Column(
                frozenset(model.names[row] for row in feature[bits[:, moment]]),
                ColumnKind(kind[moment]),
            )
            for moment in np.flatnonzero(kind)
        )
        components[int(table.component[slot])].append(PredictionMatrix(tuple(columns)))
    return Sign(model.names[index], *map(tuple, components))


def _capacity(count: int) -> int:
    """Returns the capacity that holds `count`: the next power of two, 4 at least."""
    return next_power_of_two(count, least=4)
