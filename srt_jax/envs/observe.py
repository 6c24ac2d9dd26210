"""What the agent sees: planes over the whole map or a window round the agent; and which actions do
something.
"""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import core

from srt_jax.envs.levels import Levels
from srt_jax.envs.rules import EnvState, is_standing, owners
from srt_jax.moves import MOVES
from srt_jax.types import OUTSIDE, Array

NUM_PLANES = {"window": 6, "map": 5}


def observation_of(levels: Levels, state: EnvState, kind: str, radius: int) -> Array:
    """Returns the observation, float32 [rows, cols, planes].

    "window", 2 radius + 1 cells a side: 0 fixed (obstacles that cannot be destroyed, and all
    outside the map), 1 destroyable, 2 the price of opening the cell, 3 the goal, 4 and 5 the rows
    and columns to the goal over the map's sides, the same everywhere. "map": 0 to 2 likewise, 3 the
    agent, 4 the goal.
    """
    _, _, H, W = levels.labels.shape
    goal = levels.goal[state.level]
    if kind == "map":
        rows, cols = jnp.arange(H, dtype=jnp.int32), jnp.arange(W, dtype=jnp.int32)
    else:
        around = jnp.arange(-radius, radius + 1, dtype=jnp.int32)
        rows, cols = state.cell[0] + around, state.cell[1] + around
    rows, cols = jnp.broadcast_arrays(rows[:, None], cols[None, :])
    planes = _ground(levels, state, rows, cols)
    at_goal = (rows == goal[0]) & (cols == goal[1])
    if kind == "map":
        planes += [(rows == state.cell[0]) & (cols == state.cell[1]), at_goal]
    else:
        ahead = (goal - state.cell).astype(jnp.float32) / jnp.asarray(np.array([H, W], np.float32))
        planes += [
            at_goal,
            jnp.broadcast_to(ahead[0], rows.shape),
            jnp.broadcast_to(ahead[1], rows.shape),
        ]
    return jnp.stack([plane.astype(jnp.float32) for plane in planes], axis=-1)


def _ground(levels: Levels, state: EnvState, rows: Array, cols: Array) -> list[Array]:
    """Returns the planes fixed, destroyable and price."""
    ids = owners(levels, state.level, rows, cols)
    is_there = is_standing(state.gone, ids)
    price = levels.price[state.level, jnp.maximum(ids, 0)]
    fixed = ((ids == OUTSIDE) | (is_there & ~jnp.isfinite(price))).any(axis=0)
    destroyable = is_there.any(axis=0) & ~fixed
    return [
        fixed,
        destroyable,
        jnp.where(is_there & ~fixed[None], price, jnp.float32(0)).sum(axis=0),
    ]


def observation_bounds(levels: Levels, kind: str, shape: tuple[int, ...]) -> tuple[Any, Any]:
    """Returns the least and the greatest observation, float32 [rows, cols, planes] each, finite.

    On the host, unless the levels are traced: a process that may not compute asks it too.
    """
    library: Any = jnp if isinstance(levels.price, core.Tracer) else np
    price = library.asarray(levels.price)
    L = levels.labels.shape[1]
    # A cell costs what covers it, an obstacle in each layer; their sum is rounded once for each.
    rounded = np.float32(L * (1 + (L - 1) * 2.0**-23))
    finite = library.where(library.isfinite(price), price, library.zeros_like(price))
    most = finite.max(initial=0) * rounded
    low = np.zeros(NUM_PLANES[kind], np.float32)
    if kind == "window":
        low[4:] = -1  # rows and columns to the goal
    high = library.where(np.arange(len(low)) == 2, most, np.float32(1)).astype(np.float32)
    return library.broadcast_to(low, shape), library.broadcast_to(high, shape)


def action_mask(levels: Levels, state: EnvState) -> Array:
    """Returns which actions change something: bool [16], eight moves and eight destroyings.

    Args:
      levels: the pool, as in `EnvParams.levels`.
      state: of one environment; use vmap for several.

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
      >>> np.flatnonzero(envs.action_mask(levels, state)).tolist()  # moves only
      [1, 2, 4, 6, 7]
    """
    moves = jnp.asarray(np.array(MOVES, np.int32))
    rows = state.cell[0] + jnp.stack([moves[:, 0], moves[:, 0], jnp.zeros_like(moves[:, 0])])
    cols = state.cell[1] + jnp.stack([moves[:, 1], jnp.zeros_like(moves[:, 1]), moves[:, 1]])
    ids = owners(levels, state.level, rows, cols)  # [L, 3, 8]
    is_there = is_standing(state.gone, ids)
    can_move = ~(is_there | (ids == OUTSIDE)).any(axis=(0, 1))
    can_destroy = (is_there & jnp.isfinite(levels.price[state.level, jnp.maximum(ids, 0)])).any(
        axis=(0, 1)
    )
    return jnp.concatenate([can_move, can_destroy])
