"""The least removal and its bound: equal to two exact solvers, brute force and integer programming;
and the prices beneath.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.campaigns.judges.integer_programming import exact_removal
from srt_jax import Status, check, solve, stack
from srt_jax.obstacles import Labels, survey
from srt_jax.reference.brute_force import brute_force_removal
from srt_jax.removal import sums
from srt_jax.removal.prices import Terms, goal_prices, prices_of
from tests.helpers.labelled import random_tasks, walled_tasks

WHOLE = [
    *random_tasks(1, 110, overlap=False, unit_costs=True, max_side=20, max_obstacles=8),
    *random_tasks(2, 110, overlap=False, max_side=20, max_obstacles=8),
]
PARTS = random_tasks(3, 160, overlap=True, max_side=20, max_obstacles=8)
WALLED = walled_tasks(4, 20, side=20, num_obstacles=8, num_walls=4)
TASKS = [*WHOLE, *PARTS, *WALLED]
MANY = walled_tasks(5, 8, side=20, num_obstacles=20, num_walls=4)
"""More obstacles than brute force takes."""


@functools.cache
def brute_force(index):
    task = TASKS[index]
    ends = (tuple(end.tolist()) for end in (task.start, task.goal))
    return brute_force_removal(task.labels, task.destroyable, task.removal_cost, *ends)


def solved(**options):
    """Solves all in one batch of one shape: compiling takes longer than solving."""
    batch = stack([*TASKS, *MANY])
    answers = jax.tree.map(np.asarray, solve(batch, max_destroyed=16, **options))
    assert not check(batch, answers)
    return [jax.tree.map(lambda array, i=i: array[i], answers) for i in range(len(batch.start))]


@pytest.fixture(scope="module")
def answers():
    return solved()


@pytest.fixture(scope="module")
def answers_of_few_branches():
    return solved(max_branches=9)


def test_cost_and_bound_are_the_optimum(answers):
    num_blocked = 0
    for index, answer in enumerate(answers[: len(TASKS)]):
        best = brute_force(index)
        assert Status(int(answer.status)).is_solved == best.is_solvable
        assert answer.removal_bound == np.float32(best.cost), index
        # eight obstacles: the branches allowed look into all
        assert answer.removal_cost == np.float32(best.cost), index
        num_blocked += 0 < best.cost < np.inf
    assert num_blocked > 100


def test_of_several_least_sets_nearly_always_the_one_with_the_shortest_route(answers):
    longer = [
        answer.cost > best.length * (1 + 1e-6)
        for answer, best in zip(answers, map(brute_force, range(len(TASKS))))
    ]
    shorter = [
        answer.cost < best.length * (1 - 1e-6)
        for answer, best in zip(answers, map(brute_force, range(len(TASKS))))
    ]
    assert not any(shorter) and sum(longer) < 0.05 * len(TASKS)


def test_with_few_branches_the_optimum_lies_between_bound_and_cost(answers_of_few_branches):
    num_open = 0
    for index, answer in enumerate(answers_of_few_branches[: len(TASKS)]):
        best = brute_force(index)
        assert answer.removal_bound <= best.cost <= answer.removal_cost
        assert Status(int(answer.status)).is_solved == best.is_solvable
        num_open += answer.removal_bound < answer.removal_cost
    assert num_open


def test_one_branch_more_than_is_destroyed_is_enough_where_obstacles_are_whole(
    answers_of_few_branches,
):
    for index, answer in enumerate(answers_of_few_branches[: len(WHOLE)]):
        assert answer.removal_bound == answer.removal_cost == np.float32(brute_force(index).cost)


def test_integer_programming_finds_the_same_with_more_obstacles_than_brute_force_takes(
    answers, answers_of_few_branches
):
    for index, task in enumerate(MANY, len(TASKS)):
        optimum, few = exact_removal(task), answers_of_few_branches[index]
        assert answers[index].removal_bound == optimum == answers[index].removal_cost
        assert few.removal_bound <= optimum <= few.removal_cost


def test_both_exact_solvers_agree():
    for index in (
        *range(60),
        *range(len(WHOLE), len(WHOLE) + 60),
        *range(len(TASKS) - 10, len(TASKS)),
    ):
        assert exact_removal(TASKS[index]) == brute_force(index).cost


def _is_askable(index):
    """Whether the start is free, as the prices want it."""
    return (TASKS[index].labels[:, *TASKS[index].start] < 0).all()


def test_the_price_of_the_goal_is_the_optimum_where_obstacles_are_whole_and_else_no_more():
    among = np.array([_is_askable(index) for index in range(len(TASKS))])
    _, reached, price = (np.asarray(part) for part in jax.jit(goal_prices)(stack(TASKS), among))
    for index in range(len(TASKS)):
        cost = brute_force(index).cost
        assert price[index] <= cost
        if index < len(WHOLE):
            assert price[index] == np.float32(cost)
        assert reached[index].any() == among[index]


def test_tight_are_the_members_of_least_sets_and_what_is_gone_costs_nothing_more():
    batch = jax.tree.map(jnp.asarray, stack(WHOLE))
    cost = jnp.where(batch.destroyable, batch.removal_cost, jnp.inf)

    @jax.jit
    def all_prices(labels, cost, start, goal, gone):
        def one(which, cost, start, goal, gone):
            may_go = jnp.isfinite(cost)
            costs = sums.costs_of(cost, may_go)
            paid = sums.zero()  # what is gone is given
            own, terms = Labels(labels, which), Terms(start, goal, costs, may_go)
            found = prices_of(own, survey(own, len(cost)), terms, gone, paid, sums.never())
            return found._replace(goal=sums.to_float32(found.goal[:, None], costs)[0])

        return jax.lax.map(
            lambda entry: one(*entry),
            (jnp.arange(len(labels), dtype=jnp.int32), cost, start, goal, gone),
        )

    nothing = jnp.zeros_like(batch.destroyable)
    found = all_prices(batch.labels, cost, batch.start, batch.goal, nothing)
    after = all_prices(batch.labels, cost, batch.start, batch.goal, found.affordable)
    for index in filter(_is_askable, range(len(WHOLE))):
        best = brute_force(index)
        assert found.goal[index] == np.float32(best.cost)
        if 0 < best.cost < np.inf:
            assert set(np.flatnonzero(found.tight[index]).tolist()) == set().union(*best.sets)
            assert (
                not (found.tight[index] & ~found.affordable[index]).any() and after.goal[index] == 0
            )
        else:
            assert not found.tight[index].any()
