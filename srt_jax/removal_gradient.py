"""The cost of the least removal as a differentiable function of the removal costs."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.dtypes import float0

from srt_jax.engine.arguments import is_traced
from srt_jax.engine.entrance import require_task
from srt_jax.solver import solve
from srt_jax.types import Array, Task


def least_removal(
    task: Task, *, max_destroyed: int = 8, max_cells: int | None = None, with_route: bool = False
) -> Array | tuple[Array, Array]:
    """Returns what the obstacles cost that `solve` destroys; 0 where a path exists, inf where none
    can be opened.

    Differentiable with respect to `task.removal_cost`. By the envelope theorem the gradient is 1
    for every obstacle destroyed and 0 for every other (all 0 where the cost is 0 or inf); where
    several sets cost the least, it is that of the one that `solve` takes. Where the least is not
    proven (`Solution.removal_bound`), cost and gradient are those of the set found.

        jax.grad(lambda costs: least_removal(task.replace(removal_cost=costs)))(task.removal_cost)

    Args:
      task: one task or a batch.
      max_destroyed, max_cells: as for `solve`; a budget that is spent gives inf.
      with_route: whether to return the length of the route as well. It changes only where the set
        changes: its derivative is 0.

    Raises:
      ValueError: a removal cost is not positive (where its value is known, hence not inside jit).

    Returns:
      float32 [...]; with the route, a pair of these, the route inf where there is none.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> srt_jax.least_removal(task).item()
      1.0
    """

    require_task("least_removal", task)
    _check_costs(task)

    @jax.custom_jvp
    def costs(removal_cost: Array, rest: Task) -> tuple[Array, Array, Array]:
        solution = solve(
            rest.replace(removal_cost=removal_cost),
            max_destroyed=max_destroyed,
            max_cells=max_cells,
        )
        return solution.removal_cost, solution.cost, solution.destroyed

    @costs.defjvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        removal, route, destroyed = costs(*primals)
        change = tangents[0]
        if change.dtype == float0:
            change = jnp.zeros(primals[0].shape, jnp.float32)
        along = jnp.where(_is_destroyed(destroyed, change.shape[-1]), change, 0).sum(axis=-1)
        return (removal, route, destroyed), (
            along,
            jnp.zeros_like(along),
            np.zeros(destroyed.shape, float0),
        )

    rest = task.replace(removal_cost=jax.lax.stop_gradient(task.removal_cost))
    removal, route, _ = costs(task.removal_cost, rest)
    return (removal, route) if with_route else removal


def _check_costs(task: Task) -> None:
    if is_traced(task):
        return
    costs, flags = np.asarray(task.removal_cost), np.asarray(task.destroyable)
    wrong = np.argwhere(flags & ~(costs > 0)) if flags.shape == costs.shape else []
    if len(wrong):
        place = tuple(wrong[0].tolist())
        raise ValueError(
            f"removal_cost at {list(place)} is {costs[place]}: it must be positive; learn its"
            " logarithm, or clip it"
        )


def _is_destroyed(destroyed: Array, num_obstacles: int) -> Array:
    """Which obstacles are among the ids `destroyed`: int32 [..., K] -> bool [..., M]."""
    ids = jnp.arange(num_obstacles, dtype=jnp.int32).reshape([1] * destroyed.ndim + [num_obstacles])
    return (destroyed[..., None] == ids).any(axis=-2)
