"""Answers by the million: shards of some thousand tasks in a folder, each written whole or not at
all, by any number of processes (`srt_jax.scale`).

A folder holds `_solve.json`, which says what was asked for, and `answers-000000.parquet` and on, or
`.jsonl`, a line of JSON a task, where pyarrow is not installed. Shard s holds the tasks s *
shard_size and on, of all inputs in their order; those that no blocker fits are left out.
"""

import collections
import contextlib
import dataclasses
import hashlib
import json
import os
import pathlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import jax
import numpy as np

from sign_model.foundation.legible import counted
from srt_jax.answers.results_file import arrow_table, as_record, read_results
from srt_jax.answers.task_stream import count_tasks, tasks_between
from srt_jax.check import check
from srt_jax.formats.movingai import read_scen
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.shared.whole_files import atomic_write, require_module
from srt_jax.geometry.frame import Frame
from srt_jax.many_tasks import solve_many
from srt_jax.paths.approach import approach
from srt_jax.scale.job import Job
from srt_jax.scale.manifest import read_manifest, settle
from srt_jax.task import NamedTask
from srt_jax.types import Status

MANIFEST = "_solve.json"
"""Readers of tables, such as pandas and pyarrow, pass over names that begin with _."""
SHARD_SIZE = 4096
_VERSION = 1
_WHAT = "run of srt-jax solve"
_ROWS_AT_ONCE, _CELLS_AT_ONCE = 256, 2**18
"""Records, and cells of their routes, after which those in memory are written; as lists of Python,
which they are until then, 2**18 cells take 25 MB, and a route through a maze has 2**16.
"""


@dataclasses.dataclass(frozen=True)
class Request:
    """What is asked for.

    inputs: names of files. counts: the tasks of each. mode, toll, max_destroyed: of `solve`.
    format: "parquet" or "jsonl".
    """

    inputs: tuple[str, ...]
    counts: tuple[int, ...]
    reading: Reading = dataclasses.field(default_factory=Reading)
    destroyable: str | None = None
    mode: str = "least"
    toll: float = 1.0
    max_destroyed: int = 8
    shard_size: int = SHARD_SIZE
    format: str = "parquet"


def count_all(inputs: Sequence[str], reading: Reading) -> tuple[int, ...]:
    """Returns how many tasks each input holds; errors as `count_tasks`."""
    return tuple(count_tasks(path, reading) for path in inputs)


def format_of(folder: pathlib.Path) -> str:
    """Returns the format of a folder's shards: the one it has, else Parquet where it can be
    written.
    """
    if (folder / MANIFEST).exists():
        return str(read_manifest(folder / MANIFEST, _WHAT).get("format"))
    with contextlib.suppress(ImportError):
        require_module("pyarrow.parquet", extra="parquet", what="writing Parquet")
        return "parquet"
    return "jsonl"


class SolveJob(Job):
    """The shards of a request in a folder."""

    def __init__(self, folder: pathlib.Path, request: Request) -> None:
        self.folder, self.request = folder, request

    @property
    def total(self) -> int:
        """The tasks of all inputs."""
        return sum(self.request.counts)

    def __len__(self) -> int:
        return len(range(0, self.total, self.request.shard_size))

    def name(self, unit: int) -> str:
        return f"answers-{unit:06d}.{self.request.format}"

    def num_tasks(self, unit: int) -> int:
        size = self.request.shard_size
        return min(size, self.total - unit * size)

    def make(self, unit: int) -> None:
        notes = Notes()
        with _writer(self.folder / self.name(unit), self.request.format) as write:
            records: list[dict[str, Any]] = []
            cells = 0
            for record in self._records(unit, notes):
                records.append(record)
                cells += _num_cells(record)
                if len(records) == _ROWS_AT_ONCE or cells >= _CELLS_AT_ONCE:
                    write(records)
                    records, cells = [], 0
            write(records)

    def statuses(self, unit: int) -> collections.Counter[str]:
        """Returns how many answers of each status a shard holds."""
        path = self.folder / self.name(unit)
        if self.request.format == "jsonl":
            with open(path, encoding="utf-8") as file:
                return collections.Counter(json.loads(line)["status"] for line in file)
        parquet = require_module("pyarrow.parquet", extra="parquet", what="reading Parquet")
        column = parquet.read_table(path, columns=["status"])["status"]
        return collections.Counter(column.to_pylist())

    def records(self, unit: int) -> list[dict[str, Any]]:
        """Returns the records that a shard holds."""
        path = self.folder / self.name(unit)
        if self.request.format == "parquet":
            return read_results(path)
        with open(path, encoding="utf-8") as file:
            return [json.loads(line) for line in file]

    def _tasks(self, unit: int, notes: Notes) -> Iterator[tuple[NamedTask, Frame | None]]:
        """Yields the tasks of a shard, from one input or several."""
        request = self.request
        first = unit * request.shard_size
        last = first + self.num_tasks(unit)
        begin = 0
        for path, count in zip(request.inputs, request.counts):
            low, high = max(first - begin, 0), min(last - begin, count)
            if low < high:
                yield from tasks_between(
                    path, request.reading, request.destroyable, low, high, notes
                )
            begin += count

    def _records(self, unit: int, notes: Notes) -> Iterator[dict[str, Any]]:
        """Yields the answers of a shard, each replayed."""
        request = self.request
        waiting: collections.deque[tuple[NamedTask, Frame | None]] = collections.deque()

        def coming() -> Iterator[Any]:
            for named, frame in self._tasks(unit, notes):
                waiting.append((named, frame))
                yield named.task

        solutions = solve_many(
            coming(), mode=request.mode, toll=request.toll, max_destroyed=request.max_destroyed
        )
        for solution in solutions:
            (name, task), frame = waiting.popleft()
            is_solved = Status(int(solution.status)).is_solved
            near = None if is_solved else jax.tree.map(np.asarray, approach(task))
            problems = check(task, solution, mode=request.mode, toll=request.toll, approach=near)
            if problems:
                raise AssertionError(
                    f"{name}: a solution failed its replay, please report it: {'; '.join(problems)}"
                )
            side = frame.side if frame is not None and frame.has_metres else None
            yield as_record(name, task, solution, cell_side=side, frame=frame, approach=near)


