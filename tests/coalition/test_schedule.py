"""Schedules for the set that a coalition destroys."""

import numpy as np
import pytest

from srt_jax import Status
from srt_jax.coalition import check_coalition, schedule_coalition


@pytest.mark.parametrize("objective", ["length", "makespan"])
def test_schedules_pass_the_judge_and_are_no_worse_than_the_answer(mixed, objective):
    seen = 0
    for task, answer in zip(*mixed):
        # maps of one shape share a program
        if not Status(int(answer.status)).is_solved or max(task.size) > 8:
            continue
        schedule = schedule_coalition(task, answer, objective=objective)
        given = {"length": answer.cost.sum(), "makespan": answer.finish.max()}[objective]
        assert check_coalition(task, schedule.solution) == []
        assert schedule.bound <= schedule.value <= given * (1 + 1e-5) + 1e-5
        assert set(schedule.solution.destroyed.tolist()) == set(answer.destroyed.tolist())
        seen += 1
    assert seen >= 2


def test_the_least_length_of_a_chain_is_known(chain):
    schedule = schedule_coalition(chain.tasks[0], chain.answers[0], objective="length")
    assert schedule.is_proven and schedule.value == pytest.approx(9 + 6)


def test_a_spent_budget_leaves_a_proven_bound(chain):
    task, answer = chain.tasks[0], chain.answers[0]
    schedule = schedule_coalition(task, answer, objective="length", max_steps=1)
    assert 9 <= schedule.bound <= 15 <= schedule.value + 1e-5
    assert check_coalition(task, schedule.solution) == []


def test_what_has_no_schedule_is_refused(chain):
    with pytest.raises(ValueError, match="UNSOLVABLE"):
        schedule_coalition(chain.tasks[1], chain.answers[1])
    with pytest.raises(ValueError, match="makespan, length"):
        schedule_coalition(chain.tasks[0], chain.answers[0], objective="sum")
    batch = chain.answers[0].replace(status=np.array([1], np.int32))
    with pytest.raises(ValueError, match="not a batch"):
        schedule_coalition(chain.tasks[0], batch)
