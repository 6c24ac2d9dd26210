"""The metacognitive rule as a record: saved, loaded, refused."""

import math

import pytest

from sign_model import PlanningRule, load_rule, save_rule
from sign_model.strategies.rule import UNLEARNED


def test_a_rule_comes_back_from_its_file_in_the_same_order(tmp_path):
    rule = PlanningRule("mine", {"forwards": 7, "backwards": 3}, growth=2, improvement=0)
    for one in (rule, UNLEARNED):
        save_rule(tmp_path / "rule.json", one)
        loaded = load_rule(tmp_path / "rule.json")
        assert loaded == one and list(loaded.turns) == list(one.turns)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"planning_rule": {"name": "x"}}', "null"])
def test_a_file_without_a_rule_is_refused_by_name(tmp_path, text):
    (tmp_path / "rule.json").write_text(text)
    with pytest.raises(ValueError, match=r"rule\.json: not a planning rule"):
        load_rule(tmp_path / "rule.json")


@pytest.mark.parametrize(
    "turns,options,message",
    [
        ({}, {}, "at least one, got none"),
        ({"sideways": 1}, {}, "got sideways"),
        ({"forwards": 0}, {}, "turns, beam and at_once from 1 up"),
        ({"forwards": 1}, {"growth": 1}, "growth from 2 up"),
        ({"forwards": 1}, {"beam": 0}, "turns, beam and at_once from 1 up"),
        ({"forwards": 1}, {"at_once": 0}, "turns, beam and at_once from 1 up"),
        ({"forwards": 1}, {"trust": (1.0, math.nan)}, "two numbers as its trust"),
        ({"forwards": 1}, {"improvement": -1}, "improvement and effort from 0 up"),
    ],
)
def test_a_rule_that_makes_no_sense_is_refused(turns, options, message):
    with pytest.raises(ValueError, match=message):
        PlanningRule("bad", turns, **options)
