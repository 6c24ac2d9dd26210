"""Recognition in an input flow against a plain twin that works on symbols."""

import chex
import jax
import numpy as np
import pytest

from sign_model.signs.matrix import ColumnKind, Component
from sign_model.signs.recognition import expectation, recognise
from sign_model.signs.sign import Column, PredictionMatrix, Sign, causal, sequence, with_elementary
from tests.helpers.sign_worlds import NAMES, ROOM, face_signs, model_of


def flow_of(model, *steps, length=5):
    """Returns the steps as an input flow, padded with empty steps to one length, so that one
    compilation serves all.
    """
    flow = np.zeros((max(length, len(steps)), ROOM[0]), bool)
    flow[: len(steps)] = [model.features(step) for step in steps]
    return flow


def ends(matrix, flow, contiguous):
    """Returns the steps at which the matrix can end in the flow; tries every way to place its
    columns.
    """

    def matches(column, step):
        if column.kind == ColumnKind.DELETES:
            return not column.features & flow[step]
        return column.features <= flow[step]

    def places(columns, first, last):
        if not columns:
            return {first - 1}
        found = set()
        for step in range(first, last + 1):
            if matches(columns[0], step):
                nearest = step if contiguous else len(flow) - 1
                found |= places(columns[1:], step + 1, min(nearest + 1, len(flow) - 1))
                merged = columns[:2]
                if [column.kind for column in merged] == [
                    ColumnKind.ADDS,
                    ColumnKind.DELETES,
                ] and matches(merged[1], step):
                    found.add(step)
        return found

    return places(matrix.columns, 0, len(flow) - 1) if matrix.columns else set()


def twin(signs, flow, *, contiguous, levels=1):
    """Returns {name: (step, precedent)} of the signs recognised by their images."""
    offered = [set(step) for step in flow]
    for step in range(len(flow)):
        for _ in range(levels - 1):
            past = offered[: step + 1]
            found = {
                sign.name
                for sign in signs
                if any(step in ends(matrix, past, contiguous) for matrix in sign.image)
            }
            offered[step] |= found
    recognised = {}
    for sign in signs:
        done = [
            (min(steps), number)
            for number, matrix in enumerate(sign.image)
            if (steps := ends(matrix, offered, contiguous))
        ]
        if done:
            recognised[sign.name] = min(done)
    return recognised


def random_matrix(rng):
    """Returns up to three condition columns and perhaps effects, of random features."""

    def some():
        return frozenset(name for name in NAMES if rng.random() < 0.25) or frozenset(
            rng.choice(NAMES, 1).tolist()
        )

    kinds = [ColumnKind.CONDITION] * int(rng.integers(0, 4))
    kinds += [kind for kind in (ColumnKind.ADDS, ColumnKind.DELETES) if rng.random() < 0.5]
    return PredictionMatrix(tuple(Column(some(), kind) for kind in kinds))


@pytest.mark.parametrize("contiguous", [False, True])
@pytest.mark.parametrize("levels", [1, 3])
def test_recognition_equals_its_plain_twin_on_random_worlds(contiguous, levels):
    rng = np.random.default_rng(11)
    for _ in range(40):
        signs = tuple(
            Sign(name, image=tuple(random_matrix(rng) for _ in range(rng.integers(1, 3))))
            for name in NAMES
        )
        steps = [frozenset(name for name in NAMES if rng.random() < 0.5) for _ in range(5)]
        model = model_of(signs)
        found = recognise(
            model.matrices, flow_of(model, *steps), contiguous=contiguous, levels=levels
        )
        actual = {
            name: (int(found.step[index]), int(found.precedent[index]))
            for index, name in enumerate(NAMES)
            if found.recognised[index]
        }
        assert actual == twin(signs, steps, contiguous=contiguous, levels=levels)
        assert not found.recognised[len(NAMES) :].any()


def test_a_face_is_recognised_by_the_precedent_whose_order_the_flow_has():
    model = model_of(face_signs())
    flow = flow_of(model, ["left eye"], ["nose"], ["mouth"], ["right eye"], ["left eye"])
    found = recognise(model.matrices, flow)
    face = model.index("face")
    assert (
        bool(found.recognised[face])
        and int(found.step[face]) == 3
        and int(found.precedent[face]) == 1
    )
    assert int(found.recognised.sum()) == 1 and int(found.step[model.index("nose")]) == -1


def test_other_steps_may_lie_between_columns_unless_they_must_be_contiguous():
    model = model_of(face_signs())
    flow = flow_of(model, ["nose"], ["mouth"], ["padded"], ["right eye"], ["left eye"])
    assert bool(recognise(model.matrices, flow).recognised[0])
    assert not bool(recognise(model.matrices, flow, contiguous=True).recognised[0])


