"""Many tasks of unequal size: grouped by size, solved in batches of one shape, each answer cut to
its own map.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from srt_jax.engine.buckets import batch_bucket, map_bucket, obstacle_bucket
from srt_jax.padding import pad_batch, with_slots
from srt_jax.solver import MAX_BRANCHES, solve
from srt_jax.task import stack
from srt_jax.types import Solution, Status, Task

_CELLS_AT_ONCE = 2**24  # 64 MiB of labels
_MOST_AT_ONCE = 256
_COMMON_NUMBER = 64
"""Obstacles that hardly any task needs destroyed: the time to compile grows with the room for
more.
"""
_WORTH_COMPILING = 2**26  # cells of labels: some seconds of solving


def solve_many(
    tasks: Sequence[Task],
    *,
    mode: str = "least",
    toll: float | Sequence[float] = 1.0,
    max_destroyed: int = 8,
    max_cells: int | None = None,
    max_branches: int = MAX_BRANCHES,
    progress: Callable[[int], None] | None = None,
) -> list[Solution]:
    """Returns the solution of each of many single tasks, in their order, as NumPy arrays; an empty
    list for no task.

    Tasks are grouped by the bucket of their maps' sides and solved in batches, compiled once per
    group. `toll` is one for all, or one for each task. `progress` is called with the number of
    tasks finished after each batch. Other arguments and errors as for `solve`; without `max_cells`
    the routes are given as much room as they need, so unlike there `cells` is no longer than that.
    The work is done on JAX's default device, whatever device the tasks lie on: `with
    jax.default_device(device):` chooses another.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> small = srt_jax.make_task(np.ones((2, 2), bool), (0, 0), (1, 1))
      >>> [solution.num_cells.item() for solution in srt_jax.solve_many([task, small])]
      [7, 2]
    """
    solutions: dict[int, Solution] = {}
    tolls = _toll_of_each(toll, len(tasks))
    # The largest first: what is compiled for them serves the smaller ones as well.
    groups = sorted(_groups(tasks).items(), key=lambda group: -math.prod(group[0]))
    for (L, height, width), members in groups:
        M = obstacle_bucket(max(len(tasks[index].destroyable) for index in members))
        at_once = max(
            1,
            min(_MOST_AT_ONCE, _CELLS_AT_ONCE // (L * height * width), batch_bucket(len(members))),
        )
        for first in range(0, len(members), at_once):
            chunk = members[first : first + at_once]
            batch = pad_batch(
                stack([tasks[index] for index in chunk]), (at_once, L, height, width, M)
            )
            own_tolls = np.zeros(at_once, np.float32)
            own_tolls[: len(chunk)] = tolls[chunk]
            options = {"mode": mode, "toll": own_tolls, "max_branches": max_branches}
            answer = _with_room(batch, max_cells, max_destroyed, **options)
            solutions |= {
                index: _cut_to(answer, place, tasks[index]) for place, index in enumerate(chunk)
            }
            if progress:
                progress(len(chunk))
    return [solutions[index] for index in range(len(tasks))]


def _toll_of_each(toll: float | Sequence[float], number: int) -> np.ndarray:
    """Returns the toll of each task, float32 [number]; their values are checked by `solve`."""
    given = np.asarray(toll, np.float32)
    if given.shape not in ((), (number,)):
        raise ValueError(
            f"toll must be a number, or one for each of {number} tasks, got {list(given.shape)}"
        )
    return np.broadcast_to(given, number)


def _groups(tasks: Sequence[Task]) -> dict[tuple[int, int, int], list[int]]:
    """Returns the tasks' indices by the shape (L, H, W) to which they are padded.

    Padding costs work and another shape costs compiling: a shape gets its own group where its maps
    are worth that, else they join the others of the next powers of two.
    """
    fine: dict[tuple[int, int, int], list[int]] = {}
    for index, task in enumerate(tasks):
        L, H, W = np.shape(task.labels)
        fine.setdefault((batch_bucket(L), *map_bucket(H, W)), []).append(index)
    groups: dict[tuple[int, int, int], list[int]] = {}
    for (L, H, W), members in sorted(fine.items()):
        is_worth_it = len(members) * L * H * W >= _WORTH_COMPILING
        groups.setdefault((L, H, W) if is_worth_it else _coarse(L, H, W), []).extend(members)
    return groups


def _coarse(L: int, H: int, W: int) -> tuple[int, int, int]:
    layers = 4 ** (L.bit_length() // 2)  # L is a power of two: 1, 4, 16, ...
    height, width = batch_bucket(H), batch_bucket(W)
    side = max(height, width)
    return (layers, side, side) if side <= 2 * min(height, width) else (layers, height, width)


def _with_room(batch: Task, max_cells: int | None, max_destroyed: int, **options: Any) -> Solution:
    """Returns the solutions, with room for common routes and numbers of obstacles, and again with
    more for greater ones.

    With `max_cells` there is no more room for the route than that.
    """
    room, slots = max_cells or 16 * batch.labels.shape[-1], min(max_destroyed, _COMMON_NUMBER)
    while True:
        answer = jax.tree.map(
            np.asarray, solve(batch, max_cells=room, max_destroyed=slots, **options)
        )
        longest = int(answer.num_cells.max())
        is_too_long = answer.num_cells > room
        # In mode "paper" what stopped for want of room may need more yet.
        is_short_of_slots = (
            (slots < max_destroyed) & (answer.status == Status.BUDGET_SPENT) & ~is_too_long
        )
        if max_cells is None and longest > room:
            room = batch_bucket(2 * longest)
        elif is_short_of_slots.any():
            slots = min(
                max_destroyed, batch_bucket(max(2 * slots, int(answer.num_destroyed.max())))
            )
        else:
            return with_slots(answer, max_destroyed, np)


def _cut_to(answer: Solution, place: int, task: Task) -> Solution:
    """Returns the solution at `place` of a padded batch, cut to its own task."""
    one = jax.tree.map(lambda array: array[place].copy(), answer)
    (H, W), M = np.shape(task.labels)[-2:], len(task.destroyable)
    ids = {name: getattr(one, name)[:M].copy() for name in ("blocking", "separating")}
    return one.replace(contour=one.contour[:H, :W].copy(), **ids)
