"""What arrays may come in: dtype and rank checks that name the argument, and batch dimensions
folded into one.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import core, lax

from srt_jax.types import Array

try:  # undocumented; saves an eager call the 50 us that making an array to inspect takes
    from jax._src.core import trace_state_clean as _is_outside
except ImportError:
    _is_outside = None


def as_mask(name: str, value: Array, *, core_rank: int = 2) -> Array:
    """Returns `value` if it is bool [..., *core]; else TypeError or ValueError with the remedy."""
    array = _as_array(value)
    if array.dtype != bool:
        raise TypeError(
            f"{name} must be bool (True where the agent fits), got {array.dtype}: write"
            f" {name}.astype(bool)"
        )
    return _with_rank(name, array, core_rank)


def as_cells(name: str, value: Array | Sequence[int]) -> Array:
    """Returns `value` as int32 [..., 2], cells (row, col)."""
    array = _as_array(value)
    if not np.issubdtype(array.dtype, np.integer):
        raise TypeError(
            f"{name} must hold integers (row, col), got {array.dtype}: cells are counted, not"
            " measured"
        )
    if array.ndim < 1 or array.shape[-1] != 2:
        raise ValueError(f"{name} must have shape [..., 2] (row, col), got {list(array.shape)}")
    return array if array.dtype == np.int32 else array.astype(np.int32)


def as_floats(name: str, value: Array, *, core_rank: int = 2) -> Array:
    """Returns `value` if it is float32 [..., *core]."""
    array = _as_array(value)
    if array.dtype != np.float32:
        raise TypeError(
            f"{name} must be float32, got {array.dtype}: write {name}.astype('float32')"
        )
    return _with_rank(name, array, core_rank)


def require_key(key: Any) -> None:
    """Raises TypeError where `key` is no JAX random key: neither `jax.random.key(0)` nor the older
    `jax.random.PRNGKey(0)`; ValueError where it is several.
    """
    dtype, shape = getattr(key, "dtype", None), tuple(getattr(key, "shape", ()))
    is_typed = dtype is not None and jnp.issubdtype(dtype, jax.dtypes.prng_key)
    is_old = dtype == np.uint32 and len(shape) >= 1 and not is_typed
    if not is_typed and not is_old:
        given = type(key).__name__ if dtype is None else f"an array of {dtype} {list(shape)}"
        raise TypeError(f"key must be a JAX random key, such as jax.random.key(0), got {given}")
    batch = shape if is_typed else shape[:-1]
    if batch:
        raise ValueError(
            f"key must be one JAX random key, got {list(batch)} of them: take jax.vmap over keys"
        )


def mask_and_cells(**named: Any) -> tuple[tuple[Array, ...], tuple[int, ...]]:
    """Returns a mask and cells, checked, and the batch dimensions that they share: first the mask,
    bool [..., H, W], then any number of cells, int32 [..., 2], each under its name.
    """
    (first, mask), *rest = named.items()
    checked = {first: (as_mask(first, mask), 2)}
    checked |= {name: (as_cells(name, cells), 1) for name, cells in rest}
    return tuple(array for array, _ in checked.values()), common_batch(**checked)


def common_batch(**core_ranks_of: tuple[Array, int]) -> tuple[int, ...]:
    """Returns the batch dimensions shared by all arrays, given as name=(array, core rank);
    ValueError where they differ.
    """
    batches = {
        name: array.shape[: array.ndim - rank] for name, (array, rank) in core_ranks_of.items()
    }
    if len(set(batches.values())) != 1:
        shapes = ", ".join(f"{name} has {list(batch)}" for name, batch in batches.items())
        raise ValueError(
            f"batch dimensions must be equal: {shapes}; broadcast them first, or use jax.vmap"
        )
    batch = next(iter(batches.values()))
    if 0 in batch:
        raise ValueError(
            f"the batch is empty (batch dimensions {list(batch)}): give at least one map"
        )
    return batch


def require_forms(task: Any, forms: Mapping[str, tuple[Any, int]]) -> None:
    """Raises TypeError or ValueError that names the first array of a task whose dtype is another,
    or that has too few dimensions or an empty one.

    Args:
      forms: dtype and rank of each array of one task.
    """
    for name, (dtype, rank) in forms.items():
        array = getattr(task, name)
        if getattr(array, "dtype", None) != dtype:
            wanted = np.dtype(dtype).name
            given, remedy = type(array).__name__, f"numpy.asarray(task.{name}, '{wanted}')"
            if hasattr(array, "dtype"):
                given, remedy = array.dtype, f"task.{name}.astype('{wanted}')"
            raise TypeError(
                f"task.{name} must be an array of {wanted}, got {given}: write"
                f" task.replace({name}={remedy})"
            )
        if array.ndim < rank or 0 in array.shape[array.ndim - rank :]:
            raise ValueError(
                f"task.{name} must have at least {rank} dimensions, none empty, got"
                f" {list(array.shape)}"
            )


def fold(array: Array, core_rank: int) -> Array:
    """Returns `array` with its batch dimensions folded into one: [..., *core] -> [B, *core]; B is 1
    where there is none.
    """
    return (
        array
        if array.ndim == core_rank + 1
        else array.reshape(-1, *array.shape[array.ndim - core_rank :])
    )


def unfold(array: Array, batch: tuple[int, ...]) -> Array:
    """Returns the inverse of `fold`: [B, *core] -> [*batch, *core]."""
    return array if len(batch) == 1 else array.reshape((*batch, *array.shape[1:]))


def is_traced(*trees: object) -> bool:
    """Returns whether the caller is inside jit or scan, or any leaf is a tracer, as in vmap and
    grad.

    Inside jit even what is made of constants is a tracer, which the host cannot read.
    """
    if any(isinstance(leaf, core.Tracer) for leaf in jax.tree.leaves(trees)):
        return True
    is_outside = _is_outside is not None and _is_outside()
    return not is_outside and isinstance(lax.full((), 0, np.int32), core.Tracer)


def _as_array(value: object) -> Array:
    return value if isinstance(value, jax.Array | np.ndarray) else np.asarray(value)


def _with_rank(name: str, array: Array, core_rank: int) -> Array:
    if array.ndim < core_rank or 0 in array.shape[array.ndim - core_rank :]:
        core = ", ".join("HW"[:core_rank]) if core_rank <= 2 else "L, H, W"
        raise ValueError(
            f"{name} must have shape [..., {core}] with no empty side, got {list(array.shape)}"
        )
    return array
