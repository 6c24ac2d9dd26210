"""The least sum of length and tolls to every cell of a map: `cost_to_come` for maps on which
obstacles can be entered at a price.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.dtypes import float0

from sign_model.foundation.marks import compiled_whole, jitted
from srt_jax.engine import arguments, cores, eager
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.engine.buckets import batch_bucket, map_bucket
from srt_jax.engine.packing import pack
from srt_jax.padding import padded_labels
from srt_jax.propagation import fixed_point
from srt_jax.tolls import entry
from srt_jax.tolls.cell_field import along_tree, cost_maps, toll_tree_of_costs, toll_tree_of_sums
from srt_jax.tolls.spread import UNREACHED, Size, ground_of, sums_of
from srt_jax.types import FREE, Array


def toll_to_come(
    labels: Array, toll: Array, start: Array, traversal_cost: Array | None = None
) -> Array:
    """Returns the least sum of length and tolls from `start` to each cell; inf where none leads,
    and everywhere if the start is covered.

    A move pays the toll of every obstacle that it needs gone and that the cell left does not lie
    in: those that cover the cell entered, and on a diagonal those that cover a cell beside it, as
    the library's corner rule wants them gone. So an obstacle that is left and entered again is paid
    again: what one way costs with everything paid once, `solve` with mode "shortest" finds.

    Sums are whole numbers of the map's fixed point, tolls rounded to it (1/5741 cell side on maps
    of up to 700 cells a side), so they do not depend on order, batch or machine; with no obstacle
    entered they are the lengths of `cost_to_come`. Sums from about 370,000 cell sides on count as
    inf. With `traversal_cost` a move costs its length times the mean of the costs of its two cells,
    also where it walks through obstacles, and sums are float32.

    Differentiable with respect to `toll` and `traversal_cost`, forwards and backwards, by the
    envelope theorem: by a toll, how often the way found enters the obstacle; by the cost of a cell,
    the length of the way that the cell answers for (`cell_field`). 0 for cells not reached.

    Args:
      labels: int32 [..., L, H, W], as in `Task`.
      toll: float32 [..., M], of each obstacle, in cell sides, not negative; inf of one that may not
        be entered.
      start: int32 [..., 2], (row, col); may lie outside the map.
      traversal_cost: float32 [..., H, W], of each cell, positive; inf closes it.

    Returns:
      float32 [..., H, W], in cell sides.

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit; outside jit, for a toll that
        is negative or not a number, or a cost that is not positive.

    Examples:
      >>> import jax
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> toll = np.array([20], np.float32)
      >>> print(srt_jax.toll_to_come(task.labels, toll, task.start)[2])
      [ 0.  1.  2. 23. 24. 25. 26.]
      >>> at_goal = lambda toll: srt_jax.toll_to_come(task.labels, toll, task.start)[2, 6]
      >>> print(jax.grad(at_goal)(toll))
      [1.]
    """
    start, toll = arguments.as_cells("start", start), arguments.as_floats("toll", toll, core_rank=1)
    if getattr(labels, "dtype", None) != np.int32:
        raise TypeError(
            "labels must be int32, ids as in Task (-1 free), got"
            f" {getattr(labels, 'dtype', type(labels))}"
        )
    if labels.ndim < 3 or 0 in labels.shape[-3:]:
        raise ValueError(
            f"labels must have shape [..., L, H, W] with no empty side, got {list(labels.shape)}"
        )
    named, costs = {"labels": (labels, 3), "toll": (toll, 1), "start": (start, 1)}, ()
    if traversal_cost is not None:
        costs = (_as_costs(labels, traversal_cost),)
        named["traversal_cost"] = (costs[0], 2)
    batch = arguments.common_batch(**named)
    arrays = [array for array, _ in named.values()]
    ranks = [rank for _, rank in named.values()]
    if arguments.is_traced(*arrays):
        folded = (arguments.fold(x, rank) for x, rank in zip(arrays, ranks))
        return arguments.unfold(_with_derivative(*folded), batch)
    if not (np.asarray(toll) >= 0).all():
        wrong = np.asarray(toll)[~(np.asarray(toll) >= 0)][0]
        raise ValueError(f"toll holds {wrong}: a toll is not negative, inf forbids to enter")

    def run() -> jax.Array:
        folded = [eager.fold(x, rank) for x, rank in zip(arrays, ranks)]
        return eager.unfold(_in_bucket(*map(np.asarray, folded)), batch)

    return cores.at_device_of(run, *arrays)


def _as_costs(labels: Array, traversal_cost: Array) -> Array:
    """The costs of cells, checked."""
    costs = arguments.as_floats("traversal_cost", traversal_cost)
    if costs.shape[-2:] != labels.shape[-2:]:
        raise ValueError(
            f"traversal_cost must have the map's shape, {list(labels.shape[-2:])}, got"
            f" {list(costs.shape[-2:])}"
        )
    if not arguments.is_traced(costs) and not (np.asarray(costs) > 0).all():
        where = np.argwhere(~(np.asarray(costs) > 0))[0].tolist()
        raise ValueError(
            f"traversal_cost at {where} is {np.asarray(costs)[tuple(where)]}: the cost of a cell"
            " must be positive; inf closes it"
        )
    return costs


def _in_bucket(labels: np.ndarray, toll: np.ndarray, start: np.ndarray, *costs: Any) -> np.ndarray:
    """The sums, computed on arrays padded to bucketed shapes, so that few are ever compiled."""
    B, L, H, W = labels.shape
    shape = (batch_bucket(B), batch_bucket(L), *map_bucket(H, W))
    room = max(8, batch_bucket(toll.shape[1])) - toll.shape[1]
    more = ((0, shape[0] - B), (0, 0))
    tolls = np.pad(toll, (more[0], (0, room)), constant_values=np.inf)
    sides = (more[0], (0, shape[2] - H), (0, shape[3] - W))
    padded = [np.pad(one, sides, constant_values=np.inf) for one in costs]
    args = padded_labels(labels, shape), tolls, np.pad(start, more), *padded
    return np.asarray(_program(cost_maps if costs else _toll_maps)(*args))[:B, :H, :W]


@functools.cache
def _program(kernel: Callable) -> Callable:
    return jitted(kernel, name=eager.name_of(kernel))


@jax.custom_jvp
def _with_derivative(labels: Array, toll: Array, start: Array, *costs: Array) -> Array:
    """The sums of a batch, with or without costs of cells: float32 [B, H, W]."""
    return _program(cost_maps if costs else _toll_maps)(labels, toll, start, *costs)


@_with_derivative.defjvp
def _rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    labels, toll, start, *costs = primals
    sums = _with_derivative(*primals)
    # Between its jumps the tree does not change with tolls and costs.
    constant = jax.lax.stop_gradient((toll, *costs, sums))
    if costs:
        tree = _program(toll_tree_of_costs)(labels, *constant)
    else:
        tree = _program(_tree_maps)(labels, constant[0], start)
    by_toll = _as_float(tangents[1], toll)
    by_cell = _as_float(tangents[3], costs[0]) if costs else jnp.zeros_like(sums)
    return sums, along_tree(tree, labels, by_toll, by_cell)


def _as_float(tangent: Array, primal: Array) -> Array:
    return jnp.zeros(primal.shape, primal.dtype) if tangent.dtype == float0 else tangent


def _toll_maps(labels: Array, toll: Array, start: Array) -> Array:
    """`toll_to_come` of a batch: int32 [B, L, H, W], float32 [B, M], int32 [B, 2]."""
    return batch_kernel(compiled_whole(functools.partial(each, _toll_map)))(labels, toll, start)


def _tree_maps(labels: Array, toll: Array, start: Array) -> Array:
    """The trees of least ways of a batch: uint8 [B, H, W]."""
    return batch_kernel(compiled_whole(functools.partial(each, _tree_map)))(labels, toll, start)


class _Sums(NamedTuple):
    """sums: uint32 [H, W], exact. tolls: uint32 [M + 2], in units. straight, diagonal: uint32 [].
    scale: int32 [], of `fixed_point`.
    """

    sums: Array
    tolls: Array
    straight: Array
    diagonal: Array
    scale: Array


def _toll_map(labels: Array, toll: Array, start: Array) -> Array:
    found = _sums_of_map(labels, toll, start)
    is_there = found.sums < UNREACHED
    return fixed_point.length_where(is_there, found.sums.astype(jnp.int32), found.scale)


def _tree_map(labels: Array, toll: Array, start: Array) -> Array:
    found = _sums_of_map(labels, toll, start)
    return toll_tree_of_sums(labels, found.tolls, found.straight, found.diagonal, found.sums)


def _sums_of_map(labels: Array, toll: Array, start: Array) -> _Sums:
    size = Size(*labels.shape[1:])
    may_enter = jnp.concatenate([jnp.array(np.array([False, True])), toll < jnp.inf])
    openable = jnp.take(may_enter, labels + 2, mode="clip").all(axis=0)
    scale = jnp.asarray(fixed_point.finest_scale_within(pack(openable[None])[0], size.width))
    scale = scale.astype(jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    ground = ground_of(labels, straight, diagonal, start, size)
    own = lax.dynamic_index_in_dim(ground.labels, ground.start, keepdims=False)
    is_free = (own == FREE).all()
    ground = ground._replace(start=jnp.where(is_free, ground.start, jnp.uint32(0)))
    tolls = entry.with_ends(entry.in_units(toll, straight))
    sums = sums_of(ground, tolls, size)
    sums = sums.reshape(size.height + 2, size.stride)[1:-1, 1:-1]
    return _Sums(sums, tolls, straight, diagonal, scale)
