"""The length, or the cost, of a shortest path from the start to every cell (PY16 §3.2: g).

Lengths come from `propagation.lengths`; costs over cells of unequal cost, which are
differentiable, from `gradients.least_costs`.
"""

from srt_jax.engine import arguments, eager
from srt_jax.gradients import least_costs
from srt_jax.paths.shortest import path_length
from srt_jax.propagation.lengths import length_maps
from srt_jax.types import Array


def cost_to_come(free: Array, start: Array, traversal_cost: Array | None = None) -> Array:
    """Returns the length of a shortest path from `start` to each cell; inf where none leads
    (everywhere if `start` is blocked).

    Octile: 1 for a straight move, sqrt 2 for a diagonal one, which needs both cells beside it free
    (PY16 §3.2). Exact up to two relative errors: the rounding to float32, 1.8e-7 at most, and that
    of the fixed point's diagonals, 8e-9 on maps up to 700x700, 3e-7 up to 1700x1700, 1.5e-6 up to
    2600x2600 (`fixed_point`).

    With `traversal_cost`, a move costs its length times the mean of the costs of its two cells
    (`cell_costs`), and the result is differentiable with respect to the costs, forwards and
    backwards (`least_costs`): blocked and unreached cells have gradient 0.

    Memory besides arguments and result: 20 bytes a cell of the one map in work, whatever the batch
    (without `traversal_cost`).

    Args:
      free: bool [..., H, W], True where the agent fits.
      start: int32 [..., 2], (row, col); may lie outside the map.
      traversal_cost: float32 [..., H, W], positive on free cells, 1 where a move costs its length;
        inf blocks the cell. Where all free cells of a map cost the same, the lengths are computed
        and multiplied.

    Returns:
      float32 [..., H, W], in cell sides (times the cost).

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit; outside jit, for a cost that
        is not positive.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> print(srt_jax.cost_to_come(free, (2, 0))[2])
      [ 0.  1.  2. inf inf inf inf]
      >>> swamp = np.full((5, 7), 3, np.float32)  # three times as dear as open ground
      >>> print(srt_jax.cost_to_come(free, (2, 0), swamp)[2, :3])
      [0. 3. 6.]
    """
    (free, start), batch = arguments.mask_and_cells(free=free, start=start)
    if traversal_cost is not None:
        return least_costs.least_costs(
            free, start, arguments.as_floats("traversal_cost", traversal_cost)
        )
    return eager.call(length_maps, batch, free, start)


def path_cost(
    free: Array,
    start: Array,
    goal: Array,
    traversal_cost: Array | None = None,
) -> Array:
    """Returns `cost_to_come` at `goal` alone; inf where no path leads there or it lies outside the
    map.

    Without `traversal_cost` as fast as `shortest_path`, which gives the cells too. The derivative
    with respect to `traversal_cost` is that of the path to `goal`: cheaper than the one of the
    whole field, and the path itself, each cell with the length it answers for.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start, goal: int32 [..., 2], (row, col); may lie outside the map.
      traversal_cost: float32 [..., H, W], as in `cost_to_come`.

    Returns:
      float32 [...].

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> round(srt_jax.path_cost(free, (2, 0), (0, 2)).item(), 4)  # two diagonal moves
      2.8284
    """
    if traversal_cost is None:
        return path_length(free, start, goal)
    (free, start, goal), _ = arguments.mask_and_cells(free=free, start=start, goal=goal)
    return least_costs.least_cost(
        free, start, goal, arguments.as_floats("traversal_cost", traversal_cost)
    )
