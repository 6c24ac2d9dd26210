"""As near as one gets: the shortest route to the reachable cell nearest the goal (PY16 §3.2, the
seed).

A function of its own and no array of `Solution`: as one it would double the largest array of every
answer, and put a flood and a path search into every program of `solve`, for tasks that are solved
as well. `Solution.approach` calls it when it is first asked for.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole
from sign_model.foundation.sizes import next_power_of_two
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.batching import batch_kernel, each_or_all
from srt_jax.engine.entrance import require_task
from srt_jax.moves import max_path_cells, octile_distance
from srt_jax.paths.reach import flood_group
from srt_jax.paths.seed import nearest_in_words
from srt_jax.paths.shortest import path_of_map
from srt_jax.types import FREE, Approach, Array, Task

_FORMS = {"labels": (np.int32, 3), "start": (np.int32, 1), "goal": (np.int32, 1)}


def approach(task: Task, *, max_cells: int | None = None) -> Approach:
    """Returns the way as near to the goal as one gets with nothing destroyed; num_cells 0 and gap
    inf where no cell is free.

    It leads to the cell nearest the goal among those reachable from the start, which is
    `Solution.seed` where nothing else is wrong with the task, and to the goal itself where a path
    exists. Where the start is blocked, or lies outside the map, it begins in the free cell nearest
    to it; where the goal is, it ends as near as can be reached. Nearness is octile distance,
    compared without rounding; ties go to the lowest row, then the lowest column (as for
    `seed_cell`). The route is `shortest_path` between the two. One task or any batch of them; may
    be called inside jit, vmap and scan; the same bits whatever the batch around a task.

    Args:
      task: from `make_task`, `rasterize` or `stack`; only its labels and ends count.
      max_cells: as in `shortest_path`.

    Returns:
      Approach.

    Raises:
      TypeError, ValueError: an array of the task has a wrong dtype or shape, or max_cells < 1.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6), destroyable=False)
      >>> near = srt_jax.approach(task)
      >>> near.end.tolist(), near.cost.item(), near.gap.item()
      ([2, 2], 2.0, 4.0)
      >>> srt_jax.check(task, srt_jax.solve(task), approach=near)
      []
    """
    require_task("approach", task)
    arguments.require_forms(task, _FORMS)
    for name in ("start", "goal"):
        arguments.as_cells(f"task.{name}", getattr(task, name))
    labels = task.labels
    batch = arguments.common_batch(labels=(labels, 3), start=(task.start, 1), goal=(task.goal, 1))
    if max_cells is not None and max_cells < 1:
        raise ValueError(f"max_cells must be at least 1, got {max_cells}: a route holds its start")
    is_traced = arguments.is_traced(labels, task.start, task.goal)
    free = ((labels if is_traced else np.asarray(labels)) == FREE).all(axis=-3)

    def call(room: int) -> Approach:
        found = eager.call(_approach_maps, batch, free, task.start, task.goal, max_cells=room)
        return Approach(**found)

    most = max(1, max_path_cells(*labels.shape[-2:]))
    if max_cells is not None or is_traced:
        return call(int(max_cells or most))
    # as much room as most routes need; more for all, if one needs it
    room = min(next_power_of_two(2 * max(labels.shape[-2:])), most)
    found = call(room)
    longest = int(jnp.max(found.num_cells, initial=0))
    return found if longest <= room else call(next_power_of_two(longest))


def _approach_maps(free: Array, start: Array, goal: Array, *, max_cells: int) -> dict[str, Array]:
    def one_map(free: Array, start: Array, goal: Array) -> dict[str, Array]:
        return _approach_of_map(free, start, goal, max_cells)

    return batch_kernel(compiled_whole(each_or_all(one_map)))(free, start, goal)


def _approach_of_map(free: Array, start: Array, goal: Array, max_cells: int) -> dict[str, Array]:
    """Returns the fields of `Approach` of one map: free bool [H, W], start and goal int32 [2]."""
    height, width = free.shape
    words = packing.pack(free[None])[0]

    def nearest_of(phase: Array, state: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        # One body for both ends: first the free cell nearest the start, and what is reached from
        # there; then the cell of that which is nearest the goal.
        cells, begin, _ = state
        is_first = phase == 0
        near = nearest_in_words(cells, jnp.where(is_first, start, goal), width)
        source = packing.words_of_cell(near[None], height, width)[0] & words
        reached = lax.cond(
            is_first,
            lambda: flood_group(words, source, group=1, through_corners=False),
            lambda: cells,
        )
        return reached, jnp.where(is_first, near, begin), near

    nowhere = jnp.full(2, -1, jnp.int32)
    _, begin, end = lax.fori_loop(jnp.int32(0), jnp.int32(2), nearest_of, (words, nowhere, nowhere))
    (cells, num_cells, cost), _ = path_of_map(words, begin, end, width, max_cells)
    gap = jnp.where(num_cells > 0, octile_distance(end, goal), jnp.inf)
    return {
        "cells": cells,
        "num_cells": num_cells,
        "cost": cost,
        "begin": begin,
        "end": end,
        "gap": gap,
    }
