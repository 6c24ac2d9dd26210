"""Which plans of a queue contain a detour: a state that already includes what a later step needs.
Jitted, the batch last.

The search itself cannot see them: it looks back from the goal, and a detour shows only against the
states from the start on.
"""

import jax
import jax.numpy as jnp
from jax import lax

from sign_model.map_batch.compiled import compiled_whole


def have_detours(
    keeps: jax.Array,
    needs: jax.Array,
    deletes: jax.Array,
    start: jax.Array,
    goal: jax.Array,
    plan: jax.Array,
    *,
    lanes: int,
) -> jax.Array:
    """Returns bool [Q]: whether some steps of a plan can be left out together (see
    `shorten.drop_detours`).

    Args:
      keeps, needs, deletes: uint32 [W, A], of `Tables`.
      start, goal: uint32 [Q, W].
      plan: int32 [Q, L], actions in the order of execution, -1 after the last.
      lanes: plans side by side; Q is a multiple.
    """

    def by_lanes(rows: jax.Array) -> jax.Array:
        return jnp.moveaxis(rows.reshape(-1, lanes, rows.shape[1]), 2, 1)  # [chunks, width, lanes]

    def search(keeps, needs, deletes, start, goal, plan):
        chunks, num_steps = plan.shape[0], plan.shape[1]
        # not known to the compiler: a loop of one chunk would be taken apart
        chunks = chunks + (plan[0, 0, 0] & 0)

        def chunk(i, found):
            one = (lax.dynamic_index_in_dim(x, i, keepdims=False) for x in (start, goal, plan))
            new = _in_lanes(keeps, needs, deletes, *one)
            return lax.dynamic_update_index_in_dim(found, new, i, 0)

        assert num_steps > 0
        return lax.fori_loop(0, chunks, chunk, jnp.zeros((plan.shape[0], lanes), bool))

    return compiled_whole(search)(
        keeps, needs, deletes, *map(by_lanes, (start, goal, plan))
    ).reshape(-1)


def _in_lanes(keeps, needs, deletes, start, goal, plan):
    """The same for one chunk: start, goal uint32 [W, B], plan int32 [L, B] -> bool [B]."""
    num_steps = plan.shape[0]

    def row(table: jax.Array, action: jax.Array) -> jax.Array:
        return jnp.where(
            action >= 0,
            table.at[:, jnp.maximum(action, 0)].get(mode="promise_in_bounds"),
            jnp.uint32(0),
        )

    def forward(state, action):
        return (state & ~row(deletes, action)) | row(~keeps, action), state

    def backward(situation, action):
        return (situation & ~row(~keeps, action)) | row(needs, action), situation

    states = lax.scan(forward, start, plan)[1]  # [L, W, B], before each step
    # [L, W, B], what must hold after each step
    situations = lax.scan(backward, goal, plan, reverse=True)[1]

    def at_step(i, found):
        state = lax.dynamic_index_in_dim(states, i)  # [1, W, B]
        meets = ((situations & ~state) == 0).all(axis=1)
        later = (jnp.arange(num_steps, dtype=jnp.int32)[:, None] >= i) & (plan >= 0)
        return found | (meets & later).any(axis=0)

    return lax.fori_loop(0, num_steps, at_step, jnp.zeros(plan.shape[1], bool))
