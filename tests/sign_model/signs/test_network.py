"""The derived networks, and procedural signs by the order of their columns."""

import chex
import jax
import numpy as np
import pytest
from hypothesis import given, settings

from sign_model.signs.matrix import ColumnKind, Component
from sign_model.signs.network import is_procedural, network, networks, precedence, roles
from sign_model.signs.sign import Sign, causal, sequence, with_elementary
from tests.helpers.sign_worlds import NAMES, face_signs, model_of, sign_worlds


@settings(max_examples=20, deadline=None)
@given(sign_worlds())
def test_links_go_to_the_features_of_the_matrices_and_to_nothing_else(signs):
    model = model_of(signs)
    for component in Component:
        links = np.asarray(network(model.matrices, component))
        for index, sign in enumerate(signs):
            wanted = frozenset().union(*(matrix.features for matrix in sign.matrices(component)))
            assert frozenset(model.named(links[index])) == wanted
        assert not links[len(signs) :].any()


def test_networks_jitted_and_in_a_batch_give_the_same_bits():
    tables = model_of(face_signs()).matrices
    both = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), tables)
    eager = networks(tables)
    chex.assert_trees_all_equal(jax.jit(networks)(tables), eager)
    chex.assert_trees_all_equal(jax.vmap(networks)(both), np.stack([eager, eager]))


def test_a_feature_of_an_image_has_the_sign_of_that_image_among_its_roles():
    model = model_of(face_signs())
    assert model.named(roles(model.matrices)[model.index("nose")]) == ("face",)
    assert model.named(roles(model.matrices)[model.index("face")]) == ()


def is_process(*matrices, whole=True):
    """Returns whether the sign with these images is procedural."""
    model = model_of(with_elementary([Sign("sign", image=matrices)]))
    return is_procedural(model.matrices, 0, Component.IMAGE, whole=whole)


def test_the_sign_face_is_not_procedural_as_its_left_eye_comes_first_or_last():
    matrices = face_signs()[0].image
    assert not is_process(*matrices)
    assert is_process(*matrices, whole=False)
    assert is_process(*matrices[1:])


@pytest.mark.parametrize(
    "matrices, whole, part",
    [
        ((), False, False),
        ((sequence("a"),), False, False),
        ((sequence(),), False, False),
        ((sequence("a", "b"),), True, True),
        ((sequence("a", "b"), sequence("b", "a")), False, False),
        ((sequence("a", "b", "c"), sequence("a", "c")), True, True),
        ((sequence("a", "b"), sequence("c", "d")), False, False),
        ((sequence("a", "b"), sequence({"a", "b"})), False, False),
        ((sequence("a", "b", "a"),), False, False),
        ((causal("a", "b", "a"),), True, True),
        ((causal("a", (), "a"),), True, True),
    ],
)
def test_a_procedural_sign_has_a_strict_order_shared_by_all_matrices(matrices, whole, part):
    assert is_process(*matrices) == whole
    assert is_process(*matrices, whole=False) == part


@settings(max_examples=30, deadline=None)
@given(sign_worlds())
def test_the_precedence_relation_equals_its_definition_over_the_symbols(signs):
    model = model_of(signs)
    for number, sign in enumerate(signs):
        places = []
        for matrix in sign.image:
            places.append({})
            for moment, column in enumerate(matrix.columns):
                for name in column.features:
                    key = ("not " if column.kind == ColumnKind.DELETES else "") + name
                    places[-1].setdefault(key, []).append(moment)
        features, precedes, _ = precedence(model.matrices, number, Component.IMAGE)
        names = [
            ("not " + NAMES[-1 - feature]) if feature < 0 else NAMES[feature]
            for feature in features
        ]
        assert sorted(names) == sorted(set().union(*places))
        for i, earlier in enumerate(names):
            for j, later in enumerate(names):
                always = all(
                    earlier in place and later in place and max(place[earlier]) < min(place[later])
                    for place in places
                )
                assert precedes[i, j] == always
