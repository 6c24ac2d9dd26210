"""Derivatives of least costs, by the envelope theorem: those of the cost of the least path.

A least cost is the minimum, over all paths, of sums that are linear in the cell costs. Where one
path is least, the derivative is that path's: for each cell on it, the length of it that the cell
answers for. Where several are, it is that of the path which the rule of `path_tree.parents` picks
(the first in row order): one of the supergradients, always the same one.

The rules are custom_jvp with a linear solve along the tree of shortest paths inside, so forward and
reverse mode both work, and reverse mode stores one byte a cell.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.dtypes import float0

from sign_model.foundation.marks import jitted
from srt_jax.engine import arguments, eager
from srt_jax.gradients.cell_costs import cost_maps
from srt_jax.gradients.path_tree import move_integral, parents, path_mask, path_sums
from srt_jax.moves import is_on_map
from srt_jax.types import Array


def least_costs(free: Array, start: Array, cell_cost: Array) -> Array:
    """Returns `distance.cost_to_come` for cells of unequal cost, differentiable with respect to
    `cell_cost`.

    Args:
      free: bool [..., H, W]. start: int32 [..., 2]. cell_cost: float32 [..., H, W].
    """
    batch = checked_batch(free, start, cell_cost)

    @jax.custom_jvp
    def of_costs(free: Array, start: Array, cell_cost: Array) -> Array:
        return eager.call(cost_maps, batch, free, start, cell_cost)

    @of_costs.defjvp
    def rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
        cost = of_costs(*primals)
        tree = _tree(batch, primals[0], primals[2], cost)
        return cost, _along_tree(tree, _as_float(tangents[2], cell_cost))

    return of_costs(free, start, cell_cost)


def least_cost(free: Array, start: Array, goal: Array, cell_cost: Array) -> Array:
    """Returns the least cost from `start` to `goal`, float32 [...]; only the path there is
    differentiated: cheaper.
    """
    batch = checked_batch(free, start, cell_cost, goal=(goal, 1))

    @jax.custom_jvp
    def of_costs(free: Array, start: Array, goal: Array, cell_cost: Array) -> tuple[Array, Array]:
        cost = eager.call(cost_maps, batch, free, start, cell_cost)
        return _at(cost, goal), cost  # the field for the rule's own use, as a constant

    @of_costs.defjvp
    def rule(primals: tuple, tangents: tuple) -> tuple:
        at_goal, cost = of_costs(*primals)
        tree = _tree(batch, primals[0], primals[3], cost)
        on_path = eager.call(path_mask, batch, tree, primals[2])
        along = _along_path(tree, on_path, _as_float(tangents[3], cell_cost))
        return (at_goal, cost), (along, jnp.zeros_like(cost))

    return of_costs(free, start, goal, cell_cost)[0]


def _tree(batch: tuple[int, ...], free: Array, cell_cost: Array, cost: Array) -> Array:
    """The tree of least paths, as a constant: between its jumps it does not change with the
    costs.
    """
    return eager.call(parents, batch, free, *lax.stop_gradient((cell_cost, cost)))


def checked_batch(
    free: Array, start: Array, cell_cost: Array, **others: tuple[Array, int]
) -> tuple[int, ...]:
    """Returns the batch dimensions.

    ValueError where arrays do not fit, or, outside jit, where the cost of a free cell is not
    positive.
    """
    batch = arguments.common_batch(
        free=(free, 2), start=(start, 1), traversal_cost=(cell_cost, 2), **others
    )
    if free.shape != cell_cost.shape:
        raise ValueError(
            f"traversal_cost must have the shape of free, {list(free.shape)}, got"
            f" {list(cell_cost.shape)}"
        )
    if not arguments.is_traced(free, cell_cost):
        is_wrong = np.asarray(free) & ~(np.asarray(cell_cost) > 0)
        if is_wrong.any():
            where = np.argwhere(is_wrong)[0].tolist()
            raise ValueError(
                f"traversal_cost at {where} is {np.asarray(cell_cost)[tuple(where)]}: the cost of a"
                " free cell must be positive; block the cell, or give it a small cost"
            )
    return batch


@jitted
def _along_tree(tree: Array, tangent: Array) -> Array:
    return path_sums(tree, move_integral(tree, tangent))


@jitted
def _along_path(tree: Array, on_path: Array, tangent: Array) -> Array:
    return jnp.where(on_path, move_integral(tree, tangent), 0).sum(axis=(-2, -1))


def _at(cost: Array, goal: Array) -> Array:
    """The entries of `cost` [..., H, W] at `goal` [..., 2]; inf where it lies outside the map."""
    *batch, height, width = cost.shape
    is_inside = is_on_map(goal[..., 0], goal[..., 1], height, width)
    place = jnp.where(is_inside, goal[..., 0] * width + goal[..., 1], 0)[..., None]
    there = jnp.take_along_axis(jnp.reshape(cost, (*batch, height * width)), place, axis=-1)[..., 0]
    return jnp.where(is_inside, there, jnp.inf)


def _as_float(tangent: Array, primal: Array) -> Array:
    return jnp.zeros(primal.shape, primal.dtype) if tangent.dtype == float0 else tangent
