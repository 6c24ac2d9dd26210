"""Kernels over maps: one map after the other in a marked call, queues of cells, and vmap folded
into the batch axis.

How a call is marked, and what the compiler refuses inside one: `sign_model.ground.marks`.

Loops over single cells (queues) can be nearly as fast as native code, on two conditions.
- The arrays a loop carries must stay in place. XLA copies an array, whole and at every step, when a
  fused computation reads it that need not come before the write. A read through `read_apart` is
  done once, and what it returns decides the write.
- XLA repeats a chain of scalar reads in every computation that uses its end. `apart` keeps a link
  of the chain from that.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array, lax

from sign_model.ground.loops import hidden_zero
from sign_model.ground.marks import apart
from srt_jax.engine.devices import device_by_device


def each(fun: Callable, *args: Any) -> Any:
    """Returns `fun` of the entries of `args` along their leading axis, one after the other:
    lax.map, a loop even for one.

    XLA does away with a loop of one step; what was in it then lies open in the marked call, where
    the compiler splits large steps among threads, which such a call cannot hold. So the number of
    steps is hidden from it.
    """
    count = jax.tree.leaves(args)[0].shape[0]
    if count > 1:
        return lax.map(lambda entry: fun(*entry), args)
    entry = jax.tree.map(lambda leaf: leaf[0], args)
    empty = jax.tree.map(
        lambda leaf: jnp.zeros((1, *leaf.shape), leaf.dtype), jax.eval_shape(fun, *entry)
    )
    steps = jnp.int32(1) + hidden_zero(args)

    def step(i: Array, out: Any) -> Any:
        new = fun(
            *jax.tree.map(lambda leaf: lax.dynamic_index_in_dim(leaf, i, keepdims=False), args)
        )
        return jax.tree.map(
            lambda leaf, value: lax.dynamic_update_index_in_dim(leaf, value, i, 0), out, new
        )

    return lax.fori_loop(jnp.int32(0), steps, step, empty)


def read(array: Array, index: Array) -> Array:
    """Returns array[index], index uint32: a signed one would be tested for being negative."""
    return lax.dynamic_slice(array, (index,), (1,))[0]


read_apart = apart(read)


def write(array: Array, value: Array, index: Array) -> Array:
    """Returns `array` with `value` at `index`, uint32."""
    return lax.dynamic_update_slice(array, value[None].astype(array.dtype), (index,))


def batch_kernel(fun: Callable) -> Callable:
    """Returns `fun` such that vmap, along any axis and nested, arrives as a larger leading batch
    axis.

    Every argument and result of `fun` has a leading axis whose entries are independent, on one
    device or several (`devices`). vmapped as it stands, each while loop would wait for its slowest
    lane, and each dynamic_update_slice would become a scatter, which a marked call cannot hold.
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
