"""Kernels on arrays that are spread over several devices: each device works on the maps it holds.

The entries of a kernel's leading axis are independent, so a device needs nothing from another. JAX
spreads arrays in three ways, each of which would otherwise reach into a kernel's loops.
- Inside `jax.shard_map` the loops would have to declare which of their values vary from device to
  device. They are traced without that check, and the results are declared to vary as the arguments
  do.
- With explicit axes (`jax.make_mesh`) the kernel is called through `jax.shard_map`, split along its
  leading axis.
- With automatic axes the compiler splits every step and joins the parts again. A call compiled as
  one function (`marks`) cannot hold that: `sign_model.foundation.marks.may_be_split` says when it
  stays plain.
"""

import functools
from collections.abc import Callable
from typing import Any

import jax
from jax import lax

from sign_model.foundation.marks import manual_axes
from srt_jax.types import Array

# undocumented, like the marks of `sign_model.foundation.marks`; without it shard_map accepts the
# kernels with check_vma=False only
try:
    from jax._src.config import _check_vma as _varying_checked
except ImportError:
    _varying_checked = None


def device_by_device(fun: Callable) -> Callable:
    """Returns `fun`, natively batched along a leading axis, such that it takes arrays spread along
    that axis over devices.
    """

    @functools.wraps(fun)  # its name says which compiled program is its own
    def run(*args: Array) -> Any:
        leaves = jax.tree.leaves(args)
        varying = tuple(
            axis for axis in manual_axes() if any(axis in _varies_over(leaf) for leaf in leaves)
        )
        if varying and _varying_checked is not None:
            return _unchecked(fun, varying, args)
        spread = [leaf for leaf in leaves if _leading_axes(leaf) is not None]
        return _split(fun, spread[0], args) if spread else fun(*args)

    return run


def _unchecked(fun: Callable, axes: tuple, args: tuple) -> Any:
    """Traces `fun` as if nothing varied, and declares all of its results to vary over `axes`.

    In a jit of its own: without it the content of a custom_vmap would be traced once more when it
    is lowered, and checked then.
    """

    def undeclared(*args: Array) -> Any:
        # max(x, x) is the same value without the declaration
        return fun(*jax.tree.map(lambda leaf: lax.max(leaf, leaf), args))

    assert _varying_checked is not None
    with _varying_checked(False):
        out = jax.jit(undeclared)(*args)
    return jax.tree.map(lambda leaf: _declared(leaf, axes), out)


def _declared(leaf: Array, axes: tuple) -> Array:
    if hasattr(lax, "pcast"):
        return lax.pcast(leaf, axes, to="varying")
    return lax.pvary(leaf, axes)  # before JAX 0.9  # pyright: ignore[reportAttributeAccessIssue]


def _type(value: Array) -> Any:
    return jax.typeof(value) if hasattr(jax, "typeof") else None


def _varies_over(value: Array) -> frozenset:
    """The mesh axes along which `value` is declared to vary."""
    declared = getattr(_type(value), "manual_axis_type", None)
    return getattr(declared, "varying", getattr(_type(value), "vma", frozenset()))


def _leading_axes(value: Array) -> Any:
    """The explicit mesh axes over which the leading axis is spread; None where it is not."""
    sharding = getattr(_type(value), "sharding", None)
    mesh = getattr(sharding, "mesh", None)
    if (
        sharding is None
        or mesh is None
        or not getattr(mesh, "explicit_axes", ())
        or not any(sharding.spec)
    ):
        return None
    return next(part for part in sharding.spec if part)


def _split(fun: Callable, example: Array, args: tuple) -> Any:
    """Calls `fun` through shard_map, every argument spread along its leading axis as `example` is
    spread along any.
    """
    spec = jax.sharding.PartitionSpec(_leading_axes(example))
    mesh = _type(example).sharding.mesh
    args = jax.tree.map(
        lambda leaf: jax.reshard(leaf, jax.sharding.NamedSharding(mesh, spec)), args
    )
    return jax.shard_map(fun, mesh=mesh, in_specs=spec, out_specs=spec, check_vma=False)(*args)
