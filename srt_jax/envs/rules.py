"""What an action does: eight moves, and destroying what is in the way of each. Reads three cells,
whatever the map's size.

Action m of 0..7 is the move `MOVES[m]`; action 8 + m destroys every destroyable obstacle in the way
of that move: those on the cell ahead and, on a diagonal, on the two cells beside it. The agent has
no heading (PY16 §2: it is a disc), it need not turn. A route of `solve` needs at each step exactly
the obstacles so named gone (`srt_jax.removal.route`), hence these actions carry out every answer,
at its own removal cost and length.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from sign_model.foundation.words import contains, num_words, pack_members
from srt_jax.envs.levels import Levels
from srt_jax.moves import MOVES, is_on_map
from srt_jax.types import OUTSIDE, Array, Record, record

NUM_ACTIONS = 2 * len(MOVES)
"""16: move m is action m, and action 8 + m destroys what stands in the way of move m."""


@record
class EnvState(Record):
    """Where an episode stands. A dozen numbers: maps stay in the parameters.

    Attributes:
      level: int32 [], number of the level in the pool.
      cell: int32 [2], where the agent is.
      gone: uint32 [M / 32, rounded up], the obstacles destroyed, a bit each.
      time: int32 [], steps taken.
      length: float32 [], way walked in cell sides.
      removal: float32 [], cost of what was destroyed.
      score: float32 [], sum of rewards.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax import envs
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> levels = envs.make_levels([srt_jax.make_task(free, (2, 0), (2, 6))])
      >>> env, params = envs.make(levels=levels)
      >>> _, state = env.reset(jax.random.key(0), params)
      >>> state.cell.tolist(), state.time.item()
      ([2, 0], 0)
    """

    level: Array
    cell: Array
    gone: Array
    time: Array
    length: Array
    removal: Array
    score: Array


class Effect(NamedTuple):
    """What an action brought about: way walked, cost of what was destroyed, whether anything
    changed.
    """

    cell: Array
    gone: Array
    length: Array
    removal: Array
    is_wasted: Array


def no_words(num_obstacles: int) -> Array:
    """Returns the set of gone obstacles that is empty: uint32 [M / 32, rounded up]."""
    return jnp.zeros(num_words(num_obstacles), jnp.uint32)


def owners(levels: Levels, level: Array, rows: Array, cols: Array) -> Array:
    """Returns the labels at cells int32 [...] of a level: int32 [L, ...]; OUTSIDE beyond the
    array.
    """
    _, L, H, W = levels.labels.shape
    is_inside = is_on_map(rows, cols, H, W)
    rows, cols = rows.clip(0, H - 1), cols.clip(0, W - 1)
    return jnp.stack(
        [
            jnp.where(is_inside, levels.labels[level, jnp.int32(layer), rows, cols], OUTSIDE)
            for layer in range(L)
        ]
    )


def is_standing(gone: Array, ids: Array) -> Array:
    """Returns which labels are of obstacles not yet gone; False for FREE and OUTSIDE."""
    return (ids >= 0) & ~contains(gone, ids)


def act(levels: Levels, state: EnvState, action: Array) -> Effect:
    """Returns what the action does; blocked moves and destroying nothing change nothing."""
    action = jnp.asarray(action).astype(jnp.int32)
    move = jnp.asarray(np.array(MOVES, np.int32))[action % len(MOVES)]
    is_move = action < len(MOVES)
    zero = jnp.int32(0)
    rows, cols = (
        state.cell[0] + jnp.stack([move[0], move[0], zero]),
        state.cell[1] + jnp.stack([move[1], zero, move[1]]),
    )
    # a straight move names its own cell: free, the agent is on it
    ids = owners(levels, state.level, rows, cols).reshape(-1)
    is_there = is_standing(state.gone, ids)
    is_moving = is_move & ~(is_there | (ids == OUTSIDE)).any()
    price = levels.price[state.level, jnp.maximum(ids, 0)]
    is_hit = is_there & jnp.isfinite(price) & ~is_move
    is_again = jnp.tril(ids[:, None] == ids[None, :], -1).any(axis=1)
    straight, diagonal = jnp.float32(1), jnp.float32(2**0.5)
    return Effect(
        cell=jnp.where(is_moving, state.cell + move, state.cell),
        gone=state.gone | pack_members(ids, is_hit, state.gone.shape[0]),
        length=jnp.where(
            is_moving, jnp.where((move != 0).all(), diagonal, straight), jnp.float32(0)
        ),
        removal=jnp.where(is_hit & ~is_again, price, jnp.float32(0)).sum(),
        is_wasted=~is_moving & ~is_hit.any(),
    )
