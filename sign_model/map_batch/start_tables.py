"""What each feature still needs, tabulated from the starts of a whole batch: the tables of
`map_algorithm.landmarks`, jitted and on packed words.

The batch is the last axis, as everywhere in `map_batch`. Row F of each table stands for the feature
"none", which pads the lists of conditions: it needs nothing.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.records import Array
from sign_model.foundation.words import WORD, pack_columns
from sign_model.map_batch.tables import Tables

_ALL = np.uint32(0xFFFFFFFF)
# A bound for the compiler only: each fixpoint here ends by itself, because its values only grow or
# only shrink.
_MAX_SWEEPS = 4096


def landmark_table(tables: Tables, start: Array) -> Array:
    """Returns uint32 [F, S, B], the landmarks of each feature as seen from each task's start (see
    `landmarks.landmark_table`).

    Args:
      tables: of the domain.
      start: bool [F, B].
    """
    size, num_tasks = start.shape
    # What holds at the start needs nothing, and neither does "none".
    at_start = jnp.concatenate([start, jnp.ones((1, num_tasks), bool)])[:, None]
    comes_along = (
        jnp.asarray(tables.column_adds)[:, :, None]
        & ~pack_columns(at_start[:, 0][tables.column_features])[None]
    )
    # The greatest fixpoint: begin with every landmark; each sweep can only remove some.
    first = jnp.where(
        at_start, jnp.uint32(0), jnp.full((size + 1, tables.column_own.shape[1], num_tasks), _ALL)
    )

    own = tables.column_own[:, :, None]

    def sweep(table: Array) -> Array:
        # An action needs what its conditions need, and what it adds comes along with it.
        need = comes_along
        for p in range(tables.need_lists.shape[1]):
            need = need | table[tables.need_lists[:, p]]
        # A feature needs what all its achievers need, and itself.
        return jnp.where(
            at_start, jnp.uint32(0), _over_achievers(tables, jnp.bitwise_and, need, _ALL) | own
        )

    return _fixpoint(sweep, first)[:-1]


class _Sweep(NamedTuple):
    """The carry of a fixpoint."""

    values: Array
    is_changed: Array  # bool []
    count: Array  # int32 [], sweeps so far


def _fixpoint(sweep: Callable[[Array], Array], first: Array) -> Array:
    """Returns the values that one more sweep leaves unchanged."""

    def step(state: _Sweep) -> _Sweep:
        new = sweep(state.values)
        return _Sweep(new, (new != state.values).any(), state.count + 1)

    def continues(state: _Sweep) -> Array:
        return state.is_changed & (state.count < _MAX_SWEEPS)

    return lax.while_loop(continues, step, _Sweep(first, jnp.array(True), jnp.int32(0))).values


def _over_achievers(
    tables: Tables,
    combine: Callable[[Array, Array], Array],
    of_actions: Array,
    empty: np.uint32 | Array,
) -> Array:
    """Returns a value of every action combined over the achievers of each feature: [A, ...] ->
    [F + 1, ...], `empty` for a feature without achiever.

    A tree of fours: each level combines four rows of the level below.
    """
    below, levels = of_actions, []
    for fours in tables.achievers:
        one, two, three, four = (below[fours[:, i]] for i in range(4))
        below = combine(combine(one, two), combine(three, four))
        levels.append(below)
    nothing = jnp.full((1, *of_actions.shape[1:]), empty, of_actions.dtype)
    return jnp.concatenate([*levels, nothing])[tables.achieved_at]


def relaxed_plan_table(tables: Tables, start: Array) -> Array:
    """Returns uint32 [F, A / 32, B], the relaxed plan of each feature (see
    `landmarks.relaxed_plan_table`).

    Args:
      tables: of the domain.
      start: bool [F, B].
    """
    size = start.shape[0]
    # The own action of each feature, its cheapest achiever, as one bit: [F + 1, A / 32, B].
    cost, action_cost = _relaxed_costs(tables, start)
    best = _best_achievers(tables, cost, action_cost)
    words = tables.need_lists.shape[0] // WORD
    own_word = jnp.arange(words, dtype=jnp.int32)[None, :, None] == (best >> 5)[:, None]
    own = jnp.where(
        own_word & (best >= 0)[:, None],
        jnp.uint32(1) << (best & 31).astype(jnp.uint32)[:, None],
        jnp.uint32(0),
    )
    # The conditions of that action, int32 [F + 1, P, B].
    needs = jnp.where(
        (best >= 0)[:, None], tables.need_lists[jnp.maximum(best, 0)].swapaxes(1, 2), size
    )

    # The least fixpoint: a feature needs its own action and the relaxed plans of its conditions.
    def sweep(table: Array) -> Array:
        new = own
        for p in range(needs.shape[1]):
            new = new | jnp.take_along_axis(
                table, jnp.broadcast_to(needs[:, p][:, None], own.shape), 0
            )
        return new

    return _fixpoint(sweep, own)[:-1]


def _best_achievers(tables: Tables, cost: Array, action_cost: Array) -> Array:
    """Returns int32 [F + 1, B]: the cheapest achiever, the lowest of several; -1 for what holds at
    the start or is unreachable.

    Args:
      tables: of the domain.
      cost, action_cost: float32 [F + 1, B] and [A, B], of `_relaxed_costs`.
    """
    numbers = jnp.broadcast_to(
        jnp.arange(action_cost.shape[0], dtype=jnp.float32)[:, None], action_cost.shape
    )

    # Pairs (cost, action number), [..., 2, B]. Achievers ascend, so a tie stays with the lowest.
    def cheaper(one: Array, later: Array) -> Array:
        return jnp.where(later[:, :1] < one[:, :1], later, one)

    offers = _over_achievers(
        tables, cheaper, jnp.stack([action_cost, numbers], axis=1), jnp.float32(jnp.inf)
    )
    found = (cost > 0) & (offers[:, 0] < jnp.inf)
    return jnp.where(found, jnp.where(found, offers[:, 1], jnp.float32(0)).astype(jnp.int32), -1)


def _relaxed_costs(tables: Tables, start: Array) -> tuple[Array, Array]:
    """Returns the h_add costs of the features, float32 [F + 1, B], and of the actions, float32
    [A, B]; start is bool [F, B].
    """
    free = jnp.zeros((1, start.shape[1]), jnp.float32)
    first = jnp.concatenate([jnp.where(start, jnp.float32(0), jnp.float32(jnp.inf)), free])

    def actions_from(cost: Array) -> Array:
        return cost[tables.need_lists].sum(axis=1) + jnp.float32(1)

    def sweep(cost: Array) -> Array:
        return jnp.minimum(
            cost, _over_achievers(tables, jnp.minimum, actions_from(cost), jnp.float32(jnp.inf))
        )

    cost = _fixpoint(sweep, first)
    return cost, actions_from(cost)
