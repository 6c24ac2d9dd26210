"""Many tasks of unequal size: grouped by size, solved in batches of one shape, each answer cut to
its own map; all at once, or as a stream of any length in bounded memory.
"""

import collections
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, overload

import numpy as np

from srt_jax.engine.buckets import batch_bucket, map_bucket, obstacle_bucket
from srt_jax.engine.entrance import require_listed, require_tasks, require_values
from srt_jax.padding import pad_batch, with_slots
from srt_jax.solver import MAX_BRANCHES, solve_in_room
from srt_jax.task import cut_to_tasks, stack
from srt_jax.types import Solution, Status, Task

_CELLS_AT_ONCE = 2**24  # 64 MiB of labels
_MOST_AT_ONCE = 256
_COMMON_NUMBER = 64
"""Obstacles that hardly any task needs destroyed: the time to compile grows with the room for
more.
"""
_WORTH_COMPILING = 2**26  # cells of labels: some seconds of solving
_NOT_WORTH_A_CALL = 2**18  # cells of labels: a millisecond of solving
_WINDOW = 1024
_CELLS_IN_WINDOW = 2**25  # 128 MiB of labels, each array counted once

_Shape = tuple[int, int, int]


@overload
def solve_many(tasks: Sequence[Task], *, window: None = None, **options: Any) -> list[Solution]: ...


@overload
def solve_many(
    tasks: Iterable[Task], *, window: int | None = None, **options: Any
) -> Iterator[Solution]: ...


def solve_many(  # pyright: ignore[reportInconsistentOverload]  # what they have in common is here
    tasks: Iterable[Task],
    *,
    mode: str = "least",
    toll: float | Sequence[float] = 1.0,
    max_destroyed: int = 8,
    max_cells: int | None = None,
    max_branches: int = MAX_BRANCHES,
    progress: Callable[[int], None] | None = None,
    window: int | None = None,
) -> list[Solution] | Iterator[Solution]:
    """Returns the solution of each of many single tasks, in their order, as NumPy arrays: a list
    for a sequence of tasks, an iterator for any other iterable, such as a generator.

    Tasks are grouped by the bucket of their maps' sides and solved in batches, compiled once per
    group. `toll` is one for all, or one for each task. `progress` is called with the number of
    tasks finished after each batch. Other arguments and errors as for `solve`; without `max_cells`
    the routes are given as much room as they need, so unlike there `cells` is no longer than that.
    The work is done on JAX's default device, whatever device the tasks lie on: `with
    jax.default_device(device):` chooses another.

    As a stream, tasks are read and solved as their solutions are asked for, and no more than
    `window` of them are in memory; by default 1024, or fewer where their maps have more than 2**25
    cells together. A sequence is solved as a stream, too, where `window` is given. Tasks that share
    an array of labels (`task.replace(start=..., goal=...)`) share its memory. The solutions are
    those of the list.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> small = srt_jax.make_task(np.ones((2, 2), bool), (0, 0), (1, 1))
      >>> [solution.num_cells.item() for solution in srt_jax.solve_many([task, small])]
      [7, 2]
      >>> starts = (task.replace(start=np.array([row, 0], np.int32)) for row in range(5))
      >>> [round(solution.cost.item(), 2) for solution in srt_jax.solve_many(starts, window=4)]
      [6.83, 6.41, 6.0, 6.41, 6.83]
    """
    require_tasks("solve_many", tasks)
    options = {"mode": mode, "max_branches": max_branches}
    rooms = {"max_cells": max_cells, "max_destroyed": max_destroyed}
    if window is not None and window < 1:
        raise ValueError(f"window must be at least 1, got {window}")
    if window is not None or not isinstance(tasks, Sequence):
        return _streamed(tasks, toll, window, progress, **rooms, **options)
    for number, task in enumerate(tasks):
        _require_single(task, number)
    solutions: dict[int, Solution] = {}
    tolls = _toll_of_each(toll, len(tasks))
    # The largest first: what is compiled for them serves the smaller ones as well.
    groups = sorted(_groups(tasks).items(), key=lambda group: -math.prod(group[0]))
    for shape, members in groups:
        at_once = min(_at_once(shape), batch_bucket(len(members)))
        sizes = _sizes([tasks[index] for index in members], shape)
        for first in range(0, len(members), at_once):
            chunk = members[first : first + at_once]
            own = [tasks[index] for index in chunk]
            answers = _solved(own, (at_once, *sizes), tolls[chunk], **rooms, **options)
            solutions |= dict(zip(chunk, answers, strict=True))
            if progress:
                progress(len(chunk))
    return [solutions[index] for index in range(len(tasks))]


