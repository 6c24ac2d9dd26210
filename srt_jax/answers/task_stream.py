"""The tasks of a file one by one: how many there are, and those from one number to another.

Tasks on one map share its labels; what differs from task to task, such as a blocker, is made when
the task is asked for. So the rows of a scenario take the memory of its maps and of one task.
"""

import dataclasses
import functools
import os
import pathlib
import zipfile
from collections.abc import Iterator

from srt_jax.formats.containers.arrays import read_header
from srt_jax.formats.movingai import read_scen
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading, Source, read_source, require_file
from srt_jax.formats.shared.whole_files import FileError
from srt_jax.formats.task_files import UnfitBlocker, prepared
from srt_jax.geometry.frame import Frame
from srt_jax.task import NamedTask


def count_tasks(path: str, how: Reading) -> int:
    """Returns how many tasks of a file are to be read, as `Reading.limit` and `rows` choose;
    a map or place counts as one, unread.

    Raises:
      ValueError: the file is missing, or is no scenario or batch although its name says so.
    """
    return len(_chosen(path, how))


def tasks_between(
    path: str, how: Reading, destroyable: str | None, first: int, last: int, notes: Notes
) -> Iterator[tuple[NamedTask, Frame | None]]:
    """Yields tasks `first` to `last - 1` of those that `count_tasks` counts, as
    `task_files.read_tasks` has them, each with where its map lies in metres.

    Tasks that no blocker fits are left out and noted.

    Raises:
      ValueError: as `read_tasks`.
    """
    numbers = _chosen(path, how)[first:last]
    if not len(numbers):
        return
    ending = pathlib.Path(path).suffix.lower()
    some = dataclasses.replace(how, rows=(numbers.start, numbers.stop), limit=None)
    if ending == ".npz":
        # read whole in any case, and asked for again by the next unit
        whole = dataclasses.replace(how, rows=None, limit=None)
        source = _kept_batch(path, whole, os.stat(path).st_mtime_ns)
        source = source._replace(tasks=source.tasks[numbers.start : numbers.stop])
    else:
        source = read_source(path, some if ending == ".scen" else how, notes)
    unfit = 0
    for named in source.tasks:
        try:
            task = prepared(path, named.task, destroyable, how.block)
        except UnfitBlocker:
            # alone in its file, it is what the user asked for
            if ending not in (".scen", ".npz"):
                raise
            unfit += 1
            continue
        yield named._replace(task=task), source.frame
    notes.add(f"tasks left out: --block {how.block} does not fit between start and goal", unfit)


def _chosen(path: str, how: Reading) -> range:
    """Returns the numbers of the rows or tasks that are chosen; one for what has no rows."""
    require_file(path)
    ending = pathlib.Path(path).suffix.lower()
    if ending not in (".scen", ".npz"):
        return range(1)
    number = len(read_scen(path)) if ending == ".scen" else _num_tasks(path)
    chosen = [index for index, _ in how.chosen(path, range(number))]
    return range(chosen[0], chosen[-1] + 1) if chosen else range(0)


@functools.lru_cache(maxsize=1)
def _kept_batch(path: str, how: Reading, written: int) -> Source:
    return read_source(path, how, Notes())


def _num_tasks(path: str) -> int:
    """Returns the tasks of a batch by the head of one of its arrays."""
    try:
        with zipfile.ZipFile(path) as archive, archive.open("start.npy") as file:
            return read_header(file)[0][0]
    # the zip reader and NumPy raise whatever their code runs into on damaged bytes
    except Exception as error:
        raise FileError(
            f"{path}: no batch of tasks, or a damaged one: srt_jax.write_batch makes one"
        ) from error
