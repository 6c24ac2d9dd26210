"""Our own domains other than blocks: MAP decides every task that A* decides in the same way, and no
plan is much longer.
"""

import pytest

from experiments.data.pddl_domains import OTHER_DOMAINS
from sign_model import PlanStatus, load, plan, validate


@pytest.mark.parametrize("name", OTHER_DOMAINS)
def test_map_decides_tasks_like_astar(name):
    task = load(*OTHER_DOMAINS[name])
    result, best = plan(task), plan(task, planner="astar", heuristic="hmax", max_expansions=5000)
    assert not result.is_solved or validate(task, result.actions) == []
    if best.status != PlanStatus.BUDGET_SPENT:
        assert result.status == best.status
        assert len(result.actions) <= 1.2 * len(best.actions)
    else:
        assert result.is_solved
