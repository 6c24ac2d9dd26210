"""Tasks on the host: one from arrays, many as one padded batch, and back (PY16 §2)."""

import dataclasses
import warnings
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple, overload

import jax
import numpy as np

from srt_jax.components import label
from srt_jax.engine.arguments import as_cells
from srt_jax.engine.cores import empty
from srt_jax.engine.entrance import (
    how_to_make_a_task,
    require_answer,
    require_listed,
    require_task,
    require_tasks,
    require_values,
)
from srt_jax.types import FREE, OUTSIDE, Array, Solution, Status, Task, of_task

_MAX_OBSTACLES = 1 << 24
"""Beyond this an id is no number of an obstacle but something else (a colour, an OpenStreetMap id).
"""


_ENOUGH = 64
"""Cells from which on two obstacles that leave no cell free are no likely map."""


def make_task(
    free_or_labels: Array,
    start: Array | Sequence[int],
    goal: Array | Sequence[int],
    *,
    destroyable: bool | Array | Collection[int] = True,
    removal_cost: float | Array | Sequence[float] = 1.0,
) -> Task:
    """Returns the task on one map; M is 1, an indestructible obstacle that covers nothing, where
    the map has no obstacle.

    PY16 §2. Start or goal on an obstacle is no error here: `solve` answers with a status.

    Args:
      free_or_labels: bool [H, W], True where the agent fits: obstacles are the 8-connected pieces
        of the rest, ids in row order of their first cells. Or integer [H, W] or [L, H, W]: the id
        0..M-1 of the obstacle on each cell, -1 where none is; obstacles that overlap lie in
        different layers. M is the greatest id + 1, or more where a list below says so (the rest
        covers no cell).
      start, goal: integer [2], (row, col) inside the map.
      destroyable: True or False for all; bool [M], one flag each; or a collection of integer ids,
        those that can be destroyed.
      removal_cost: a number for all, or float [M]; positive and finite.

    Returns:
      Task of NumPy arrays without batch dimensions.

    Raises:
      TypeError: a wrong dtype. ValueError: a wrong rank, length or range.

    Warns:
      UserWarning: integers that look like a mask of 0 and 1, or like an occupancy grid of ROS, or
        that leave no cell free.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6), removal_cost=2.5)
      >>> task.destroyable.tolist(), task.removal_cost.tolist()
      ([True], [2.5])
    """
    require_values(
        "make_task",
        (free_or_labels, start, goal, destroyable, removal_cost),
        inside="make the task outside, and use task.replace(start=..., goal=...) inside jit",
    )
    if remedy := how_to_make_a_task(free_or_labels):
        kind = type(free_or_labels).__name__
        raise TypeError(f"make_task takes an array of cells, got a {kind}: {remedy}")
    labels, is_mask = _as_labels(np.asarray(free_or_labels))
    if not is_mask and (doubt := _doubt_of(np.asarray(free_or_labels))):
        warnings.warn(doubt, stacklevel=2)
    flags, costs = _as_flags_or_ids(destroyable), np.asarray(removal_cost)
    lists = {"removal_cost": costs} | ({"destroyable": flags} if flags.dtype == bool else {})
    num_obstacles = _num_obstacles(int(labels.max()) + 1, lists, is_exact=is_mask)
    size = labels.shape[1:]
    phantom = [(0, int(num_obstacles == 0))]
    return Task(
        labels=labels,
        destroyable=np.pad(_as_destroyable(flags, num_obstacles), phantom),
        removal_cost=np.pad(_as_costs(costs, num_obstacles), phantom, constant_values=1),
        start=_as_cell("start", start, size),
        goal=_as_cell("goal", goal, size),
        size=np.array(size, np.int32),
    )


