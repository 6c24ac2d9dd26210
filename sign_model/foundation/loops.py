"""Loops that a marked call can hold (`marks`), with the same bits under `jax_enable_x64`."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array, lax


def repeat(count: int, step: Callable[[Array, Any], Any], value: Any) -> Any:
    """Returns `value` after value = step(i, value) for i from 0 to count - 1, each int32 [].

    `lax.fori_loop` with a known number of steps would count in int64 under `jax_enable_x64`.
    """

    def one(state: tuple[Array, Any], _: None) -> tuple[tuple[Array, Any], None]:
        i, value = state
        return (i + 1, step(i, value)), None

    if count < 1:  # scan does not accept it under `jax.disable_jit`
        return value
    return lax.scan(one, (jnp.int32(0), value), None, length=count)[0][1]


def in_a_loop(fun: Callable) -> Callable:
    """Returns `fun` as the body of a loop of one step, whose steps may be as large as they are
    inside a marked call.

    The number of steps is hidden from the compiler, which would otherwise remove the loop. It is
    computed from all arguments: so none of them is unused in a marked call, whichever results the
    compiler finds that nobody needs.
    """
    keeping = in_a_loop_keeping(lambda _, *args: (fun(*args), ()))
    return lambda *args: keeping((), *args)[0]


def in_a_loop_keeping(fun: Callable) -> Callable:
    """`in_a_loop` for a function that also takes, first, and returns, second, arrays that stay in
    place.
    """

    def run(kept: Any, *args: Any) -> tuple[Any, Any]:
        once = jax.jit(fun, inline=True)  # traced once for both, the shapes and the step
        shapes = jax.eval_shape(once, kept, *args)[0]
        empty = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
        return lax.fori_loop(
            jnp.int32(0),
            jnp.int32(1) + _zero_of_all((kept, args)),
            lambda _, state: once(state[1], *args),
            (empty, kept),
        )

    return run


def hidden_zero(args: Any) -> Array:
    """Returns 0, int32, computed from an array of `args` that is not of floats, so that the
    compiler does not know it.
    """
    some = next(
        leaf for leaf in jax.tree.leaves(args) if not jnp.issubdtype(leaf.dtype, jnp.floating)
    )
    return _zero_of_all(some)


def _zero_of_all(args: Any) -> Array:
    """Returns `hidden_zero`, computed from every array of `args`."""

    def first_bits(leaf: Array) -> Array:
        if leaf.ndim:
            leaf = lax.reshape(lax.slice(leaf, (0,) * leaf.ndim, (1,) * leaf.ndim), ())
        is_float = jnp.issubdtype(leaf.dtype, jnp.floating)
        to_int = lax.bitcast_convert_type if is_float else lax.convert_element_type
        return to_int(leaf, jnp.int32)

    bits = functools.reduce(lax.bitwise_or, map(first_bits, jax.tree.leaves(args)))
    return (bits & 1) >> 1
