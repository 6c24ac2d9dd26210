"""Answers side by side: by name, where they differ, and in sum."""

import pytest

from srt_jax.answers.compare import Answer, answer_of_record, pairs, sums


def answer(name, status="SOLVED", length=5.0, removal=1.0, destroyed=(0,)):
    return Answer(name, status, length, removal, destroyed)


def test_equal_answers_do_not_differ():
    left = [answer("a"), answer("b", "UNSOLVABLE", None, None, ())]
    right = [answer("b", "UNSOLVABLE", None, None, ()), answer("a", length=5.0000001)]
    found = pairs(left, right)
    assert [pair.name for pair in found] == ["a", "b"]
    assert not any(pair.differs for pair in found)
    total = sums(found)
    assert total.differing == 0 and total.shared == 1 and total.tasks == (2, 2)
    assert total.shorter == total.cheaper == (0, 0)


def test_what_differs_is_named_and_added_up():
    left = [answer("a"), answer("b", length=9.0), answer("only left"), answer("c")]
    right = [
        answer("a", removal=2.0, destroyed=(1, 2)),
        answer("b", length=8.0),
        answer("c", "BUDGET_SPENT", None, None, ()),
    ]
    found = {pair.name: pair for pair in pairs(left, right)}
    assert found["a"].differs == ("removal_cost", "destroyed")
    assert found["b"].differs == ("length",)
    assert found["c"].differs == ("status", "length", "removal_cost", "destroyed")
    assert found["only left"].differs == ("task",) and found["only left"].right is None
    total = sums(list(found.values()))
    assert (total.tasks, total.solved, total.shared) == ((4, 3), (4, 2), 2)
    assert total.lengths == (14, 13) and total.removal_costs == (2, 3)
    assert total.shorter == (0, 1) and total.cheaper == (1, 0) and total.differing == 4


def test_tasks_of_one_name_meet_in_order():
    found = pairs([answer("a"), answer("a", length=7.0)], [answer("a"), answer("a")])
    assert [pair.differs for pair in found] == [(), ("length",)]


def test_a_record_without_its_fields_is_refused():
    with pytest.raises(ValueError, match="an answer has no 'cost'"):
        answer_of_record({"name": "a", "status": "SOLVED"})
