"""What a coalition can reach, against the slow twin."""

import jax
import numpy as np
import pytest

from experiments.campaigns.inputs.coalition_tasks import random_coalition
from srt_jax.coalition import Help, coalition_reach, make_coalition, stack_coalitions
from srt_jax.reference import coalition as twin


def helped():
    """Wall 0 only agent 1 can destroy, wall 1 nobody; agent 4 stands on wall 0."""
    labels = np.full((3, 9), -1, np.int32)
    labels[:, 3], labels[:, 6] = 0, 1
    return make_coalition(
        labels,
        [(0, 0), (0, 4), (0, 0), (1, 0), (0, 3)],
        [(0, 5), (0, 0), (0, 8), None, (0, 0)],
        able=[(), (0,), (), (), ()],
    )


def by_a_corner():
    """Obstacle 0 keeps agent 0 in; agent 1 touches it by a corner alone, past wall 1."""
    labels = np.array([[-1, 0, 1, -1], [1, 1, -1, 1], [1, 1, 1, 1]], np.int32)
    return make_coalition(labels, [(0, 0), (1, 2)], [(0, 1), None], able=[(), (0,)])


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(3)
    return [*(random_coalition(rng) for _ in range(60)), helped(), by_a_corner()]


@pytest.fixture(scope="module")
def found(drawn):
    return jax.tree.map(np.asarray, coalition_reach(stack_coalitions(drawn)))


def test_cells_abilities_and_what_stands_firm_are_those_of_the_slow_twin(drawn, found):
    for index, task in enumerate(drawn):
        agents, obstacles = task.able.shape
        inside = np.ix_([index], range(agents), *map(range, task.size.tolist()))
        true = twin.coalition_reach(task.labels, task.able, task.start)
        assert (found.reached[inside][0] == true.reached).all()
        assert (found.destroys[index, :agents, :obstacles] == true.destroys).all()
        assert (found.firm[index, :obstacles] == true.firm).all()
        for a in range(agents):
            alone = twin.coalition_reach(task.labels, task.able[a : a + 1], task.start[a : a + 1])
            assert (found.alone[inside][0, a] == alone.reached[0]).all()


def test_a_task_alone_and_under_vmap_has_the_same_bits_as_in_the_batch(drawn, found):
    batch = stack_coalitions(drawn)
    mapped = jax.jit(jax.vmap(coalition_reach))(batch)
    jax.tree.map(np.testing.assert_array_equal, found, mapped)
    alone = coalition_reach(jax.tree.map(lambda array: array[2], batch))
    jax.tree.map(np.testing.assert_array_equal, jax.tree.map(lambda a: a[2], found), alone)


def test_help_says_who_needs_the_others(found):
    assert [Help(int(h)) for h in found.help[-2]] == [
        Help.WITH_HELP,
        Help.ALONE,
        Help.NEVER,
        Help.HELPER,
        Help.START_BLOCKED,
    ]
    assert np.flatnonzero(found.firm[-2, :2]).tolist() == [1]


def test_an_obstacle_touched_by_a_corner_alone_can_be_destroyed(found):
    assert Help(int(found.help[-1, 0])) is Help.WITH_HELP
