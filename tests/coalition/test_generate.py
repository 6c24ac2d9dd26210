"""Generated tasks and their optimum."""

import numpy as np
import pytest

from srt_jax.coalition import helpers
from srt_jax.reference import coalition as twin


def test_the_optimum_over_rooms_is_that_of_all_sets_of_obstacles():
    for _, task, optimum in helpers(count=12, size=16, seed=4, rooms=2, doubled=0.5):
        true = twin.coalition_removal(
            task.labels, task.able, task.removal_cost, task.start, task.goal
        )
        assert optimum == true.cost


def test_an_instance_depends_on_its_number_alone():
    many = helpers(count=4, size=16, seed=2, rooms=2)
    ((name, task, optimum),) = helpers(count=1, size=16, seed=2, rooms=2, first=3)
    assert name == many[3][0] and optimum == many[3][2]
    assert (task.labels == many[3][1].labels).all() and (task.able == many[3][1].able).all()


def test_with_many_obstacles_the_optimum_is_not_known():
    ((_, task, optimum),) = helpers(count=1, size=16, seed=0, rooms=4)
    assert task.able.shape[1] == 25 and np.isnan(optimum)


def test_numbers_out_of_range_are_refused():
    with pytest.raises(ValueError, match="size must be at least 20"):
        helpers(count=1, size=16, seed=0, rooms=5)
    with pytest.raises(ValueError, match="agents must be at least 1"):
        helpers(count=1, size=16, seed=0, agents=0)
