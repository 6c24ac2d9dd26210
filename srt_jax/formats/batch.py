"""Batches of tasks as one compressed `.npz` file of plain arrays, without pickled objects."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from srt_jax.engine.entrance import require_task
from srt_jax.formats.containers.arrays import read_arrays
from srt_jax.formats.shared.whole_files import PathLike, atomic_write, read_bytes
from srt_jax.types import FREE, OUTSIDE, Task

_FIELDS = {
    "labels": (np.int32, "[B, L, H, W]"),
    "destroyable": (np.bool_, "[B, M]"),
    "removal_cost": (np.float32, "[B, M]"),
    "start": (np.int32, "[B, 2]"),
    "goal": (np.int32, "[B, 2]"),
    "size": (np.int32, "[B, 2]"),
}
"""The arrays of a batch, dtype and shape as in `Task`."""


class Batch(NamedTuple):
    """What a file holds.

    tasks: NumPy arrays with one batch dimension, padded as by `stack`.
    names: one per task; "0", "1", ... where the file has none.
    optimum: float32 [B], the least total removal cost that opens a way, inf where none does, NaN
      where unknown.
    """

    tasks: Task
    names: tuple[str, ...]
    optimum: np.ndarray

    def __repr__(self) -> str:
        """What it is in a line."""
        known = int(np.isfinite(self.optimum).sum())
        shown = ", ".join(map(repr, self.names[:3])) + (", ..." if len(self.names) > 3 else "")
        return f"Batch({self.tasks!r}, names ({shown}), least removal known of {known})"


def write_batch(
    path: PathLike,
    tasks: Task,
    *,
    names: Sequence[str] | None = None,
    optimum: ArrayLike | None = None,
) -> None:
    """Writes a batch (`stack` makes one); what `read_batch` would refuse is refused here.

    Args:
      tasks: with one batch dimension.
      names: one per task.
      optimum: float32 [B], NaN where unknown.
    """
    require_task("write_batch", tasks, takes="one batch")
    arrays: dict[str, Any] = {name: np.asarray(getattr(tasks, name)) for name in _FIELDS}
    if names is not None:
        arrays["names"] = np.array([str(name) for name in names], np.str_)
    if optimum is not None:
        arrays["optimum"] = np.asarray(optimum, np.float32)
    _checked(str(path), arrays)
    with atomic_write(path, "wb") as file:
        np.savez_compressed(file, **arrays)


def read_batch(path: PathLike) -> Batch:
    """Returns the batch in an `.npz` file.

    Raises:
      ValueError: the file is missing, cut off, no batch, or an array has a wrong dtype, shape or
        range.
    """
    return _checked(str(path), read_arrays(path, read_bytes(path, "batch of tasks")))


def _checked(path: str, arrays: dict[str, np.ndarray]) -> Batch:
    wrong = (_FIELDS.keys() - arrays.keys()) | (
        arrays.keys() - _FIELDS.keys() - {"names", "optimum"}
    )
    if wrong:
        name = min(wrong)
        fault = "is missing" if name in _FIELDS else "is unknown"
        raise ValueError(
            f"{path}: the array {name!r} {fault}: a batch holds {', '.join(_FIELDS)}, and may hold"
            " names, optimum"
        )
    sizes = {
        "2": 2,
        **dict(zip("BLHW", arrays["labels"].shape)),
        **dict(zip("BM", arrays["destroyable"].shape)),
    }
    num_tasks = sizes.get("B", 0)
    arrays.setdefault("names", np.array([str(index) for index in range(num_tasks)], np.str_))
    arrays.setdefault("optimum", np.full(num_tasks, np.nan, np.float32))
    for name, (dtype, axes) in (
        _FIELDS | {"names": (np.str_, "[B]"), "optimum": (np.float32, "[B]")}
    ).items():
        _check_array(f"{path}: {name}", arrays[name], dtype, axes, sizes)
    _check_ranges(path, arrays)
    tasks = Task(**{name: arrays[name] for name in _FIELDS})
    return Batch(tasks=tasks, names=_texts(path, arrays["names"]), optimum=arrays["optimum"])


def _texts(path: str, names: np.ndarray) -> tuple[str, ...]:
    try:
        return tuple(names.tolist())
    except ValueError as error:  # a number that is no sign of Unicode
        raise ValueError(
            f"{path}: names hold what is no text ({error}): the file is damaged"
        ) from error


def _check_array(
    name: str, array: np.ndarray, dtype: type, axes: str, sizes: dict[str, int]
) -> None:
    if not np.issubdtype(array.dtype, dtype):
        raise ValueError(f"{name} must be {np.dtype(dtype).name}, got {array.dtype}")
    if list(array.shape) != [sizes.get(axis) for axis in axes.strip("[]").split(", ")]:
        raise ValueError(
            f"{name} must have shape {axes}, sizes equal in all arrays, got {list(array.shape)}"
        )
    if 0 in array.shape:
        raise ValueError(f"{name} has shape {list(array.shape)}: the batch is empty")


def _check_ranges(path: str, arrays: dict[str, np.ndarray]) -> None:
    labels, size, cost = arrays["labels"], arrays["size"], arrays["removal_cost"]
    _, num_layers, height, width = labels.shape
    in_rows, in_columns = np.arange(height) < size[:, :1], np.arange(width) < size[:, 1:]
    is_inside = (in_rows[:, :, None] & in_columns[:, None, :])[:, None]
    is_id = (labels >= FREE) & (labels < cost.shape[1])
    is_padding = labels == np.where(np.arange(num_layers) == 0, OUTSIDE, FREE)[:, None, None]
    broken = {
        f"size must lie between 1 x 1 and {height} x {width}, the shape of labels": (
            (size < 1) | (size > (height, width))
        ),
        "start must lie inside the map": (arrays["start"] < 0) | (arrays["start"] >= size),
        "goal must lie inside the map": (arrays["goal"] < 0) | (arrays["goal"] >= size),
        f"labels must be {FREE} (free) or an id from 0 to {cost.shape[1] - 1}": is_inside & ~is_id,
        f"labels beyond the map's size must be {OUTSIDE} in layer 0 and {FREE} in the others": (
            ~is_inside & ~is_padding
        ),
        "removal_cost must be positive and finite": ~(np.isfinite(cost) & (cost > 0)),
        "optimum must not be negative (NaN where unknown)": arrays["optimum"] < 0,
    }
    for rule, is_broken in broken.items():
        if is_broken.any():
            raise ValueError(f"{path}: task {np.argwhere(is_broken)[0][0]}: {rule}")
