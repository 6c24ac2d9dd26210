"""Pictures of a state as arrays, drawn with NumPy alone."""

from typing import Any

import jax
import numpy as np

from srt_jax.envs.levels import Levels
from srt_jax.types import OUTSIDE

_COLOURS = {
    "free": (255, 255, 255),
    "outside": (120, 120, 120),
    "fixed": (40, 40, 40),
    "destroyable": (226, 150, 70),
    "goal": (60, 160, 80),
    "agent": (50, 90, 200),
}


def render(state: Any, levels: Levels, *, cell_side: int = 16) -> np.ndarray:
    """Returns the map as it stands, uint8 [H * side, W * side, 3] (host).

    White is free, black fixed, orange can be destroyed, grey is padding; the goal is a green
    square, the agent a blue disc.

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
      >>> envs.render(state, levels, cell_side=8).shape
      (40, 56, 3)
    """
    state = jax.tree.map(np.asarray, state)
    level = int(state.level)
    labels, price = np.asarray(levels.labels[level]), np.asarray(levels.price[level])
    is_gone = np.unpackbits(state.gone.astype("<u4").view(np.uint8), bitorder="little")[
        : len(price)
    ].astype(bool)
    ids = labels.clip(0)
    stands = (labels >= 0) & ~is_gone[ids]
    image = np.full((*labels.shape[1:], 3), _COLOURS["free"], np.uint8)
    image[stands.any(axis=0)] = _COLOURS["destroyable"]
    image[(stands & ~np.isfinite(price[ids])).any(axis=0)] = _COLOURS["fixed"]
    image[(labels == OUTSIDE).any(axis=0)] = _COLOURS["outside"]
    image = image.repeat(cell_side, axis=0).repeat(cell_side, axis=1)
    apart = abs(np.arange(cell_side) - (cell_side - 1) / 2)
    square = np.maximum(apart[:, None], apart[None]) <= 0.4 * cell_side
    disc = np.hypot(apart[:, None], apart[None]) <= 0.35 * cell_side
    for (row, col), mark, colour in (
        (levels.goal[level], square, "goal"),
        (state.cell, disc, "agent"),
    ):
        top, left = int(row) * cell_side, int(col) * cell_side
        image[top : top + cell_side, left : left + cell_side][mark] = _COLOURS[colour]
    return image