def _doubt_of(labels: np.ndarray) -> str:
    """Returns why integers are hardly meant as ids of obstacles, or nothing."""
    if labels.ndim == 2 and labels.size >= _ENOUGH and labels.min() == 0 and labels.max() == 1:
        return (
            "the map holds the integers 0 and 1 alone: they are ids of two obstacles, and no cell"
            " is free (-1); for a mask, True where the agent fits, write map.astype(bool)"
        )
    if labels.dtype == np.int8 and labels.min() >= -1 and labels.max() == 100:
        return (
            "the map looks like an occupancy grid of ROS, but as labels -1 is free and 0 is an"
            " obstacle; for a mask, True where the agent fits, write map == 0"
        )
    if labels.ndim == 2 and labels.size >= _ENOUGH and labels.min() >= 0:
        return (
            "no cell of the map is free: as labels -1 is free and 0 is an obstacle; for a mask,"
            " True where the agent fits, write map == 0, or whatever a free cell holds"
        )
    return ""


def stack(tasks: Sequence[Task]) -> Task:
    """Returns one batch of all `tasks`, in order, padded to the largest map and the most layers and
    obstacles.

    Padding cells are OUTSIDE in layer 0 and FREE in the others; padding obstacles are
    indestructible, cost 1 and cover nothing.

    Raises:
      ValueError: no task at all, or one that already is a batch.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> small = srt_jax.make_task(np.ones((2, 2), bool), (0, 0), (1, 1))
      >>> batch = srt_jax.stack([task, small])
      >>> batch.labels.shape, batch.size.tolist()
      ((2, 1, 5, 7), [[5, 7], [2, 2]])
    """
    require_tasks("stack", tasks)
    tasks = list(tasks)
    if not tasks:
        raise ValueError("the batch is empty: stack needs at least one task")
    for index, task in enumerate(tasks):
        require_listed("stack", task, index)
    require_values("stack", tasks, inside="make the batch outside, or use jax.vmap inside jit")
    shape = tuple(np.max([np.shape(task.labels) for task in tasks], axis=0).tolist())
    num_obstacles = max(np.shape(task.destroyable)[0] for task in tasks)
    labels = empty((len(tasks), *shape), np.int32)  # JAX takes it over without a copy
    labels[:] = FREE
    labels[:, 0] = OUTSIDE
    destroyable = np.zeros((len(tasks), num_obstacles), bool)
    removal_cost = np.ones((len(tasks), num_obstacles), np.float32)
    for index, task in enumerate(tasks):
        layers, height, width = np.shape(task.labels)
        labels[index, :layers, :height, :width] = task.labels
        destroyable[index, : len(task.destroyable)] = task.destroyable
        removal_cost[index, : len(task.removal_cost)] = task.removal_cost
    return Task(
        labels=labels,
        destroyable=destroyable,
        removal_cost=removal_cost,
        start=np.stack([np.asarray(task.start, np.int32) for task in tasks]),
        goal=np.stack([np.asarray(task.goal, np.int32) for task in tasks]),
        size=np.stack([np.asarray(task.size, np.int32) for task in tasks]),
    )


@overload
def unstack(batch: Task) -> list[Task]: ...


@overload
def unstack(batch: Solution, tasks: Task | None = None) -> list[Solution]: ...


def unstack(batch: Task | Solution, tasks: Task | None = None) -> list[Task] | list[Solution]:
    """Returns the single tasks of a batch, or the single solutions, without their padding: the
    inverse of `stack`.

    Layers at the end that are free everywhere look like padding and go (one always stays); so do
    obstacles at the end that cover no cell, are indestructible and cost 1. A solution that `solve`
    returned knows its tasks and is cut to them, so that `zip(unstack(batch), unstack(solutions))`
    pairs each task with its own.

    Args:
      batch: tasks or solutions with one batch dimension.
      tasks: of solutions that do not know their tasks (copies, and what came out of jit or a
        function of pytrees) the batch that was solved. Without it their entries keep the padding.

    Returns:
      Tasks or Solutions of NumPy arrays.

    Raises:
      TypeError: neither tasks nor solutions. ValueError: not exactly one batch dimension, or
        `tasks` of another length or map.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> small = srt_jax.make_task(np.ones((2, 2), bool), (0, 0), (1, 1))
      >>> batch = srt_jax.stack([task, small])
      >>> [one.labels.shape for one in srt_jax.unstack(batch)]
      [(1, 5, 7), (1, 2, 2)]
      >>> [one.cost.item() for one in srt_jax.unstack(srt_jax.solve(batch))][0]
      6.0
    """
    if isinstance(batch, Solution):
        return _solutions_of(batch, tasks)
    require_task("unstack", batch, takes="a batch of tasks or of solutions")
    require_values("unstack", batch, inside="use jax.vmap, or call it outside")
    labels = np.asarray(batch.labels)
    if labels.ndim != 4:
        raise ValueError(
            f"labels have shape {list(labels.shape)}, not [B, L, H, W]: unstack takes a batch with"
            " one batch dimension"
        )
    fields = [
        np.asarray(leaf)
        for leaf in (batch.destroyable, batch.removal_cost, batch.start, batch.goal, batch.size)
    ]
    return [
        _without_padding(labels[index], *(field[index] for field in fields))
        for index in range(len(labels))
    ]


