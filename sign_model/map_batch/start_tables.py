"""What each feature still needs, tabulated from the starts of a whole batch: `landmarks` on packed
words, jitted.

The batch is the minor axis, as everywhere in `kernel`.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.words import WORD, pack_columns
from sign_model.map_batch.tables import Tables

_ALL = np.uint32(0xFFFFFFFF)
# a bound for the compiler: each fixpoint here ends by itself, as it only grows or only shrinks
_MAX_SWEEPS = 4096


def landmark_table(tables: Tables, start: jax.Array) -> jax.Array:
    """Returns uint32 [F, S, B], the landmarks of each feature as seen from each task's start (see
    `landmarks.landmark_table`).

    Args:
      tables: of the domain.
      start: bool [F, B].
    """
    size, num_tasks = start.shape
    # "none" needs nothing
    at_start = jnp.concatenate([start, jnp.ones((1, num_tasks), bool)])[:, None]
    comes_along = (
        jnp.asarray(tables.column_adds)[:, :, None]
        & ~pack_columns(at_start[:, 0][tables.column_features])[None]
    )
    first = jnp.where(
        at_start, jnp.uint32(0), jnp.full((size + 1, tables.column_own.shape[1], num_tasks), _ALL)
    )

    own = tables.column_own[:, :, None]

    def sweep(state):
        table, _, count = state
        need = comes_along
        for p in range(tables.need_lists.shape[1]):
            need = need | table[tables.need_lists[:, p]]
        new = jnp.where(
            at_start, jnp.uint32(0), _over_achievers(tables, jnp.bitwise_and, need, _ALL) | own
        )
        return new, (new != table).any(), count + 1

    state = (first, jnp.array(True), jnp.int32(0))
    return lax.while_loop(lambda s: s[1] & (s[2] < _MAX_SWEEPS), sweep, state)[0][:-1]


def _over_achievers(tables: Tables, combine, of_actions: jax.Array, empty) -> jax.Array:
    """Combines a value of every action over the achievers of each feature: [A, ...] -> [F + 1,
    ...], `empty` without achiever.

    A tree of fours: each level combines four rows of the level below.
    """
    below, levels = of_actions, []
    for fours in tables.achievers:
        one, two, three, four = (below[fours[:, i]] for i in range(4))
        below = combine(combine(one, two), combine(three, four))
        levels.append(below)
    nothing = jnp.full((1, *of_actions.shape[1:]), empty, of_actions.dtype)
    return jnp.concatenate([*levels, nothing])[tables.achieved_at]


def relaxed_plan_table(tables: Tables, start: jax.Array) -> jax.Array:
    """Returns uint32 [F, A / 32, B], the relaxed plan of each feature (see
    `landmarks.relaxed_plan_table`).
    """
    size = start.shape[0]
    cost, action_cost = _relaxed_costs(tables, start)
    best = _best_achievers(tables, cost, action_cost)
    words = tables.need_lists.shape[0] // WORD
    own_word = jnp.arange(words, dtype=jnp.int32)[None, :, None] == (best >> 5)[:, None]
    own = jnp.where(
        own_word & (best >= 0)[:, None],
        jnp.uint32(1) << (best & 31).astype(jnp.uint32)[:, None],
        jnp.uint32(0),
    )
    # [F + 1, P, B]
    needs = jnp.where(
        (best >= 0)[:, None], tables.need_lists[jnp.maximum(best, 0)].swapaxes(1, 2), size
    )

    def sweep(state):
        table, _, count = state
        new = own
        for p in range(needs.shape[1]):
            new = new | jnp.take_along_axis(
                table, jnp.broadcast_to(needs[:, p][:, None], own.shape), 0
            )
        return new, (new != table).any(), count + 1

    return lax.while_loop(
        lambda s: s[1] & (s[2] < _MAX_SWEEPS), sweep, (own, jnp.array(True), jnp.int32(0))
    )[0][:-1]


def _best_achievers(tables: Tables, cost: jax.Array, action_cost: jax.Array) -> jax.Array:
    """int32 [F + 1, B]: the cheapest achiever, the lowest of several; -1 for what is in the start
    or unreachable.
    """
    numbers = jnp.broadcast_to(
        jnp.arange(action_cost.shape[0], dtype=jnp.float32)[:, None], action_cost.shape
    )

    def cheaper(one, later):
        return jnp.where(later[:, :1] < one[:, :1], later, one)

    offers = _over_achievers(
        tables, cheaper, jnp.stack([action_cost, numbers], axis=1), jnp.float32(jnp.inf)
    )
    found = (cost > 0) & (offers[:, 0] < jnp.inf)
    return jnp.where(found, jnp.where(found, offers[:, 1], jnp.float32(0)).astype(jnp.int32), -1)


def _relaxed_costs(tables: Tables, start: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(h_add of each feature float32 [F + 1, B], of each action [A, B])."""
    free = jnp.zeros((1, start.shape[1]), jnp.float32)
    first = jnp.concatenate([jnp.where(start, jnp.float32(0), jnp.float32(jnp.inf)), free])

    def actions_from(cost):
        return cost[tables.need_lists].sum(axis=1) + jnp.float32(1)

    def sweep(state):
        cost, _, count = state
        new = jnp.minimum(
            cost, _over_achievers(tables, jnp.minimum, actions_from(cost), jnp.float32(jnp.inf))
        )
        return new, (new != cost).any(), count + 1

    cost = lax.while_loop(
        lambda s: s[1] & (s[2] < _MAX_SWEEPS), sweep, (first, jnp.array(True), jnp.int32(0))
    )[0]
    return cost, actions_from(cost)
