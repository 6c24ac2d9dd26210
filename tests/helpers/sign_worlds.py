"""Small sign worlds for the tests: the paper's face, and random worlds for property tests."""

from hypothesis import strategies as st

from sign_model.signs.matrix import ColumnKind, Component
from sign_model.signs.sign import Column, PredictionMatrix, Sign, sequence, with_elementary
from sign_model.signs.world_model import from_signs

FACE = Sign(
    "face",
    image=(
        sequence("nose", "mouth", "right eye", "left eye"),
        sequence("left eye", "nose", "mouth", "right eye"),
        sequence("left eye", "nose", "mouth", {"padded", "right eye"}),
    ),
)
"""The three precedents of PY16 §3.1."""

ROOM = (8, 64, 8, 8)
"""A capacity that holds every drawn world, so that one compilation serves them all."""

NAMES = ("a", "b", "c", "d", "e", "f")


def model_of(signs):
    """Returns the world model of the signs, with room to spare."""
    return from_signs(signs, capacity=ROOM)


def face_signs() -> tuple[Sign, ...]:
    """Returns the face and its features."""
    return with_elementary([FACE])


@st.composite
def prediction_matrices(draw, names=NAMES, max_columns=4, causal=True):
    """Draws a matrix: some condition columns, then perhaps effects."""
    sets = st.frozensets(st.sampled_from(names), min_size=1, max_size=3)
    columns = [Column(features) for features in draw(st.lists(sets, max_size=max_columns))]
    for kind in (ColumnKind.ADDS, ColumnKind.DELETES) if causal else ():
        if draw(st.booleans()):
            columns.append(Column(draw(sets), kind))
    return PredictionMatrix(tuple(columns))


@st.composite
def sign_worlds(draw, names=NAMES, max_columns=4):
    """Draws signs with several matrices in every component, their features among themselves."""
    matrices = st.lists(prediction_matrices(names, max_columns), max_size=3).map(tuple)
    return tuple(Sign(name, *(draw(matrices) for _ in Component)) for name in names)
