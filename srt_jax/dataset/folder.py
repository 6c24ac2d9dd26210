"""Data sets of labelled tasks: shards on disk, written one by one, and read back in batches.

A folder holds `dataset.json` and shards of tasks in order: shard s holds tasks s * shard_size and
on. Task i depends on kind, size, seed and i alone, and a shard takes its name only once it is
whole; so whoever was interrupted asks again, and gets the same bytes as if nothing had happened.
One shard at a time is in memory of each process that works in the folder (`srt_jax.scale`).
"""

import pathlib
from collections.abc import Callable, Iterator

import numpy as np

from srt_jax import scale
from srt_jax.dataset import shards
from srt_jax.dataset.job import DatasetJob, Plan
from srt_jax.formats.files import PathLike, make_folder
from srt_jax.instances.generate import generate
from srt_jax.scale.manifest import read_manifest, settle
from srt_jax.scale.parts import as_part

MANIFEST = "dataset.json"
VERSION = 1


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
    workers: int | None = None,
    part: str | None = None,
    engine: str | None = None,
    address: str | None = None,
) -> Plan:
    """Writes the shards that are not there yet, and returns the plan; `progress` is called with the
    tasks of each shard.

    Any number of calls may write one folder at a time, on one machine or several that share it; the
    bytes are the same.

    Args:
      folder: made where it is missing.
      kind, count, size, seed: of `srt_jax.instances.generate.generate`.
      shard_size: tasks in a shard, 1 or more.
      format: "npz" or "arrayrecord" (needs the extra `arrayrecord`).
      workers: processes, one core each; None writes in this process.
      part: of the shards: "I/N", I from 0, or "slurm"; None for all.
      engine: None, "dask" or "ray" (extras of these names). address: of its scheduler; None starts
        one on this machine.

    Raises:
      ValueError: a number out of range, or the folder holds a data set of another plan.
      ImportError: the format's package, or the engine's, is missing.
      RuntimeError: a shard ended several workers in turn.

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
    folder, mine = pathlib.Path(folder), as_part(part)
    _check(plan)
    make_folder(folder)
    description = {**plan._asdict(), "size": list(plan.size), "version": VERSION}
    settle(folder, MANIFEST, description, "data set")
    scale.run(
        DatasetJob(folder.absolute(), plan),
        workers=workers,
        part=mine,
        engine=engine,
        address=address,
        progress=progress,
    )
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


def load(
    folder: PathLike,
    *,
    batch_size: int = 64,
    seed: int | None = None,
    epochs: int | None = 1,
    worker: tuple[int, int] = (0, 1),
    fields: tuple[str, ...] | None = None,
    drop_remainder: bool = False,
) -> Iterator[dict[str, np.ndarray]]:
    """Returns an iterator of batches: {name: array [batch, ...]}, all batches of one shape but the
    last of an epoch.

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
      >>> batch = next(dataset.load(folder, batch_size=8, seed=0, fields=("start", "cost_to_go")))
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
    missing = [shard for shard in range(plan.num_shards()) if not plan.file(folder, shard).exists()]
    if missing:
        raise ValueError(
            f"{folder}: {len(missing)} of {plan.num_shards()} shards are missing, the first is"
            f" {plan.file(folder, missing[0]).name}: write them with the same srt-jax dataset"
            " command again"
        )
    shape = np.max(
        [
            shards.SHAPES[plan.format](plan.file(folder, shard))
            for shard in range(plan.num_shards())
        ],
        axis=0,
    )
    widths = {"L": int(shape[0]), "M": int(shape[1])}
    names = shards.FIELDS if fields is None else fields
    unknown = [name for name in names if name not in shards.FIELDS]
    if unknown:
        raise ValueError(
            f"no field is called {unknown[0]!r}: choose among {', '.join(shards.FIELDS)}"
        )
    return _batches(
        folder, plan, widths, tuple(names), batch_size, seed, epochs, worker, drop_remainder
    )


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
    description = read_manifest(pathlib.Path(folder) / MANIFEST, "data set")
    if description.pop("version", None) != VERSION or set(description) != set(Plan._fields):
        raise ValueError(f"{folder}: {MANIFEST} is of another version: write the data set again")
    return Plan(**description)._replace(size=(description["size"][0], description["size"][1]))


_AT_ONCE = 4
"""Shards in memory while shuffling."""


def _batches(folder, plan, widths, names, batch_size, seed, epochs, worker, drop_remainder):
    epoch = 0
    while epochs is None or epoch < epochs:
        rng = None if seed is None else np.random.default_rng([seed, epoch])
        order = np.arange(plan.num_shards()) if rng is None else rng.permutation(plan.num_shards())
        mine = order[worker[0] :: worker[1]]
        waiting: dict[str, np.ndarray] = {}
        for first in range(0, len(mine), _AT_ONCE):
            read = [
                shards.READERS[plan.format](plan.file(folder, int(s)), names)
                for s in mine[first : first + _AT_ONCE]
            ]
            wide = [
                {name: shards.widen(name, array, widths) for name, array in one.items()}
                for one in read
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
