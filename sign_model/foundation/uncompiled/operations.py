"""What operations of a traced function mean on NumPy arrays: the same bits as compiled on a CPU.

Scalars are NumPy's (`np.int32(3)`), which compute several times as fast as arrays without axes.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def index_in(start: Any, last: int) -> int:
    """Returns where an entry or a slice begins that is moved to lie within its axis."""
    start = int(start)
    return 0 if start < 0 else last if start > last else start


def slice_in(start: Any, last: int, size: int) -> slice:
    """Returns the slice of `size` entries that begins there."""
    start = index_in(start, last)
    return slice(start, start + size)


def put(array: np.ndarray, part: np.ndarray, index: tuple, is_own: bool) -> np.ndarray:
    """Returns `array` with `part` at `index`; the very array where nobody else has it."""
    if not is_own:
        array = array.copy()
    array[index] = part
    return array


def to_integers(x: Any, dtype: np.dtype) -> Any:
    """Returns floats as integers, towards zero; what is too large is the nearest integer there is,
    NaN is 0.
    """
    info, wide = np.iinfo(dtype), np.trunc(np.asarray(x, np.float64))
    is_high, is_low = wide >= float(info.max), wide <= float(info.min)
    whole = np.where(is_high | is_low | np.isnan(wide), 0, wide).astype(dtype)
    whole = np.where(is_high, dtype.type(info.max), whole)
    return np.where(is_low, dtype.type(info.min), whole)[()]


def filled(shape: tuple[int, ...], value: Any, dtype: np.dtype) -> np.ndarray:
    """Returns an array of one value; for small ones in a fifth of the time of `np.full`."""
    out = np.empty(shape, dtype)
    out.fill(value)
    return out


_SMALL = 1 << 12  # entries up to which a copy is made sooner than a view


def broadcast(x: np.ndarray, sides: tuple[int, ...], shape: tuple[int, ...]) -> np.ndarray:
    """Returns `x`, seen with `sides`, as an array of `shape`."""
    x = x.reshape(sides)
    if math.prod(shape) > _SMALL:
        return np.broadcast_to(x, shape)
    out = np.empty(shape, x.dtype)
    out[...] = x
    return out


def quotient(a: Any, b: Any) -> Any:
    """Returns a / b; of integers towards zero, by 0 all bits set."""
    if a.dtype.kind == "f":
        return a / b
    out = quotient_by(a, b)
    return np.where(b == 0, ~a.dtype.type(0), out)[()]


def quotient_by(a: Any, b: Any) -> Any:
    """`quotient` of integers where no `b` is 0."""
    return np.floor_divide(a - np.fmod(a, b), b) if a.dtype.kind == "i" else a // b


def remainder(a: Any, b: Any) -> Any:
    """Returns what `quotient` leaves, with the sign of `a`; by 0 `a` itself."""
    rest = np.fmod(a, b)
    return rest if a.dtype.kind == "f" else np.where(b == 0, a, rest)[()]


def shifted_as(x: Any, by: Any, kind: str) -> Any:
    """Returns the bits of `x` moved to the right as those of numbers of another kind: "u" has zeros
    moving in, "i" the highest bit.
    """
    other = np.dtype(f"{kind}{x.dtype.itemsize}")
    return (x.view(other) >> by.view(other)).view(x.dtype)


def leading_zeros(x: Any) -> Any:
    """Returns how many bits are 0 above the highest that is 1; of up to 32 bits."""
    bits = 8 * x.dtype.itemsize
    length = np.frexp(x.view(np.dtype(f"u{x.dtype.itemsize}")).astype(np.float64))[1]
    return (bits - length).astype(x.dtype)


def padded(x: np.ndarray, value: Any, widths: Sequence[tuple[int, int, int]]) -> np.ndarray:
    """Returns `x` with `value` around it and between its entries: (before, after, between) for each
    axis; what is negative cuts off.
    """
    shape = [
        low + high + side + max(side - 1, 0) * between
        for side, (low, high, between) in zip(x.shape, widths)
    ]
    out = np.full(shape, value, x.dtype)
    into, of = [], []
    for side, room, (low, _, between) in zip(x.shape, shape, widths):
        step = between + 1
        first = -(low // step) if low < 0 else 0
        last = min(side - 1, (room - 1 - low) // step)
        count = max(0, last - first + 1)
        start = low + first * step
        into.append(slice(start, start + count * step, step))
        of.append(slice(first, first + count))
    out[tuple(into)] = x[tuple(of)]
    return out


def gathered(
    x: np.ndarray, start: np.ndarray, numbers: Any, sizes: tuple[int, ...], fill: Any
) -> np.ndarray:
    """Returns slices of `x` that begin at cells of `start`, as `jax.lax.gather` does.

    Args:
      numbers: `jax.lax.GatherDimensionNumbers`.
      fill: what a slice holds that does not lie within `x`; None: it is moved to lie there.
    """
    offsets = numbers.offset_dims
    dropped = (*numbers.collapsed_slice_dims, *numbers.operand_batching_dims)
    windows = dict(zip((axis for axis in range(x.ndim) if axis not in dropped), offsets))
    batched = dict(zip(numbers.operand_batching_dims, numbers.start_indices_batching_dims))
    rank = start.ndim - 1 + len(offsets)
    index, is_within = _cells(
        x.shape, start, numbers.start_index_map, batched, windows, sizes, rank
    )
    shape = [0] * rank
    rest = iter(start.shape[:-1])
    for axis in range(rank):
        shape[axis] = 0 if axis in offsets else next(rest)
    for axis, offset in windows.items():
        shape[offset] = sizes[axis]
    out = np.broadcast_to(x[index], shape)
    return out if fill is None or is_within.all() else np.where(is_within, out, fill)


def scattered(
    x: np.ndarray, start: np.ndarray, parts: np.ndarray, numbers: Any, is_moved: bool, fold: Any
) -> np.ndarray:
    """Returns `x` with `parts` written to it, one after the other, as `jax.lax.scatter` does.

    Args:
      numbers: `jax.lax.ScatterDimensionNumbers`.
      is_moved: whether a part that does not lie within `x` is moved to lie there; else it is left
        out.
      fold: the function of NumPy that joins an entry with the one written to it; None: it takes
        its place.
    """
    offsets = numbers.update_window_dims
    dropped = (*numbers.inserted_window_dims, *numbers.operand_batching_dims)
    windows = dict(zip((axis for axis in range(x.ndim) if axis not in dropped), offsets))
    batched = dict(zip(numbers.operand_batching_dims, numbers.scatter_indices_batching_dims))
    sizes = [parts.shape[windows[axis]] if axis in windows else 1 for axis in range(x.ndim)]
    index, is_within = _cells(
        x.shape, start, numbers.scatter_dims_to_operand_dims, batched, windows, sizes, parts.ndim
    )
    is_there = np.broadcast_to(is_within | is_moved, parts.shape)
    places = tuple(np.broadcast_to(places, parts.shape)[is_there] for places in index)
    out, values = x.copy(), parts[is_there]
    if fold is None:
        out[places] = values
    else:
        fold.at(out, places, values)
    return out


def _cells(
    shape: Sequence[int],
    start: np.ndarray,
    axes: Sequence[int],
    batched: dict[int, int],
    windows: dict[int, int],
    sizes: Sequence[int],
    rank: int,
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Returns the cells of slices of an array, moved to lie within it: for each of its axes numbers
    that broadcast to the slices together, and which slices lay there already.

    Args:
      shape: of the array.
      start: int [*batch, len(axes)], where slices begin.
      axes: to which axis of the array each entry of `start` belongs.
      batched: axes of the array along which a slice has the number of its batch, each with the axis
        of the batch.
      windows: axes of the array along which a slice goes on, each with its axis in the slices.
      sizes: of a slice along each axis of the array.
      rank: of all slices together.
    """
    batch = start.shape[:-1]
    batch_axes = [axis for axis in range(rank) if axis not in windows.values()]

    def across(values: np.ndarray, axes: Sequence[int]) -> np.ndarray:
        sides = [1] * rank
        for axis, side in zip(axes, values.shape):
            sides[axis] = side
        return values.reshape(sides)

    begins = {axis: start[..., k].astype(np.int64) for k, axis in enumerate(axes)}
    for axis, of in batched.items():
        sides = [1] * len(batch)
        sides[of] = batch[of]
        begins[axis] = np.broadcast_to(np.arange(batch[of]).reshape(sides), batch)
    is_within = np.ones(batch, bool)
    index = []
    for axis, side in enumerate(shape):
        begin, last = begins.get(axis, np.zeros(batch, np.int64)), side - sizes[axis]
        is_within &= (begin >= 0) & (begin <= last)
        places = across(begin.clip(0, last), batch_axes)
        if axis in windows:
            places = places + across(np.arange(sizes[axis]), [windows[axis]])
        index.append(places)
    return tuple(index), across(is_within, batch_axes)


