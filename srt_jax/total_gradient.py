"""The least total of length and tolls as a differentiable function of removal costs and toll."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.dtypes import float0

from srt_jax.engine.entrance import require_task
from srt_jax.solver import solve
from srt_jax.types import Array, Task


def least_total(
    task: Task, toll: float | Array = 1.0, *, max_destroyed: int = 8, max_cells: int | None = None
) -> Array:
    """Returns `Solution.total` of mode "shortest": the least sum of a route's length and the tolls
    of what it destroys; inf without a route.

    Differentiable with respect to `task.removal_cost` and `toll`. By the envelope theorem the
    derivative is that of the route found: by the cost of an obstacle `toll` where it is destroyed
    and 0 elsewhere, by the toll the removal cost of what is destroyed. The lengths of moves do not
    depend on either, so nothing else changes until another route is the best; where several are,
    it is the one that `solve` takes. Cells all cost the same here: by costs of cells
    `toll_to_come` is differentiable, in which an obstacle is paid at each entry.

    Args:
      task: one task or a batch.
      toll: as for `solve`: one, or float32 [...], one for each task.
      max_destroyed, max_cells: as for `solve`; a budget that is spent gives inf.

    Returns:
      float32 [...].

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((21, 21), bool)
      >>> free[:20, 10] = False  # a wall with a gap far away
      >>> task = srt_jax.make_task(free, (0, 8), (0, 12), removal_cost=3.0)
      >>> srt_jax.least_total(task, 2.0).item()  # 4 long, and twice 3 for the wall
      10.0
      >>> jax.grad(lambda toll: srt_jax.least_total(task, toll))(2.0).item()
      3.0
    """
    require_task("least_total", task)
    batch = np.shape(task.start)[:-1]
    of_each = jnp.broadcast_to(jnp.asarray(toll, jnp.float32), batch)

    @jax.custom_jvp
    def total(removal_cost: Array, toll: Array, rest: Task) -> tuple[Array, Array, Array]:
        solution = solve(
            rest.replace(removal_cost=removal_cost),
            mode="shortest",
            toll=toll,
            max_destroyed=max_destroyed,
            max_cells=max_cells,
        )
        return solution.total, solution.removal_cost, solution.destroyed

    @total.defjvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        value, removal, destroyed = total(*primals)
        cost, toll, _ = primals
        by_cost, by_toll = (
            jnp.zeros(jnp.shape(primal), jnp.float32) if tangent.dtype == float0 else tangent
            for primal, tangent in zip((cost, toll), tangents)
        )
        ids = jnp.arange(cost.shape[-1], dtype=jnp.int32)
        ids = ids.reshape((1,) * (destroyed.ndim - 1) + (-1, 1))
        is_gone = (destroyed[..., None, :] == ids).any(axis=-1)
        along = toll * jnp.where(is_gone, by_cost, 0).sum(axis=-1)
        along = along + jnp.where(jnp.isfinite(removal), removal, 0) * by_toll
        nothing = np.zeros(destroyed.shape, float0)
        return (value, removal, destroyed), (along, jnp.zeros_like(removal), nothing)

    rest = task.replace(removal_cost=jax.lax.stop_gradient(task.removal_cost))
    return total(task.removal_cost, of_each, rest)[0]
