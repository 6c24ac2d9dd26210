import jax
import numpy as np
import pytest

import srt_jax
from srt_jax.moves import max_path_cells
from srt_jax.paths.path import trace_field
from srt_jax.propagation.lengths import cost_field
from tests.helpers.maps import any_start, noise, random_maps, snake
from tests.helpers.pictures import drawn


def _assert_shortest(free, start, goal, cells, num, cost):
    path = cells[:num]
    assert (cells[num:] == -1).all()
    assert tuple(path[0]) == tuple(start) and tuple(path[-1]) == tuple(goal)
    step = np.abs(np.diff(path, axis=0))
    assert (step.max(1) == 1).all()
    diagonal = step.sum(1) == 2
    assert free[tuple(path.T)].all()
    before, after = path[:-1][diagonal], path[1:][diagonal]
    assert free[before[:, 0], after[:, 1]].all() and free[after[:, 0], before[:, 1]].all()
    np.testing.assert_allclose(np.where(diagonal, 2**0.5, 1).sum(), cost, rtol=1e-6, atol=1e-6)


def test_the_path_runs_from_the_start_round_the_wall_to_the_goal():
    free, places = drawn("""
        S.@G
        ..@.
        ....
    """)
    path = srt_jax.trace_path(srt_jax.cost_to_come(free, places["S"]), places["G"], max_cells=12)
    assert path.num_cells == 7
    assert path.cells[:7].tolist() == [[0, 0], [1, 0], [2, 1], [2, 2], [2, 3], [1, 3], [0, 3]]
    assert (path.cells[7:] == -1).all()
    np.testing.assert_allclose(path.cost, 5 + 2**0.5, rtol=1e-6)


def test_ties_go_to_the_first_neighbour_in_row_order():
    path = srt_jax.trace_path(
        srt_jax.cost_to_come(np.ones((3, 4), bool), (2, 0)), (0, 3), max_cells=4
    )
    assert path.cells.tolist() == [[2, 0], [1, 1], [0, 2], [0, 3]]


@pytest.mark.parametrize("exact", [False, True])
def test_paths_on_random_maps_are_legal_and_as_long_as_the_costs_say(exact):
    free, starts, _ = random_maps(50, 128, 40, 50)
    rng = np.random.default_rng(1)
    goals = np.stack([any_start(rng, one) for one in free])
    room = max_path_cells(40, 50)
    if exact:
        path = jax.jit(lambda f, s, g: trace_field(cost_field(f, s), g, max_cells=room))(
            free, starts, goals
        )
    else:
        path = srt_jax.trace_path(srt_jax.cost_to_come(free, starts), goals, max_cells=room)
    lengths = np.asarray(srt_jax.cost_to_come(free, starts))
    for i, (one, start, goal) in enumerate(zip(free, starts, goals)):
        assert path.cost[i] == lengths[i][tuple(goal)]
        if np.isinf(path.cost[i]):
            assert path.num_cells[i] == 0 and (path.cells[i] == -1).all()
        else:
            _assert_shortest(
                one,
                start,
                goal,
                np.asarray(path.cells[i]),
                int(path.num_cells[i]),
                float(path.cost[i]),
            )


def test_float_and_exact_costs_give_the_same_path():
    free, starts, _ = random_maps(51, 64, 40, 50)
    goals = np.stack([any_start(np.random.default_rng(i), one) for i, one in enumerate(free)])
    exact = jax.jit(lambda f, s, g: trace_field(cost_field(f, s), g, max_cells=400))(
        free, starts, goals
    )
    rounded = srt_jax.trace_path(srt_jax.cost_to_come(free, starts), goals, max_cells=400)
    assert np.array_equal(exact.cells, rounded.cells) and np.array_equal(
        exact.num_cells, rounded.num_cells
    )
    assert np.array_equal(exact.cost, rounded.cost)


def test_a_path_longer_than_max_cells_reports_its_true_number_of_cells():
    free = snake(21, 30)
    cost = srt_jax.cost_to_come(free, (0, 0))
    goal = np.argwhere(free)[-1].astype(np.int32)
    whole = srt_jax.trace_path(cost, goal, max_cells=700)
    short = srt_jax.trace_path(cost, goal, max_cells=10)
    exactly = srt_jax.trace_path(cost, goal, max_cells=int(whole.num_cells))
    assert short.num_cells == whole.num_cells == exactly.num_cells > 10
    assert (short.cells == -1).all() and short.cost == whole.cost
    assert np.array_equal(exactly.cells, whole.cells[: int(whole.num_cells)])


@pytest.mark.parametrize("goal", [(-1, 2), (2, 4), (7, 0), (0, 4), (2**31 - 1, -(2**31))])
def test_there_is_no_path_to_a_goal_outside_blocked_or_cut_off(goal):
    free = np.ones((3, 5), bool)
    free[:, 3] = False
    path = srt_jax.trace_path(
        srt_jax.cost_to_come(free, (0, 0)), np.array(goal, np.int32), max_cells=15
    )
    assert path.num_cells == 0 and np.isinf(path.cost) and (path.cells == -1).all()


def test_the_path_to_the_start_itself_is_one_cell():
    path = srt_jax.trace_path(
        srt_jax.cost_to_come(np.ones((3, 5), bool), (1, 2)), (1, 2), max_cells=4
    )
    assert (
        path.num_cells == 1
        and path.cost == 0
        and path.cells.tolist() == [[1, 2], [-1, -1], [-1, -1], [-1, -1]]
    )


def test_vmap_and_jit_give_the_same_path():
    free = noise(np.random.default_rng(0), 30, 40, 0.3)
    cost = srt_jax.cost_to_come(free, any_start(np.random.default_rng(1), free))
    goals = np.argwhere(np.isfinite(cost))[:9].astype(np.int32)
    each = [srt_jax.trace_path(cost, goal, max_cells=80) for goal in goals]
    together = jax.jit(jax.vmap(lambda goal: srt_jax.trace_path(cost, goal, max_cells=80)))(goals)
    for i, one in enumerate(each):
        jax.tree.map(lambda a, b: np.testing.assert_array_equal(a[i], b), together, one)  # noqa: B023


def test_max_cells_below_one_is_refused():
    with pytest.raises(ValueError, match="max_cells must be at least 1"):
        srt_jax.trace_path(np.zeros((3, 3), np.float32), (0, 0), max_cells=0)
    with pytest.raises(TypeError, match="cost must be float32"):
        srt_jax.trace_path(np.zeros((3, 3)), (0, 0), max_cells=3)
