"""World models in words and as drawings."""

from sign_model.description import describe, describe_matrix, describe_steps, to_dot
from sign_model.map_algorithm.plan_specification import REALISE, SPECIFY, Step
from sign_model.signs.matrix import Component
from sign_model.signs.sign import Sign, causal, sequence, with_elementary
from sign_model.signs.world_model import from_signs
from tests.helpers.sign_worlds import face_signs


def test_a_sign_is_described_with_its_matrices_and_links():
    text = describe(from_signs(face_signs()))
    assert text.startswith(
        "World model of 6 signs with 3 prediction matrices; links: 5 in W_p, 0 in W_m, 0 in"
        " W_a.\n\nface\n  image\n"
    )
    assert "    1. nose -> mouth -> right eye -> left eye\n" in text
    assert "    3. left eye -> nose -> mouth -> {padded, right eye}\n" in text
    assert "    W_p: left eye, mouth, nose, padded, right eye\n" in text
    assert text.endswith("\n\nright eye\n")


def test_a_procedural_sign_is_marked_and_its_effects_follow_an_arrow():
    model = from_signs(
        with_elementary([Sign("destroy", meaning=(causal({"near", "wall"}, "open", "wall"),))])
    )
    text = describe(model, names=["destroy"])
    assert (
        "  personal meaning [strict order]\n    1. {near, wall} => +open -wall\n    W_a: near,"
        " open, wall\n" in text
    )
    assert "\nnear\n" not in text


def test_matrices_without_some_columns_are_described():
    assert describe_matrix(sequence()) == "(nothing)"
    assert describe_matrix(causal(adds="a")) == "(nothing) => +a"
    assert describe_matrix(causal("a", deletes={"b", "c"})) == "a => -{b, c}"


def test_a_model_without_signs_is_described_by_its_heading():
    assert (
        describe(from_signs(()))
        == "World model of 0 signs with 0 prediction matrices; links: 0 in W_p, 0 in W_m, 0 in"
        " W_a.\n"
    )


def test_the_drawing_has_a_node_for_each_sign_and_an_edge_for_each_link():
    model = from_signs(
        with_elementary([Sign('a "b"', image=(sequence("c", "c"),), meaning=(sequence("c"),))])
    )
    graph = to_dot(model)
    assert graph.splitlines() == [
        'digraph "world_model" {',
        "  rankdir=LR;",
        r'  "a \"b\"";',
        '  "c";',
        r'  "a \"b\"" -> "c" [color=black, label="W_p"];',
        r'  "a \"b\"" -> "c" [color=red, label="W_a"];',
        "}",
    ]
    assert "W_a" not in to_dot(model, components=[Component.IMAGE])


def test_a_specified_plan_is_described_as_a_tree():
    leaves = (Step("(approach one)", REALISE), Step("(pass one)", REALISE))
    steps = (
        Step("(change-room hall lab)", SPECIFY, leaves),
        Step("(rest)", REALISE),
        Step("(fly)", SPECIFY),
    )
    assert (
        describe_steps(steps)
        == "(change-room hall lab)\n  (approach one)\n  (pass one)\n(rest)\n(fly) (no sub-plan"
        " found)\n"
    )
    assert describe_steps(()) == ""