def _streamed(
    tasks: Iterable[Task],
    toll: float | Iterable[float],
    window: int | None,
    progress: Callable[[int], None] | None,
    **options: Any,
) -> Iterator[Solution]:
    """Yields the solutions in order.

    A group is solved when it fills a batch; when the window is full, or there is no further task,
    the group that holds the next one in order.
    """
    arriving = _with_tolls(tasks, toll)
    waiting: dict[_Shape, dict[int, tuple[Task, float]]] = {}
    solved: dict[int, tuple[Task, Solution]] = {}
    cells = _Cells()
    counts: collections.Counter[_Shape] = collections.Counter()
    is_over, number = False, 0  # of the next that goes out

    def solve_group(shape: _Shape) -> None:
        members = waiting[shape]
        chunk = list(members)[: _at_once(shape)]
        own, tolls = zip(*(members.pop(index) for index in chunk))
        at_once = min(_at_once(shape), batch_bucket(len(chunk)))
        sizes = (at_once, *_sizes(own, shape))
        answers = _solved(own, sizes, np.array(tolls, np.float32), **options)
        solved.update(zip(chunk, zip(own, answers, strict=True), strict=True))
        if progress:
            progress(len(chunk))

    arrived = 0
    while True:
        while number in solved:
            # who asks for solutions keeps their tasks until then: they count until then
            task, answer = solved.pop(number)
            cells.remove(task)
            number += 1
            yield answer
        is_full = arrived - number >= (window or _WINDOW)
        is_full |= window is None and arrived > number and cells.total >= _CELLS_IN_WINDOW
        if not is_over and not is_full:
            for task, own_toll in itertools.islice(arriving, 1):
                _require_single(task, arrived)
                shape = _group_of(np.shape(task.labels), counts)
                waiting.setdefault(shape, {})[arrived] = task, own_toll
                cells.add(task)
                arrived += 1
                if len(waiting[shape]) >= _at_once(shape):
                    solve_group(shape)
                break
            else:
                is_over = True
            continue
        if number == arrived:
            return
        solve_group(next(shape for shape, members in waiting.items() if number in members))


def _require_single(task: Task, number: int) -> None:
    require_listed("solve_many", task, number)
    require_values("solve_many", task, inside="call solve inside jit, on a task or a batch")


class _Cells:
    """Counts the cells of the labels that are in memory, an array that several tasks share once."""

    def __init__(self) -> None:
        self.total = 0
        self._users: collections.Counter[int] = collections.Counter()

    def add(self, task: Task) -> None:
        if not self._users[id(task.labels)]:
            self.total += math.prod(np.shape(task.labels))
        self._users[id(task.labels)] += 1

    def remove(self, task: Task) -> None:
        self._users[id(task.labels)] -= 1
        if not self._users[id(task.labels)]:
            self.total -= math.prod(np.shape(task.labels))
            del self._users[id(task.labels)]


def _with_tolls(
    tasks: Iterable[Task], toll: float | Iterable[float]
) -> Iterator[tuple[Task, float]]:
    if not isinstance(toll, Iterable) or np.ndim(toll) == 0:  # pyright: ignore[reportArgumentType]
        yield from ((task, float(toll)) for task in tasks)  # pyright: ignore[reportArgumentType]
        return
    tolls = iter(toll)
    for number, task in enumerate(tasks):
        own = next(tolls, None)
        if own is None:
            raise ValueError(
                f"toll must be a number, or one for each task: there is none for task {number}"
            )
        yield task, float(own)


