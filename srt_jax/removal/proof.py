"""What blocks at first, and what blocks for good: the firm obstacles that keep start and goal apart
(PY16 §3.2).

With every destroyable obstacle gone, what still blocks is found as at first: seed, piece ahead,
contour. That piece separates, and of it the cells that touch the contour are enough: the agent's
region has no other border on that side. So the owners of these cells that stand firm are the proof.
Where the goal itself lies in something firm, that is the proof.
"""

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax.objects import owners_at
from srt_jax.obstacles import all_open_cells
from srt_jax.paths.blockage import Blockage, find_blockage
from srt_jax.paths.reach import reach_words
from srt_jax.types import Array, Task


def blockages(
    task: Task, reached: Array, *, is_cut_off: Array, is_inside: Array, is_apart: Array
) -> tuple[Blockage, Array]:
    """Returns the first blockage, and of each task in `is_apart` the firm obstacles that separate,
    bool [B, M].

    Two rounds of one and the same code, for it takes long to compile; the second only where some
    task asks for it.

    Args:
      task: with one batch axis.
      reached: uint32 [B, H, words], packed, from the start with nothing gone; not known where the
        goal is inside.
      is_cut_off: bool [B], tasks whose goal is not reached: those that have a first blockage.
      is_inside: bool [B], those of them whose goal lies in something firm.
      is_apart: bool [B], those whose goal is not reached even with all that is destroyable gone,
        though it is open then.
    """
    B, _, _, W = task.labels.shape
    M = task.destroyable.shape[1]

    def look(state: tuple) -> tuple:
        number, first, _ = state
        is_last = number == 1
        opened = all_open_cells(task.labels, task.destroyable & is_last)
        asked = jnp.where(is_last, is_apart, is_inside)
        start = jnp.where(asked[:, None], task.start, -1)
        flooded = lax.cond(
            asked.any(),
            lambda: reach_words(opened, start, width=W),
            lambda: jnp.zeros_like(reached),
        )
        closed = jnp.where(asked[:, None, None], flooded, reached)
        among = jnp.where(is_last, is_apart, is_cut_off)
        found = find_blockage(
            task.labels, opened, closed, task.goal, task.size, num_obstacles=M, among=among
        )
        first = jax.tree.map(lambda old, new: jnp.where(is_last, old, new), first, found)
        return number + 1, first, found.on_contour & ~task.destroyable & is_last

    nothing = Blockage(
        jnp.full((B, 2), -1, jnp.int32), jnp.zeros_like(reached), jnp.zeros((B, M), bool)
    )
    num_rounds = jnp.where(is_apart.any(), 2, 1)
    # Ends: after one round or two.
    _, first, firm = lax.while_loop(
        lambda state: state[0] < num_rounds, look, (jnp.int32(0), nothing, nothing.on_contour)
    )
    return first, firm


def covering(task: Task, is_inside: Array) -> Array:
    """Returns the firm obstacles that cover the goal of each task in `is_inside` (bool [B]),
    bool [B, M].
    """
    return (
        owners_at(task.labels, task.goal, task.destroyable.shape[1])
        & ~task.destroyable
        & is_inside[:, None]
    )
