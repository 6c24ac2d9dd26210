"""Generated tasks of every kind, in batches: replayed, compared with a slow shortest path, and with
their proven optimum.
"""

import gc
import weakref

import numpy as np
import pytest

from srt_jax import Status, check, solve_many
from srt_jax.instances.generate import generate
from srt_jax.many_tasks import _groups
from srt_jax.reference.dijkstra import dijkstra
from srt_jax.task import make_task


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


@pytest.fixture(scope="module")
def mixture():
    """Tasks of several sizes in turn, and their solutions as a list."""
    tasks = [task for _, task, _ in generate("mixed", count=30, size=(16, 60), seed=8)]
    return tasks, solve_many(tasks, max_destroyed=16)


@pytest.mark.parametrize("window", [1, 7, None])
def test_a_stream_gives_in_order_what_the_list_gives(mixture, window):
    tasks, expected = (some[:8] if window == 1 else some for some in mixture)
    finished = []
    got = list(solve_many(iter(tasks), max_destroyed=16, window=window, progress=finished.append))
    assert len(got) == len(tasks) and sum(finished) == len(tasks)
    for one, other in zip(got, expected):
        assert one.status == other.status and one.cost == other.cost
        count = int(one.num_cells)
        np.testing.assert_array_equal(one.cells[:count], other.cells[:count])
        for name in ("destroyed", "contour", "blocking", "separating", "removal_bound"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_stream_reads_no_further_than_its_window_and_keeps_no_task(mixture):
    read, alive = [], []

    def coming():
        for number in range(40):
            task = make_task(np.ones((16, 16), bool), (0, 0), (15, number % 16))
            alive.append(weakref.ref(task.labels))
            read.append(number)
            yield task

    for number, solution in enumerate(solve_many(coming(), window=8)):
        assert solution.num_cells == 16
        assert len(read) <= number + 9
        if number % 10 == 9:  # a collection takes a second where so much is loaded
            gc.collect()
            assert sum(one() is not None for one in alive) <= 9
    assert len(read) == 40


def test_a_stream_ends_a_window_early_where_maps_are_large(monkeypatch):
    monkeypatch.setattr("srt_jax.many_tasks._CELLS_IN_WINDOW", 4 * 256)
    read = []

    def coming(is_shared):
        task = make_task(np.ones((16, 16), bool), (0, 0), (15, 15))
        for number in range(20):
            read.append(number)
            yield task if is_shared else task.replace(labels=task.labels.copy())

    next(solve_many(coming(is_shared=False)))
    assert len(read) == 4
    read.clear()
    next(solve_many(coming(is_shared=True)))  # one map in memory
    assert len(read) == 20


def test_each_task_of_a_stream_has_its_toll():
    free = np.ones((16, 16), bool)
    free[:14, 8] = False
    task = make_task(free, (0, 0), (0, 15))
    through, round_it = solve_many(iter([task, task]), mode="shortest", toll=[0.5, 90.0])
    assert (through.num_destroyed, round_it.num_destroyed) == (1, 0)
    with pytest.raises(ValueError, match="there is none for task 1"):
        list(solve_many(iter([task, task]), mode="shortest", toll=[0.5]))
    with pytest.raises(ValueError, match="window must be at least 1"):
        solve_many(iter([task]), window=0)
    assert list(solve_many(iter([]))) == []
