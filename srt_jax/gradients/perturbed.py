"""Smooth versions of what jumps: the mean over perturbed costs (Berthet et al., "Learning with
differentiable perturbed optimizers", NeurIPS 2020).

The least path and the least removal change by jumps: their own derivatives are 0 almost everywhere,
those of their costs jump. The mean over random costs near the given ones is smooth in them. Costs
are positive, so the noise is in their logarithms: c exp(t Z - t^2 / 2), Z standard normal, a factor
of mean 1 for each cost; t is the temperature. As t -> 0 the mean tends to the value itself wherever
that is continuous. Minima over paths or sets are concave in the costs, so the mean is below them.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax.engine.arguments import require_key
from srt_jax.types import Array


def perturbed(
    fun: Callable[[Array], Any], *, num_samples: int, temperature: float, pathwise: bool = False
) -> Callable:
    """Returns (key, costs) -> the mean of `fun` over perturbed costs, differentiable with respect
    to `costs`.

    Value and derivative are estimates from the same samples, in pairs of opposite noise; both are
    without bias.
    - pathwise: the mean of the derivatives of `fun`. For functions that are continuous and have
      derivatives, as `cost_to_come`, `path_cost` and `least_removal`: little variance. Of a
      function that jumps the derivative would be wrong.
    - else by the score, E[fun Z] / (t c): for any function, also masks of paths or of obstacles
      destroyed. `fun` is not differentiated. The variance grows with the number of costs and with 1
      / t; use many samples.

    Args:
      fun: costs, float32 [...] -> a pytree of arrays; called once, under vmap, so kernels see one
        batch of `num_samples`.
      num_samples: even.
      temperature: about the relative error of a cost that is to matter; positive.

    Raises:
      ValueError: num_samples is not even and positive, or temperature is not positive.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> free, costs = np.ones((5, 7), bool), np.ones((5, 7), np.float32)
      >>> def length(costs):
      ...     return srt_jax.path_cost(free, (2, 0), (2, 6), costs)
      >>> smooth = srt_jax.perturbed(length, num_samples=4, temperature=0.1, pathwise=True)
      >>> jax.grad(lambda costs: smooth(jax.random.key(0), costs))(costs).shape
      (5, 7)
    """
    if num_samples < 2 or num_samples % 2:
        raise ValueError(
            f"num_samples must be even and positive, got {num_samples}: noise comes in pairs"
        )
    if not temperature > 0:
        raise ValueError(
            f"temperature must be positive, got {temperature}: without noise call the function"
            " itself"
        )

    def smoothed(key: Array, costs: Array) -> Any:
        require_key(key)
        # each noise and its opposite, as factors of mean 1
        half = jax.random.normal(key, (num_samples // 2, *costs.shape), costs.dtype)
        noise = jnp.concatenate([half, -half])
        factor = jnp.exp(temperature * noise - 0.5 * temperature**2)
        if pathwise:
            return jax.tree.map(
                lambda value: value.mean(axis=0), jax.vmap(fun)(costs[None] * factor)
            )
        # by the score: the values are constants, their weights are differentiated
        values = lax.stop_gradient(jax.vmap(fun)(lax.stop_gradient(costs)[None] * factor))
        score = (noise * _relative_change(costs)[None]).reshape(num_samples, -1).sum(
            axis=1
        ) / temperature
        return jax.tree.map(lambda value: _with_score(value.astype(costs.dtype), score), values)

    return smoothed


def _relative_change(costs: Array) -> Array:
    """0, whose derivative is that of the logarithm of `costs`; of a cost that is not finite the
    derivative is 0.
    """
    known = jnp.where(jnp.isfinite(costs), costs, 1)
    return known / lax.stop_gradient(known) - 1


def _with_score(values: Array, score: Array) -> Array:
    """The mean of `values` [S, ...]; its derivative is the sum of (value - mean) d score, over S -
    1: without bias.
    """
    mean = values.mean(axis=0, keepdims=True)
    weight = score.reshape(-1, *[1] * (values.ndim - 1)) / (values.shape[0] - 1)
    return mean[0] + ((values - mean) * weight).sum(axis=0)
