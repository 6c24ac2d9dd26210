"""What breaking through is worth: the front of route lengths against removal costs."""

from collections.abc import Sequence

import jax
import numpy as np

from srt_jax.engine.entrance import require_single
from srt_jax.solver import MAX_BRANCHES, solve
from srt_jax.task import stack
from srt_jax.tolls.pareto_front import Tradeoff, front_of
from srt_jax.types import Task

NUM_TOLLS = 16
"""Tolls that are tried where none are given."""


def tradeoffs(
    task: Task,
    *,
    tolls: Sequence[float] | None = None,
    max_destroyed: int = 8,
    max_branches: int = MAX_BRANCHES,
) -> list[Tradeoff]:
    """Returns the front of (length, removal cost) pairs of one task, the shortest route first;
    empty where no toll leads to a route.

    Every toll is a task of one batch, solved in mode "shortest". So the front holds its supported
    points, those that are best at some toll, as far as the tolls tried lie between theirs; others,
    that no sum of length and tolls prefers, it does not hold.

    Args:
      task: a single task.
      tolls: what one unit of removal cost is worth, in cell sides. By default 16 of them, from a
        quarter of a cell side to twice the map's longer side for the obstacle of median cost.
      max_destroyed, max_branches: as for `solve`; a toll at which more would be destroyed gives no
        point.

    Raises:
      ValueError: a batch instead of one task, no toll, or one that `solve` refuses.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((21, 21), bool)
      >>> free[:20, 10] = False  # a wall with a gap far away
      >>> task = srt_jax.make_task(free, (0, 8), (0, 12))
      >>> for point in srt_jax.tradeoffs(task, tolls=(1, 10, 100)):
      ...     print(round(point.length, 2), point.removal_cost, point.destroyed, point.tolls)
      4.0 1.0 (0,) (1.0, 10.0)
      42.83 0.0 () (100.0, 100.0)
    """
    require_single("tradeoffs", task)
    with np.errstate(over="ignore"):  # what is too large becomes infinite, which is refused
        chosen = np.asarray(default_tolls(task) if tolls is None else tolls, np.float32).reshape(-1)
    if not len(chosen):
        raise ValueError("tolls is empty: give at least one")
    batch = stack([task] * len(chosen))
    answers = jax.device_get(
        solve(
            batch,
            mode="shortest",
            toll=chosen,
            max_destroyed=max_destroyed,
            max_branches=max_branches,
        )
    )
    each = (jax.tree.map(lambda array, i=i: array[i], answers) for i in range(len(chosen)))
    return front_of(zip(chosen.tolist(), each))


def default_tolls(task: Task) -> np.ndarray:
    """Returns the tolls that `tradeoffs` tries: float32 [NUM_TOLLS]."""
    flags, costs = np.asarray(task.destroyable), np.asarray(task.removal_cost)
    middle = float(np.median(costs[flags])) if flags.any() else 1.0
    most = 2 * max(np.asarray(task.size).tolist())
    return (np.geomspace(0.25, most, NUM_TOLLS) / middle).astype(np.float32)
