"""Reading a data set: in batches, shuffled and shared among workers; or task by task, in any
order.
"""

import functools
import operator
import pathlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from srt_jax.dataset import shards
from srt_jax.dataset.folder import read_plan
from srt_jax.dataset.specification import Plan
from srt_jax.formats.shared.whole_files import PathLike


def load(
    folder: PathLike,
    *,
    batch_size: int = 64,
    seed: int | None = None,
    epochs: int | None = 1,
    worker: tuple[int, int] = (0, 1),
    fields: tuple[str, ...] | None = None,
    drop_remainder: bool = False,
) -> "Batches":
    """Returns an iterator of batches: {name: array [batch, ...]}, all batches of one shape but the
    last of an epoch. `len` of it is the number of batches in all epochs.

    Names are those of `Task` and `TaskLabels`, and `index`, int64, the task's number. Shards whose
    maps have fewer layers or obstacles than others are padded as `stack` does.

    Args:
      folder: written by `write_dataset`, whole.
      batch_size: 1 or more.
      seed: shuffles shards, and tasks within four shards at a time, again each epoch; None: in
        order.
      epochs: how often to go over the data; None: without end.
      worker: (i, n): every n-th shard from the i-th on, of the same shuffling for all; n at most
        the number of shards.
      fields: the names wanted; all by default.
      drop_remainder: leave out the last batch of an epoch where it is smaller.

    Raises:
      ValueError: no data set, shards missing, an unknown field, or a number out of range.

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> batches = dataset.load(folder, batch_size=8, seed=0, fields=("start", "cost_to_go"))
      >>> len(batches)
      2
      >>> batch = next(batches)
      >>> batch["start"].shape, batch["cost_to_go"].shape
      ((8, 2), (8, 16, 16))
    """
    folder = pathlib.Path(folder)
    plan = read_plan(folder)
    part, parts = worker
    if batch_size < 1 or not 0 <= part < parts <= plan.num_shards():
        raise ValueError(
            "batch_size must be at least 1 and worker (i, n) have 0 <= i < n <="
            f" {plan.num_shards()} shards, got batch_size {batch_size}, worker {worker}"
        )
    widths, names = _widths(folder, plan), _names(plan, fields)
    return Batches(
        _batches(folder, plan, widths, names, batch_size, seed, epochs, worker, drop_remainder),
        None if epochs is None else _count(plan, batch_size, seed, epochs, worker, drop_remainder),
    )


class Batches(Iterator[dict[str, np.ndarray]]):
    """An iterator of batches with a length; made by `load`.

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> len(dataset.load(folder, batch_size=3, epochs=2))
      12
    """

    def __init__(self, batches: Iterator[dict[str, np.ndarray]], count: int | None):
        self._batches, self._count = batches, count

    def __repr__(self) -> str:
        """How many there are in all, also of those already taken."""
        return f"Batches({'without end' if self._count is None else self._count})"

    def __next__(self) -> dict[str, np.ndarray]:
        """Returns the next batch."""
        return next(self._batches)

    def __len__(self) -> int:
        """Returns the number of batches in all epochs; TypeError where they never end."""
        if self._count is None:
            raise TypeError("epochs=None never ends and has no length: give a number of epochs")
        return self._count


class TaskSource(Sequence[dict[str, np.ndarray]]):
    """The tasks of a data set by number: {name: array}, without a batch dimension, all of one
    shape. What torch calls a map-style data set and grain a random access source; it can be
    pickled.

    Args:
      folder: written by `write_dataset`, whole.
      fields: the names wanted, as for `load`; all by default.

    Raises:
      ValueError: no data set, shards missing, or an unknown field.
      IndexError: no task has that number. TypeError: a slice of them was asked for.

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> tasks = dataset.TaskSource(folder, fields=("index", "cost_to_go"))
      >>> len(tasks), tasks[9]["index"].item(), tasks[9]["cost_to_go"].shape
      (16, 9, (16, 16))
    """

    def __init__(self, folder: PathLike, *, fields: tuple[str, ...] | None = None):
        self.folder = pathlib.Path(folder)
        self.plan = read_plan(self.folder)
        self.fields = _names(self.plan, fields)
        self._widths = _widths(self.folder, self.plan)

    def __repr__(self) -> str:
        """What it reads from, in a line."""
        return (
            f"TaskSource({str(self.folder)!r}, {len(self)} tasks, {len(self.fields)} fields each)"
        )

    def __len__(self) -> int:
        """Returns the number of tasks."""
        return self.plan.count

    def __getitem__(self, index: Any) -> Any:
        """Returns a task; a shard that was read lately is still in memory."""
        if isinstance(index, slice):
            raise TypeError(
                f"a task is taken by its number, such as 3, got {index}: dataset.load reads batches"
            )
        number = operator.index(index)
        number += len(self) if number < 0 else 0
        if not 0 <= number < len(self):
            raise IndexError(f"task must be 0..{len(self) - 1}, got {index}")
        shard, place = divmod(number, self.plan.shard_size)
        read = _recent(self.folder, self.plan, shard, self.fields, tuple(self._widths.items()))
        return {name: array[place] for name, array in read.items()}


