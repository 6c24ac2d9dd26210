"""Answers of coalitions, all from one program: it takes long to compile."""

from typing import NamedTuple

import jax
import numpy as np

from experiments.campaigns.inputs.coalition_tasks import random_coalition
from srt_jax.coalition import (
    CoalitionSolution,
    CoalitionTask,
    make_coalition,
    solve_coalition,
    stack_coalitions,
)

COUNT = 16


class Solved(NamedTuple):
    tasks: list[CoalitionTask]
    answers: list[CoalitionSolution]


def solved(tasks: list[CoalitionTask]) -> Solved:
    """The answers to at most COUNT tasks of at most 4 agents and 8 obstacles on 32x32 cells in two
    layers, in one program whatever they are.
    """
    shape = random_coalition(np.random.default_rng(5), min_agents=4, max_layers=1)
    filler = shape.replace(
        labels=np.full((2, 32, 32), -1, np.int32),
        removal_cost=np.ones(8, np.float32),
        able=np.zeros((4, 8), bool),
        start=np.zeros((4, 2), np.int32),
        goal=np.zeros((4, 2), np.int32),
        size=np.array([32, 32], np.int32),
    )
    lone = make_coalition(np.ones((2, 2), bool), [(0, 0)], (0, 1))
    given = [*tasks, *[filler] * (COUNT - 1 - len(tasks)), lone]
    whole = jax.tree.map(np.asarray, solve_coalition(stack_coalitions(given), max_destroyed=8))
    answers = []
    for index, task in enumerate(tasks):
        agents, obstacles = task.able.shape
        one = jax.tree.map(lambda array: array[index], whole)  # noqa: B023
        names = ("help", "cells", "num_cells", "needed", "cost", "finish")
        cut = {name: getattr(one, name)[:agents] for name in names}
        answers.append(one.replace(firm=one.firm[:obstacles], **cut))
    return Solved(tasks, answers)
