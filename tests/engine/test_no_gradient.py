"""Who differentiates `solve` is told what to take; jit, vmap, scan and stop_gradient go on."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax

FREE = np.ones((8, 8), bool)
FREE[:, 4] = False
TASK = srt_jax.make_task(FREE, (0, 0), (7, 7))
WRAPPED = {
    "plain": lambda f: f,
    "jit": jax.jit,
    "scan": lambda f: lambda x: jax.lax.scan(lambda c, _: (c, f(x)), 0, length=1)[1][0],
    "vmap": lambda f: lambda x: jax.vmap(f)(x[None])[0],
    "checkpoint": jax.checkpoint,
}


@pytest.mark.parametrize("name", WRAPPED)
def test_a_gradient_is_refused_with_the_function_to_take(name):
    def of_costs(costs):
        return srt_jax.solve(TASK.replace(removal_cost=costs)).removal_cost

    with pytest.raises(TypeError, match=r"differentiate srt_jax\.least_removal"):
        jax.grad(WRAPPED[name](of_costs))(jnp.ones(1))


def test_the_toll_has_none_either():
    with pytest.raises(TypeError, match=r"srt_jax\.least_total"):
        jax.jvp(lambda toll: srt_jax.solve(TASK, mode="shortest", toll=toll).total, (1.0,), (1.0,))


def test_a_loss_may_hold_answers_that_are_not_differentiated():
    @jax.jit
    def loss(costs):
        task = TASK.replace(removal_cost=costs)
        kept = srt_jax.solve(task.replace(removal_cost=jax.lax.stop_gradient(costs)))
        return srt_jax.least_removal(task) * kept.removal_cost

    value, slope = jax.value_and_grad(loss)(jnp.full(1, 3.0))
    assert value == 9 and slope.tolist() == [3]


def test_sixteen_bits_are_refused_with_the_cast():
    narrow = jnp.ones(1, jnp.bfloat16)
    with pytest.raises(TypeError, match=r"got bfloat16: write .*removal_cost\.astype\('float32'\)"):
        srt_jax.solve(TASK.replace(removal_cost=narrow))
    with pytest.raises(TypeError, match=r"got bfloat16: write removal_cost\.astype\('float32'\)"):
        srt_jax.make_task(FREE, (0, 0), (7, 7), removal_cost=narrow)
    with pytest.raises(TypeError, match=r"traversal_cost\.astype\('float32'\)"):
        srt_jax.path_cost(FREE, (0, 0), (7, 7), jnp.ones((8, 8), jnp.bfloat16))
    with pytest.raises(TypeError, match=r"got list: write .*numpy\.asarray\(task\.removal_cost"):
        srt_jax.solve(TASK.replace(removal_cost=[1.0]))
