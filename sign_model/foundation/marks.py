"""How a program is compiled: the one place that knows XLA's undocumented marks and its compiler
options.

By default XLA:CPU compiles every fused step of a loop body as a kernel of its own, and the code of
one row step is then scalar: five to eight times slower than when the loop is compiled as one
function. A call that carries the mark below is. The marks are local to their calls: nothing global
is set, other JAX code in the process compiles as before. They are undocumented, so nothing but
speed may depend on them: `srt-jax bench` shows whether they are in force, and the results are equal
bit for bit without.

What the compiler refuses inside a marked call (jaxlib 0.10; `tests/engine/test_fast_path.py`
compiles around each threshold):
- scatter, dot, sort, top_k, FFT and callbacks;
- a sum, minimum or maximum of float32, or a minimum or maximum of 8-bit integers, over an array of
  4,096 entries or more (entries that go in, whatever the axes): it is handed to a library of
  kernels. Add and compare such numbers as integers (`srt_jax/removal/sums.py` does); sums and
  minima of wider integers, any, all and argmin are taken at any size;
- a large step that gives the only result of the call, or of a loop's condition: from 65,536 entries
  on, a look-up from 4,096 on, it is split among threads, if there are several. The body of a loop
  may hold it: `loops.in_a_loop` makes one; a large test belongs into the body of its loop, which
  carries the outcome.
An operand that a marked call inside `custom_vmap` does not use ends the whole process, without an
exception: hand over what is used and nothing else.

A program that is refused all the same is compiled without the marks, that program alone, and one
warning says so (`jitted`, `jitted_wide`). Inside a user's own jit the compiler speaks to the user
alone: SRT_JAX_PLAIN=1 in the environment leaves the marks out everywhere.
"""

import contextlib
import contextvars
import functools
import inspect
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import core, lax

from sign_model.foundation import kept_programs

try:
    from jax.experimental.xla_metadata import set_xla_metadata
except ImportError:
    set_xla_metadata = None
# it could mark no single call, or steps of it were split among threads that it cannot start
if jax.__version_info__ < (0, 8):
    set_xla_metadata = None  # the same bits, compiled the slower way

_KEPT = {"inlineable": "false"}  # the call stays a call, and nothing is fused across it
_WHOLE = {"xla_cpu_small_call": "true", **_KEPT}  # compile as one function
_WIDE = {"xla_cpu_prefer_vector_width": 512}  # narrower machines use what they have
# The first two look at the whole program again and again, a third of the time to compile it; what
# they would change inside a marked call, LLVM does as well. The third looks for loops to be made
# one function each, which the marks do already.
_NOT_NEEDED = (
    "while-loop-invariant-code-motion",
    "simplify-while-loops",
    "small-while-loop-hoisting",
)
_FEWER_PASSES = {"xla_disable_hlo_passes": ",".join(_NOT_NEEDED)}
_LARGE = 1024
"""Entries from which on a result may be a large step: none of fewer is split among threads."""
_LONGEST_REASON = 120  # characters of what the compiler says

_marks_apart = contextvars.ContextVar("marks_apart", default=False)
_without_marks = contextvars.ContextVar("without_marks", default=False)
_is_for_cpu = contextvars.ContextVar("is_for_cpu", default=False)


def is_marking() -> bool:
    """Returns whether programs carry the marks; SRT_JAX_PLAIN=1 in the environment leaves them out,
    to compare.
    """
    is_possible = set_xla_metadata is not None and not _without_marks.get()
    return is_possible and os.environ.get("SRT_JAX_PLAIN") != "1"


