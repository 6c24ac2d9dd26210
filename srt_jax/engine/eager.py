"""How an eager call of a public function reaches its kernel: padded to a size bucket, run by one
jit, cropped again.

Otherwise each new map size would be compiled again. Padding consists of blocked cells and of maps
without a free cell, which change no bit of the rest. On the host a large batch goes in parts, on
all cores (`cores`), and masks may go as quads (`packing`). Inside jit, vmap or scan shapes and
batches are taken as they are: the user has chosen them.
"""

import collections
import functools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jax import core

from sign_model.foundation.marks import jitted
from srt_jax.engine import arguments, cores, packing
from srt_jax.engine.buckets import batch_bucket, size_bucket
from srt_jax.types import Array

_FOR_QUADS = 1 << 18  # cells of a batch from which on quads pay: one map of 512 x 512


def call(
    kernel: Callable,
    batch: tuple[int, ...],
    *arrays: Array,
    on_quads: Callable | None = None,
    is_light: bool = False,
    **static: Any,
) -> Any:
    """Returns kernel(*arrays, **static), for which batch dimensions are folded into one; the
    padding of an eager call is removed again.

    Args:
      kernel: natively batched; a module-level function, since it keys the cache of compiled code.
      batch: the leading dimensions of every array.
      *arrays: the first [*batch, H, W], the others the same or [*batch, ...]. Every result of the
        kernel has the leading axis B and, where its next two axes are those of the padded maps,
        these are cropped as well.
      on_quads: the same kernel for masks as quads, if it has one; its first argument is such a
        mask.
      is_light: whether it is memory-bound: about one read per cell.
      **static: options that fix a shape or choose the code.
    """
    options = tuple(sorted(static.items()))
    if arguments.is_traced(*arrays):
        folded = [arguments.fold(array, array.ndim - len(batch)) for array in arrays]
        # jitted even there, since a vmap outside jit would otherwise compile at every call
        out = _jitted(kernel, options)(*folded)
    else:
        folded = [fold(array, array.ndim - len(batch)) for array in arrays]
        return cores.at_device_of(
            lambda: unfold(_call_eagerly(kernel, on_quads, is_light, folded, options), batch),
            *arrays,
        )
    return unfold(out, batch)


def _call_eagerly(
    kernel: Callable,
    on_quads: Callable | None,
    is_light: bool,
    arrays: Sequence[Array],
    options: tuple,
) -> Any:
    # the padded size, and whether the batch is cut into parts or its masks are seen as quads
    size = tuple(arrays[0].shape)
    bucket = (batch_bucket(size[0]), *(size_bucket(side) for side in size[1:]))
    if cores.is_on_host(*arrays):
        cells = bucket[1] * bucket[2]
        as_quads = (
            on_quads is not None and bucket[2] % packing.WORD == 0 and size[0] * cells >= _FOR_QUADS
        )
        part = cores.part_size(
            bucket[0], cells, cores.LIGHT if is_light or on_quads else cores.FIELD
        )
        if as_quads or part < bucket[0]:
            run = _jitted(on_quads if as_quads else kernel, options, part < bucket[0])
            return _call_in_parts(run, arrays, (part, *bucket[1:]), as_quads=as_quads)
    # else one call: padded on the host, run, cropped on the host
    run = _jitted(kernel, options)
    if bucket == size:
        return run(*arrays)
    out = run(*(_pad(array, size, bucket) for array in arrays))
    return jax.tree.map(lambda array: _crop(array, size, bucket), out)


def _call_in_parts(
    run: Callable, arrays: Sequence[Array], bucket: tuple[int, ...], *, as_quads: bool
) -> Any:
    """Runs parts of bucket[0] maps each, and returns what they give as one."""

    def call_part(maps: Sequence[Array]) -> Any:
        shape = tuple(maps[0].shape)
        if shape != bucket:
            maps = [_pad(array, shape, bucket) for array in maps]
        if as_quads:
            maps = [np.ascontiguousarray(maps[0]).view(np.uint32), *maps[1:]]
        out = run(*maps)
        return (
            out if shape == bucket else jax.tree.map(lambda array: _crop(array, shape, bucket), out)
        )

    if len(arrays[0]) > bucket[0]:
        return cores.in_parts(call_part, list(arrays), bucket[0], (run, bucket))
    return jax.block_until_ready(call_part(arrays))  # JAX may be reading the caller's memory


