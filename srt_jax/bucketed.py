"""How an eager call of a public function reaches its kernel: padded to a size bucket, run by one jit, cropped again.

New map sizes would else each be compiled anew. Padding is blocked cells and maps without a free cell, which change no bit
of the rest. On the host a large batch goes in parts, on all cores (`cores`), and masks may go as quads (`packing`). Inside jit,
vmap or scan shapes and batches are taken as they are: the user has chosen them.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from srt_jax import cores, packing, shapes
from srt_jax.kernel import jitted
from srt_jax.types import Array

_FOR_QUADS = 1 << 18  # cells of a batch from which on quads pay: one map of 512 x 512

_forms: dict[tuple, tuple[list[tuple[tuple[int, ...], Any]], Any]] = {}
"""Of each part that has been compiled the shapes and dtypes of its results, a map each, and the tree they hang in."""


def call(kernel: Callable, batch: tuple[int, ...], *arrays: Array, on_quads: Callable | None = None, **static: Any) -> Any:
    """Returns kernel(*arrays, **static), batch dimensions folded into one for it, and no trace of the padding of an eager call.

    Args:
      kernel: natively batched; a module-level function, since it keys the cache of compiled code.
      batch: the leading dimensions of every array.
      *arrays: the first [*batch, H, W], the others the same or [*batch, ...]. Every result of the kernel has the leading axis B
        and, where its next two axes are those of the padded maps, these are cropped as well.
      on_quads: the same kernel for masks as quads, if it has one; its first argument is such a mask.
      **static: options that fix a shape or choose the code.
    """
    options = tuple(sorted(static.items()))
    if shapes.is_traced(*arrays):
        folded = [shapes.fold(array, array.ndim - len(batch)) for array in arrays]
        out = _jitted(kernel, options)(*folded)  # a jit even there: vmap outside jit would else compile at every call
    else:
        out = _call_eagerly(kernel, on_quads, [_folded(array, batch) for array in arrays], options)
    return jax.tree.map(lambda array: _unfolded(array, batch), out)


def _call_eagerly(kernel: Callable, on_quads: Callable | None, arrays: Sequence[Array], options: tuple) -> Any:
    size = tuple(arrays[0].shape)
    bucket = (shapes.batch_bucket(size[0]), *(shapes.size_bucket(side) for side in size[1:]))
    if cores.is_on_host(*arrays):
        cells = bucket[1] * bucket[2]
        part = cores.part_size(bucket[0], cells)
        if on_quads is not None and bucket[2] % packing.WORD == 0 and size[0] * cells >= _FOR_QUADS:
            return _call_in_parts(_jitted(on_quads, options), arrays, (part, *bucket[1:]), as_quads=True)
        if part < bucket[0]:
            return _call_in_parts(_jitted(kernel, options), arrays, (part, *bucket[1:]), as_quads=False)
    run = _jitted(kernel, options)
    if bucket == size:
        return run(*arrays)
    out = run(*(_padded(array, size, bucket) for array in arrays))
    return jax.tree.map(lambda array: _kept(array, size, bucket), out)


def _call_in_parts(run: Callable, arrays: Sequence[Array], bucket: tuple[int, ...], *, as_quads: bool) -> Any:
    """Runs parts of bucket[0] maps each, and returns what they give as one."""
    size = tuple(arrays[0].shape)

    def call_part(part: slice | None) -> Any:
        """The results of some maps, of all if None."""
        maps = list(arrays) if part is None else [np.asarray(array)[part] for array in arrays]
        shape = tuple(maps[0].shape)
        if shape != bucket:
            maps = [_padded(array, shape, bucket) for array in maps]
        if as_quads:
            maps[0] = np.ascontiguousarray(maps[0]).view(np.uint32)
        out = run(*maps)
        return out if shape == bucket else jax.tree.map(lambda array: _kept(array, shape, bucket), out)

    if size[0] <= bucket[0]:
        return jax.block_until_ready(call_part(None))  # JAX may be reading the caller's memory
    key = (run, bucket, size[1:], *(array.shape[1:] for array in arrays[1:]))
    if key not in _forms:  # the first time one part goes ahead of the others, or each thread would compile
        leaves, structure = jax.tree.flatten(call_part(slice(0, bucket[0])))
        _forms[key] = [(leaf.shape[1:], leaf.dtype) for leaf in leaves], structure
    forms, structure = _forms[key]
    whole = [cores.empty((size[0], *shape), dtype) for shape, dtype in forms]
    cores.run_parts(lambda part: jax.tree.leaves(call_part(part)), size[0], bucket[0], whole)
    return jax.tree.unflatten(structure, whole)


@functools.cache
def _jitted(kernel: Callable, static: tuple[tuple[str, Any], ...]) -> Callable:
    return jitted(functools.partial(kernel, **dict(static)))


def _padded(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> np.ndarray:
    """Returns `array` with its batch, and its map sides if it has any, padded on the host, where no shape is compiled."""
    shape = bucket if array.shape == size else (bucket[0], *array.shape[1:])
    fill = np.inf if array.dtype == np.float32 else 0  # no free cell, no cost, or a cell of a map that is not there
    out = np.full(shape, fill, array.dtype)
    out[tuple(slice(0, side) for side in array.shape)] = np.asarray(array)
    return out


def _kept(array: Array, size: tuple[int, ...], bucket: tuple[int, ...]) -> np.ndarray:
    """Returns a result without its padding, which is cut off on the host, where no shape is compiled."""
    sides = size if array.shape[:3] == bucket else size[:1]
    return np.asarray(array)[tuple(slice(0, side) for side in sides)]


def _folded(array: Array, batch: tuple[int, ...]) -> Array:
    """`shapes.fold`, on the host if the array is there: JAX would compile a reshape for every new shape."""
    core_rank = array.ndim - len(batch)
    return shapes.fold(np.asarray(array) if len(batch) != 1 and cores.is_on_host(array) else array, core_rank)


def _unfolded(array: Array, batch: tuple[int, ...]) -> jax.Array:
    """`shapes.unfold`, on the host if the array has been cropped there."""
    array = shapes.unfold(array, batch)
    return array if isinstance(array, jax.Array) else jax.device_put(array)
