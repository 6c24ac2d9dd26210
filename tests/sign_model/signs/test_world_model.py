"""Arrays and symbols of the sign world model, and the conversion between them."""

import chex
import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sign_model.signs import matrix as tables
from sign_model.signs.matrix import ColumnKind, Component
from sign_model.signs.sign import Column, PredictionMatrix, Sign, causal, sequence, with_elementary
from sign_model.signs.world_model import from_signs
from tests.helpers.sign_worlds import NAMES, face_signs, model_of, prediction_matrices, sign_worlds


@settings(max_examples=30, deadline=None)
@given(sign_worlds())
def test_symbols_become_arrays_and_symbols_again_without_loss(signs):
    model = from_signs(signs)
    assert tables.faults(model.matrices) == []
    assert model.signs() == signs
    assert tuple(map(model.sign, NAMES)) == signs


@settings(max_examples=20, deadline=None)
@given(sign_worlds(), st.integers(0, 3))
def test_arrays_become_symbols_and_arrays_again_at_any_capacity(signs, room):
    model = from_signs(signs)
    larger = tables.with_capacity(
        model.matrices, *(side + room for side in tables.capacity(model.matrices))
    )
    again = from_signs(model.signs(), capacity=tables.capacity(larger))
    chex.assert_trees_all_equal(again.matrices, larger)


@settings(max_examples=20, deadline=None)
@given(
    sign_worlds(),
    st.lists(
        st.tuples(st.sampled_from(NAMES), st.sampled_from(Component), prediction_matrices()),
        max_size=4,
    ),
)
def test_an_experience_adds_the_youngest_matrix_and_leaves_the_old_model_unchanged(
    signs, experiences
):
    model = extended = model_of(signs)
    expected = {
        sign.name: [list(sign.matrices(component)) for component in Component] for sign in signs
    }
    for name, component, matrix in experiences:
        extended = extended.grown(name, component, matrix)
        expected[name][component].append(matrix)
    assert tables.faults(extended.matrices) == []
    assert extended.signs() == tuple(Sign(name, *map(tuple, expected[name])) for name in NAMES)
    assert model.signs() == signs


def test_insert_jitted_and_in_a_batch_gives_the_same_bits():
    model = from_signs(face_signs(), capacity=(8, 8, 8, 8))
    feature = np.array([1, 2] + [-1] * 6, np.int32)
    bits = np.zeros((8, 8), bool)
    bits[0, 0] = bits[1, 1] = True
    kind = np.array([1, 1] + [0] * 6, np.int32)
    new = (np.int32(0), np.int32(0), feature, bits, kind)
    eager = tables.insert(model.matrices, *new)
    chex.assert_trees_all_equal(jax.jit(tables.insert)(model.matrices, *new), eager)
    batch = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), (model.matrices, *new))
    chex.assert_trees_all_equal(
        jax.vmap(tables.insert)(*batch), jax.tree.map(lambda leaf: np.stack([leaf, leaf]), eager)
    )


def test_added_matrices_keep_the_shape_while_there_is_room():
    model = from_signs(face_signs(), capacity=(8, 16, 8, 8))
    shapes = set()
    for _ in range(10):
        model = model.grown("face", Component.MEANING, sequence("nose", "mouth"))
        shapes.add(tables.capacity(model.matrices))
    assert shapes == {(8, 16, 8, 8)}


@settings(max_examples=20, deadline=None)
@given(sign_worlds())
def test_the_features_of_a_column_kind_equal_those_of_the_symbols(signs):
    model = model_of(signs)
    stored = [matrix for sign in signs for _, matrix in sign]
    for kind in (ColumnKind.CONDITION, ColumnKind.ADDS, ColumnKind.DELETES):
        rows = np.asarray(tables.features_of(model.matrices, kind))
        assert [frozenset(model.named(row)) for row in rows[: len(stored)]] == [
            matrix.named(kind) for matrix in stored
        ]
        assert not rows[len(stored) :].any()
    assert list(tables.is_causal(model.matrices)[: len(stored)]) == [
        matrix.is_causal for matrix in stored
    ]


def test_a_model_without_signs_is_empty():
    model = from_signs(())
    assert model.signs() == () and int(tables.num_matrices(model.matrices)) == 0


def test_a_matrix_without_columns_is_stored():
    signs = (Sign("start", meaning=(sequence(),)), Sign("p"))
    assert from_signs(signs).signs() == signs


def test_elementary_features_become_signs_in_order_of_name():
    assert [sign.name for sign in face_signs()] == [
        "face",
        "left eye",
        "mouth",
        "nose",
        "padded",
        "right eye",
    ]
    assert with_elementary(face_signs()) == face_signs()


def test_situations_become_bits_and_names_again():
    model = from_signs(face_signs())
    assert model.named(model.features(["nose", "mouth"])) == ("mouth", "nose")
    assert model.with_signs([Sign("hand")]).index("hand") == 6


@pytest.mark.parametrize(
    "broken, message",
    [
        (lambda: from_signs([Sign("a"), Sign("a")]), "two signs are called 'a'"),
        (lambda: from_signs([Sign("a", image=(sequence("b"),))]), "has the feature 'b'"),
        (lambda: from_signs([Sign("a")], capacity=(0, 1, 1, 1)), "a table can only be enlarged"),
        (lambda: from_signs([Sign("a")]).index("b"), "no sign is called 'b'"),
        (lambda: Column(frozenset()), "names no feature"),
        (lambda: Column(frozenset("a"), ColumnKind.ABSENT), "cannot be ABSENT"),
        (
            lambda: PredictionMatrix(
                (Column(frozenset("a"), ColumnKind.ADDS), Column(frozenset("b")))
            ),
            "must be conditions, then at most one ADDS",
        ),
    ],
)
def test_a_broken_rule_is_reported_in_one_sentence(broken, message):
    with pytest.raises(ValueError, match=message):
        broken()


def test_faults_reports_a_table_out_of_order():
    table = from_signs(
        (
            Sign("a", image=(sequence("b"), sequence("a", "b"))),
            Sign("b", meaning=(causal("a", "b"),)),
        )
    ).matrices
    assert tables.faults(table) == []
    for part in ("owner", "component", "feature", "bits", "kind"):
        turned = getattr(table, part)[::-1]
        assert tables.faults(table.replace(**{part: turned})), part
