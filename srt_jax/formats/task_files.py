"""Tasks from any file that `srt-jax solve` reads; the ending of its name decides the format
(`reading`).
"""

from collections.abc import Collection, Sequence

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Cell as Cell
from srt_jax.formats.reading import Reading, Source, read_source
from srt_jax.instances.paper_blockers import block, require_kind
from srt_jax.task import NamedTask
from srt_jax.types import Task


def read_tasks(
    path: str,
    *,
    start: Cell | None = None,
    goal: Cell | None = None,
    destroyable: str | None = None,
    repair: bool = False,
    reading: Reading | None = None,
    notes: Notes | None = None,
) -> list[NamedTask]:
    """Returns the tasks in a file: one of a map, a place or a world, each of a .scen or .npz.

    Args:
      start, goal, repair: as in `Reading`, for those who need no more of it.
      destroyable: "all", "none" or ids such as "3,7"; None keeps what the file says (maps: all).
      notes: receives what was odd, and what was chosen where nobody said.

    Raises:
      ValueError: the file cannot be read, or start or goal cannot be where they are.
    """
    how = reading or Reading(start=start, goal=goal, repair=repair)
    return read_prepared(path, how, destroyable, Notes() if notes is None else notes).tasks


def read_prepared(path: str, how: Reading, destroyable: str | None, notes: Notes) -> Source:
    """Returns what a file holds, with its tasks as `read_tasks` has them, and where its map lies in
    metres.
    """
    source = read_source(path, how, notes)
    return source._replace(tasks=all_prepared(path, source.tasks, destroyable, how.block, notes))


def all_prepared(
    path: str, tasks: Sequence[NamedTask], destroyable: str | None, kind: str | None, notes: Notes
) -> list[NamedTask]:
    """Returns the tasks of a file, with obstacles destroyable and the goal cut off as `read_tasks`
    has it.

    Of several tasks those that no blocker fits are left out and noted.

    Raises:
      ValueError: no blocker fits any of them, or there is but one; or what is wrong for every task.
    """
    kept, unfit = [], []
    for named in tasks:
        try:
            kept.append(named._replace(task=prepared(path, named.task, destroyable, kind)))
        except UnfitBlocker as error:
            unfit.append((named.name, error))
    if unfit and not kept:
        raise ValueError(
            str(unfit[0][1])
            + (f"; nor does it fit any other of the {len(unfit)} tasks" if unfit[1:] else "")
        )
    notes.add(
        f"tasks left out: --block {kind} does not fit between start and goal",
        len(unfit),
        example=unfit[0][0] if unfit else "",
    )
    return kept


class UnfitBlocker(ValueError):
    """A blocker of this kind does not fit between the start and the goal of one task."""


def prepared(path: str, task: Task, destroyable: str | None, kind: str | None) -> Task:
    """Returns the task with obstacles destroyable as `read_tasks` has it, and the goal cut off as
    `Reading.block` has it.
    """
    task = _with_flags(path, task, destroyable)
    return task if kind is None else _with_blocker(path, task, kind)


def _with_blocker(path: str, task: Task, kind: str) -> Task:
    num_obstacles = len(task.destroyable)
    start, goal = ((int(row), int(col)) for row, col in (task.start, task.goal))
    try:
        require_kind(kind)
    except ValueError as error:
        raise ValueError(f"{path}: --block {error}") from error
    try:
        labels, blocker = block(task.labels, start, goal, kind)
    except ValueError as error:
        raise UnfitBlocker(f"{path}: --block {error}") from error
    # ids in between belong to obstacles that cover no cell
    labels[labels == blocker] = num_obstacles
    flags, costs = np.append(task.destroyable, True), np.append(task.removal_cost, np.float32(1))
    return task.replace(labels=labels, destroyable=flags, removal_cost=costs)


def _with_flags(path: str, task: Task, destroyable: str | None) -> Task:
    if destroyable is None:
        return task
    num_obstacles = len(task.destroyable)
    ids = {"all": range(num_obstacles), "none": ()}.get(destroyable)
    wanted = _ids(destroyable) if ids is None else ids
    wrong = [i for i in wanted if not 0 <= i < num_obstacles]
    if wrong:
        raise ValueError(
            f"{path}: --destroyable names obstacle {wrong[0]}, but the ids there are 0 to"
            f" {num_obstacles - 1}"
        )
    covers = np.isin(np.arange(num_obstacles), task.labels)
    return task.replace(destroyable=np.isin(np.arange(num_obstacles), list(wanted)) & covers)


def _ids(text: str) -> Collection[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(
            f"--destroyable must be all, none or ids such as 3,7, got {text!r}"
        ) from None
