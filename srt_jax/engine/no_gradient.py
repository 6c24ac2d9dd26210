"""Functions without a gradient say so, and what has one, where JAX would fail deep inside."""

import jax

from srt_jax.types import Array


def refuse_gradient(value: Array, reason: str) -> Array:
    """Returns `value` itself; whoever differentiates what depends on it gets TypeError(reason).

    jit, vmap, scan and `jax.lax.stop_gradient` do not mind it: the rule runs only where a
    derivative is asked for.
    """

    @jax.custom_jvp
    def same(value: Array) -> Array:
        return value

    @same.defjvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        del primals, tangents
        raise TypeError(reason)

    return same(value)
