"""Why a task cannot be solved: the firm obstacles that keep start and goal apart, whatever else is gone (PY16 §3.2).

With every destroyable obstacle gone, what still blocks is found as at first: seed, piece ahead, contour. That piece separates,
and of it the cells that touch the contour are enough: the agent's region has no other border on that side. So the owners of
these cells that stand firm are the proof. Where the goal itself lies in something firm, that is the proof.
"""

import jax.numpy as jnp
from jax import lax

from srt_jax.objects import only_cell, open_cells, owners_at
from srt_jax.planner import find_blockage
from srt_jax.reach import flood
from srt_jax.types import Array, Task


def separating(task: Task, is_apart: Array, is_inside: Array) -> Array:
    """Returns the firm obstacles that keep start and goal apart, bool [B, M]; none where neither flag is set.

    Args:
      task: with one batch axis.
      is_apart: bool [B], tasks whose goal is open once all that is destroyable is gone, and still not reached.
      is_inside: bool [B], tasks whose goal is not.
    """
    num_obstacles = task.destroyable.shape[1]

    def found(_: None) -> Array:
        _, _, H, W = task.labels.shape
        opened = open_cells(task.labels, task.destroyable)
        at_start = only_cell(task.start, H, W) & opened & is_apart[:, None, None]
        reached = flood(opened & is_apart[:, None, None], at_start, through_corners=False)
        options = {"num_obstacles": num_obstacles, "among": is_apart}
        return find_blockage(task.labels, opened, reached, task.goal, **options).on_contour

    ahead = lax.cond(is_apart.any(), found, lambda _: jnp.zeros_like(task.destroyable), None)
    covering = owners_at(task.labels, task.goal, num_obstacles) & is_inside[:, None]
    return (ahead | covering) & ~task.destroyable
