"""Where on the route each step of a symbolic plan ends: "approach" where the agent comes beside the
obstacle, "pass" where it has left the obstacle's cells behind.
"""

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.loops import in_a_loop
from sign_model.foundation.marks import compiled_whole
from srt_jax.engine.batching import each
from srt_jax.types import Act, Array


def left_behind(
    labels: Array, cells: Array, num_cells: Array, destroyed: Array, destroyed_at: Array
) -> Array:
    """Returns where the route leaves what each destroyed obstacle covered: int32 [B, K], index into
    `cells`.

    That is the first cell after the one it is destroyed from that it did not cover; the next
    obstacle's place, or the route's end, where that comes first.

    Args:
      labels: int32 [B, L, H, W].
      cells, num_cells: int32 [B, N, 2], [B], a route.
      destroyed, destroyed_at: int32 [B, K], as in `Solution`; the result is -1 where there is no
        obstacle.
    """
    # the last cells covered are searched along the route, one obstacle after the other
    L, N, K = labels.shape[1], cells.shape[1], destroyed.shape[1]

    def all_routes(labels: Array, cells: Array, last: Array, ids: Array, at: Array) -> Array:
        def one_route(which: Array, last: Array, ids: Array, at: Array) -> Array:
            def is_covered(index: Array, obstacle: Array) -> Array:
                row, col = lax.dynamic_slice(cells, (which, index, jnp.int32(0)), (1, 1, 2))[0, 0]
                owners = [
                    lax.dynamic_slice(labels, (which, jnp.int32(layer), row, col), (1, 1, 1, 1))
                    for layer in range(L)
                ]
                return (jnp.stack(owners).reshape(-1) == obstacle).any()

            def leave(k: Array, left: Array) -> Array:
                obstacle, here = ids[k], at[k]
                following = jnp.where(
                    (k + 1 < K) & (ids[(k + 1).clip(0, K - 1)] >= 0),
                    at[(k + 1).clip(0, K - 1)],
                    last,
                )
                # ends at the next obstacle's place or the route's end
                first = jnp.minimum(here + 1, following)
                end = lax.while_loop(
                    lambda i: (i < following) & is_covered(i, obstacle), lambda i: i + 1, first
                )
                return lax.dynamic_update_slice(left, jnp.where(obstacle >= 0, end, -1)[None], (k,))

            return lax.fori_loop(
                jnp.int32(0), (ids >= 0).sum(dtype=jnp.int32), leave, jnp.full(K, -1, jnp.int32)
            )

        return each(one_route, jnp.arange(cells.shape[0], dtype=jnp.int32), last, ids, at)

    # A route that did not fit has no cells to read.
    ids = jnp.where((num_cells <= N)[:, None], destroyed, -1)
    return compiled_whole(all_routes)(labels, cells, num_cells - 1, ids, destroyed_at)


def place_plan(
    act: Array, slot: Array, num_cells: Array, destroyed: Array, destroyed_at: Array, left_at: Array
) -> tuple:
    """Returns a plan over the slots 0, 1, ... as (plan, plan_at) of a `Solution`; slot k holds the
    k-th obstacle destroyed.

    Args:
      act, slot: int32 [B, P], -1 where there is no step.
      num_cells: int32 [B]. destroyed, destroyed_at, left_at: int32 [B, K].
    """

    def run(
        act: Array,
        slot: Array,
        num_cells: Array,
        destroyed: Array,
        destroyed_at: Array,
        left_at: Array,
    ) -> tuple:
        def of_slot(values: Array) -> Array:
            return jnp.take_along_axis(values, slot.clip(0, values.shape[1] - 1), axis=1)

        # a pass ends behind its obstacle, other acts at the place of destroying; the last step and
        # a relocation end at the goal
        is_last = (act >= 0) & (jnp.pad(act, ((0, 0), (0, 1)), constant_values=-1)[:, 1:] < 0)
        ends = jnp.where(act == Act.PASS, of_slot(left_at), of_slot(destroyed_at))
        ends = jnp.where(is_last | (act == Act.RELOCATE), num_cells[:, None] - 1, ends)
        plan = jnp.stack([act, jnp.where(slot >= 0, of_slot(destroyed), -1)], axis=-1)
        return plan, jnp.where(act >= 0, ends, -1)

    return compiled_whole(in_a_loop(run))(act, slot, num_cells, destroyed, destroyed_at, left_at)
