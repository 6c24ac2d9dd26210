"""Which plans of a queue contain a detour: a state that already includes what a later step needs.
Jitted, with the batch as the last axis.

The search itself cannot see detours: it regresses from the goal, and a detour shows only when its
situations are compared with the states reached from the start.

A plan is followed in both directions: forwards, `states[t]` is the state before step t; backwards,
`situations[t]` is what must hold after step t for the rest of the plan to reach the goal. If
`states[i]` includes `situations[t]` for some t >= i, steps i to t can be left out together.
"""

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import compiled_whole
from sign_model.foundation.records import Array


def have_detours(
    keeps: Array,
    needs: Array,
    deletes: Array,
    start: Array,
    goal: Array,
    plan: Array,
    *,
    lanes: int,
) -> Array:
    """Returns bool [Q]: whether some steps of a plan can be left out together (see
    `shorten.drop_detours`).

    Args:
      keeps, needs, deletes: uint32 [W, A], of `Tables`.
      start, goal: uint32 [Q, W].
      plan: int32 [Q, L], actions in the order of execution, -1 after the last.
      lanes: batch slots, B: plans examined side by side; Q is a multiple.
    """

    def in_chunks(rows: Array) -> Array:
        return jnp.moveaxis(rows.reshape(-1, lanes, rows.shape[1]), 2, 1)  # [chunks, width, B]

    def search(
        keeps: Array,
        needs: Array,
        deletes: Array,
        start: Array,
        goal: Array,
        plan: Array,
    ) -> Array:
        chunks, num_steps = plan.shape[0], plan.shape[1]
        # The number of chunks is hidden from the compiler, which would unroll a loop of one chunk.
        chunks = chunks + (plan[0, 0, 0] & 0)

        def examine_chunk(i: Array, found: Array) -> Array:
            one = (lax.dynamic_index_in_dim(x, i, keepdims=False) for x in (start, goal, plan))
            new = _in_one_chunk(keeps, needs, deletes, *one)
            return lax.dynamic_update_index_in_dim(found, new, i, 0)

        assert num_steps > 0
        nothing = jnp.zeros((plan.shape[0], lanes), bool)
        return lax.fori_loop(jnp.int32(0), chunks, examine_chunk, nothing)

    return compiled_whole(search)(
        keeps, needs, deletes, *map(in_chunks, (start, goal, plan))
    ).reshape(-1)


def _in_one_chunk(
    keeps: Array,
    needs: Array,
    deletes: Array,
    start: Array,
    goal: Array,
    plan: Array,
) -> Array:
    """Returns the same for one chunk: start, goal uint32 [W, B], plan int32 [L, B] -> bool [B]."""
    num_steps = plan.shape[0]

    def row(table: Array, action: Array) -> Array:
        return jnp.where(
            action >= 0,
            table.at[:, jnp.maximum(action, 0)].get(mode="promise_in_bounds"),
            jnp.uint32(0),
        )

    def forward(state: Array, action: Array) -> tuple[Array, Array]:
        return (state & ~row(deletes, action)) | row(~keeps, action), state

    def backward(situation: Array, action: Array) -> tuple[Array, Array]:
        return (situation & ~row(~keeps, action)) | row(needs, action), situation

    # Follow the plan in both directions, [L, W, B] each: the states before the steps, and what must
    # hold after them.
    states = lax.scan(forward, start, plan)[1]
    situations = lax.scan(backward, goal, plan, reverse=True)[1]

    # Compare every state with the needs of every later step. Padding after the last action is no
    # step.
    def compare_state(i: Array, found: Array) -> Array:
        state = lax.dynamic_index_in_dim(states, i)  # [1, W, B]
        meets = ((situations & ~state) == 0).all(axis=1)
        later = (jnp.arange(num_steps, dtype=jnp.int32)[:, None] >= i) & (plan >= 0)
        return found | (meets & later).any(axis=0)

    return repeat(num_steps, compare_state, jnp.zeros(plan.shape[1], bool))
