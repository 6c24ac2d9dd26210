"""Spreading activation over the semantic networks (PY16 §3.1): an active sign activates, step by
step and ever more weakly, the signs that are features of its prediction matrices.
"""

import functools

import chex
import jax
import jax.numpy as jnp

from sign_model.foundation.loops import repeat
from sign_model.foundation.records import Array
from sign_model.signs.matrix import Component, Matrices


@functools.partial(jax.jit, static_argnames=("steps",))
def spread_activation(matrices: Matrices, activation: Array, *, decay: Array, steps: int) -> Array:
    """Returns the activation after `steps` steps over the three networks; all 0 if nothing was
    active.

    In each step a sign sends its activation, times `decay`, along each of its links and keeps its
    own; of several activations that reach it a sign takes the greatest. So the result is the given
    activation times the decays along the best chain of at most `steps` links: it never exceeds the
    greatest one given, never falls, and does not depend on an order of summation.

    Args:
      matrices: the table of one world model.
      activation: float32 [..., S], not negative.
      decay: float32 [3], in [0, 1], for links in W_p, W_m and W_a; 0 closes a network.
      steps: the greatest length of a chain.

    Returns:
      float32 [..., S].
    """
    num_signs = matrices.is_sign.shape[0]
    chex.assert_axis_dimension(activation, -1, num_signs)
    chex.assert_shape(decay, (len(Component),))

    # Where each row of each matrix sends to, and how much of its owner's activation. Unused rows
    # and slots point one past the end, where the update is dropped.
    target = jnp.where(matrices.feature >= 0, matrices.feature, num_signs)
    share = jnp.where(matrices.owner >= 0, jnp.asarray(decay)[matrices.component], jnp.float32(0))

    def step(_: Array, active: Array) -> Array:
        sent = (active[matrices.owner] * share)[:, None]
        return active.at[target].max(jnp.broadcast_to(sent, target.shape), mode="drop")

    def one(active: Array) -> Array:
        return repeat(steps, step, active)

    # One batch dimension after the other.
    for _ in range(activation.ndim - 1):
        one = jax.vmap(one)
    return one(jnp.asarray(activation))
