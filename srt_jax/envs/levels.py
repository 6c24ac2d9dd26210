"""Levels: a pool of tasks as one pytree, each with what the oracle makes of it.

An environment's state holds the number of its level only, so a step reads single cells of the pool
and copies no map.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.solver import solve
from srt_jax.task import stack
from srt_jax.types import Array, Record, Status, Task, record

_MOST_DESTROYED = 32


@record
class Levels(Record):
    """N levels, padded to one shape.

    Attributes:
      labels: int32 [N, L, H, W], obstacle ids as in `Task`.
      price: float32 [N, M], the cost of destroying each obstacle, inf where it cannot be destroyed.
      start, goal, size: int32 [N, 2].
      removal: float32 [N], the total cost the oracle destroys (`solve`, by default mode "least");
        NaN where not known.
      length: float32 [N], the length of the oracle's route in cell sides; NaN where not known.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> levels.price.shape, levels.removal.tolist(), levels.length.tolist()
      ((1, 1), [1.0], [6.0])
    """

    labels: Array
    price: Array
    start: Array
    goal: Array
    size: Array
    removal: Array
    length: Array


def make_levels(
    tasks: Task | Sequence[Task],
    *,
    oracle: bool = True,
    mode: str = "least",
    toll: float | Array = 1.0,
) -> Levels:
    """Returns the levels of those tasks that have a solution and do not start in the goal, in order
    (host).

    Args:
      tasks: a batch, such as `srt_jax.stack` makes, or single tasks.
      oracle: whether to solve them; without it every task becomes a level and regret is NaN.
      mode: of the oracle's `solve`, "least" or "shortest", see `with_oracle`.
      toll: a number, or float32 [B], one for each task.

    Raises:
      TypeError: something else than tasks.
      ValueError: no task, or none that has a solution; an option that `solve` refuses.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> levels.start.tolist(), levels.goal.tolist()
      ([[2, 0]], [[2, 6]])
    """
    batch = _as_batch(tasks)
    # Every task as a level; an infinite price says that an obstacle cannot be destroyed.
    nothing = np.full(len(batch.start), np.nan, np.float32)
    levels = Levels(
        labels=np.asarray(batch.labels),
        price=np.where(batch.destroyable, batch.removal_cost, np.float32(np.inf)).astype(
            np.float32
        ),
        start=np.asarray(batch.start),
        goal=np.asarray(batch.goal),
        size=np.asarray(batch.size),
        removal=nothing,
        length=nothing,
    )
    # With the oracle only what has a solution of at least one step is kept.
    if oracle:
        solution = solve(batch, mode=mode, toll=toll, max_destroyed=_MOST_DESTROYED)
        levels = levels.replace(
            removal=np.asarray(solution.removal_cost), length=np.asarray(solution.cost)
        )
        solved = [status for status in Status if status.is_solved]
        is_kept = np.isin(solution.status, solved) & (levels.start != levels.goal).any(axis=1)
        if not is_kept.any():
            raise ValueError(
                f"none of the {len(is_kept)} tasks has a solution that takes a step: give tasks"
                " that can be solved"
            )
        levels = jax.tree.map(lambda array: array[is_kept], levels)
    return jax.tree.map(jnp.asarray, levels)


def _as_batch(tasks: Task | Sequence[Task]) -> Task:
    """Returns one batch of the tasks; TypeError or ValueError where they are none."""
    tasks = tasks if isinstance(tasks, Task | jax.Array | np.ndarray) else list(tasks)
    if not isinstance(tasks, Task) and not all(isinstance(task, Task) for task in tasks):
        raise TypeError(
            "tasks must be a Task or a list of them, as make_task makes, got"
            f" {type(tasks).__name__}"
        )
    batch = tasks if isinstance(tasks, Task) else stack(tasks)
    if np.ndim(batch.labels) != 4:
        raise ValueError(
            f"labels have shape {list(np.shape(batch.labels))}, not [N, L, H, W]: "
            "give a list of tasks, [task] for one, or one batch made with stack"
        )
    return batch


def to_tasks(levels: Levels) -> Task:
    """Returns the batch of tasks the levels are; what cannot be destroyed costs 1. May be
    traced.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> envs.to_tasks(levels).labels.shape
      (1, 1, 5, 7)
    """
    is_destroyable = jnp.isfinite(levels.price)
    return Task(
        labels=levels.labels,
        destroyable=is_destroyable,
        removal_cost=jnp.where(is_destroyable, levels.price, jnp.float32(1)),
        start=levels.start,
        goal=levels.goal,
        size=levels.size,
    )


def with_oracle(levels: Levels, *, mode: str = "least", toll: float | Array = 1.0) -> Levels:
    """Returns the levels with the oracle's removal and length, both inf where a level has no
    solution. May be traced.

    Mode "least" destroys the least and then walks the shortest. Mode "shortest" asks of every wall
    whether to break it or to go round: with the toll `removal_weight / step_cost` of the
    environment's parameters, 100 as they are set, its score is the greatest there is, and regret
    exact, as far as `solve` proves its answer and time suffices.

    Args:
      mode: "least" or "shortest".
      toll: a number, or float32 [B], one for each level.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> envs.with_oracle(levels).removal.tolist()
      [1.0]
    """
    solution = solve(to_tasks(levels), mode=mode, toll=toll, max_destroyed=_MOST_DESTROYED)
    return levels.replace(removal=solution.removal_cost, length=solution.cost)
