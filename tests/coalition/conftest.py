"""Answers that several tests here look at."""

import numpy as np
import pytest

from experiments.campaigns.inputs.coalition_tasks import lone_coalition, random_coalition
from srt_jax.coalition import make_coalition
from tests.helpers.coalitions import Solved, solved


@pytest.fixture(scope="session")
def mixed() -> Solved:
    """Random tasks of several agents, and of one."""
    rng = np.random.default_rng(11)
    tasks = [random_coalition(rng, min_agents=2) for _ in range(10)]
    return solved([*tasks, *(lone_coalition(rng) for _ in range(5))])


@pytest.fixture(scope="session")
def chain() -> Solved:
    """Agent 0 can destroy wall 0, and needs wall 1, which only agent 1 can destroy, once wall 0 is
    gone; wall 2 stands for good.
    """
    labels = np.full((5, 12), -1, np.int32)
    labels[:, 3], labels[:, 7], labels[:, 10] = 0, 1, 2
    starts, able = [(2, 0), (1, 0)], [(0,), (1,)]
    task = make_coalition(labels, starts, [(2, 9), None], able=able, removal_cost=[2, 3, 1])
    stuck = make_coalition(labels, starts, (2, 11), able=able)
    return solved([task, stuck])
