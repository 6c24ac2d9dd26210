"""The relaxation of many states at once, against a plain fixpoint over dictionaries."""

import numpy as np
import pytest

from sign_model.forward_search.relaxed_costs import RelaxedCosts
from tests.helpers.strips import random_task


def plain_costs(task, state, costs, combine):
    """{feature: cost} by sweeps over sets, until nothing becomes cheaper."""
    cost = {int(f): 0 for f in np.flatnonzero(state)}
    rows = [
        ([int(f) for f in np.flatnonzero(needs)], [int(f) for f in np.flatnonzero(gives)], int(c))
        for needs, gives, c in zip(task.conditions, task.adds, costs)
    ]
    is_stable = False
    while not is_stable:
        is_stable = True
        for needs, gives, c in rows:
            if all(f in cost for f in needs):
                value = combine([cost[f] for f in needs] or [0]) + c
                for f in gives:
                    if value < cost.get(f, 1 << 40):
                        cost[f], is_stable = value, False
    return cost


@pytest.mark.parametrize("is_sum", [True, False])
@pytest.mark.parametrize("dearest", [1, 5, 10**6])
def test_costs_are_those_of_a_plain_fixpoint(is_sum, dearest):
    rng = np.random.default_rng(dearest)
    for seed in range(60):
        task = random_task(seed)
        costs = rng.integers(0, dearest + 1, task.num_actions)
        states = rng.random((7, task.num_features)) < 0.3
        relaxed = RelaxedCosts(task.conditions, task.adds, costs, is_sum=is_sum)
        found = relaxed.from_states(states)
        assert relaxed.is_exact(found)
        for state, column in zip(states, found.T):
            want = plain_costs(task, state, costs, sum if is_sum else max)
            got = {f: int(c) for f, c in enumerate(column.tolist()) if c < relaxed.far}
            assert got == want, seed


def test_a_relaxed_plan_reaches_the_goal_if_nothing_is_deleted():
    count = 0
    for seed in range(200):
        task = random_task(seed)
        ones = np.ones(task.num_actions, np.int64)
        relaxed = RelaxedCosts(task.conditions, task.adds, ones)
        states = np.random.default_rng(seed).random((5, task.num_features)) < 0.3
        cost, goal = relaxed.from_states(states), np.flatnonzero(task.goal)
        can = (cost[goal] < relaxed.far).all(axis=0)
        plans = relaxed.relaxed_plans(states[can], cost[:, can], goal)
        for number, state in enumerate(states[can]):
            mine = plans.owner == number
            order = np.argsort(plans.ready[mine], kind="stable")
            held = state.copy()
            for action in plans.action[mine][order]:
                assert held[task.conditions[action]].all(), seed
                held |= task.adds[action]
            assert held[task.goal].all()
            count += mine.any()
    assert count > 100


def test_costs_that_reach_the_limit_of_16_bits_are_not_called_exact():
    size = 20  # each feature needs the two before it: costs grow like the Fibonacci numbers
    conditions = np.zeros((size, size), bool)
    for i in range(2, size):
        conditions[i, i - 2 : i] = True
    adds = np.eye(size, dtype=bool)
    relaxed = RelaxedCosts(conditions, adds, np.ones(size, np.int64))
    cost = relaxed.from_states(np.zeros((1, size), bool))
    assert not relaxed.is_exact(cost) or (cost < relaxed.far).all()
    long = RelaxedCosts(
        np.eye(9, 9, -1, bool)[:, :].repeat(1, 0), np.eye(9, dtype=bool), np.full(9, 16)
    )
    assert long.is_exact(long.from_states(np.zeros((1, 9), bool)))
