"""Tasks of coalitions on the host."""

import jax
import numpy as np
import pytest

from srt_jax.coalition import make_coalition, stack_coalitions, unstack_coalitions
from srt_jax.coalition.task import on_one_map

FREE = np.array([[1, 1, 0, 1, 1]] * 3, bool)


def test_goals_are_shared_own_or_none():
    shared = make_coalition(FREE, [(0, 0), (1, 0)], (2, 4))
    own = make_coalition(FREE, [(0, 0), (1, 0)], [(2, 4), None])
    assert shared.goal.tolist() == [[2, 4], [2, 4]]
    assert own.goal.tolist() == [[2, 4], [-1, -1]]


def test_abilities_are_flags_ids_or_an_array():
    labels = np.array([[0, -1, 1]] * 2, np.int32)
    starts = [(0, 1)] * 3
    mixed = make_coalition(labels, starts, (1, 1), able=[True, (1,), False])
    assert mixed.able.tolist() == [[True, True], [False, True], [False, False]]
    same = make_coalition(labels, starts, (1, 1), able=mixed.able)
    assert (same.able == mixed.able).all()


def test_stacking_pads_agents_too_and_unstacking_takes_the_padding_off():
    pair = make_coalition(FREE, [(0, 0), (1, 0)], [(2, 4), None], able=[(0,), ()])
    lone = make_coalition(np.ones((2, 9), bool), [(1, 1)], (0, 8))
    batch = stack_coalitions([pair, lone])
    assert batch.able.shape == (2, 2, 1) and batch.start[1].tolist() == [[1, 1], [-1, -1]]
    for one, again in zip([pair, lone], unstack_coalitions(batch)):
        jax.tree.map(np.testing.assert_array_equal, one, again)


def test_one_map_of_a_coalition_is_a_task_of_one_agent():
    pair = make_coalition(FREE, [(0, 0), (1, 0)], [(2, 4), None], able=[(), (0,)])
    assert on_one_map(pair, 1).goal.tolist() == [1, 0]
    assert on_one_map(pair).destroyable.tolist() == [True]


@pytest.mark.parametrize(
    ("start", "goal", "able", "message"),
    [
        ([], (0, 0), True, "a cell .* for each agent"),
        ((0, 0), (0, 0), True, "a cell .* for each agent"),
        ([(0, 0), (9, 0)], (0, 0), True, "agent 1: start .* outside"),
        ([(0, 0), (1, 0)], [(0, 0)], True, "goal has 1 entries, but there are 2 agents"),
        ([(0, 0), (1, 0)], (0, 0), [True], "able has 1 entries, but there are 2 agents"),
        ([(0, 0), (1, 0)], (0, 0), [(), (7,)], "agent 1: destroyable names obstacle 7"),
    ],
)
def test_what_cannot_be_a_task_is_refused_in_one_sentence(start, goal, able, message):
    with pytest.raises(ValueError, match=message):
        make_coalition(FREE, start, goal, able=able)
