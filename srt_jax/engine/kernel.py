"""How a kernel is compiled and batched: the one place that knows XLA's undocumented marks and folds
vmap into the batch axis.

By default XLA:CPU compiles every fused step of a loop body as a kernel of its own, and the code of
one row step is then scalar: five to eight times slower than when the loop is compiled as one
function. A call that carries the mark below is. The marks are local to their calls: nothing global
is set, other JAX code in the process compiles as before. They are undocumented, so nothing but
speed may depend on them: `srt-jax bench` shows whether they are in force, and the results are equal
bit for bit without.

Inside a marked call scatter, dot, sort, top_k, FFT and callbacks are refused by the compiler.

Loops over single cells (queues) can be nearly as fast as native code, on two conditions.
- The arrays a loop carries must stay in place. XLA copies an array, whole and at every step, when a
  fused computation reads it that need not come before the write. A read through `read_apart` is
  done once, and what it returns decides the write.
- XLA repeats a chain of scalar reads in every computation that uses its end. `apart` keeps a link
  of the chain from that.
"""

import contextlib
import contextvars
import os
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array, lax

from srt_jax.engine.devices import device_by_device, may_be_split

try:
    from jax.experimental.xla_metadata import set_xla_metadata
except ImportError:
    set_xla_metadata = None
# it could mark no single call, or steps of it were split among threads that it cannot start
if jax.__version_info__ < (0, 8):
    set_xla_metadata = None  # the same bits, compiled the slower way

_KEPT = {"inlineable": "false"}  # the call stays a call, and nothing is fused across it
_WHOLE = {"xla_cpu_small_call": "true", **_KEPT}  # compile as one function

_marks_apart = contextvars.ContextVar("marks_apart", default=False)
_without_marks = contextvars.ContextVar("without_marks", default=False)
# what the compiler said when it refused a marked call; from then on none is marked
_refused: list[str] = []


def is_marking() -> bool:
    """Returns whether kernels carry the marks; SRT_JAX_PLAIN=1 in the environment leaves them
    out, to compare.
    """
    is_possible = set_xla_metadata is not None and not _refused and not _without_marks.get()
    return is_possible and os.environ.get("SRT_JAX_PLAIN") != "1"


def jitted(fun: Callable, *, is_part: bool = False) -> Callable:
    """Returns jax.jit(fun), which is compiled without the marks, with a warning, where the compiler
    refuses them.

    The marks are undocumented, and another jaxlib, or one with more threads, may not take them
    everywhere. That is noticed when a call fails that succeeds without them; afterwards nothing is
    marked any more. A user's own jit is not caught so: there SRT_JAX_PLAIN=1 helps.

    Args:
      fun: takes and returns arrays.
      is_part: whether calls run side by side, each on a core of its own (`cores`), and outside any
        other jit. XLA would split the steps that are not marked among all cores, where they wait
        for each other's.
    """
    options = {"xla_cpu_multi_thread_eigen": False} if is_part else None
    form = {
        is_marked: jax.jit(lambda *args: fun(*args), compiler_options=options)
        for is_marked in (True, False)
    }

    def run(*args: Any) -> Any:
        is_marked = is_marking()
        try:
            return form[is_marked](*args)
        except jax.errors.JaxRuntimeError as error:
            if not is_marked:
                raise
            out = _unmarked(form[False], *args)
            _refused.append(str(error))
            warnings.warn(
                f"this jaxlib refuses the fast form of the kernels, they run slower: {error}",
                stacklevel=2,
            )
            return out

    run.forms = tuple(form.values())  # pyright: ignore[reportFunctionMemberAccess]
    return run


def _unmarked(run: Callable, *args: Any) -> Any:
    token = _without_marks.set(True)
    try:
        return run(*args)
    finally:
        _without_marks.reset(token)


def compiled_whole(fun: Callable) -> Callable:
    """Returns `fun`, compiled on CPU as a single function with its loops wherever a jit calls
    it; elsewhere as it is.
    """

    def traced(marks_apart: bool) -> Callable:
        def run(*args: Any) -> Any:
            with _setting(marks_apart):
                return fun(*args)

        # becomes the call that the mark goes on; only `apart` marks anything inside it
        return jax.jit(run)

    plain, kept = traced(False), traced(True)

    def marked(*args: Any) -> Any:
        assert set_xla_metadata is not None
        # a constant among the operands of a marked call would crash the compiler
        args = lax.optimization_barrier(args)
        return set_xla_metadata(kept(*args), **_WHOLE)

    def run(*args: Any) -> Any:
        may_mark = is_marking() and not may_be_split()
        return (
            lax.platform_dependent(*args, cpu=marked, default=plain) if may_mark else plain(*args)
        )

    return run


@contextlib.contextmanager
def _setting(marks_apart: bool) -> Iterator[None]:
    token = _marks_apart.set(marks_apart)
    try:
        yield
    finally:
        _marks_apart.reset(token)


def runs_in_place() -> bool:
    """Returns whether the code being traced goes into a marked call: whether a queue is worth its
    while there.

    Elsewhere (a GPU, an older JAX) its arrays would be copied at every step; kernels then sweep to
    the end.
    """
    return _marks_apart.get()


def apart(fun: Callable) -> Callable:
    """Returns `fun` such that, inside a marked call, its result is computed once and not again
    wherever it is used.
    """

    def run(*args: Any) -> Any:
        if not runs_in_place():
            return fun(*args)
        assert set_xla_metadata is not None
        return set_xla_metadata(jax.jit(fun)(*args), **_WHOLE)

    return run


def each(fun: Callable, *args: Any) -> Any:
    """Returns `fun` of the entries of `args` along their leading axis, one after the other:
    lax.map, a loop even for one.

    XLA does away with a loop of one step; what was in it then lies open in the marked call, where
    the compiler splits large steps among threads, which such a call cannot hold ("Symbols not
    found: ParallelForkJoin"). So the number of steps is hidden from it.
    """
    count = jax.tree.leaves(args)[0].shape[0]
    if count > 1:
        return lax.map(lambda entry: fun(*entry), args)
    entry = jax.tree.map(lambda leaf: leaf[0], args)
    empty = jax.tree.map(
        lambda leaf: jnp.zeros((1, *leaf.shape), leaf.dtype), jax.eval_shape(fun, *entry)
    )
    some = next(
        leaf for leaf in jax.tree.leaves(args) if not jnp.issubdtype(leaf.dtype, jnp.floating)
    )
    steps = 1 + ((some.reshape(-1)[0].astype(jnp.int32) & 1) >> 1)  # which is 1

    def step(i: Array, out: Any) -> Any:
        new = fun(
            *jax.tree.map(lambda leaf: lax.dynamic_index_in_dim(leaf, i, keepdims=False), args)
        )
        return jax.tree.map(
            lambda leaf, value: lax.dynamic_update_index_in_dim(leaf, value, i, 0), out, new
        )

    return lax.fori_loop(0, steps, step, empty)


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
