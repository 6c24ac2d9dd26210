"""How a kernel is compiled and batched: the one place that knows XLA's undocumented mark and folds vmap into the batch axis.

By default XLA:CPU compiles every fused step of a loop body as a kernel of its own, and the code of one row step is then scalar:
five to eight times slower than when the loop is compiled as one function. A call that carries the mark below is. The mark is
local to that call: nothing global is set, other JAX code in the process compiles as before. It is undocumented, so nothing
but speed may depend on it: `srt-jax bench` shows whether it is in force, and the results are equal bit for bit without it.

Inside a marked call scatter, dot, sort, top_k, FFT and callbacks are refused by the compiler.
"""

import os
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

try:
    from jax.experimental.xla_metadata import set_xla_metadata
except ImportError:  # an older JAX: the same code, compiled the slower way
    set_xla_metadata = None

_MARK = {"xla_cpu_small_call": "true", "inlineable": "false"}  # compile as one function; keep the call until that is done


def is_marking() -> bool:
    """Returns whether kernels carry the mark; SRT_JAX_PLAIN=1 in the environment leaves it out, to compare."""
    return set_xla_metadata is not None and os.environ.get("SRT_JAX_PLAIN") != "1"


def compiled_whole(fun: Callable) -> Callable:
    """Returns `fun`, compiled on CPU as a single function with its loops wherever a jit calls it; elsewhere as it is."""
    inner = jax.jit(fun)  # the nested jit becomes the call that the mark goes on; nothing inside it is marked

    def marked(*args: Any) -> Any:
        assert set_xla_metadata is not None
        return set_xla_metadata(inner(*args), **_MARK)

    def run(*args: Any) -> Any:
        return lax.platform_dependent(*args, cpu=marked, default=inner) if is_marking() else inner(*args)

    return run


def batch_kernel(fun: Callable) -> Callable:
    """Returns `fun` such that vmap, along any axis and nested, arrives as a larger leading batch axis.

    Every argument and result of `fun` has a leading axis whose entries are independent. vmapped as it stands, each while loop
    would wait for its slowest lane, and each dynamic_update_slice would become a scatter, which a marked call cannot hold.
    """
    run = jax.custom_batching.custom_vmap(fun)

    @run.def_vmap
    def fold(axis_size: int, is_batched: list, *args: Any) -> tuple[Any, Any]:
        def folded(arg: Any, batched: bool) -> Any:
            arg = arg if batched else jnp.broadcast_to(arg, (axis_size, *arg.shape))
            return arg.reshape(-1, *arg.shape[2:])

        out = run(*(folded(arg, batched) for arg, batched in zip(args, is_batched)))
        return jax.tree.map(lambda x: x.reshape(axis_size, -1, *x.shape[1:]), out), jax.tree.map(lambda _: True, out)

    return run