def test_expectation_is_the_fraction_matched_with_the_next_feature():
    model = model_of(face_signs())
    found = recognise(model.matrices, flow_of(model, ["left eye"], ["nose"], ["mouth"]))
    strength = np.asarray(expectation(model.matrices, found))[model.index("face")]
    expected = {name: float(strength[model.index(name)]) for name in model.named(strength > 0)}
    assert expected == {"right eye": 1.0, "padded": 1.0}
    first = np.asarray(
        expectation(model.matrices, recognise(model.matrices, flow_of(model, ["nose"])))
    )[0]
    assert {name: float(first[model.index(name)]) for name in model.named(first > 0)} == {
        "left eye": 0.25,
        "mouth": 0.5,
    }


def test_a_recognised_sign_expects_no_feature():
    model = model_of(face_signs())
    found = recognise(
        model.matrices, flow_of(model, ["left eye"], ["nose"], ["mouth"], ["right eye"])
    )
    assert not found.expected.any()


def test_a_sign_recognised_within_a_step_is_a_feature_for_the_signs_above_it():
    signs = with_elementary(
        [
            Sign("scene", image=(sequence("face", "hand"),)),
            Sign("face", image=(sequence("nose", "eye"),)),
            Sign("nose", image=(sequence("dot"),)),
        ]
    )
    model = model_of(signs)
    flow = flow_of(model, ["dot"], ["eye"], ["hand"])
    assert model.named(recognise(model.matrices, flow, levels=3).recognised[: len(signs)]) == (
        "scene",
        "face",
        "nose",
    )
    assert model.named(recognise(model.matrices, flow, levels=1).recognised[: len(signs)]) == (
        "nose",
    )


def test_an_action_is_recognised_by_its_adds_and_deletes_in_one_moment():
    signs = with_elementary([Sign("destroy", meaning=(causal({"near", "wall"}, "open", "wall"),))])
    model = model_of(signs)
    done = flow_of(model, ["near", "wall"], ["near", "open"], length=2)
    undone = flow_of(model, ["near", "wall"], ["near", "wall", "open"], length=2)
    assert int(recognise(model.matrices, done, component=Component.MEANING).step[0]) == 1
    assert not recognise(model.matrices, undone, component=Component.MEANING).recognised[0]


@pytest.mark.parametrize(
    "rule, steps, step",
    [
        (causal("a", deletes="b"), ("b", "a"), -1),
        (causal("a", deletes="b"), ("a", "a"), 1),
        (causal("a", deletes="b"), ("a", "b"), -1),
        (causal("a", "c", "b"), ("a", "c"), 1),
        (causal("a", "c", "b"), ("a", "bc", "a"), 2),
        (causal(deletes="b"), ("b", "a"), 1),
    ],
)
def test_deletes_match_after_the_conditions_and_with_the_adds_or_later(rule, steps, step):
    signs = with_elementary([Sign("act", meaning=(rule,)), *map(Sign, "abc")])
    model = model_of(signs)
    found = recognise(model.matrices, flow_of(model, *steps, length=2), component=Component.MEANING)
    assert int(found.step[0]) == step


def test_no_feature_is_expected_if_only_an_absence_is_required():
    model = model_of(with_elementary([Sign("act", image=(causal("a", deletes="b"),))]))
    found = recognise(model.matrices, flow_of(model, *["ab"] * 5))
    assert not found.recognised[0] and int(found.passed[0]) == 1 and not found.expected.any()


def test_nothing_is_recognised_in_an_empty_flow():
    model = model_of(face_signs())
    found = recognise(model.matrices, np.zeros((0, 8), bool))
    assert not found.recognised.any() and not found.passed.any()


def test_flows_in_a_batch_of_any_shape_and_models_in_a_batch_give_the_same_bits():
    model = model_of(face_signs())
    flows = np.random.default_rng(0).random((2, 3, 5, 8)) < 0.4
    batch = recognise(model.matrices, flows)
    for i in range(2):
        for j in range(3):
            single = recognise(model.matrices, flows[i, j])
            chex.assert_trees_all_equal(
                jax.tree.map(lambda leaf, i=i, j=j: leaf[i, j], batch), single
            )
    models = jax.tree.map(lambda leaf: np.stack([leaf] * 2), model.matrices)
    chex.assert_trees_all_equal(jax.vmap(recognise)(models, flows), batch)


def test_new_flows_and_new_models_of_one_shape_compile_once():
    before = recognise._cache_size()
    for names in (("a", "b", "c"), ("c", "b", "a")):
        model = model_of(with_elementary([Sign("sign", image=(sequence(*names),))]))
        recognise(model.matrices, flow_of(model, ["a"], ["b"], ["c"]))
    assert recognise._cache_size() <= before + 1
