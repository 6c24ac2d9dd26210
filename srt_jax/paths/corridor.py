"""A path that stays within a permitted deviation from the straight link of its ends (PY16 §2,
Figure 1: H1, H2).
"""

from collections.abc import Sequence

import jax.numpy as jnp

from srt_jax.engine import arguments
from srt_jax.moves import max_path_cells
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.paths.path import trace_path
from srt_jax.types import Array, Path

_SLACK = 1e-4
"""By how much a deviation may be exceeded, in cell sides: more than the error of float32 on a map
of 2048 x 2048 cells.
"""


def path_within(
    free: Array,
    start: Array | Sequence[int],
    goal: Array | Sequence[int],
    deviation: Array | float,
    *,
    max_cells: int | None = None,
) -> Path:
    """Returns a shortest path that nowhere strays from the straight link by more than `deviation`;
    empty where there is none.

    PY16 §2. The search is limited to the corridor about the link, so a longer path is found, or
    none, where the shortest of all leaves it. Ties as in `trace_path`. May be called inside jit and
    vmap.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start, goal: int32 [..., 2], (row, col).
      deviation: float32 [...] or a number, in cell sides, 0 or more; inf permits any path.
      max_cells: how many cells `cells` holds; by default enough for any path.

    Returns:
      Path, as of `trace_path`.

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> path = srt_jax.path_within(free, (2, 0), (2, 6), deviation=1)
      >>> path.num_cells.item(), path.cost.item()
      (7, 6.0)
    """
    free = arguments.as_mask("free", free)
    height, width = free.shape[-2:]
    narrowed = free & corridor(start, goal, deviation, height=height, width=width)
    return trace_path(
        cost_to_come(narrowed, start), goal, max_cells=max_cells or max_path_cells(height, width)
    )


def corridor(
    start: Array | Sequence[int],
    goal: Array | Sequence[int],
    deviation: Array | float,
    *,
    height: int,
    width: int,
) -> Array:
    """Returns the cells whose centres lie no farther than `deviation` from the straight link: bool
    [..., H, W].

    The distance from a segment is convex, so a path that steps from such cell to such cell stays
    within all the way.

    Args:
      start, goal: int32 [..., 2], (row, col).
      deviation: float32 [...] or a number, in cell sides.
      height, width: H, W.
    """
    start, goal = (
        jnp.asarray(arguments.as_cells("start", start)),
        jnp.asarray(arguments.as_cells("goal", goal)),
    )
    # one batch axis after the other, then rows and columns
    permitted = jnp.asarray(deviation, jnp.float32)
    permitted = jnp.broadcast_to(permitted, start.shape[:-1])[..., None, None] + jnp.float32(_SLACK)
    rows, cols = jnp.indices((height, width), jnp.int32)
    rows, cols = (place.reshape((1,) * (start.ndim - 1) + place.shape) for place in (rows, cols))
    (row, col), (to_row, to_col) = (_row_and_col(cell) for cell in (start, goal))
    down, right = to_row - row, to_col - col
    # distance from the link: that from its line between the ends, else from the nearer end
    along = (rows - row) * down + (cols - col) * right
    across = jnp.abs((rows - row) * right - (cols - col) * down).astype(jnp.float32)
    length = down * down + right * right
    from_start = jnp.hypot((rows - row).astype(jnp.float32), (cols - col).astype(jnp.float32))
    from_goal = jnp.hypot((rows - to_row).astype(jnp.float32), (cols - to_col).astype(jnp.float32))
    away = across / jnp.sqrt(length.clip(1).astype(jnp.float32))
    away = jnp.where(
        along > length, from_goal, jnp.where((along < 0) | (length == 0), from_start, away)
    )
    return away <= permitted


def _row_and_col(cell: Array) -> tuple[Array, Array]:
    return cell[..., 0, None, None], cell[..., 1, None, None]
