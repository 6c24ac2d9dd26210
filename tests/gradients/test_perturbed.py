"""Perturbed costs: values and derivatives against closed forms, and the hard limit; the least
removal and its gradient.
"""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from srt_jax import least_removal, perturbed
from tests.helpers.labelled import random_tasks

KEY = jax.random.key(0)
COSTS = jnp.array([2.0, 2.4], jnp.float32)


def _share_of_first(costs, t):
    """How often the first of two perturbed costs is the less: log c0 + t Z0 < log c1 + t Z1."""
    return 0.5 * (1 + math.erf(math.log(costs[1] / costs[0]) / (2 * t)))


def _mean_least(costs, t):
    """E min of two log-normals of means c0 and c1."""
    gap, width = math.log(costs[1] / costs[0]), t * math.sqrt(2)
    return sum(
        c * 0.5 * (1 + math.erf((sign * gap - width**2 / 2) / width / math.sqrt(2)))
        for c, sign in zip(costs, (1, -1))
    )


def _differences(fun, costs, eps=1e-5):
    costs = np.asarray(costs, float)
    return [
        (fun(costs + step) - fun(costs - step)) / (2 * eps) for step in np.eye(len(costs)) * eps
    ]


def _first_is_less(costs):
    return (costs[0] < costs[1]).astype(jnp.float32)


def test_a_choice_between_two_costs_has_the_mean_and_the_gradient_of_its_closed_form():
    smooth = perturbed(_first_is_less, num_samples=200_000, temperature=0.3)
    value, gradient = jax.jit(jax.value_and_grad(smooth, argnums=1))(KEY, COSTS)
    assert abs(value - _share_of_first((2, 2.4), 0.3)) < 0.005
    np.testing.assert_allclose(
        gradient, _differences(lambda c: _share_of_first(c, 0.3), COSTS), rtol=0.03
    )
    way = jnp.array([1.0, 0.5], jnp.float32)
    push = jax.jit(lambda costs: jax.jvp(lambda costs: smooth(KEY, costs), (costs,), (way,)))
    _, along = push(COSTS)
    np.testing.assert_allclose(along, gradient[0] + 0.5 * gradient[1], rtol=1e-3)


@pytest.mark.parametrize("pathwise", [True, False])
def test_a_smooth_minimum_has_the_mean_and_the_gradient_of_its_closed_form(pathwise):
    smooth = perturbed(jnp.min, num_samples=200_000, temperature=0.3, pathwise=pathwise)
    value, gradient = jax.jit(jax.value_and_grad(smooth, argnums=1))(KEY, COSTS)
    assert abs(value - _mean_least((2, 2.4), 0.3)) < 0.005
    np.testing.assert_allclose(
        gradient, _differences(lambda c: _mean_least(c, 0.3), COSTS), atol=0.02
    )


def test_the_smooth_cost_of_a_path_is_below_the_hard_one_and_tends_to_it_as_the_temperature_falls():
    rng = np.random.default_rng(0)
    free, costs = rng.random((16, 16)) < 0.9, rng.uniform(1, 3, (16, 16)).astype(np.float32)
    free[0, 0] = free[15, 15] = True

    def cost(costs):
        return srt_jax.path_cost(free, np.zeros(2, np.int32), np.array([15, 15], np.int32), costs)

    hard, hard_gradient = jax.value_and_grad(cost)(costs)
    gaps, turns = [], []
    for t in (0.4, 0.1, 0.001):
        smooth = perturbed(cost, num_samples=32, temperature=t, pathwise=True)
        value, gradient = jax.value_and_grad(smooth, argnums=1)(KEY, jnp.asarray(costs))
        gaps.append(float(hard - value))
        turns.append(float(jnp.abs(gradient - hard_gradient).max()))
    assert gaps[0] > gaps[1] > abs(gaps[2]) and gaps[2] < 0.01 * hard
    assert turns[0] > 0.05 and turns[2] < 0.01


def test_costs_that_are_infinite_stay_so_and_have_no_gradient():
    costs = jnp.array([2.0, jnp.inf], jnp.float32)
    smooth = perturbed(jnp.min, num_samples=64, temperature=0.3)
    value, gradient = jax.jit(jax.value_and_grad(smooth, argnums=1))(KEY, costs)
    assert np.isfinite(value) and gradient[1] == 0 and np.isfinite(gradient[0])


@pytest.mark.parametrize(("samples", "temperature"), [(0, 1.0), (3, 1.0), (4, 0.0), (4, -1.0)])
def test_options_out_of_range_are_refused(samples, temperature):
    with pytest.raises(ValueError, match="must be"):
        perturbed(jnp.min, num_samples=samples, temperature=temperature)


