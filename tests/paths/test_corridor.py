"""A path within a permitted deviation: the corridor against its definition, the path against a
search of the slow twin.
"""

import jax
import numpy as np
import pytest

from srt_jax import path_within
from srt_jax.paths.corridor import corridor
from srt_jax.reference.astar import astar
from tests.helpers.pictures import drawn


def strays(start, goal, size=16):
    """How far each cell's centre lies from the straight link, float [size, size], by its
    definition.
    """
    a, b = (np.array(point, float) for point in (start, goal))
    cells = np.stack(np.mgrid[:size, :size], axis=-1).astype(float)
    apart = lambda along: np.linalg.norm(a + along[..., None] * (b - a) - cells, axis=-1)  # noqa: E731
    low, high = np.zeros((size, size)), np.ones((size, size))
    for _ in range(60):  # convex along the link: ternary search
        one, two = low + (high - low) / 3, high - (high - low) / 3
        is_lower = apart(one) <= apart(two)
        low, high = np.where(is_lower, low, one), np.where(is_lower, two, high)
    return apart(low)


def random_case(rng, size=16):
    free = rng.random((size, size)) > 0.25
    cells = np.argwhere(free)
    start, goal = (tuple(cells[rng.integers(len(cells))].tolist()) for _ in range(2))
    return free, start, goal, float(rng.integers(0, 7) + rng.choice([0.0, 0.3, 0.6]))


def test_the_corridor_and_its_path_agree_with_brute_force():
    rng, found = np.random.default_rng(0), 0
    for _ in range(60):
        free, start, goal, deviation = random_case(rng)
        away = strays(start, goal)
        inside = away <= deviation + 1e-4
        assert np.array_equal(corridor(start, goal, deviation, height=16, width=16), inside)
        truth = astar(free & inside, start, goal)
        path = path_within(free, start, goal, deviation)
        np.testing.assert_allclose(path.cost, truth.cost, rtol=1e-5)
        cells = np.asarray(path.cells)[: int(path.num_cells)]
        assert all(
            away[row, col] <= deviation + 1e-4 and free[row, col] for row, col in cells.tolist()
        )
        found += np.isfinite(truth.cost)
    assert found > 15


def test_a_wider_corridor_never_makes_a_path_longer():
    rng = np.random.default_rng(1)
    free, start, goal, _ = random_case(rng)
    costs = [
        float(path_within(free, start, goal, deviation).cost)
        for deviation in (0, 1, 2, 4, 8, 16, np.inf)
    ]
    assert costs == sorted(costs, reverse=True)


def test_a_detour_is_found_only_if_the_deviation_permits_it():
    free, places = drawn("""
        ..........
        ....@.....
        S...@....G
        ....@.....
        ..........
    """)
    paths = [path_within(free, places["S"], places["G"], deviation) for deviation in (1.0, 2.0)]
    assert [int(path.num_cells) for path in paths] == [0, 10]


@pytest.mark.parametrize("deviation", [0.5, np.float32(0.5)])
def test_where_start_and_goal_are_one_cell_the_corridor_is_a_disc(deviation):
    assert np.asarray(corridor((2, 2), (2, 2), deviation, height=5, width=5)).sum() == 1
    assert np.asarray(corridor((2, 2), (2, 2), 1.0, height=5, width=5)).sum() == 5


def test_a_batch_may_be_vmapped_and_jitted():
    rng = np.random.default_rng(2)
    cases = [random_case(rng) for _ in range(8)]
    free, start, goal, deviation = (
        np.stack([case[i] for case in cases]).astype(kind)
        for i, kind in enumerate((bool, np.int32, np.int32, np.float32))
    )
    whole = path_within(free, start, goal, deviation)
    mapped = jax.jit(jax.vmap(path_within))(free, start, goal, deviation)
    for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(mapped)):
        assert np.array_equal(one, other)
