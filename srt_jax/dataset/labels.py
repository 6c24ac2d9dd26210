"""What a data set tells of each task: exact costs to go, heuristics to learn, what blocks first and
what must go.

Costs are on the map once the least removal is gone, the map on which the route lies; where nothing
blocks that is the map as it is. Where a task has no solution they are inf, and the ratios 0.

Correction factors and focal maps follow TransPath (Kirilenko, Andreychuk, Panov, Yakovlev, AAAI
2023): there a network learns, for A*, by what share the octile distance falls short of the exact
cost to go, and, for focal search, how near each cell is to lying on a shortest path. Here both are
exact.

In mode "shortest" what goes is not the least removal but what breaking is worth (`solve`): of each
task the labels say whether to break or to go round.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import jitted
from srt_jax.engine.buckets import batch_bucket
from srt_jax.engine.packing import unpack
from srt_jax.many_tasks import solve_many
from srt_jax.moves import octile_distance
from srt_jax.obstacles import all_cells_of, all_open_cells
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.task import stack, unstack
from srt_jax.types import Array, Solution, Task


class TaskLabels(NamedTuple):
    """Labels of a batch of B tasks.

    status: int32 [B], a `Status`.
    length: float32 [B], the route's length in cell sides, inf without one.
    least_cost: float32 [B], what the least removal costs, inf without a route. removal_bound:
      float32 [B], its lower bound.
    least_removal: bool [B, M], the obstacles to destroy.
    first_blocker: bool [B, H, W], the cells of those obstacles that block first (PY16 §3.2: of the
      separating obstacle, those the contour meets); all False where a path exists.
    cost_to_go: float32 [B, H, W], h*: the length of a shortest path from each cell to the goal; inf
      where there is none.
    correction: float32 [B, H, W], octile distance to the goal over h*: in (0, 1], 1 in the goal, 0
      where h* is inf. The octile distance divided by it is h* again.
    focal: float32 [B, H, W], the shortest path's length over that of the shortest path led through
      the cell: in (0, 1], 1 on shortest paths (to float32 rounding) and only there, 0 where no such
      path is.
    breaks: bool [B], total, total_bound: float32 [B], of mode "shortest", else None: whether the
      best route breaks anything, its length and tolls, and their lower bound. There `least_cost`
      and `least_removal` are of what that route breaks.
    """

    status: np.ndarray
    length: np.ndarray
    least_cost: np.ndarray
    removal_bound: np.ndarray
    least_removal: np.ndarray
    first_blocker: np.ndarray
    cost_to_go: np.ndarray
    correction: np.ndarray
    focal: np.ndarray
    breaks: np.ndarray | None = None
    total: np.ndarray | None = None
    total_bound: np.ndarray | None = None


_AT_ONCE = 512
"""Tasks whose maps are in memory twice, on the way from the device."""


def label_tasks(
    tasks: Task | list[Task], *, max_destroyed: int = 32, mode: str = "least", toll: float = 1.0
) -> TaskLabels:
    """Returns the labels of a batch, or of single tasks padded as `stack` pads them (host)."""
    both = (unstack(tasks), tasks) if isinstance(tasks, Task) else (tasks, stack(tasks))
    return label_stacked(*both, max_destroyed=max_destroyed, mode=mode, toll=toll)


def label_stacked(
    singles: list[Task],
    batch: Task,
    *,
    max_destroyed: int = 32,
    mode: str = "least",
    toll: float = 1.0,
) -> TaskLabels:
    """Returns the labels of tasks that are there both ways, as singles and as their batch."""
    options = {"max_destroyed": max_destroyed, "mode": mode, "toll": toll}
    whole: dict[str, np.ndarray] = {}
    for first in range(0, len(singles), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        some = jax.tree.map(lambda array, part=part: array[part], batch)
        for name, array in _labels_of(singles[part], some, options).items():
            if name not in whole:
                whole[name] = np.empty((len(singles), *array.shape[1:]), array.dtype)
            whole[name][part] = array
    return TaskLabels(**whole)


def _labels_of(singles: list[Task], batch: Task, options: dict[str, Any]) -> dict[str, np.ndarray]:
    """Returns the labels by their names; options: of `solve_many`."""
    solutions = solve_many(singles, **options)
    M = batch.destroyable.shape[-1]
    removed, blocking = (_as_sets(solutions, name, M) for name in ("destroyed", "blocking"))
    facts = {
        name: np.array([getattr(one, name) for one in solutions])
        for name in ("status", "removal_bound")
    }
    facts |= {
        "least_cost": np.array([one.removal_cost for one in solutions]),
        "length": np.array([one.cost for one in solutions]),
    }
    if options["mode"] == "shortest":
        facts["breaks"] = np.asarray(removed.any(axis=1))
        facts |= {
            name: np.array([getattr(one, name) for one in solutions])
            for name in ("total", "total_bound")
        }
    is_solved = np.isfinite(facts["length"])
    # shards differ by an obstacle or two: that need not compile again
    room = [(0, 0), (0, batch_bucket(M) - M)]
    sets = np.pad(removed, room), np.pad(blocking, room)
    maps = jax.tree.map(np.asarray, _maps(batch.labels, *sets, batch.start, batch.goal, is_solved))
    return facts | {"least_removal": removed} | maps


def _as_sets(solutions: list[Solution], name: str, num_obstacles: int) -> np.ndarray:
    sets = np.zeros((len(solutions), num_obstacles), bool)
    for row, solution in zip(sets, solutions):
        ids = np.asarray(getattr(solution, name))
        row[ids[ids >= 0]] = True
    return sets


@jitted
def _maps(
    labels: Array, removed: Array, blocking: Array, start: Array, goal: Array, is_solved: Array
) -> dict[str, Array]:
    """Returns the labels that are maps, [B, H, W] each."""
    _, _, H, W = labels.shape
    free = unpack(all_open_cells(labels, removed), W) & is_solved[:, None, None]
    to_go, come = cost_to_come(free, goal), cost_to_come(free, start)
    cells = jnp.stack(
        jnp.meshgrid(*(jnp.arange(side, dtype=jnp.int32) for side in (H, W)), indexing="ij"),
        axis=-1,
    )
    octile = octile_distance(cells[None], goal[:, None, None, :])
    is_reached = jnp.isfinite(to_go)
    correction = jnp.where(to_go > 0, jnp.minimum(octile / to_go, jnp.float32(1)), jnp.float32(1))
    least = jnp.take_along_axis(
        to_go.reshape(len(start), -1), (start[:, :1] * W + start[:, 1:]), axis=1
    )[:, :, None]
    through = come + to_go
    focal = jnp.where(through > 0, jnp.minimum(least / through, jnp.float32(1)), jnp.float32(1))
    return {
        "first_blocker": unpack(all_cells_of(labels, blocking), W),
        "cost_to_go": to_go,
        "correction": jnp.where(is_reached, correction, jnp.float32(0)),
        "focal": jnp.where(jnp.isfinite(through), focal, jnp.float32(0)),
    }