def test_the_gradient_of_smooth_least_costs_equals_differences_under_the_same_noise():
    free, start, goal = np.ones((6, 6), bool), np.zeros(2, np.int32), np.array([5, 5], np.int32)
    costs = jnp.asarray(np.random.default_rng(3).uniform(1, 3, (6, 6)), jnp.float32)
    smooth = perturbed(
        lambda costs: srt_jax.path_cost(free, start, goal, costs),
        num_samples=4096,
        temperature=0.3,
        pathwise=True,
    )
    both = jax.jit(jax.value_and_grad(smooth, argnums=1))
    _, gradient = both(KEY, costs)
    for seed in range(3):
        way = np.random.default_rng(seed).choice([-1, 1], costs.shape).astype(np.float32) / 64
        difference = both(KEY, costs + way)[0] - both(KEY, costs - way)[0]
        assert float(difference) / 2 == pytest.approx(
            float((gradient * way).sum()), rel=5e-3, abs=2e-5
        )


def test_the_score_is_within_five_standard_errors_of_the_differences_of_the_value():
    costs = jnp.array([2.0, 2.4, 2.2], jnp.float32)
    jump = perturbed(
        lambda c: (c.argmin(axis=-1) == 0).astype(jnp.float32), num_samples=20_000, temperature=0.3
    )
    seeds = jax.random.split(KEY, 32)
    gradients = jax.jit(jax.vmap(jax.grad(jump, argnums=1), in_axes=(0, None)))(seeds, costs)

    @jax.jit
    def differences_along(step):
        one = lambda key: (jump(key, costs + step) - jump(key, costs - step)) / (2 * eps)  # noqa: E731
        return jax.vmap(one)(seeds)

    eps = np.float32(1 / 16)  # curvature within it is far below the tolerance
    for index in range(3):
        step = np.eye(3, dtype=np.float32)[index] * eps
        # the same noise in both
        error = np.asarray(gradients[:, index] - differences_along(step))
        assert abs(error.mean()) < 5 * error.std(ddof=1) / len(seeds) ** 0.5 + 1e-3


def test_a_removal_cost_that_is_not_positive_is_named():
    task = srt_jax.make_task(np.arange(9)[None] != np.full((9, 9), 4), (0, 0), (8, 8))
    with pytest.raises(ValueError, match=r"removal_cost at \[0\] is -1.0: it must be positive"):
        least_removal(task.replace(removal_cost=-task.removal_cost))


TASKS = random_tasks(31, 12, overlap=False, max_side=12)


def test_the_gradient_of_the_least_removal_is_the_set_destroyed_and_equals_differences():
    batch = srt_jax.stack(TASKS)
    solution = srt_jax.solve(batch)
    gradient, (removal, route) = jax.grad(_total, has_aux=True)(batch.removal_cost, batch)
    assert np.array_equal(removal, solution.removal_cost) and np.array_equal(route, solution.cost)
    for destroyed, row in zip(np.asarray(solution.destroyed), np.asarray(gradient)):
        assert np.array_equal(np.flatnonzero(row), np.sort(destroyed[destroyed >= 0])) and set(
            row
        ) <= {0.0, 1.0}
    assert gradient.sum() > 5
    eps = np.float32(1 / 64)  # less than half of what any two sets can differ by, save for ties
    way = np.random.default_rng(0).choice([-1, 1], batch.removal_cost.shape).astype(np.float32)
    ahead, back = (
        least_removal(batch.replace(removal_cost=batch.removal_cost + step * way))
        for step in (eps, -eps)
    )
    here = np.asarray(removal)
    # where there is a tie, the least bends
    known = np.isfinite(here) & (np.asarray(ahead) + back == 2 * here)
    slope = (np.asarray(ahead) - back)[known] / (2 * eps)
    assert known.sum() > 4 and np.array_equal(slope, (np.asarray(gradient) * way).sum(1)[known])


def _total(costs, batch):
    removal, route = least_removal(batch.replace(removal_cost=costs), with_route=True)
    return jnp.where(jnp.isfinite(removal), removal, 0).sum(), (removal, route)


@pytest.mark.slow
def test_the_least_removal_under_jit_and_vmap_has_the_same_bits_and_its_mean_a_gradient():
    batch = srt_jax.stack(TASKS)
    expected = least_removal(batch)
    assert np.array_equal(jax.vmap(least_removal)(batch), expected)

    smooth = perturbed(
        lambda costs: _total(costs, batch)[0], num_samples=4, temperature=0.5, pathwise=True
    )
    gradient = jax.grad(smooth, argnums=1)(KEY, jnp.asarray(batch.removal_cost))
    assert np.isfinite(gradient).all() and gradient.sum() > 5
