"""A*, weighted A* and greedy best-first: one search with three orderings."""

import numpy as np
import pytest

from sign_model.blocks import random_blocks_tasks
from sign_model.forward_search.relaxation import make_heuristic
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.result import PlanStatus
from tests.helpers.strips import random_task, reachable_states, shortest_length


@pytest.mark.parametrize("heuristic", ["blind", "hmax"])
def test_astar_plans_are_shortest(heuristic):
    for seed in range(300):
        task = random_task(seed)
        length, result = shortest_length(task), plan(task, planner="astar", heuristic=heuristic)
        assert (len(result.actions) if result.is_solved else None) == length, seed
        assert result.is_solved or result.status == PlanStatus.UNSOLVABLE, seed


@pytest.mark.parametrize(
    "planner,heuristic",
    [("wastar", "hadd"), ("wastar", "ff"), ("gbfs", "ff"), ("gbfs", "hadd"), ("gbfs", "goals")],
)
def test_the_other_orderings_solve_what_can_be_solved(planner, heuristic):
    for seed in range(200):
        task = random_task(seed)
        length, result = shortest_length(task), plan(task, planner=planner, heuristic=heuristic)
        assert result.is_solved == (length is not None), seed
        assert not result.is_solved or validate(task, result.actions) == [], seed


def test_weighted_astar_with_an_admissible_heuristic_keeps_its_bound():
    for task in random_blocks_tasks(4, 10, seed=6):
        optimal = len(plan(task, planner="astar", heuristic="hmax").actions)
        assert (
            len(plan(task, planner="wastar", heuristic="hmax", weight=2.0).actions) <= 2 * optimal
        )


def test_astar_counts_the_costs_of_actions():
    task = random_task(0)
    for seed in range(100):
        task = random_task(seed)
        rng = np.random.default_rng(seed)
        dear = task.__class__(
            **{**task.__dict__, "costs": rng.integers(1, 5, task.num_actions).astype(np.int32)}
        )
        costs = []
        for heuristic in ("blind", "hmax"):
            result = plan(dear, planner="astar", heuristic=heuristic)
            costs.append(
                sum(int(dear.costs[dear.action_names.index(name)]) for name in result.actions)
            )
        assert costs[0] == costs[1], seed


def test_hmax_never_overestimates_and_infinity_means_unreachable():
    for seed in range(60):
        task = random_task(seed)
        states = reachable_states(task)
        estimates = {name: make_heuristic(name, task)(states) for name in ("hmax", "hadd", "ff")}
        for i, state in enumerate(states):
            length = shortest_length(task.__class__(**{**task.__dict__, "start": state}))
            assert length is None or estimates["hmax"][i] <= length
            if np.isinf(estimates["ff"][i]):
                assert length is None
        assert (np.isinf(estimates["hadd"]) == np.isinf(estimates["ff"])).all()
        assert (estimates["hmax"] <= estimates["hadd"]).all()


def test_a_spent_budget_is_a_status():
    task = random_blocks_tasks(7, 1, seed=3)[0]
    assert (
        plan(task, planner="astar", heuristic="hmax", max_expansions=3).status
        == PlanStatus.BUDGET_SPENT
    )