@functools.cache
def _jitted(
    kernel: Callable, static: tuple[tuple[str, Any], ...], is_part: bool = False
) -> Callable:
    return jitted(
        functools.partial(kernel, **dict(static)),
        is_part=is_part,
        name=(*name_of(kernel), static, is_part),
    )


def name_of(kernel: Callable) -> tuple[str, str]:
    """Returns where a kernel is defined: no other has that name, so its compiled programs can be
    kept under it.

    Raises:
      ValueError: it is defined inside a function, which may define many of one name.
    """
    module, name = kernel.__module__, kernel.__qualname__
    if "<" in name:
        raise ValueError(f"a kernel must be a function of a module, got {module}.{name}")
    return module, name


def _pad(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> np.ndarray:
    """Returns `array` with its batch, and its map sides if it has any, padded on the host, where no
    shape is compiled.
    """
    shape = bucket if array.shape == size else (bucket[0], *array.shape[1:])
    # blocked cells, infinite costs, and cell (0, 0) for the maps that fill up the batch
    fill = np.inf if array.dtype == np.float32 else 0
    return padded(np.asarray(array), shape, fill)


def padded(array: np.ndarray, shape: tuple[int, ...], fill: float) -> np.ndarray:
    """Returns `array` padded at the ends, in a twentieth of the time of `np.pad`; itself where it
    has that shape.
    """
    if array.shape == shape:
        return array
    out = np.full(shape, fill, array.dtype)
    out[tuple(slice(0, side) for side in array.shape)] = array
    return out


def _crop(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> np.ndarray:
    """Returns a result without its padding, which is cut off on the host, where no shape is
    compiled.
    """
    sides = size if array.shape[:3] == bucket else size[:1]
    return np.asarray(array)[tuple(slice(0, side) for side in sides)]


def fold(array: Array, core_rank: int) -> Array:
    """Returns `arguments.fold`, on the host if the array is there: JAX would compile a reshape for
    every new shape.
    """
    is_folded = array.ndim == core_rank + 1
    return array if is_folded else arguments.fold(_on_host(array), core_rank)


def unfold(arrays: Any, batch: tuple[int, ...]) -> Any:
    """Returns `arguments.unfold` of a pytree as arrays of JAX, on the host if they are there."""
    leaves, structure = jax.tree.flatten(arrays)
    leaves = [
        arguments.unfold(leaf if len(batch) == 1 else _on_host(leaf), batch) for leaf in leaves
    ]
    host = [leaf for leaf in leaves if not isinstance(leaf, jax.Array)]
    moved = iter(_as_arrays_of_jax(host) if host else ())
    leaves = [leaf if isinstance(leaf, jax.Array) else next(moved) for leaf in leaves]
    return jax.tree.unflatten(structure, leaves)


_SMALL_BYTES = 1 << 16
_OFTEN = 32
_MOST_FORMS = 4096
_seen: collections.Counter[tuple] = collections.Counter()
"""How often small arrays of some shapes and dtypes have been made arrays of JAX, up to `_OFTEN`."""


def _as_arrays_of_jax(host: list[np.ndarray]) -> list[jax.Array]:
    """Returns arrays on the host as arrays of JAX.

    `device_put` takes 20 us an array, as long as a small kernel; a jitted function takes 2, but is
    compiled for each form. So it serves small arrays whose form has come often.
    """
    form = tuple((array.shape, array.dtype) for array in host if array.nbytes <= _SMALL_BYTES)
    if _seen[form] < _OFTEN or jax.config.jax_disable_jit:  # pyright: ignore
        if len(_seen) > _MOST_FORMS:
            _seen.clear()
        _seen[form] += 1
        return jax.device_put(host)
    large = [array for array in host if array.nbytes > _SMALL_BYTES]
    small = _passed_on(*(array for array in host if array.nbytes <= _SMALL_BYTES))
    parts = iter(small), iter(jax.device_put(large) if large else ())
    return [next(parts[array.nbytes > _SMALL_BYTES]) for array in host]


@jax.jit
def _passed_on(*arrays: Array) -> tuple[Array, ...]:
    return arrays


def _on_host(array: Array) -> Array:
    if isinstance(array, np.ndarray):
        return array
    is_traced = isinstance(array, core.Tracer)
    return np.asarray(array) if not is_traced and cores.is_on_host(array) else array