def sorted_together(arrays: Sequence[np.ndarray], axis: int, num_keys: int) -> list[np.ndarray]:
    """Returns the arrays in the order of the first `num_keys` of them, the first one foremost; ties
    stay as they are.
    """
    order = np.lexsort(tuple(reversed(arrays[:num_keys])), axis=axis)
    return [np.take_along_axis(array, order, axis) for array in arrays]


def reduced(
    arrays: Sequence[np.ndarray],
    firsts: Sequence[Any],
    axes: tuple[int, ...],
    combine: Callable[[list], list],
) -> list:
    """Returns arrays folded along axes by an associative `combine` of two entries of each."""
    left = [axis for axis in range(arrays[0].ndim) if axis not in axes]
    rows = [
        array.transpose(*left, *axes).reshape(*(array.shape[axis] for axis in left), -1)
        for array in arrays
    ]
    while (count := rows[0].shape[-1]) > 1:
        half = count // 2
        pairs = [row[..., :half] for row in rows] + [row[..., half : 2 * half] for row in rows]
        folded = combine(pairs)
        rows = [
            np.concatenate([now, row[..., 2 * half :]], axis=-1) if count % 2 else now
            for now, row in zip(folded, rows)
        ]
    firsts = [np.broadcast_to(first, rows[0].shape[:-1]) for first in firsts]
    out = combine([*firsts, *(row[..., 0] for row in rows)]) if count else firsts
    return [array[()] for array in out]


def scanned(
    step: Callable[[list, float], list],
    fixed: list,
    carry: list,
    rows: list,
    count: int,
    is_reversed: bool,
    forms: Sequence[tuple[tuple[int, ...], np.dtype]],
    until: float,
) -> list:
    """Returns what is carried through all steps and, stacked, what each gave: `jax.lax.scan`.

    Args:
      forms: shape and dtype of each stack.
      until: as `program` gives it to each step.
    """
    stacks, size = [np.empty(*form) for form in forms], len(carry)
    for i in range(count - 1, -1, -1) if is_reversed else range(count):
        given = [*fixed, *taken(carry), *(row[i] for row in rows)]
        out = step(given, until)
        carry = out[:size]
        for stack, row in zip(stacks, out[size:]):
            stack[i] = row
        del out
    return carry + stacks


def taken(values: list) -> list:
    """Returns the entries of a list, which it no longer holds."""
    out = values[:]
    values.clear()
    return out
