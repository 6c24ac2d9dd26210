"""Many tasks of unequal size: grouped by size, solved in batches of one shape, each answer cut to its own map."""

from collections.abc import Callable, Sequence

import jax
import numpy as np

from srt_jax.shapes import batch_bucket, map_bucket
from srt_jax.solver import pad_batch, solve
from srt_jax.task import stack
from srt_jax.types import Solution, Task

_CELLS_AT_ONCE = 2**24  # 64 MiB of labels
_MOST_AT_ONCE = 256


def solve_many(
    tasks: Sequence[Task],
    *,
    mode: str = "least",
    max_destroyed: int = 8,
    max_cells: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Solution]:
    """Returns the solution of each of many single tasks, in their order, as NumPy arrays; an empty list for no task.

    Tasks are grouped by the bucket of their maps' sides and solved in batches, compiled once per group. `progress` is called
    with the number of tasks finished after each batch. Other arguments and errors as for `solve`; without `max_cells` the
    routes are given as much room as they need, so unlike there `cells` is no longer than that.
    """
    groups: dict[tuple[int, int, int], list[int]] = {}
    for index, task in enumerate(tasks):
        L, H, W = np.shape(task.labels)
        groups.setdefault((batch_bucket(L), *map_bucket(H, W)), []).append(index)
    solutions: dict[int, Solution] = {}
    for (L, height, width), members in sorted(groups.items()):
        M = max(8, batch_bucket(max(len(tasks[index].destroyable) for index in members)))
        at_once = max(1, min(_MOST_AT_ONCE, _CELLS_AT_ONCE // (L * height * width), batch_bucket(len(members))))
        for first in range(0, len(members), at_once):
            chunk = members[first : first + at_once]
            batch = pad_batch(stack([tasks[index] for index in chunk]), (at_once, L, height, width, M))
            answer = _with_room(batch, max_cells, mode=mode, max_destroyed=max_destroyed)
            solutions |= {index: _cut_to(answer, place, tasks[index]) for place, index in enumerate(chunk)}
            if progress:
                progress(len(chunk))
    return [solutions[index] for index in range(len(tasks))]


def _with_room(batch: Task, max_cells: int | None, *, mode: str, max_destroyed: int) -> Solution:
    """Returns the solutions; without `max_cells` with room for common routes, and again with more for longer ones."""
    room = max_cells or 4 * batch.labels.shape[-1]
    while True:
        answer = jax.tree.map(np.asarray, solve(batch, mode=mode, max_destroyed=max_destroyed, max_cells=room))
        longest = int(answer.num_cells.max())
        if max_cells is not None or longest <= room:
            return answer
        room = batch_bucket(2 * longest)  # in mode "paper" a route that stopped for want of room may be longer yet


def _cut_to(answer: Solution, place: int, task: Task) -> Solution:
    """Returns the solution at `place` of a padded batch, cut to its own task."""
    one = jax.tree.map(lambda array: array[place].copy(), answer)
    H, W = np.shape(task.labels)[-2:]
    return one.replace(contour=one.contour[:H, :W].copy(), blocking=one.blocking[: len(task.destroyable)].copy())
