"""Signs as people read them: a name, and prediction matrices for image, significance and personal
meaning (PY16 §3.1).

The symbolic view of what `matrix.py` stores as arrays; `world_model.py` converts each into the
other without loss.
"""

import dataclasses
from collections.abc import Iterable, Iterator

from sign_model.signs.matrix import ColumnKind, Component


@dataclasses.dataclass(frozen=True)
class Column:
    """One moment of a prediction matrix: the names of the features that are required (or added, or
    deleted) in it.

    Raises:
      ValueError: the column is empty, or its kind is ABSENT.
    """

    features: frozenset[str]
    kind: ColumnKind = ColumnKind.CONDITION

    def __post_init__(self) -> None:
        if not self.features:
            raise ValueError(
                f"a column of kind {self.kind.name} names no feature: leave the column out"
            )
        if self.kind == ColumnKind.ABSENT:
            raise ValueError(
                "a column cannot be ABSENT: that kind marks padding, leave the column out"
            )


@dataclasses.dataclass(frozen=True)
class PredictionMatrix:
    """A sequence of feature sets; causal if its last columns are effects. Without columns it
    requires nothing.

    Raises:
      ValueError: the kinds of the columns are out of order, or an effect occurs twice.
    """

    columns: tuple[Column, ...]

    def __post_init__(self) -> None:
        kinds = [column.kind for column in self.columns]
        if kinds != sorted(kinds) or any(
            kinds.count(effect) > 1 for effect in (ColumnKind.ADDS, ColumnKind.DELETES)
        ):
            names = ", ".join(kind.name for kind in kinds)
            raise ValueError(
                f"columns ({names}) must be conditions, then at most one ADDS, then at most one"
                " DELETES column"
            )

    @property
    def features(self) -> frozenset[str]:
        """All features named in any column."""
        return frozenset().union(*(column.features for column in self.columns))

    def named(self, kind: ColumnKind) -> frozenset[str]:
        """Returns the features named in the columns of one kind; empty without such a column."""
        return frozenset().union(
            *(column.features for column in self.columns if column.kind == kind)
        )

    @property
    def is_causal(self) -> bool:
        """Whether the matrix has an effect column."""
        return any(column.kind >= ColumnKind.ADDS for column in self.columns)


@dataclasses.dataclass(frozen=True)
class Sign:
    """A sign: name, image, significance and personal meaning (PY16 §2). Each component is a tuple
    of matrices, oldest first. A sign without an image is an elementary feature or operation.
    """

    name: str
    image: tuple[PredictionMatrix, ...] = ()
    significance: tuple[PredictionMatrix, ...] = ()
    meaning: tuple[PredictionMatrix, ...] = ()

    def matrices(self, component: Component) -> tuple[PredictionMatrix, ...]:
        """Returns the matrices of one component, oldest first."""
        return (self.image, self.significance, self.meaning)[component]

    def __iter__(self) -> Iterator[tuple[Component, PredictionMatrix]]:
        """Yields every matrix with its component, in the order of storage."""
        for component in Component:
            for matrix in self.matrices(component):
                yield component, matrix


def sequence(*moments: Iterable[str] | str) -> PredictionMatrix:
    """Returns the matrix that requires the given feature sets one after the other; a single name
    stands for a set of one feature.
    """
    return PredictionMatrix(tuple(Column(_as_set(moment)) for moment in moments))


def causal(
    conditions: Iterable[str] = (), adds: Iterable[str] = (), deletes: Iterable[str] = ()
) -> PredictionMatrix:
    """Returns the causal matrix (FC, FA, FD); a set that is empty gets no column."""
    parts = (
        (conditions, ColumnKind.CONDITION),
        (adds, ColumnKind.ADDS),
        (deletes, ColumnKind.DELETES),
    )
    columns = ((_as_set(features), kind) for features, kind in parts)
    return PredictionMatrix(tuple(Column(features, kind) for features, kind in columns if features))


def with_elementary(signs: Iterable[Sign]) -> tuple[Sign, ...]:
    """Returns the signs, followed by an elementary sign for each feature that is none of them, in
    order of name.
    """
    signs = tuple(signs)
    known = {sign.name for sign in signs}
    features = frozenset().union(*(matrix.features for sign in signs for _, matrix in sign))
    return signs + tuple(Sign(name) for name in sorted(features - known))


def _as_set(moment: Iterable[str] | str) -> frozenset[str]:
    """Returns the features of a moment; a single name is a set of one."""
    return frozenset([moment]) if isinstance(moment, str) else frozenset(moment)