def _solutions_of(batch: Solution, tasks: Task | None) -> list[Solution]:
    """Returns the entries of a batch of solutions, each cut to its own task where that is known."""
    require_values("unstack", batch, inside="use jax.vmap, or call it outside")
    shape = np.shape(batch.status)
    if len(shape) != 1:
        raise ValueError(
            f"status has shape {list(shape)}, not [B]: unstack takes a batch with one batch"
            " dimension"
        )
    known = getattr(batch, "_task", None) if tasks is None else tasks
    arrays = jax.tree.map(np.asarray, batch)
    if known is None:
        return [jax.tree.map(lambda array, i=i: array[i].copy(), arrays) for i in range(*shape)]
    if tasks is not None:
        require_answer("unstack", tasks, batch)
    return cut_to_tasks(arrays, unstack(known))


def cut_to_tasks(solutions: Solution, tasks: Iterable[Task]) -> list[Solution]:
    """Returns the solutions of a padded batch, NumPy arrays, each cut to the map and the obstacles
    of its own task; those added to fill the batch are left out.

    One with a route needs its task no more: who keeps millions of them keeps no maps.
    """
    arrays = {field.name: getattr(solutions, field.name) for field in dataclasses.fields(Solution)}

    def one(place: int, task: Task) -> Solution:
        (H, W), M = np.shape(task.labels)[-2:], len(task.destroyable)
        own = {name: array[place] for name, array in arrays.items()}
        own["contour"] = own["contour"][:H, :W]
        own |= {name: own[name][:M] for name in ("blocking", "separating")}
        solution = Solution(**{name: array.copy() for name, array in own.items()})
        return solution if Status(int(own["status"])).is_solved else of_task(solution, task)

    return [one(place, task) for place, task in enumerate(tasks)]


def _without_padding(
    labels: np.ndarray,
    destroyable: np.ndarray,
    removal_cost: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    size: np.ndarray,
) -> Task:
    own = labels[:, : size[0], : size[1]]
    num_layers = 1 + max(
        (layer for layer in range(1, len(own)) if (own[layer] != FREE).any()), default=0
    )
    is_real = destroyable | (removal_cost != 1)
    num_obstacles = max(1, int(own.max()) + 1, *(np.flatnonzero(is_real)[-1:] + 1).tolist())
    return Task(
        labels=own[:num_layers].copy(),
        destroyable=destroyable[:num_obstacles].copy(),
        removal_cost=removal_cost[:num_obstacles].copy(),
        start=start.copy(),
        goal=goal.copy(),
        size=size.copy(),
    )


def _as_labels(array: np.ndarray) -> tuple[np.ndarray, bool]:
    """Returns labels int32 [L, H, W], and whether they come from a mask."""
    is_mask = array.dtype == bool
    if not is_mask and not np.issubdtype(array.dtype, np.signedinteger):
        raise TypeError(
            "the map must be bool (True where the agent fits) or signed integers (obstacle ids, -1"
            f" free), got {array.dtype}: write .astype(bool) for a mask, .astype('int32') for ids"
        )
    if array.ndim not in ((2,) if is_mask else (2, 3)) or 0 in array.shape:
        rule = (
            "a bool map must have shape [H, W]"
            if is_mask
            else "labels must have shape [H, W] or [L, H, W]"
        )
        raise ValueError(
            f"{rule} with no empty side, got {list(array.shape)}: one task holds one map, stack"
            " makes a batch"
        )
    if is_mask:
        labels = np.asarray(label(~array), np.int32)
    else:
        labels = _checked_ids(array)
    return labels.reshape(-1, *labels.shape[-2:]), is_mask


