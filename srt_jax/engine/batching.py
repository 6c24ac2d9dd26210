"""A batch of maps in one kernel: one map after the other in a marked call, and vmap folded into the
batch axis.

How a call is marked, and what the compiler refuses inside one: `sign_model.foundation.marks`.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

from sign_model.foundation.loops import hidden_zero
from sign_model.foundation.marks import runs_in_place
from srt_jax.engine.devices import device_by_device
from srt_jax.types import Array


def each(fun: Callable, *args: Any) -> Any:
    """Returns `fun` of the entries of `args` along their leading axis, one after the other, in a
    loop even where there is only one.

    XLA removes a loop of one step. What was inside then stands directly in the marked call, where
    the compiler splits large steps among threads, which such a call cannot hold. So the number of
    steps is hidden from the compiler.
    """
    count = jax.tree.leaves(args)[0].shape[0]
    if count > 1:
        return lax.map(lambda entry: fun(*entry), args)
    # one entry: `lax.map` written out, with a number of steps that the compiler does not know; the
    # jit is traced once for both, the shapes and the step
    fun = jax.jit(fun, inline=True)
    entry = jax.tree.map(lambda leaf: leaf[0], args)
    empty = jax.tree.map(
        lambda leaf: jnp.zeros((1, *leaf.shape), leaf.dtype), jax.eval_shape(fun, *entry)
    )
    steps = jnp.int32(1) + hidden_zero(args)

    def step(_: Array, out: Any) -> Any:
        del out
        return jax.tree.map(lambda leaf: leaf[None], fun(*entry))

    return lax.fori_loop(jnp.int32(0), steps, step, empty)


def each_keeping(fun: Callable, kept: Any, *args: Any) -> Any:
    """`each` for a function that also takes, first, and returns, second, arrays that stay in place
    from one entry to the next: room to work in, whose contents do not matter.

    Clearing it for every map can take longer than what is done there.
    """
    count = jax.tree.leaves(args)[0].shape[0]
    fun = jax.jit(fun, inline=True)
    entry = jax.tree.map(lambda leaf: leaf[0], args)
    shapes = jax.eval_shape(fun, kept, *entry)[0]
    empty = jax.tree.map(lambda leaf: jnp.zeros((count, *leaf.shape), leaf.dtype), shapes)
    # As in `each`, the compiler is not to know the number of steps where there is one.
    steps = jnp.int32(count) + hidden_zero(args)

    def step(i: Array, state: tuple[Any, Any]) -> tuple[Any, Any]:
        out, kept = state
        entry = jax.tree.map(lambda leaf: lax.dynamic_index_in_dim(leaf, i, keepdims=False), args)
        new, kept = fun(kept, *entry)
        out = jax.tree.map(
            lambda leaf, value: lax.dynamic_update_index_in_dim(leaf, value, i, 0), out, new
        )
        return out, kept

    return lax.fori_loop(jnp.int32(0), steps, step, (empty, kept))[0]


def each_or_all(fun: Callable) -> Callable:
    """Returns `fun` of one map as a function of a batch, for use inside `compiled_whole`: one map
    after the other in a marked call, elsewhere all side by side.
    """

    def run(*args: Any) -> Any:
        return each(fun, *args) if runs_in_place() else jax.vmap(fun)(*args)

    return run


def batch_kernel(fun: Callable) -> Callable:
    """Returns `fun` in a form that sees vmap, along any axis and nested, as a larger leading batch
    axis.

    Every argument and result of `fun` has a leading axis whose entries are independent, on one
    device or several (`devices`). Under the plain rules of vmap each while loop would run until the
    slowest map is done, and each dynamic_update_slice would become a scatter, which a marked call
    cannot hold.
    """
    run = jax.custom_batching.custom_vmap(device_by_device(fun))

    @run.def_vmap
    def fold(axis_size: int, is_batched: list, *args: Any) -> tuple[Any, Any]:
        def folded(arg: Any, batched: bool) -> Any:
            arg = arg if batched else jnp.broadcast_to(arg, (axis_size, *arg.shape))
            return arg.reshape(-1, *arg.shape[2:])

        out = run(*(folded(arg, batched) for arg, batched in zip(args, is_batched)))
        return jax.tree.map(lambda x: x.reshape(axis_size, -1, *x.shape[1:]), out), jax.tree.map(
            lambda _: True, out
        )

    return run
