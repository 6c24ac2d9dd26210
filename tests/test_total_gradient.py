"""The derivative of the least total: against differences, in both modes, by cost and by toll."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax import least_total, make_task, stack


@pytest.fixture(scope="module")
def walls():
    labels = np.full((12, 12), -1)
    labels[:11, 3], labels[1:, 8] = 0, 1
    return make_task(labels, (5, 0), (5, 11), removal_cost=[4.0, 1.0])


@pytest.mark.parametrize(("toll", "gone"), [(0.5, (1, 1)), (2.0, (0, 1)), (30.0, (0, 0))])
def test_the_derivative_is_that_of_differences(walls, toll, gone):
    def total(costs, toll):
        return least_total(walls.replace(removal_cost=costs), toll)

    costs = jnp.asarray(walls.removal_cost)
    by_cost, by_toll = jax.grad(total, argnums=(0, 1))(costs, jnp.float32(toll))
    assert by_cost.tolist() == [toll * one for one in gone]
    assert float(by_toll) == sum(cost * one for cost, one in zip(costs.tolist(), gone))
    step = 0.125
    for i in range(2):
        up, down = (float(total(costs.at[i].add(sign * step), toll)) for sign in (1, -1))
        assert (up - down) / (2 * step) == pytest.approx(float(by_cost[i]), abs=2e-3)
    up, down = (float(total(costs, toll + sign * 0.0625)) for sign in (1, -1))
    assert (up - down) / 0.125 == pytest.approx(float(by_toll), abs=4e-3)


def test_forward_mode_and_a_batch_agree_with_reverse_mode(walls):
    batch = stack([walls] * 3)
    tolls = jnp.array([0.5, 2.0, 30.0], jnp.float32)
    costs = jnp.asarray(batch.removal_cost)

    def totals(costs):
        return least_total(batch.replace(removal_cost=costs), tolls)

    push = jax.jit(lambda costs: jax.jvp(totals, (costs,), (jnp.ones_like(costs),)))
    _, along = push(costs)
    assert along.tolist() == [1.0, 2.0, 0.0]
    back = jax.jit(jax.grad(lambda costs: totals(costs).sum()))(costs)
    assert back.tolist() == [[0.5, 0.5], [0.0, 2.0], [0.0, 0.0]]
