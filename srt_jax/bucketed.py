"""How an eager call of a public function reaches its kernel: padded to a size bucket, run by one jit, cropped again.

New map sizes would else each be compiled anew. Padding is blocked cells and maps without a free cell, which change no bit
of the rest. Inside jit, vmap or scan shapes are taken as they are: the user has chosen them.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from srt_jax import shapes
from srt_jax.kernel import is_marking
from srt_jax.types import Array


def call(kernel: Callable, batch: tuple[int, ...], *arrays: Array, **static: Any) -> Any:
    """Returns kernel(*arrays, **static), batch dimensions folded into one for it, and no trace of the padding of an eager call.

    Args:
      kernel: natively batched; a module-level function, since it keys the cache of compiled code.
      batch: the leading dimensions of every array.
      *arrays: the first [*batch, H, W], the others the same or [*batch, ...]. Every result of the kernel has the leading axis B
        and, where its next two axes are those of the padded maps, these are cropped as well.
      **static: options that fix a shape or choose the code.
    """
    folded = [array.reshape(-1, *array.shape[len(batch) :]) for array in arrays]
    run = _jitted(kernel, tuple(sorted(static.items())), is_marking())  # vmap outside jit would else compile at every call
    out = run(*folded) if shapes.is_traced(*arrays) else _call_eagerly(run, folded)
    return jax.tree.map(lambda array: shapes.unfold(array, batch), out)


def _call_eagerly(run: Callable, arrays: Sequence[Array]) -> Any:
    size = tuple(arrays[0].shape)
    bucket = (shapes.batch_bucket(size[0]), *(shapes.size_bucket(side) for side in size[1:]))
    if bucket == size:
        return run(*arrays)
    out = run(*(_padded(array, size, bucket) for array in arrays))
    return jax.tree.map(lambda array: _cropped(array, size, bucket), out)


@functools.cache
def _jitted(kernel: Callable, static: tuple[tuple[str, Any], ...], marked: bool) -> Callable:
    """One jit for each of its arguments; `marked` only keeps apart what is compiled with and without the marks of `kernel`."""
    return jax.jit(functools.partial(kernel, **dict(static)))


def _padded(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> np.ndarray:
    """Returns `array` with its batch, and its map sides if it has any, padded on the host, where no shape is compiled."""
    shape = bucket if array.shape == size else (bucket[0], *array.shape[1:])
    fill = np.inf if array.dtype == np.float32 else 0  # no free cell, no cost, or a cell of a map that is not there
    out = np.full(shape, fill, array.dtype)
    out[tuple(slice(0, side) for side in array.shape)] = np.asarray(array)
    return out


def _cropped(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> jax.Array:
    sides = size if array.shape[:3] == bucket else size[:1]
    return jax.numpy.asarray(np.asarray(array)[tuple(slice(0, side) for side in sides)])
