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

from srt_jax import obstacles
from srt_jax.obstacles import Labels, owners_at
from srt_jax.paths.blockage import Blockage, Ends, blockage_of
from srt_jax.types import Array, Task


class _Rounds(NamedTuple):
    """number: int32 [], rounds done. first: the blockage of the first round. separating: bool
    [M], found in the last.
    """

    number: Array
    first: Blockage
    separating: Array


def blockages(
    task: Task, free: Array, reached: Array, *, is_cut_off: Array, is_inside: Array, is_apart: Array
) -> tuple[Blockage, Array]:
    """Returns the first blockage, and of each task in `is_apart` the indestructible obstacles that
    separate, bool [B, M].

    Args:
      task: with one batch axis.
      free: uint32 [B, H, words], packed, the cells open with nothing gone.
      reached: uint32 [B, H, words], packed, from the start with nothing gone; not known where the
        goal is inside.
      is_cut_off: bool [B], tasks whose goal is not reached: those that have a first blockage.
      is_inside: bool [B], those of them whose goal lies in something indestructible.
      is_apart: bool [B], those of them whose goal is not reached even with all that is destroyable
        gone, though it is open then.
    """

    def one_map(
        labels: Labels,
        may_go: Array,
        ends: Ends,
        free: Array,
        reached: Array,
        is_cut_off: Array,
        is_inside: Array,
        is_apart: Array,
    ) -> tuple[Blockage, Array]:
        M = len(may_go)

        def look(state: _Rounds) -> _Rounds:
            # What blocks with nothing gone; in the last round, with all gone that may go: that is
            # the proof. One body for both: it takes long to compile.
            is_last = state.number == 1
            passable = lax.cond(is_last, lambda: obstacles.open_cells(labels, may_go), lambda: free)
            is_known = ~is_last & ~is_inside
            found = blockage_of(labels, passable, ends, reached, M, is_known, jnp.bool_(True))
            first = jax.tree.map(lambda old, new: jnp.where(is_last, old, new), state.first, found)
            return _Rounds(state.number + 1, first, found.on_contour & ~may_go & is_last)

        nothing = Blockage(jnp.full(2, -1, jnp.int32), jnp.zeros_like(reached), jnp.zeros(M, bool))
        num_rounds = is_cut_off.astype(jnp.int32) + is_apart.astype(jnp.int32)
        # Ends: after two rounds at most.
        begin = _Rounds(jnp.int32(0), nothing, nothing.on_contour)
        end = lax.while_loop(lambda state: state.number < num_rounds, look, begin)
        return end.first, end.separating

    ends = Ends(task.start, task.goal, task.size)
    known = (free, reached, is_cut_off, is_inside, is_apart)
    return obstacles.of_all(one_map, task.labels, task.destroyable, ends, *known)


def covering(task: Task, is_inside: Array) -> Array:
    """Returns the indestructible obstacles that cover the goal of each task in `is_inside` (bool
    [B]), bool [B, M].
    """
    return (
        owners_at(task.labels, task.goal, task.destroyable.shape[1])
        & ~task.destroyable
        & is_inside[:, None]
    )
