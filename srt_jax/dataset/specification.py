"""What a data set is to hold, and its shards as the units of a job."""

import pathlib
from typing import NamedTuple

import numpy as np

from srt_jax.dataset import shards
from srt_jax.dataset.labels import label_stacked
from srt_jax.instances.generate import generate
from srt_jax.scale.job import Job
from srt_jax.task import stack
from srt_jax.types import FREE, OUTSIDE


class Plan(NamedTuple):
    """What a data set is to hold; kept in `dataset.json`. `size` is (least, greatest) side; format
    "npz" or "arrayrecord"; mode and toll those of `solve`, "least" or "shortest".

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> plan.kind, plan.count, plan.size, plan.format
      ('rooms', 16, (16, 16), 'npz')
    """

    kind: str
    count: int
    size: tuple[int, int]
    seed: int
    shard_size: int
    format: str
    mode: str = "least"
    toll: float = 1.0

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of the arrays of a shard."""
        return shards.FIELDS + (shards.SHORTEST_FIELDS if self.mode == "shortest" else ())

    def num_shards(self) -> int:
        """Returns how many shards hold the tasks."""
        return -(-self.count // self.shard_size)

    def file(self, folder: pathlib.Path, shard: int) -> pathlib.Path:
        """Returns the name of a shard's file."""
        return folder / f"shard-{shard:06d}.{shards.SUFFIXES[self.format]}"


class DatasetJob(Job):
    """The shards of a data set in a folder."""

    def __init__(self, folder: pathlib.Path, plan: Plan) -> None:
        self.folder, self.plan = folder, plan

    def __len__(self) -> int:
        return self.plan.num_shards()

    def name(self, unit: int) -> str:
        return self.plan.file(self.folder, unit).name

    def num_tasks(self, unit: int) -> int:
        return min(self.plan.shard_size, self.plan.count - unit * self.plan.shard_size)

    def make(self, unit: int) -> None:
        arrays = _shard(self.plan, unit * self.plan.shard_size, self.num_tasks(unit))
        shards.WRITERS[self.plan.format](self.plan.file(self.folder, unit), arrays)


def _shard(plan: Plan, first: int, number: int) -> dict[str, np.ndarray]:
    """Returns the arrays of a shard, maps padded to the data set's greatest side."""
    instances = generate(plan.kind, count=number, size=plan.size, seed=plan.seed, first=first)
    tasks = [task for _, task, _ in instances]
    del instances
    batch = stack(tasks)
    # each map once in memory: the tasks look at their part of the batch
    for index, task in enumerate(tasks):
        layers, height, width = task.labels.shape
        tasks[index] = task.replace(labels=batch.labels[index, :layers, :height, :width])
    labels = label_stacked(tasks, batch, mode=plan.mode, toll=plan.toll)
    side = plan.size[1]
    arrays = {"index": np.arange(first, first + number, dtype=np.int64)}
    arrays |= {
        name: np.asarray(value)
        for name, value in [*batch.items(), *labels._asdict().items()]
        if value is not None
    }
    return {name: _padded(name, array, side) for name, array in arrays.items()}


_MAPS = {"first_blocker": False, "cost_to_go": np.inf, "correction": 0, "focal": 0}
"""The labels that are maps, and what is on padding."""


def _padded(name: str, array: np.ndarray, side: int) -> np.ndarray:
    if name != "labels" and name not in _MAPS:
        return array
    gap = [(0, 0)] * (array.ndim - 2) + [(0, side - length) for length in array.shape[-2:]]
    if not np.any(gap):  # the rule, and a copy would double the memory of a shard
        return array
    if name in _MAPS:
        return np.pad(array, gap, constant_values=_MAPS[name])
    padded = np.pad(array, gap, constant_values=FREE)
    outside = np.pad(np.zeros(array.shape[-2:], bool), gap[-2:], constant_values=True)
    padded[:, 0][:, outside] = OUTSIDE
    return padded
