"""Generated tasks of every kind, in batches: replayed, compared with a slow shortest path, and with
their proven optimum.
"""

import numpy as np
import pytest

from srt_jax import Status, check, solve_many
from srt_jax.instances.generate import generate
from srt_jax.many_tasks import _groups
from srt_jax.reference.dijkstra import dijkstra


def length_on(labels, gone, start, goal):
    free = ((labels == -1) | np.isin(labels, gone) & (labels >= 0)).all(axis=0)
    return float(dijkstra(free, start)[goal])


@pytest.mark.parametrize("mode", ["least", pytest.param("paper", marks=pytest.mark.slow)])
def test_generated_tasks_of_every_kind_are_answered_rightly(mode):
    instances = generate("mixed", count=56, size=(16, 32), seed=5)
    solutions = solve_many([task for _, task, _ in instances], mode=mode, max_destroyed=16)
    for (name, task, optimum), solution in zip(instances, solutions):
        status, ends = (
            Status(int(solution.status)),
            (tuple(task.start.tolist()), tuple(task.goal.tolist())),
        )
        assert not check(task, solution), name
        assert (status is Status.PATH_EXISTS) == np.isfinite(length_on(task.labels, [], *ends)), (
            name
        )
        if status.is_solved:
            shortest = length_on(task.labels, solution.destroyed[solution.destroyed >= 0], *ends)
            assert (
                solution.cost == pytest.approx(shortest, rel=1e-5)
                if mode == "least"
                else solution.cost >= shortest - 1e-3
            )
        if np.isfinite(optimum):
            assert solution.removal_bound <= optimum <= solution.removal_cost, name
        assert np.isinf(optimum) <= (not status.is_solved), name


def test_few_maps_of_many_sizes_share_a_shape_and_many_of_one_size_have_their_own():
    sizes = [(20, 20), (33, 40), (300, 280), (300, 500), (100, 500)]
    tasks = [generate("half", count=1, size=(min(size), max(size)), seed=0)[0][1] for size in sizes]
    shapes = set(_groups(tasks))
    assert len(shapes) <= 4 and all(H in (32, 64, 128, 256, 512) for _, H, _ in shapes)
    (open_map,) = (task for _, task, _ in generate("half", count=1, size=300, seed=0))
    assert (1, 384, 384) in {
        (L, H, W) if L == 1 else (1, H, W) for L, H, W in _groups([open_map] * 500)
    }
