"""Answers of coalitions: against enumeration, replayed, and what the judge says of spoilt ones."""

import numpy as np
import pytest

from srt_jax import Status, solve
from srt_jax.coalition import Help, check_coalition, explain_coalition, help_edges
from srt_jax.coalition.task import on_one_map
from srt_jax.reference import coalition as twin
from tests.helpers.coalitions import solved


def test_cost_bound_and_set_are_those_of_the_cheapest_of_all_sets(mixed):
    for task, answer in zip(*mixed):
        true = twin.coalition_removal(
            task.labels, task.able, task.removal_cost, task.start, task.goal
        )
        assert answer.removal_cost == answer.removal_bound == true.cost
        assert Status(int(answer.status)).is_solved == np.isfinite(true.cost)
        if np.isfinite(true.cost):
            assert tuple(sorted(answer.destroyed[answer.destroyed >= 0].tolist())) in true.sets


def test_every_answer_passes_its_replay(mixed, chain):
    for task, answer in [*zip(*mixed), *zip(*chain)]:
        assert check_coalition(task, answer) == []


def test_with_one_agent_everything_equals_solve(mixed):
    lone = [(task, answer) for task, answer in zip(*mixed) if len(task.start) == 1]
    assert len(lone) == 5
    for task, answer in lone:
        single = solve(on_one_map(task))
        for name in ("status", "removal_cost", "removal_bound"):
            assert getattr(answer, name) == getattr(single, name)
        if Status(int(answer.status)).is_solved:
            assert answer.cost[0] == single.cost


def test_the_neighbours_in_a_batch_change_no_bit(mixed):
    turned = solved(mixed.tasks[::-1])
    for answer, again in zip(mixed.answers, turned.answers[::-1]):
        for name, array in answer.items():
            np.testing.assert_array_equal(array, getattr(again, name), err_msg=name)


def test_agents_help_each_other_in_turn(chain):
    task, answer = chain.tasks[0], chain.answers[0]
    assert answer.destroyed[:2].tolist() == [0, 1] and answer.destroyed_by[:2].tolist() == [0, 1]
    assert answer.removal_cost == 5
    assert help_edges(answer) == [(0, 1, 0), (1, 0, 1)]
    assert answer.after[:2, :2].tolist() == [[False, False], [True, False]]
    # nobody passes a wall before it is gone, and nobody waits in vain
    assert answer.needed[0, :2].tolist() == [2, 6] and answer.needed[1, 1] == -1
    assert answer.finish.tolist() == [9, 6]
    text = explain_coalition(task, answer)
    step = "Step 2: agent 1 destroys obstacle 1 from (1, 6), after obstacle 0 is gone;"
    assert f"{step} it does so for agent 0." in text
    assert "0 to 1: please destroy obstacle 1." in text


def test_what_nobody_can_destroy_is_the_proof(chain):
    task, answer = chain.tasks[1], chain.answers[1]
    assert Status(int(answer.status)) is Status.UNSOLVABLE
    assert np.flatnonzero(answer.firm).tolist() == [2]
    assert [Help(int(h)) for h in answer.help] == [Help.NEVER] * 2
    assert "obstacle 2 cannot be destroyed" in explain_coalition(task, answer)


@pytest.mark.parametrize(
    ("field", "place", "value", "says"),
    [
        ("status", (), 2, "the truth is SOLVED"),
        ("help", (0,), 0, "help is"),
        ("removal_cost", (), 4, "the sum is 5"),
        ("removal_bound", (), 6, "more than the removal cost"),
        ("destroyed_by", (0,), 1, "is not able to"),
        ("destroyed_at", (0,), 0, "without being beside it"),
        ("cells", (0, 3, 0), 4, "illegal move"),
        ("needed", (0, 1), 3, "needed is"),
        ("finish", (0,), 3, "has done its part at"),
        ("cost", (0,), 3, "has length"),
        ("firm", (0,), True, "firm names"),
        ("after", (0, 1), True, "against the order"),
    ],
)
def test_the_judge_finds_what_is_spoilt(chain, field, place, value, says):
    task, answer = chain.tasks[0], chain.answers[0]
    array = np.array(getattr(answer, field))
    array[place] = value
    problems = check_coalition(task, answer.replace(**{field: array}))
    assert any(says in problem for problem in problems), problems


def test_the_judge_finds_an_order_that_leaves_out_what_is_needed(chain):
    order = chain.answers[0].replace(after=np.zeros((8, 8), bool))
    assert any("does not say so" in problem for problem in check_coalition(chain.tasks[0], order))