def _at_once(shape: _Shape) -> int:
    return max(1, min(_MOST_AT_ONCE, _CELLS_AT_ONCE // math.prod(shape)))


def _solved(
    tasks: Sequence[Task],
    shape: tuple[int, int, int, int, int],
    tolls: np.ndarray,
    *,
    max_cells: int | None,
    max_destroyed: int,
    **options: Any,
) -> list[Solution]:
    """Returns the solutions of tasks that are padded to `shape` (B, L, H, W, M)."""
    batch = pad_batch(stack(tasks), shape)
    own_tolls = np.zeros(shape[0], np.float32)
    own_tolls[: len(tasks)] = tolls
    answer = _with_room(batch, max_cells, max_destroyed, toll=own_tolls, **options)
    return cut_to_tasks(answer, tasks)


def _toll_of_each(toll: float | Sequence[float], number: int) -> np.ndarray:
    """Returns the toll of each task, float32 [number]; their values are checked by `solve`."""
    with np.errstate(over="ignore"):  # what is too large becomes infinite, which is refused
        given = np.asarray(toll, np.float32)
    if given.shape not in ((), (number,)):
        raise ValueError(
            f"toll must be a number, or one for each of {number} tasks, got {list(given.shape)}"
        )
    return np.broadcast_to(given, number)


def _groups(tasks: Sequence[Task]) -> dict[_Shape, list[int]]:
    """Returns the tasks' indices by the shape (L, H, W) to which they are padded.

    Padding costs work and another shape costs compiling: a shape gets its own group where its maps
    are worth that, else they join the others of the next powers of two; and few maps those with
    more layers.
    """
    fine: dict[_Shape, list[int]] = {}
    for index, task in enumerate(tasks):
        fine.setdefault(_fine(np.shape(task.labels)), []).append(index)
    groups: dict[_Shape, list[int]] = {}
    for shape, members in sorted(fine.items()):
        is_worth_it = len(members) * math.prod(shape) >= _WORTH_COMPILING
        groups.setdefault(shape if is_worth_it else _coarse(*shape), []).extend(members)
    for shape in sorted(groups):
        more = [other for other in groups if other[0] > shape[0] and other[1:] == shape[1:]]
        if more and len(groups[shape]) * math.prod(min(more)) <= _NOT_WORTH_A_CALL:
            groups[min(more)] = sorted(groups.pop(shape) + groups[min(more)])
    return groups


def _group_of(shape: tuple[int, ...], counts: "collections.Counter[_Shape]") -> _Shape:
    """Returns the shape to which a task of a stream is padded, as `_groups` has it, by what has
    come so far.
    """
    fine = _fine(shape)
    counts[fine] += 1
    is_worth_it = counts[fine] * math.prod(fine) >= _WORTH_COMPILING
    return fine if is_worth_it else _coarse(*fine)


def _fine(shape: tuple[int, ...]) -> _Shape:
    L, H, W = shape
    return (batch_bucket(L), *map_bucket(H, W))


def _coarse(L: int, H: int, W: int) -> tuple[int, int, int]:
    layers = 4 ** (L.bit_length() // 2)  # L is a power of two: 1, 4, 16, ...
    height, width = batch_bucket(H), batch_bucket(W)
    side = max(height, width)
    return (layers, side, side) if side <= 2 * min(height, width) else (layers, height, width)


def _sizes(tasks: Sequence[Task], shape: _Shape) -> tuple[int, int, int, int]:
    """Returns (L, H, W, M) that hold all of some tasks of a group, with no more layers than they
    have need of.
    """
    layers = batch_bucket(max(np.shape(task.labels)[0] for task in tasks))
    M = obstacle_bucket(max(len(task.destroyable) for task in tasks))
    return min(layers, shape[0]), *shape[1:], M


def _with_room(batch: Task, max_cells: int | None, max_destroyed: int, **options: Any) -> Solution:
    """Returns the solutions, with room for common numbers of obstacles, and again with more for
    greater ones. With `max_cells` there is no more room for the route than that.
    """
    slots = min(max_destroyed, _COMMON_NUMBER)
    while True:
        answer = solve_in_room(batch, max_cells=max_cells, max_destroyed=slots, **options)
        is_too_long = answer.num_cells > answer.cells.shape[1]
        # In mode "paper" what stopped for want of room may need more yet.
        is_short_of_slots = (
            (slots < max_destroyed) & (answer.status == Status.BUDGET_SPENT) & ~is_too_long
        )
        if not is_short_of_slots.any():
            return with_slots(answer, max_destroyed, np)
        slots = min(max_destroyed, batch_bucket(max(2 * slots, int(answer.num_destroyed.max()))))