def jitted(
    fun: Callable,
    *,
    is_part: bool = False,
    is_large: bool = False,
    level: int | None = None,
    name: tuple | None = None,
    in_tiers: Callable[..., bool] | None = None,
) -> Callable:
    """Returns jax.jit(fun), of which a program that the compiler refuses with the marks is compiled
    without, with a warning.

    The marks are undocumented, and another jaxlib, or one with more threads, may not take them
    everywhere. That is noticed when a call fails with them and succeeds without; from then on calls
    of the same shapes go without marks. A user's own jit cannot be caught in this way: there
    SRT_JAX_PLAIN=1 helps. The call is compiled under `jax.disable_jit` too: a kernel holds nothing
    that its caller could step through.

    Args:
      fun: takes and returns arrays.
      is_part: whether calls run side by side, each on a core of its own (`cores`), and outside any
        other jit. XLA would else split the steps that are not marked among all cores, and the calls
        would wait for each other there.
      is_large: whether the program is so large that the compiler is to do less, on a CPU.
      level: LLVM's level of optimisation there, if less than its usual 3.
      name: what decides the program besides the shapes of the arguments (`kept_programs`): then
        what is compiled for calls on a CPU outside any jit is kept on disk.
      in_tiers: whether such a call with these arguments is so small that its program is compiled
        without optimisation at first; by default none is.
    """
    options: dict[str, Any] = {"xla_cpu_multi_thread_eigen": False} if is_part else {}

    @functools.cache
    def form(is_marked: bool, is_for_cpu: bool) -> Callable:
        own = dict(options)
        if is_for_cpu:
            own |= _FEWER_PASSES if is_large else {}
            own |= {} if level is None else {"xla_backend_optimization_level": level}
        if is_for_cpu and name is not None and kept_programs.is_on():
            return kept_programs.KeptProgram(fun, name, own, in_tiers)
        return jax.jit(lambda *args: fun(*args), compiler_options=own or None)

    return _with_fallback(form, _name_of(fun))


def jitted_wide(fun: Callable, static_argnames: Sequence[str] = ()) -> Callable:
    """Returns `fun` jitted, on CPU for the widest vector registers that the machine has, and as
    `jitted` where it is refused.

    The vector width counts as much as the marks on machines with 512-bit registers; it is requested
    for each program and never set globally.
    """
    knows_options = "compiler_options" in inspect.signature(jax.jit).parameters

    @functools.cache
    # made at the first call, since asking for the backend starts it
    def form(is_marked: bool, is_for_cpu: bool) -> Callable:
        is_wide = knows_options and is_marked and jax.default_backend() == "cpu"
        options: dict[str, Any] = {"compiler_options": _WIDE} if is_wide else {}
        return jax.jit(
            lambda *args, **static: fun(*args, **static), static_argnames=static_argnames, **options
        )

    return functools.wraps(fun)(_with_fallback(form, _name_of(fun)))


def _with_fallback(form: Callable[[bool, bool], Callable], name: str) -> Callable:
    """Returns a caller of form(is_marked, is_for_cpu), jitted functions of the same results, that
    remembers which programs were refused.
    """
    refused: set[Any] = set()

    def run(*args: Any, **static: Any) -> Any:
        if jax.config.jax_disable_jit:  # pyright: ignore
            with jax.disable_jit(False):  # a loop over cells, step by step in Python, would not end
                return run(*args, **static)
        if not is_marking() or (refused and _program(args, static) in refused):
            return _unmarked(form(False, False), *args, **static)
        is_for_cpu = _runs_on_cpu(args)
        try:
            with _set(_is_for_cpu, is_for_cpu):
                return form(True, is_for_cpu)(*args, **static)
        except jax.errors.JaxRuntimeError as error:
            # an error that has nothing to do with the marks is raised here again
            out = _unmarked(form(False, False), *args, **static)
            refused.add(_program(args, static))
            message = (
                f"the compiler refuses the fast form of {name} for arrays of this size, it runs"
                f" slower: {_reason(error)}"
            )
            warnings.warn(message, stacklevel=2)
            return out

    def is_kept(*args: Any) -> bool:
        """Whether the program for arguments of these shapes is on disk or loaded from there."""
        program = form(True, True) if is_marking() and _runs_on_cpu(()) else None
        return isinstance(program, kept_programs.KeptProgram) and program.is_kept(*args)

    run.form = form  # pyright: ignore[reportFunctionMemberAccess]
    run.is_kept = is_kept  # pyright: ignore[reportFunctionMemberAccess]
    return run


