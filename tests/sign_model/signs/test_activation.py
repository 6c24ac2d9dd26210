"""Spreading activation against a plain twin that walks the links."""

import jax
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sign_model.signs.activation import spread_activation
from sign_model.signs.matrix import Component
from sign_model.signs.sign import Sign, sequence, with_elementary
from tests.helpers.sign_worlds import NAMES, face_signs, model_of, sign_worlds

DECAY = np.array([0.5, 0.25, 0.75], np.float32)


def twin(signs, active, decay, steps):
    """Returns the activation by name after `steps` steps along all links of all signs."""
    for _ in range(steps):
        before = dict(active)
        for sign in signs:
            for component, matrix in sign:
                for feature in matrix.features:
                    sent = np.float32(before[sign.name]) * decay[component]
                    active[feature] = max(active[feature], sent)
    return active


@settings(max_examples=30, deadline=None)
@given(sign_worlds(), st.lists(st.floats(0, 1, width=32), min_size=6, max_size=6))
def test_activation_equals_that_of_the_plain_twin_bit_for_bit(signs, start):
    model = model_of(signs)
    active = np.zeros(8, np.float32)
    active[:6] = start
    spread = spread_activation(model.matrices, active, decay=DECAY, steps=3)
    expected = twin(signs, dict(zip(NAMES, active[:6])), DECAY, 3)
    assert np.asarray(spread)[:6].tolist() == [float(expected[name]) for name in NAMES]


def test_activation_decays_with_each_link_and_stops_after_the_given_steps():
    signs = with_elementary(
        [
            Sign("a", image=(sequence("b"),)),
            Sign("b", image=(sequence("c"),)),
            Sign("c", image=(sequence("d"),)),
        ]
    )
    model = model_of(signs)
    active = model.features(["a"]).astype(np.float32)
    assert spread_activation(model.matrices, active, decay=DECAY, steps=2)[:4].tolist() == [
        1.0,
        0.5,
        0.25,
        0.0,
    ]
    assert (
        spread_activation(model.matrices, active, decay=DECAY, steps=0).tolist() == active.tolist()
    )


def test_a_network_with_decay_0_sends_nothing():
    model = model_of(face_signs())
    active = model.features(["face"]).astype(np.float32)
    decay = DECAY.copy()
    decay[Component.IMAGE] = 0
    assert (
        spread_activation(model.matrices, active, decay=decay, steps=4).tolist() == active.tolist()
    )


def test_a_batch_of_situations_gives_the_same_bits():
    model = model_of(face_signs())
    active = np.random.default_rng(0).random((2, 3, 8), np.float32)
    batch = spread_activation(model.matrices, active, decay=DECAY, steps=2)
    single = [
        [spread_activation(model.matrices, one, decay=DECAY, steps=2) for one in row]
        for row in active
    ]
    assert np.array_equal(
        batch, np.stack([np.stack(row) for row in jax.tree.map(np.asarray, single)])
    )
