"""Data sets of labelled tasks: shards on disk, written one by one.

A folder holds `dataset.json` and shards of tasks in order: shard s holds tasks s * shard_size and
on. Task i depends on kind, size, seed and i alone, and a shard takes its name only once it is
whole; so whoever was interrupted asks again, and gets the same bytes as if nothing had happened.
One shard at a time is in memory of each process that works in the folder (`srt_jax.scale`).
"""

import pathlib
from collections.abc import Callable

import numpy as np

from srt_jax import scale
from srt_jax.dataset import shards
from srt_jax.dataset.specification import DatasetJob, Plan
from srt_jax.formats.shared.whole_files import PathLike, make_folder
from srt_jax.instances.generate import generate
from srt_jax.scale.manifest import read_manifest, settle
from srt_jax.scale.parts import as_part
from srt_jax.tolls.toll_option import toll_of_each

MANIFEST = "dataset.json"
VERSION = 1
_MODE = ("mode", "toll")
_MODES = ("least", "shortest")


def write_dataset(
    folder: PathLike,
    *,
    kind: str,
    count: int,
    size: int | tuple[int, int],
    seed: int = 0,
    shard_size: int = 1024,
    format: str = "npz",
    mode: str = "least",
    toll: float = 1.0,
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
      mode, toll: of `solve`. "least", or "shortest": whether to break or to go round, with the
        fields `breaks`, `total` and `total_bound` besides.
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
    plan = plan._replace(mode=mode, toll=float(toll))
    folder, mine = pathlib.Path(folder), as_part(part)
    _check(plan)
    make_folder(folder)
    description = {**plan._asdict(), "size": list(plan.size), "version": VERSION}
    if mode == "least":  # what was written before there were modes stays as it is
        description = {name: value for name, value in description.items() if name not in _MODE}
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
    if plan.mode not in _MODES:
        raise ValueError(f"mode must be one of {', '.join(_MODES)}, got {plan.mode!r}")
    if plan.mode == "least" and plan.toll != 1:
        raise ValueError(f"toll is {plan.toll}: only mode shortest weighs tolls against length")
    toll_of_each(plan.toll, (), plan.mode)
    shards.require(plan.format)
    # refuses what it cannot make before a folder is made
    generate(plan.kind, count=1, size=plan.size, seed=plan.seed)
    if plan.count < 1:
        raise ValueError(f"count must be at least 1, got {plan.count}")


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
    if description.pop("version", None) != VERSION or (
        set(description) | set(_MODE) != set(Plan._fields)
    ):
        raise ValueError(f"{folder}: {MANIFEST} is of another version: write the data set again")
    return Plan(**description)._replace(size=(description["size"][0], description["size"][1]))