def _widths(folder: pathlib.Path, plan: Plan) -> dict[str, int]:
    """Returns the layers (L) and obstacles (M) of the whole data set; ValueError where it is not
    whole.
    """
    missing = [shard for shard in range(plan.num_shards()) if not plan.file(folder, shard).exists()]
    if missing:
        raise ValueError(
            f"{folder}: {len(missing)} of {plan.num_shards()} shards are missing, the first is"
            f" {plan.file(folder, missing[0]).name}: write them with the same srt-jax dataset"
            " command again"
        )
    shapes = [
        shards.SHAPES[plan.format](plan.file(folder, shard)) for shard in range(plan.num_shards())
    ]
    return dict(zip("LM", np.max(shapes, axis=0).tolist()))


def _names(plan: Plan, fields: tuple[str, ...] | None) -> tuple[str, ...]:
    """Returns the names of the fields wanted."""
    names = plan.fields if fields is None else tuple(fields)
    unknown = [name for name in names if name not in plan.fields]
    if unknown:
        raise ValueError(
            f"no field is called {unknown[0]!r}: choose among {', '.join(plan.fields)}"
        )
    return names


def _read(
    folder: pathlib.Path, plan: Plan, shard: int, names: tuple[str, ...], widths: dict[str, int]
) -> dict[str, np.ndarray]:
    read = shards.READERS[plan.format](plan.file(folder, shard), names)
    return {name: shards.widen(name, array, widths) for name, array in read.items()}


_AT_ONCE = 4
"""Shards in memory while shuffling."""


@functools.lru_cache(maxsize=_AT_ONCE)
def _recent(
    folder: pathlib.Path, plan: Plan, shard: int, names: tuple[str, ...], widths: tuple
) -> dict[str, np.ndarray]:
    return _read(folder, plan, shard, names, dict(widths))


def _order(plan: Plan, seed: int | None, epoch: int, worker: tuple[int, int]) -> tuple[Any, Any]:
    """Returns the generator of an epoch, None without a seed, and the shards of a worker in
    order.
    """
    rng = None if seed is None else np.random.default_rng([seed, epoch])
    order = np.arange(plan.num_shards()) if rng is None else rng.permutation(plan.num_shards())
    return rng, order[worker[0] :: worker[1]]


def _count(plan, batch_size, seed, epochs, worker, drop_remainder) -> int:
    """Returns the number of batches in all epochs; the last shard, which may be smaller, is not
    always the same worker's.
    """
    sizes = np.full(plan.num_shards(), plan.shard_size)
    sizes[-1] = plan.count - (plan.num_shards() - 1) * plan.shard_size
    tasks = [int(sizes[_order(plan, seed, epoch, worker)[1]].sum()) for epoch in range(epochs)]
    return sum(some // batch_size if drop_remainder else -(-some // batch_size) for some in tasks)


def _batches(folder, plan, widths, names, batch_size, seed, epochs, worker, drop_remainder):
    epoch = 0
    while epochs is None or epoch < epochs:
        rng, mine = _order(plan, seed, epoch, worker)
        waiting: dict[str, np.ndarray] = {}
        for first in range(0, len(mine), _AT_ONCE):
            wide = [
                _read(folder, plan, int(shard), names, widths)
                for shard in mine[first : first + _AT_ONCE]
            ]
            more = {name: np.concatenate([one[name] for one in wide]) for name in names}
            if rng is not None:
                mixed = rng.permutation(len(more[names[0]]))
                more = {name: array[mixed] for name, array in more.items()}
            waiting = {
                name: np.concatenate([waiting[name], more[name]]) if waiting else more[name]
                for name in names
            }
            whole = len(waiting[names[0]]) // batch_size * batch_size
            for place in range(0, whole, batch_size):
                yield {name: array[place : place + batch_size] for name, array in waiting.items()}
            waiting = {name: array[whole:] for name, array in waiting.items()}
        if len(waiting[names[0]]) and not drop_remainder:
            yield waiting
        epoch += 1
