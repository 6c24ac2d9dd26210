"""A batch of tasks padded on the host to a larger shape, and its answers cut to the smaller one."""

from types import ModuleType

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.engine import cores
from srt_jax.engine.eager import padded
from srt_jax.types import FREE, OUTSIDE, Array, Solution, Task


def padded_labels(labels: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Returns labels, int32 [B, L, H, W], padded to `shape`: what is added lies outside the map,
    layers that are added are free. The same array where it has that shape, since a copy takes as
    long as a stage of solving.
    """
    if labels.shape == shape:
        return labels
    wide = cores.empty(shape, np.int32)
    wide[:] = FREE
    wide[:, 0] = OUTSIDE
    wide[tuple(map(slice, labels.shape))] = labels
    return wide


def pad_batch(task: Task, shape: tuple[int, int, int, int, int]) -> Task:
    """Returns a batch [B, ...] padded on the host to `shape` (B, L, H, W, M); the tasks added end
    at once, START_BLOCKED.
    """
    host = jax.tree.map(np.asarray, task)
    obstacles, pairs = (shape[0], shape[4]), (shape[0], 2)
    return Task(
        labels=padded_labels(host.labels, shape[:4]),
        destroyable=padded(host.destroyable, obstacles, 0),
        removal_cost=padded(host.removal_cost, obstacles, 1),
        start=padded(host.start, pairs, 0),
        goal=padded(host.goal, pairs, 0),
        size=padded(host.size, pairs, 0),
    )


def with_slots(solution: Solution, max_destroyed: int, xp: ModuleType) -> Solution:
    """Returns the solution of a batch with room for `max_destroyed` obstacles, none of which it
    destroys more.
    """
    more = max_destroyed - solution.destroyed.shape[1]
    if not more:
        return solution
    # the acts of a plan: three for each obstacle, and the last walk
    room = {"destroyed": 1, "destroyed_at": 1, "plan": 3, "plan_at": 3}

    def fitted(name: str, num: int) -> Array:
        array = xp.asarray(getattr(solution, name))
        if more < 0:
            return array[:, : num * more]
        pads = ((0, 0), (0, num * more), (0, 0))[: array.ndim]
        return xp.pad(array, pads, constant_values=-1)

    return solution.replace(**{name: fitted(name, num) for name, num in room.items()})


def with_cells(solution: Solution, room: int) -> Solution:
    """Returns the solution of a batch with room for routes of `room` cells, where it has less."""
    cells = solution.cells
    more = room - cells.shape[1]
    if not more:
        return solution
    if not cores.is_on_host(cells):
        pads = ((0, 0), (0, more), (0, 0))
        return solution.replace(cells=jnp.pad(cells, pads, constant_values=-1))
    wide = cores.empty((len(cells), room, 2), np.int32)
    wide[:, : cells.shape[1]] = cells
    wide[:, cells.shape[1] :] = -1
    return solution.replace(cells=wide)


def cut(solution: Solution, task: Task, room: int) -> Solution:
    """Returns the solution of a padded batch without the padding that `task` does not have."""
    B, _, H, W = task.labels.shape
    M = task.destroyable.shape[1]
    some = jax.tree.map(lambda array: np.asarray(array)[:B], solution)
    of_map = {
        "contour": some.contour[:, :H, :W],
        "blocking": some.blocking[:, :M],
        "separating": some.separating[:, :M],
    }
    return some.replace(cells=some.cells[:, :room], **of_map)
