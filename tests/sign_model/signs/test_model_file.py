"""World models are saved in files and loaded from them."""

import json

import chex
import pytest
from hypothesis import HealthCheck, given, settings

from sign_model.signs.model_file import load_model, save_model
from sign_model.signs.world_model import from_signs
from tests.helpers.sign_worlds import face_signs, sign_worlds


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(sign_worlds())
def test_a_model_is_saved_and_loaded_without_loss(tmp_path, signs):
    model, path = from_signs(signs), tmp_path / "model.json"
    save_model(model, path)
    again = load_model(path)
    assert again.signs() == signs and again.names == model.names
    chex.assert_trees_all_equal(again.matrices, model.matrices)
    assert [other.name for other in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda sign: sign.pop("name"), r"model.json: sign 1: must have a name"),
        (lambda sign: sign.update(colour="red"), r"sign 1: must have a name, and nothing but"),
        (
            lambda sign: sign.update(image=3),
            r"sign 1 \(face\): each component must be a list of matrices",
        ),
        (
            lambda sign: sign.update(image=[3]),
            r"sign 1 \(face\): each component must be a list of matrices",
        ),
        (
            lambda sign: sign.update(image=[[["condition"]]]),
            r"sign 1 \(face\): a column must be a kind",
        ),
        (
            lambda sign: sign.update(image=[[["wish", ["nose"]]]]),
            r"a column must be a kind \(condition, adds, deletes\)",
        ),
        (
            lambda sign: sign.update(image=[[["condition", []]]]),
            r"sign 1 \(face\): a column of kind CONDITION names no feature",
        ),
        (
            lambda sign: sign.update(image=[[["adds", ["nose"]], ["adds", ["nose"]]]]),
            r"at most one ADDS",
        ),
        (
            lambda sign: sign.update(image=[[["condition", ["ear"]]]]),
            r"model.json: sign 'face' has the feature 'ear'",
        ),
        (lambda sign: sign.update(name="nose"), r"model.json: two signs are called 'nose'"),
    ],
)
def test_an_error_in_a_model_file_names_the_file_and_the_sign(tmp_path, change, message):
    path = tmp_path / "model.json"
    save_model(from_signs(face_signs()), path)
    plain = json.loads(path.read_text())
    change(plain["signs"][0])
    path.write_text(json.dumps(plain))
    with pytest.raises(ValueError, match=message):
        load_model(path)


@pytest.mark.parametrize(
    "text, message",
    [("{", "not JSON"), ("[]", "its format must be"), ('{"format": "x"}', "its format must be")],
)
def test_a_file_that_is_not_a_model_is_refused(tmp_path, text, message):
    (tmp_path / "model.json").write_text(text)
    with pytest.raises(ValueError, match=message):
        load_model(tmp_path / "model.json")
