"""A large batch of an eager call in parts, on all cores that the process may use.

One compiled call runs on one core: each map is a chain of steps, and two such calls in one program
share their temporaries, so XLA runs one after the other. Calls from several host threads do run
side by side. So the batch is cut into parts, and each of as many threads as there are cores takes
the next part until none is left: maps of unequal difficulty even out.

Each part's result is copied to its place in one array, whose memory lies in huge pages. XLA would
take a result of more than 32 MiB from the system in pages of 4 KiB, and touching these for the
first time takes longer than the copy, and longer than most kernels.

Neither the parts nor the maps of a batch depend on each other, so no bit of a result depends on the
number of parts or cores.
"""

import functools
import itertools
import threading
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import core

from sign_model.foundation.core_count import num_cores
from srt_jax.types import Array


class Work(NamedTuple):
    """How a batch is cut, in cells of maps: the most in one part, and the fewest that are worth a
    thread.
    """

    most: int
    fewest: int


SOLVE = Work(1 << 23, 1 << 17)
"""The solver. Smaller parts no longer fill the lanes of its floods."""

FIELD = Work(1 << 20, 1 << 17)
"""A field of costs: `fewest` cells take 500 us; the copy of `most`, 4 MiB, stays in the caches."""

LIGHT = Work(1 << 21, 1 << 21)
"""Memory-bound kernels, about one read per cell: a flood of so many cells takes 500 us, a search
for seeds 200 us, and the mask is 2 MiB.
"""

# cells that one core does in one part: as float32 16 MiB, which malloc keeps for the next call
_AT_ONCE = 1 << 22
_FINE = 16  # a part of more maps is cut further, so that unequal maps even out

_forms: dict[tuple, tuple[list[tuple[tuple[int, ...], Any]], Any]] = {}
"""For each kind of part that has been run: shape and dtype of each of its results, for one map, and
their pytree structure.
"""


def is_on_host(*arrays: Array) -> bool:
    """Returns whether all arrays lie in the host's memory, where numpy sees them without a copy,
    and calls run there too.
    """
    home = _home()
    if home is None or jax.config.jax_default_device is not None:  # pyright: ignore
        return False
    # arrays without `devices` are NumPy's, or were made while tracing
    of_jax = [array for array in arrays if hasattr(array, "devices")]
    return all(array.devices() == home for array in of_jax)


def device_of(*arrays: Array) -> Any:
    """Returns the device that holds the JAX arrays among these; None if that is the default one, or
    there are several or none.

    An array that is not committed to a device, so that JAX may move it, counts only where no array
    is committed.
    """
    of_jax = [
        array
        for array in arrays
        if isinstance(array, jax.Array) and not isinstance(array, core.Tracer)
    ]
    committed = [array for array in of_jax if getattr(array, "committed", True)]
    devices = {device for array in committed or of_jax for device in array.devices()}
    default = jax.config.jax_default_device or jax.local_devices()[0]  # pyright: ignore
    return devices.pop() if len(devices) == 1 and devices != {default} else None


def at_device_of(fun: Callable[[], Any], *arrays: Array) -> Any:
    """Returns fun(), computed on the device that holds the arrays; a result that was put together
    on the host is moved there.
    """
    device = device_of(*arrays)
    if device is None:
        return fun()
    with jax.default_device(device):
        return jax.device_put(fun(), device)


@functools.cache
def _home() -> set[Any] | None:
    """The device on which calls run, if that is a CPU."""
    return {jax.local_devices()[0]} if jax.default_backend() == "cpu" else None


def part_size(bucket: int, cells: int, work: Work) -> int:
    """Returns how many maps go into one part: a power of two, `bucket` if the batch stays whole.

    Args:
      bucket: size of the batch, a power of two.
      cells: of one map.
      work: what is done with them.
    """
    cores, size = num_cores(), bucket
    if bucket * cells <= (_AT_ONCE if cores == 1 else 2 * work.fewest):
        return bucket

    def is_too_large(size: int) -> bool:
        if size * cells > work.most:
            return True
        num_parts = bucket // size
        is_worth_it = cores > 1 and size * cells > 2 * work.fewest
        return is_worth_it and (num_parts < cores or (num_parts < 4 * cores and size > _FINE))

    while size > 1 and is_too_large(size):
        size //= 2
    return size


def in_parts(run: Callable[[Any], Any], arrays: Any, size: int, key: tuple) -> Any:
    """Returns what `run` gives for the parts of `size` entries, put together along the leading
    axis, as arrays of numpy.

    Args:
      run: (a pytree like `arrays`, of `size` entries or, the last, fewer) -> a pytree with as many
        entries.
      arrays: pytree of arrays on the host with one leading axis.
      size: fewer than there are entries.
      key: what `run` depends on: with the shapes of `arrays` it says which code is compiled.
    """
    count = len(jax.tree.leaves(arrays)[0])

    def leaves_of(part: slice) -> list[Any]:
        return jax.tree.leaves(run(_part(arrays, part)))

    key = (*key, size, *(array.shape[1:] for array in jax.tree.leaves(arrays)))
    ahead: list[Any] = []
    # the first time one part runs before the others; otherwise each thread would compile
    if key not in _forms:
        ahead, structure = jax.tree.flatten(run(_part(arrays, slice(0, size))))
        _forms[key] = [(leaf.shape[1:], leaf.dtype) for leaf in ahead], structure
    forms, structure = _forms[key]
    whole = [empty((count, *shape), dtype) for shape, dtype in forms]
    for array, leaf in zip(whole, ahead):
        np.copyto(array[:size], np.asarray(leaf))
    run_parts(leaves_of, count, size, whole, begin=size if ahead else 0)
    return jax.tree.unflatten(structure, whole)


def _part(arrays: Any, part: slice) -> Any:
    return jax.tree.map(lambda array: np.asarray(array)[part], arrays)


def run_parts(
    run: Callable[[slice], list[Array]],
    count: int,
    size: int,
    out: list[np.ndarray],
    begin: int = 0,
) -> None:
    """Fills `out`, arrays with leading axis `count`, from `begin` on: run(slice) gives what belongs
    there, for `size` maps.

    Whatever a part raises is raised here, after all threads have ended.
    """
    # next() is one step under the interpreter's lock, so each part is taken exactly once
    firsts = itertools.count(begin, size)
    raised: list[BaseException] = []

    def work() -> None:
        try:
            ahead = None
            while not raised and (first := next(firsts)) < count:
                part = slice(first, min(first + size, count))
                # JAX computes this part while the one before is copied
                behind, ahead = ahead, (part, run(part))
                fill(behind)
            fill(ahead)
        except BaseException as error:
            raised.append(error)

    def fill(done: Any) -> None:
        for whole, result in zip(out, done[1] if done else ()):
            np.copyto(whole[done[0]], np.asarray(result))

    # this thread works as well
    threads = [
        threading.Thread(target=work)
        for _ in range(min(num_cores(), -(-(count - begin) // size)) - 1)
    ]
    for thread in threads:
        thread.start()
    work()
    try:
        for thread in threads:
            thread.join()
    # an interrupt while waiting: the others end after their part, too
    except BaseException as error:
        raised.append(error)
        for thread in threads:
            thread.join()
    if raised:
        raise raised[0]


def empty(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """Returns an array without content, aligned so that JAX takes it over without a copy."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    memory = np.empty(size + 64, np.uint8)  # numpy requests huge pages itself
    first = -memory.ctypes.data % 64
    return memory[first : first + size].view(dtype).reshape(shape)