def _num_cells(record: dict[str, Any]) -> int:
    """Returns how many cells the lists of a record hold, all but a few of its bytes."""
    near = record["approach"]
    return len(record["cells"]) + len(record["contour"]) + (len(near["cells"]) if near else 0)


def settled_job(folder: pathlib.Path, request: Request) -> SolveJob:
    """Returns the job of a request in a folder, whose description is written there, or is the
    same; ValueError where the folder holds another one.
    """
    settle(folder, MANIFEST, _description(request), _WHAT)
    # workers may have another folder to start from
    reading = request.reading
    others = {
        name: os.path.abspath(path)
        for name in ("labels", "tags")
        if (path := getattr(reading, name)) is not None
    }
    request = dataclasses.replace(
        request,
        inputs=tuple(map(os.path.abspath, request.inputs)),
        reading=dataclasses.replace(reading, **others),
    )
    return SolveJob(folder.absolute(), request)


def read_job(folder: pathlib.Path) -> SolveJob:
    """Returns the job that a folder says it holds, to tell how far it is; it makes nothing."""
    known = read_manifest(folder / MANIFEST, _WHAT)
    try:
        if known["version"] != _VERSION:
            raise KeyError("version")
        request = Request(
            inputs=tuple(known["inputs"]),
            counts=tuple(map(int, known["counts"])),
            shard_size=int(known["shard_size"]),
            format=str(known["format"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{folder}: {MANIFEST} is of another version: name another folder"
        ) from error
    return SolveJob(folder, request)


def read_answers(folder: pathlib.Path) -> list[dict[str, Any]]:
    """Returns the records of all answers in a folder that `srt-jax solve --out` wrote: of its
    shards, or else of its results.json.

    Raises:
      ValueError: it holds neither, or shards are missing.
    """
    if not (folder / MANIFEST).is_file():
        if not (folder / "results.json").is_file():
            raise ValueError(
                f"{folder}: holds neither {MANIFEST} nor results.json: name a folder that srt-jax"
                " solve --out wrote"
            )
        return read_results(folder / "results.json")
    job = read_job(folder)
    missing = [unit for unit in range(len(job)) if not (folder / job.name(unit)).is_file()]
    if missing:
        raise ValueError(
            f"{folder}: {len(missing)} of {counted(len(job), 'shard')} missing, the first is"
            f" {job.name(missing[0])}: run the command that writes them again"
        )
    return [record for unit in range(len(job)) for record in job.records(unit)]


def _description(request: Request) -> dict[str, Any]:
    """Returns what decides the bytes: the request and the content of all files it reads."""
    fields = {field.name: getattr(request, field.name) for field in dataclasses.fields(request)}
    reading = dataclasses.asdict(fields.pop("reading"))
    given = fields | reading | {"content_of_inputs": _digest(request), "version": _VERSION}
    return json.loads(json.dumps(given, default=str))


def _digest(request: Request) -> str:
    """Returns a digest of all inputs, and of the maps, labels and rules that they need."""
    whole = hashlib.sha256()
    others = [name for name in (request.reading.labels, request.reading.tags) if name]
    for path in (*request.inputs, *others):
        needed = [pathlib.Path(path)]
        if needed[0].suffix.lower() == ".scen":
            maps = sorted({row.map_name for row in read_scen(path)})
            needed += [needed[0].with_name(name) for name in maps]
        for file in needed:
            if file.is_file():
                with open(file, "rb") as opened:
                    whole.update(hashlib.file_digest(opened, "sha256").digest())
    return whole.hexdigest()[:32]


@contextlib.contextmanager
def _writer(path: pathlib.Path, format: str) -> Iterator[Callable[[list[dict[str, Any]]], None]]:
    """Yields what writes some records more; the file appears when all are written."""
    if format == "jsonl":
        with atomic_write(path) as file:
            yield lambda records: file.writelines(f"{json.dumps(one)}\n" for one in records)
        return
    arrow = require_module("pyarrow", extra="parquet", what="writing Parquet")
    parquet = require_module("pyarrow.parquet", extra="parquet", what="writing Parquet")
    with (
        atomic_write(path, "wb") as file,
        parquet.ParquetWriter(file, arrow_table(arrow, []).schema) as writer,
    ):
        yield lambda records: writer.write_table(arrow_table(arrow, records))