def _checked_ids(labels: np.ndarray) -> np.ndarray:
    wrong = np.argwhere((labels < FREE) | (labels >= _MAX_OBSTACLES))
    if len(wrong):
        where = wrong[0].tolist()
        raise ValueError(
            f"label {labels[tuple(where)]} at {where} is no obstacle id: number the obstacles 0, 1,"
            " 2, ..., and free cells -1"
        )
    return labels.astype(np.int32)


def _as_flags_or_ids(destroyable: object) -> np.ndarray:
    """Returns bool flags, or int64 ids where a collection of ids was given."""
    array = np.asarray(
        sorted(destroyable) if isinstance(destroyable, set | frozenset) else destroyable
    )
    if array.dtype == bool:
        return array
    if (array.size and not np.issubdtype(array.dtype, np.integer)) or array.ndim != 1:
        raise TypeError(
            f"destroyable must be True, False, bool [M] or a collection of ids, got {array.dtype}"
            f" {list(array.shape)}"
        )
    return array.astype(np.int64)


def _num_obstacles(num_on_map: int, lists: dict[str, np.ndarray], *, is_exact: bool) -> int:
    """Returns M, 0 where there is no obstacle; the lists have to agree on it, and may exceed the
    map's unless `is_exact`.
    """
    sizes = [array.size for array in lists.values() if array.ndim]
    num_obstacles = num_on_map if is_exact else max([num_on_map, *sizes])
    for name, array in lists.items():
        if array.ndim and array.shape != (num_obstacles,):
            raise ValueError(
                f"{name} has shape {list(array.shape)}, but there are {num_obstacles} obstacles:"
                " give one for all, or one each"
            )
    return num_obstacles


def _as_destroyable(flags: np.ndarray, num_obstacles: int) -> np.ndarray:
    if flags.dtype == bool:
        return np.broadcast_to(flags, num_obstacles)
    wrong = flags[(flags < 0) | (flags >= num_obstacles)]
    if wrong.size:
        raise ValueError(
            f"destroyable names obstacle {wrong[0]}, but there are {num_obstacles} obstacles, with"
            " ids from 0"
        )
    return np.isin(np.arange(num_obstacles), flags)


def _as_costs(costs: np.ndarray, num_obstacles: int) -> np.ndarray:
    if not (np.issubdtype(costs.dtype, np.floating) or np.issubdtype(costs.dtype, np.integer)):
        raise TypeError(
            f"removal_cost must be a number or float [M], got {costs.dtype}: write"
            " removal_cost.astype('float32')"
        )
    with np.errstate(over="ignore", under="ignore"):
        result = np.broadcast_to(costs.astype(np.float32), num_obstacles)
    wrong = np.flatnonzero(~(np.isfinite(result) & (result > 0)))
    if wrong.size:
        given = np.broadcast_to(costs, num_obstacles)[wrong[0]]
        raise ValueError(
            f"removal_cost of obstacle {wrong[0]} is {given}, {result[wrong[0]]} in float32: it"
            " must be positive and finite"
        )
    return result


def _as_cell(name: str, cell: object, size: tuple[int, ...]) -> np.ndarray:
    """Returns the cell as int32 [2]; its range is checked before it is narrowed, so that nothing
    wraps round.
    """
    given = np.asarray(cell)
    narrowed = np.asarray(as_cells(name, given))
    if given.shape != (2,):
        raise ValueError(
            f"{name} must be one cell (row, col), got shape {list(given.shape)}: one task has one"
            f" {name}"
        )
    if (given < 0).any() or (given >= np.array(size)).any():
        raise ValueError(
            f"{name} {tuple(given.tolist())} lies outside the map of {size[0]} x {size[1]} cells:"
            " rows and columns count from 0"
        )
    return narrowed


class NamedTask(NamedTuple):
    """A task with the name it goes by in tables, files and pictures."""

    name: str
    task: Task
