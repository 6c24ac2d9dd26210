"""Spreading activation: an active sign activates, step by step and ever more weakly, the signs that
its matrices name.
"""

import functools

import chex
import jax
import jax.numpy as jnp

from sign_model.ground.loops import repeat
from sign_model.ground.records import Array
from sign_model.signs.matrix import Component, Matrices


@functools.partial(jax.jit, static_argnames=("steps",))
def spread_activation(matrices: Matrices, activation: Array, *, decay: Array, steps: int) -> Array:
    """Returns the activation after `steps` steps over the three networks; all 0 where nothing was
    active.

    At each step a sign passes `decay` of its activation along each of its links and keeps its own;
    of several that reach it a sign takes the strongest. So activation is the product of the decays
    along the best chain of at most `steps` links: it stays within the strongest given, never falls,
    and does not depend on any order of adding up.

    Args:
      matrices: one world model's table.
      activation: float32 [..., S], not negative.
      decay: float32 [3], in [0, 1], for links in W_p, W_m and W_a; 0 closes a network.
      steps: bound on the length of a chain.

    Returns:
      float32 [..., S].
    """
    num_signs = matrices.is_sign.shape[0]
    chex.assert_axis_dimension(activation, -1, num_signs)
    chex.assert_shape(decay, (len(Component),))
    target = jnp.where(matrices.feature >= 0, matrices.feature, num_signs)
    passed_on = jnp.where(
        matrices.owner >= 0, jnp.asarray(decay)[matrices.component], jnp.float32(0)
    )

    def step(_: Array, active: Array) -> Array:
        sent = (active[matrices.owner] * passed_on)[:, None]
        return active.at[target].max(jnp.broadcast_to(sent, target.shape), mode="drop")

    def one(active: Array) -> Array:
        return repeat(steps, step, active)

    for _ in range(activation.ndim - 1):
        one = jax.vmap(one)
    return one(jnp.asarray(activation))
