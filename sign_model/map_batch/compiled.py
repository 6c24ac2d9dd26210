"""How the batched search is compiled: the one place here that knows XLA's undocumented marks and
its compiler options.

By default XLA:CPU compiles every fused step of a loop body as a kernel of its own. A call that
carries the mark below is compiled as one function with its loops: nearly twice as fast, and a
program in which scalar loops cost next to nothing. The vector width counts as much again on
machines with 512-bit registers; it is asked for per program and never set globally.

Nothing but speed depends on either. Inside a marked call scatter, dot, sort, top_k, FFT and
callbacks are refused.
"""

import functools
import inspect
import os
from collections.abc import Callable, Sequence
from typing import Any

import jax
from jax import lax

try:
    from jax.experimental.xla_metadata import set_xla_metadata
except ImportError:
    set_xla_metadata = None
# single calls could not be marked, or were split among threads that they cannot start
if jax.__version_info__ < (0, 8):
    set_xla_metadata = None

_WHOLE = {"xla_cpu_small_call": "true", "inlineable": "false"}
_WIDE = {"xla_cpu_prefer_vector_width": 512}  # narrower machines use what they have


def is_marking() -> bool:
    """Returns whether calls are marked; SRT_JAX_PLAIN=1 in the environment leaves the marks out,
    to compare.
    """
    return set_xla_metadata is not None and os.environ.get("SRT_JAX_PLAIN") != "1"


def compiled_whole(fun: Callable) -> Callable:
    """Returns `fun`, compiled on CPU as a single function with its loops wherever a jit calls
    it; elsewhere as it is.
    """
    plain = jax.jit(fun)

    def marked(*args: Any) -> Any:
        assert set_xla_metadata is not None
        return set_xla_metadata(jax.jit(fun)(*args), **_WHOLE)

    def run(*args: Any) -> Any:
        return (
            lax.platform_dependent(*args, cpu=marked, default=plain)
            if is_marking()
            else plain(*args)
        )

    return run


def jitted_wide(fun: Callable, static_argnames: Sequence[str] = ()) -> Callable:
    """Returns `fun` jitted, on CPU for the widest vector registers that the machine has."""
    knows_options = "compiler_options" in inspect.signature(jax.jit).parameters

    @functools.cache
    def program() -> Callable:
        is_wide = knows_options and is_marking() and jax.default_backend() == "cpu"
        options: dict[str, Any] = {"compiler_options": _WIDE} if is_wide else {}
        return jax.jit(fun, static_argnames=static_argnames, **options)

    @functools.wraps(fun)
    def run(*args: Any, **options: Any) -> Any:
        return program()(*args, **options)

    return run
