"""Least costs over cells of unequal cost, and their derivatives, against SciPy in float64 and
central differences.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from srt_jax import path_cost
from tests.helpers.maps import any_start, random_maps, snake
from tests.helpers.pictures import drawn
from tests.helpers.slow_kernels import weighted_costs_by_scipy

FREE, STARTS, _ = random_maps(21, 200, 16, 18)
RNG = np.random.default_rng(22)
COSTS = RNG.uniform(0.2, 5, FREE.shape).astype(np.float32)
WEIGHTS = RNG.normal(size=FREE.shape).astype(np.float32)


def _score(costs, free=FREE, starts=STARTS, weights=WEIGHTS):
    """A weighted sum of the costs of all cells that are reached, one number a map."""
    cost = srt_jax.cost_to_come(free, starts, costs)
    return jnp.where(jnp.isfinite(cost), cost * weights, 0).sum(axis=(-2, -1))


def _exact_score(free, start, costs, weights):
    cost = weighted_costs_by_scipy(free, start, costs)
    return cost, np.where(np.isfinite(cost), cost * weights, 0).sum()


def test_the_path_avoids_an_expensive_cell_and_a_move_costs_the_mean_of_its_cells():
    free, places = drawn("""
        S..
        ...
        ...
    """)
    costs = np.ones(free.shape, np.float32)
    costs[1, 1] = 9
    cost = np.asarray(srt_jax.cost_to_come(free, places["S"], costs))
    assert np.allclose(cost, [[0, 1, 2], [1, 6, 1 + 2**0.5], [2, 1 + 2**0.5, 2 + 2**0.5]])
    assert np.allclose(srt_jax.cost_to_come(free, places["S"], costs.T * 2), cost * 2)


def test_costs_equal_scipys_dijkstra():
    got = np.asarray(srt_jax.cost_to_come(FREE, STARTS, COSTS))
    for free, start, costs, cost in zip(FREE, STARTS, COSTS, got):
        np.testing.assert_allclose(cost, weighted_costs_by_scipy(free, start, costs), rtol=1e-6)


def test_where_all_cells_cost_the_same_the_lengths_are_multiplied():
    lengths = np.asarray(srt_jax.cost_to_come(FREE, STARTS))
    assert np.array_equal(srt_jax.cost_to_come(FREE, STARTS, np.ones_like(COSTS)), lengths)
    assert np.array_equal(
        srt_jax.cost_to_come(FREE, STARTS, np.where(FREE, 4, 7).astype(np.float32)), lengths * 4
    )


def test_a_cell_of_infinite_cost_is_blocked():
    closed = RNG.random(FREE.shape) < 0.2
    got = srt_jax.cost_to_come(FREE, STARTS, np.where(closed, np.inf, COSTS).astype(np.float32))
    assert np.array_equal(got, srt_jax.cost_to_come(FREE & ~closed, STARTS, COSTS))


def test_the_gradient_equals_central_differences_on_200_maps():
    gradients = np.asarray(jax.grad(lambda costs: _score(costs).sum())(COSTS), np.float64)
    eps, num_compared = 1e-6, 0
    for free, start, costs, weights, gradient in zip(FREE, STARTS, COSTS, WEIGHTS, gradients):
        assert not gradient[~free].any()
        way = RNG.normal(size=costs.shape)
        ahead, here, back = (
            _exact_score(free, start, costs + step * way, weights) for step in (eps, 0.0, -eps)
        )
        reached = np.isfinite(here[0])
        bend = np.abs(ahead[0][reached] + back[0][reached] - 2 * here[0][reached]).max(initial=0)
        if bend > 1e-9:  # another path has become the least in between
            continue
        expected, got = (ahead[1] - back[1]) / (2 * eps), (gradient * way).sum()
        assert (
            abs(got - expected)
            <= 1e-3 * max(abs(expected), 1e-2 * np.abs(gradient * way).sum()) + 1e-7
        )
        num_compared += 1
    assert num_compared > 190


def test_forward_mode_and_reverse_mode_agree_and_second_derivatives_are_zero():
    way = RNG.normal(size=COSTS.shape).astype(np.float32)
    gradient = jax.grad(lambda costs: _score(costs).sum())
    _, along = jax.jvp(_score, (COSTS,), (way,))
    np.testing.assert_allclose(
        along, (np.asarray(gradient(COSTS)) * way).sum((1, 2)), rtol=1e-4, atol=1e-3
    )
    _, bend = jax.jvp(gradient, (COSTS,), (way,))
    assert not np.asarray(bend).any()


@pytest.mark.parametrize("spread", [0.0, 1.0, 6.0])
def test_along_the_costs_themselves_the_derivative_is_the_least_cost(spread):
    """Euler: a least cost is a sum of costs. Also where costs differ so much that float32 swallows
    the smaller ones.
    """
    costs = np.exp(spread * RNG.normal(size=FREE.shape)).astype(np.float32)
    cost, along = jax.jvp(
        lambda costs: srt_jax.cost_to_come(FREE, STARTS, costs), (costs,), (costs,)
    )
    reached = np.isfinite(cost)
    np.testing.assert_allclose(np.asarray(along)[reached], np.asarray(cost)[reached], rtol=1e-5)
    assert not np.asarray(along)[~reached].any()


@pytest.mark.slow
def test_without_the_marks_values_are_equal_and_gradients_up_to_rounding(monkeypatch):
    args = (FREE[:24], STARTS[:24], WEIGHTS[:24])
    expected = jax.value_and_grad(lambda costs: _score(costs, *args).sum())(COSTS[:24])
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    got = jax.jit(jax.value_and_grad(lambda costs: _score(costs, *args).sum()))(COSTS[:24])
    values = jax.jit(lambda costs: srt_jax.cost_to_come(FREE[:24], STARTS[:24], costs))(COSTS[:24])
    monkeypatch.undo()
    assert np.array_equal(values, srt_jax.cost_to_come(FREE[:24], STARTS[:24], COSTS[:24]))
    np.testing.assert_allclose(got[0], expected[0], rtol=1e-4)
    np.testing.assert_allclose(got[1], expected[1], rtol=1e-4, atol=1e-4)


def test_the_gradient_of_one_path_is_the_path_weighted_by_length():
    free, places = drawn("""
        S.@.
        .@..
        ...G
    """)
    costs = np.ones(free.shape, np.float32)
    cost, gradient = jax.value_and_grad(path_cost, argnums=3)(free, places["S"], places["G"], costs)
    assert cost == 5 and np.allclose(gradient, [[0.5, 0, 0, 0], [1, 0, 0, 0], [1, 1, 1, 0.5]])


def test_the_hessian_of_a_function_of_a_path_cost_is_that_of_the_function():
    free, costs = np.ones((4, 5), bool), RNG.uniform(1, 2, (4, 5)).astype(np.float32)
    corners = np.zeros(2, np.int32), np.array([3, 4], np.int32)
    gradient = np.asarray(jax.grad(path_cost, argnums=3)(free, *corners, costs))
    hessian = jax.jit(jax.hessian(lambda costs: path_cost(free, *corners, costs) ** 2))(costs)
    np.testing.assert_allclose(
        hessian, 2 * np.multiply.outer(gradient, gradient), rtol=1e-5, atol=1e-6
    )


def test_the_cost_of_one_path_is_the_entry_of_the_field_and_so_is_its_gradient():
    goals = np.array([any_start(RNG, free) for free in FREE])
    every = np.arange(len(FREE))
    field = np.asarray(srt_jax.cost_to_come(FREE, STARTS, COSTS))[every, goals[:, 0], goals[:, 1]]
    at_goal = np.zeros_like(WEIGHTS)
    at_goal[every, goals[:, 0], goals[:, 1]] = 1

    def total(costs):
        cost = path_cost(FREE, STARTS, goals, costs)
        return jnp.where(jnp.isfinite(cost), cost, 0).sum()

    assert np.array_equal(path_cost(FREE, STARTS, goals, COSTS), field)
    expected = jax.grad(lambda costs: _score(costs, weights=at_goal).sum())(COSTS)
    np.testing.assert_allclose(jax.grad(total)(COSTS), expected, atol=1e-6)
    assert np.isinf(path_cost(FREE[0], STARTS[0], (-1, 0))) and np.isinf(
        path_cost(FREE[0], STARTS[0], (16, 0))
    )


def test_the_memory_of_reverse_mode_does_not_depend_on_the_length_of_the_path():
    def temporaries(free):
        run = jax.jit(
            jax.grad(
                lambda costs, free: _score(costs, free, (0, 0), jnp.ones((40, 40), jnp.float32))
            )
        )
        return (
            run.lower(jnp.ones((40, 40), jnp.float32), free)
            .compile()
            .memory_analysis()
            .temp_size_in_bytes
        )

    assert temporaries(snake(40, 40)) == temporaries(np.ones((40, 40), bool)) < 400 * 40 * 40


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_a_cost_that_is_not_positive_is_refused_and_inside_jit_blocks_the_cell(bad):
    free, costs = np.ones((3, 4), bool), np.ones((3, 4), np.float32)
    costs[1, 2] = bad
    with pytest.raises(ValueError, match=r"traversal_cost at \[1, 2\] is .* must be positive"):
        srt_jax.cost_to_come(free, (0, 0), costs)
    got = jax.jit(srt_jax.cost_to_come)(free, np.zeros(2, np.int32), costs)
    free[1, 2] = False
    assert np.array_equal(
        got, srt_jax.cost_to_come(free, (0, 0), np.abs(np.nan_to_num(costs)) * 0 + 1)
    )


def test_shapes_and_dtypes_that_do_not_fit_are_refused():
    free = np.ones((3, 4), bool)
    with pytest.raises(TypeError, match="traversal_cost must be float32"):
        srt_jax.cost_to_come(free, (0, 0), np.ones((3, 4)))
    with pytest.raises(ValueError, match="traversal_cost must have the shape of free"):
        srt_jax.cost_to_come(free, (0, 0), np.ones((4, 3), np.float32))
