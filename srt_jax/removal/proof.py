"""What blocks at first, and what blocks for good: the indestructible obstacles that separate start
and goal (PY16 §3.2).

With every destroyable obstacle gone, what still blocks is found as at first: seed, piece ahead,
contour. That piece separates, and of it the cells that touch the contour are enough: the agent's
region has no other border on that side. So the indestructible owners of these cells are the proof.
Where the goal itself lies in something indestructible, that is the proof.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax.obstacles import all_open_cells, owners_at
from srt_jax.paths.blockage import Blockage, find_blockage
from srt_jax.paths.reach import reach_words
from srt_jax.types import Array, Task


class _Rounds(NamedTuple):
    """number: int32 [], rounds done. first: the blockage of the first round. separating: bool
    [B, M], found in the last.
    """

    number: Array
    first: Blockage
    separating: Array


def blockages(
    task: Task, reached: Array, *, is_cut_off: Array, is_inside: Array, is_apart: Array
) -> tuple[Blockage, Array]:
    """Returns the first blockage, and of each task in `is_apart` the indestructible obstacles that
    separate, bool [B, M].

    Two rounds of one and the same code, for it takes long to compile; the second only where some
    task needs it.

    Args:
      task: with one batch axis.
      reached: uint32 [B, H, words], packed, from the start with nothing gone; not known where the
        goal is inside.
      is_cut_off: bool [B], tasks whose goal is not reached: those that have a first blockage.
      is_inside: bool [B], those of them whose goal lies in something indestructible.
      is_apart: bool [B], those whose goal is not reached even with all that is destroyable gone,
        though it is open then.
    """
    B, _, _, W = task.labels.shape
    M = task.destroyable.shape[1]

    def look(state: _Rounds) -> _Rounds:
        # Where the agent gets to: known for most tasks in the first round, flooded for the others.
        is_last = state.number == 1
        opened = all_open_cells(task.labels, task.destroyable & is_last)
        needs_flood = jnp.where(is_last, is_apart, is_inside)
        start = jnp.where(needs_flood[:, None], task.start, -1)
        flooded = lax.cond(
            needs_flood.any(),
            lambda: reach_words(opened, start, width=W),
            lambda: jnp.zeros_like(reached),
        )
        closed = jnp.where(needs_flood[:, None, None], flooded, reached)

        # What blocks there; in the last round it is the proof.
        among = jnp.where(is_last, is_apart, is_cut_off)
        found = find_blockage(
            task.labels, opened, closed, task.goal, task.size, num_obstacles=M, among=among
        )
        first = jax.tree.map(lambda old, new: jnp.where(is_last, old, new), state.first, found)
        separating = found.on_contour & ~task.destroyable & is_last
        return _Rounds(state.number + 1, first, separating)

    nothing = Blockage(
        jnp.full((B, 2), -1, jnp.int32), jnp.zeros_like(reached), jnp.zeros((B, M), bool)
    )
    num_rounds = jnp.where(is_apart.any(), jnp.int32(2), jnp.int32(1))
    # Ends: after one round or two.
    begin = _Rounds(jnp.int32(0), nothing, nothing.on_contour)
    end = lax.while_loop(lambda state: state.number < num_rounds, look, begin)
    return end.first, end.separating


def covering(task: Task, is_inside: Array) -> Array:
    """Returns the indestructible obstacles that cover the goal of each task in `is_inside` (bool
    [B]), bool [B, M].
    """
    return (
        owners_at(task.labels, task.goal, task.destroyable.shape[1])
        & ~task.destroyable
        & is_inside[:, None]
    )