def _runs_on_cpu(args: tuple) -> bool:
    """Returns whether a call with these arguments runs on a CPU whatever is compiled with it: a
    program for every platform takes twice as long to trace.
    """
    default = jax.config.jax_default_device  # pyright: ignore[reportAttributeAccessIssue]
    if jax.default_backend() != "cpu" or default is not None:
        return False
    for leaf in jax.tree.leaves(args):
        if isinstance(leaf, core.Tracer):
            return False
        if hasattr(leaf, "devices") and any(d.platform != "cpu" for d in leaf.devices()):
            return False
    return True


def _program(args: tuple, static: dict[str, Any]) -> Any:
    """What decides which program a call runs: a key."""
    leaves, tree = jax.tree.flatten((args, static))
    return tree, tuple(
        (leaf.shape, str(leaf.dtype)) if hasattr(leaf, "dtype") else leaf for leaf in leaves
    )


def _reason(error: Exception) -> str:
    line = next(iter(str(error).splitlines()), "").strip()
    return line if len(line) <= _LONGEST_REASON else f"{line[:_LONGEST_REASON]}..."


def _name_of(fun: Callable) -> str:
    while isinstance(fun, functools.partial):
        fun = fun.func
    return getattr(fun, "__name__", "a kernel").strip("_")


def _unmarked(run: Callable, *args: Any, **static: Any) -> Any:
    with _set(_without_marks, True):
        return run(*args, **static)


def compiled_whole(fun: Callable) -> Callable:
    """Returns `fun`, compiled on CPU as a single function with its loops wherever a jit calls it;
    elsewhere as it is.
    """

    def traced(marks_apart: bool) -> Callable:
        def run(*args: Any) -> Any:
            with _set(_marks_apart, marks_apart):
                out = fun(*args)
            # beside it, no large step is the only result of the call (above)
            return (out, jnp.uint32(0)) if marks_apart else out

        # this jit becomes the call that carries the mark; inside it only `apart` marks anything
        return jax.jit(run)

    plain, kept = traced(False), traced(True)

    def marked(*args: Any) -> Any:
        assert set_xla_metadata is not None
        # a constant among the operands of a marked call would crash the compiler
        args = lax.optimization_barrier(args)
        both: Any = set_xla_metadata(kept(*args), **_WHOLE)
        return both[0]

    def run(*args: Any) -> Any:
        if not is_marking() or may_be_split():
            return plain(*args)
        if _is_for_cpu.get():
            return marked(*args)
        return lax.platform_dependent(*args, cpu=marked, default=plain)

    return run


@contextlib.contextmanager
def _set(variable: contextvars.ContextVar[bool], value: bool) -> Iterator[None]:
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


def may_be_split() -> bool:
    """Returns whether the compiler may split the code being traced among devices: several of them,
    and no shard_map around.
    """
    return jax.device_count() > 1 and not manual_axes()


def manual_axes() -> tuple:
    """The mesh axes along which an enclosing shard_map has split the arrays."""
    get_mesh = getattr(jax.sharding, "get_abstract_mesh", None)
    return tuple(getattr(get_mesh(), "manual_axes", ())) if get_mesh else ()


def runs_in_place() -> bool:
    """Returns whether the code being traced goes into a marked call, where a queue pays.

    Elsewhere (on a GPU, with an older JAX) its arrays would be copied at every step; kernels then
    sweep to the end.
    """
    return _marks_apart.get()


def apart(fun: Callable) -> Callable:
    """Returns `fun` such that, inside a marked call, its result is computed once and not again
    wherever it is used.
    """

    def beside_another(*args: Any) -> tuple:
        out = fun(*args)
        is_large = any(leaf.size >= _LARGE for leaf in jax.tree.leaves(out))
        # beside another, no large step is the only result of the call
        return (out, jnp.uint32(0)) if is_large else (out,)

    def run(*args: Any) -> Any:
        if not runs_in_place():
            return fun(*args)
        assert set_xla_metadata is not None
        both: Any = set_xla_metadata(jax.jit(beside_another)(*args), **_WHOLE)
        # the other one is not used, and the compiler would drop it
        return lax.optimization_barrier(both)[0] if len(both) > 1 else both[0]

    return run
