"""Data sets of labelled tasks: shards on disk, written one by one.

A folder holds `dataset.json` and shards of tasks in order: shard s holds tasks s * shard_size and
on. Task i depends on kind, size, seed and i alone, and a shard takes its name only once it is
whole; so whoever was interrupted asks again, and gets the same bytes as if nothing had happened.
One shard at a time is in memory.
"""

import json
import pathlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from srt_jax.dataset import shards
from srt_jax.dataset.labels import label_tasks
from srt_jax.formats.files import PathLike, atomic_write, make_folder, read_bytes
from srt_jax.instances.generate import generate
from srt_jax.task import stack
from srt_jax.types import FREE, OUTSIDE

MANIFEST = "dataset.json"
VERSION = 1


class Plan(NamedTuple):
    """What a data set is to hold; kept in `dataset.json`. `size` is (least, greatest) side; format
    one of `FORMATS`.

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

    def num_shards(self) -> int:
        """Returns how many shards hold the tasks."""
        return -(-self.count // self.shard_size)

    def file(self, folder: pathlib.Path, shard: int) -> pathlib.Path:
        """Returns the name of a shard's file."""
        return folder / f"shard-{shard:06d}.{shards.SUFFIXES[self.format]}"


def write_dataset(
    folder: PathLike,
    *,
    kind: str,
    count: int,
    size: int | tuple[int, int],
    seed: int = 0,
    shard_size: int = 1024,
    format: str = "npz",
    progress: Callable[[int], None] | None = None,
) -> Plan:
    """Writes the shards that are not there yet, and returns the plan; `progress` is called with the
    tasks of each shard.

    Args:
      folder: made where it is missing.
      kind, count, size, seed: of `srt_jax.instances.generate.generate`.
      shard_size: tasks in a shard, 1 or more.
      format: "npz" or "arrayrecord" (needs the extra `arrayrecord`).

    Raises:
      ValueError: a number out of range, or the folder holds a data set of another plan.
      ImportError: the format's package is missing.

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> plan.count, plan.shard_size
      (16, 8)
    """
    low, high = (size, size) if isinstance(size, int | np.integer) else size
    plan = Plan(kind, int(count), (int(low), int(high)), int(seed), int(shard_size), format)
    folder = pathlib.Path(folder)
    _check(plan)
    make_folder(folder)
    _settle(folder, plan)
    shards.remove_drafts(folder)
    for shard in range(plan.num_shards()):
        first = shard * plan.shard_size
        number = min(plan.shard_size, plan.count - first)
        if not plan.file(folder, shard).exists():
            shards.WRITERS[format](plan.file(folder, shard), _shard(plan, first, number))
        if progress:
            progress(number)
    return plan


def _check(plan: Plan) -> None:
    if plan.shard_size < 1:
        raise ValueError(f"shard_size must be at least 1, got {plan.shard_size}")
    if plan.format not in shards.WRITERS:
        raise ValueError(f"format must be one of {', '.join(shards.WRITERS)}, got {plan.format!r}")
    shards.require(plan.format)
    # refuses what it cannot make before a folder is made
    generate(plan.kind, count=1, size=plan.size, seed=plan.seed)
    if plan.count < 1:
        raise ValueError(f"count must be at least 1, got {plan.count}")


def _settle(folder: pathlib.Path, plan: Plan) -> None:
    """Writes the plan, or refuses the folder where it holds another one: another count is another
    plan too.
    """
    description = {**plan._asdict(), "size": list(plan.size), "version": VERSION}
    if (folder / MANIFEST).exists():
        there = _read_manifest(folder)
        differing = [name for name in description if there.get(name) != description[name]]
        if differing:
            name = differing[0]
            raise ValueError(
                f"{folder}: holds a data set of {name} {there.get(name)!r}, not"
                f" {description[name]!r}: name another folder, or request the same"
            )
        return
    with atomic_write(folder / MANIFEST) as file:
        json.dump(description, file, indent=1)


def _shard(plan: Plan, first: int, number: int) -> dict[str, np.ndarray]:
    """Returns the arrays of a shard, maps padded to the data set's greatest side."""
    instances = generate(plan.kind, count=number, size=plan.size, seed=plan.seed, first=first)
    tasks = [task for _, task, _ in instances]
    batch, labels = stack(tasks), label_tasks(tasks)
    side = plan.size[1]
    arrays = {"index": np.arange(first, first + number, dtype=np.int64)}
    arrays |= {
        name: np.asarray(value) for name, value in [*batch.items(), *labels._asdict().items()]
    }
    return {name: _padded(name, array, side) for name, array in arrays.items()}


_MAPS = {"first_blocker": False, "cost_to_go": np.inf, "correction": 0, "focal": 0}
"""The labels that are maps, and what is on padding."""


def _padded(name: str, array: np.ndarray, side: int) -> np.ndarray:
    if name != "labels" and name not in _MAPS:
        return array
    gap = [(0, 0)] * (array.ndim - 2) + [(0, side - length) for length in array.shape[-2:]]
    if name in _MAPS:
        return np.pad(array, gap, constant_values=_MAPS[name])
    padded = np.pad(array, gap, constant_values=FREE)
    outside = np.pad(np.zeros(array.shape[-2:], bool), gap[-2:], constant_values=True)
    padded[:, 0][:, outside] = OUTSIDE
    return padded


def read_plan(folder: PathLike) -> Plan:
    """Returns what a data set's folder says it holds; ValueError where it is none.

    Examples:
      >>> import tempfile
      >>> from srt_jax import dataset
      >>> folder = tempfile.mkdtemp()
      >>> plan = dataset.write_dataset(folder, kind="rooms", count=16, size=16, shard_size=8)
      >>> dataset.read_plan(folder) == plan
      True
    """
    description = _read_manifest(pathlib.Path(folder))
    if description.pop("version", None) != VERSION or set(description) != set(Plan._fields):
        raise ValueError(f"{folder}: {MANIFEST} is of another version: write the data set again")
    return Plan(**description)._replace(size=(description["size"][0], description["size"][1]))


def _read_manifest(folder: pathlib.Path) -> dict[str, Any]:
    try:
        description = json.loads(
            read_bytes(folder / MANIFEST, "data set's description", most=1 << 20)
        )
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{folder / MANIFEST}: is damaged, line {error.lineno}: write the data set again"
        ) from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{folder / MANIFEST}: is damaged: write the data set again") from error
    if not isinstance(description, dict):
        raise ValueError(
            f"{folder / MANIFEST}: is no description of a data set: write the data set again"
        )
    return description
