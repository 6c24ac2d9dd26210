"""The least removal that joins regions: that of enumeration; its bound; refusals."""

import itertools

import numpy as np
import pytest

import srt_jax
from srt_jax import connect, make_task
from srt_jax.connecting import least_set
from tests.helpers.labelled import random_tasks
from tests.helpers.slow_kernels import reach_by_steps


def by_enumeration(task, cells):
    """The least cost over all sets of obstacles, each flooded by eight moves."""
    covering = np.unique(task.labels)
    can = [one for one in covering.tolist() if one >= 0 and task.destroyable[one]]
    least = np.inf
    for flags in itertools.product((False, True), repeat=len(can)):
        gone = [one for one, flag in zip(can, flags) if flag]
        cost = float(task.removal_cost[gone].sum())
        if cost < least:
            free = ((task.labels < 0) | np.isin(task.labels, gone)).all(axis=0)
            reached = reach_by_steps(free, tuple(cells[0]))
            least = cost if all(reached[tuple(cell)] for cell in cells) else least
    return least


@pytest.fixture(scope="module")
def cases():
    """Tasks with cells to be joined, a few of them covered, and the least costs."""
    rng = np.random.default_rng(17)
    tasks = random_tasks(1, 30, overlap=False, can_destroy=0.8)
    tasks += random_tasks(2, 40, overlap=True, can_destroy=0.8)
    out = []
    for task in tasks:
        free = np.argwhere((task.labels < 0).all(axis=0))
        anywhere = rng.integers(0, task.labels.shape[1:], (4, 2))
        cells = rng.permutation(free)[: rng.integers(2, 6)]
        cells = anywhere if rng.random() < 0.2 or len(cells) < 2 else cells
        out.append((task, cells, by_enumeration(task, cells)))
    assert sum(0 < least < np.inf for *_, least in out) > 20
    return out


@pytest.mark.parametrize("max_exact", [8, 1], ids=["by least trees", "by cuts"])
def test_it_is_the_least_of_all_removals_and_proven(cases, max_exact, monkeypatch):
    monkeypatch.setattr(least_set, "MAX_EXACT", max_exact)
    for task, cells, least in cases:
        found = connect(task, cells)
        assert found.removal_cost == found.removal_bound == pytest.approx(least)
        first = connect(task, cells, max_branches=1)
        assert first.removal_bound <= found.removal_cost <= first.removal_cost
        if np.isfinite(least):
            gone = np.isin(task.labels, found.destroyed)
            free = ((task.labels < 0) | gone).all(axis=0)
            np.testing.assert_array_equal(found.joined, reach_by_steps(free, tuple(cells[0])))
            assert found.joined[tuple(np.transpose(cells))].all()


def test_all_rooms_of_a_level_are_joined_as_by_a_least_spanning_tree():
    rooms, side = 4, 4
    labels = np.full((rooms * side + 1, rooms * side + 1), -1)
    walls, number = [], 1
    for row, col in itertools.product(range(rooms), repeat=2):
        for axis in (0, 1):
            first = np.array([row, col]) * side + 1
            if (row, col)[axis] + 1 < rooms:
                line = [slice(at, at + side - 1) for at in first]
                line[axis] = slice(first[axis] + side - 1, first[axis] + side)
                labels[tuple(line)] = number
                walls.append(((row, col), (row + (axis == 0), col + (axis == 1))))
                number += 1
    labels[::side, ::side] = labels[[0, -1]] = labels[:, [0, -1]] = 0
    costs = np.random.default_rng(3).integers(1, 9, number)
    task = make_task(labels, (1, 1), (1, 1), destroyable=range(1, number), removal_cost=costs)
    # Kruskal's algorithm
    group, least = {room: room for wall in walls for room in wall}, 0
    for cost, (one, other) in sorted(zip(costs[1:].tolist(), walls)):
        if group[one] != group[other]:
            least += cost
            old = group[other]
            group = {room: group[one] if own == old else own for room, own in group.items()}
    found = connect(task)
    assert found.removal_cost == found.removal_bound == least
    assert len(found.destroyed) == rooms**2 - 1


def test_what_is_nothing_to_join_or_cannot_be_joined():
    labels = np.full((6, 9), -1)
    labels[:, 4] = 0
    labels[0, 0], labels[0, 1], labels[1, :2] = -1, 1, 1  # a region of one cell
    task = make_task(labels, (3, 0), (3, 8), destroyable=[0])
    assert connect(task, [(3, 0), (2, 2)])[:3] == ((), 0.0, 0.0)
    assert connect(task, [(3, 0)]).joined.sum() == 20
    assert connect(task)[:3] == ((), np.inf, np.inf)  # the small region stays shut
    assert connect(task, min_cells=2).destroyed == (0,)
    assert connect(task, [(3, 0), (3, 4)]).destroyed == (0,)  # what covers a cell has to go


def test_what_does_not_fit_is_refused_by_name():
    task = make_task(np.ones((4, 4), bool), (0, 0), (3, 3))
    with pytest.raises(ValueError, match=r"\(4, 0\), which lies outside the map of 4 x 4"):
        connect(task, [(0, 0), (4, 0)])
    with pytest.raises(ValueError, match="cells must have shape"):
        connect(task, [0, 0])
    with pytest.raises(ValueError, match="min_cells must be at least 1"):
        connect(task, min_cells=0)
    with pytest.raises(ValueError, match="connect takes one task, got a batch of"):
        connect(srt_jax.stack([task, task]))
