"""The least sum of costs and tolls to every cell where cells cost differently, and how the sums
change with costs and tolls.

A move costs its length times the mean of the costs of its two cells (`gradients.cell_costs`), and
the tolls of the obstacles that it needs gone and that the cell left does not lie in (`entry`). Sums
are float32, added up from the start, each move rounded once.

By the envelope theorem a least sum changes as that of the way found does: by the cost of a cell
with the length of the way that the cell answers for, by a toll with how often the way enters the
obstacle. Ways are those of a tree (`gradients.path_tree`); of several that are least it holds one,
the same at every call.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import compiled_whole, jitted
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.gradients.cell_costs import cost_of_move, move_costs, shifted, solve_map
from srt_jax.gradients.path_tree import move_integral, parents_by, path_sums
from srt_jax.moves import MOVES
from srt_jax.tolls import entry
from srt_jax.tolls.spread import STEPS, UNREACHED, bordered_layers, tolls_at
from srt_jax.types import FREE, OUTSIDE, Array


@batch_kernel
def cost_maps(labels: Array, toll: Array, start: Array, cell_cost: Array) -> Array:
    """Returns the least sums of a batch: float32 [B, H, W], inf where no way leads.

    Args:
      labels: int32 [B, L, H, W]. toll: float32 [B, M], inf of what may not be entered. start: int32
        [B, 2]. cell_cost: float32 [B, H, W]; a cell whose cost is not positive and finite is
        closed.
    """
    has_cost = (cell_cost > 0) & (cell_cost < jnp.inf)
    total = jnp.where(has_cost, cell_cost, 0).sum(axis=(1, 2))
    mean = total / jnp.maximum(has_cost.sum(axis=(1, 2), dtype=jnp.float32), 1)
    one_map = functools.partial(each, _cost_map)
    return compiled_whole(one_map)(labels, toll, start, cell_cost, mean)


def _cost_map(labels: Array, toll: Array, start: Array, cell_cost: Array, step: Array) -> Array:
    is_open = _is_open(labels, toll)
    # A start that is covered reaches nothing.
    height, width = cell_cost.shape
    rows, cols = (jnp.arange(side, dtype=jnp.int32) for side in (height, width))
    is_start = (rows[:, None] == start[0]) & (cols[None] == start[1])
    is_covered = (is_start & (labels != FREE).any(axis=0)).any()
    start = jnp.where(is_covered, jnp.int32(-1), start)
    return solve_map(is_open, cell_cost, start, step, paid_by_moves(labels, toll))


def _is_open(labels: Array, toll: Array) -> Array:
    """The cells of one map that may be entered: bool [H, W]."""
    may_enter = jnp.concatenate([jnp.array(np.array([False, True])), toll < jnp.inf])
    return jnp.take(may_enter, labels + 2, mode="clip").all(axis=0)


def paid_by_moves(labels: Array, toll: Array) -> Array:
    """Returns what each of MOVES pays from each cell of one map with its border, linear in the
    tolls: int32 [L, H, W], float32 [M] -> float32 [8, H + 2, W + 2].
    """
    bordered = jnp.stack(bordered_layers(labels))
    nine = jnp.stack([shifted(bordered, *step, outside=OUTSIDE) for step in STEPS])
    values = jnp.take(jnp.pad(toll, (2, 0)), nine + 2, mode="clip")
    return jnp.stack([entry.sum_of_move(nine, values, move) for move in range(8)])


def _into_cells(paid: Array) -> list[Array]:
    """What is paid on coming from the neighbour in the direction of each of MOVES: [..., 8, H + 2,
    W + 2] -> [..., H, W] each.
    """
    return [
        shifted(paid[..., 7 - move, :, :], *MOVES[move], outside=0)[..., 1:-1, 1:-1]
        for move in range(8)
    ]


def toll_tree_of_sums(
    labels: Array, tolls: Array, straight: Array, diagonal: Array, sums: Array
) -> Array:
    """Returns the tree of one map from its exact sums: the first of MOVES that a least way comes
    by.

    Args:
      tolls: uint32 [M + 2], from `entry.with_ends`. sums: uint32 [H, W], UNREACHED where no way
        leads.

    Returns:
      uint8 [H, W], as in `path_tree`.
    """
    lengths = entry.lengths_of_moves(straight, diagonal)
    bordered = jnp.stack(bordered_layers(labels))
    nine = jnp.stack([shifted(bordered, *step, outside=OUTSIDE) for step in STEPS])[..., 1:-1, 1:-1]
    paid = tolls_at(nine, tolls)
    tree = jnp.zeros(sums.shape, jnp.uint8)
    for move in reversed(range(8)):
        there = shifted(sums, *MOVES[move], outside=UNREACHED)
        total = there + lengths[move] + entry.of_move(nine, paid, 4, move, is_back=True)
        fits = (there < UNREACHED) & (sums < UNREACHED) & (total == sums)
        tree = jnp.where(fits, jnp.uint8(1 + move), tree)
    return tree


@batch_kernel
def toll_tree_of_costs(labels: Array, toll: Array, cell_cost: Array, cost: Array) -> Array:
    """Returns the trees of a batch from the sums of `cost_maps`: uint8 [B, H, W]."""

    def into_cells(labels: Array, toll: Array, cell_cost: Array) -> list[Array]:
        if labels.ndim == 4:
            is_open, paid = (jax.vmap(fun)(labels, toll) for fun in (_is_open, paid_by_moves))
        else:
            is_open, paid = _is_open(labels, toll), paid_by_moves(labels, toll)
        costs = move_costs(is_open, cell_cost)
        lengths = [cost_of_move(costs, move)[..., 1:-1, 1:-1] for move in range(8)]
        return [length + own for length, own in zip(lengths, _into_cells(paid))]

    return parents_by(into_cells, cost, labels, toll, cell_cost)


@jitted
def along_tree(tree: Array, labels: Array, by_toll: Array, by_cell: Array) -> Array:
    """Returns how the sums change: linear in both, float32 [B, M] and [B, H, W] -> [B, H, W]."""
    own = move_integral(tree, by_cell)
    for move, paid in enumerate(_into_cells(jax.vmap(paid_by_moves)(labels, by_toll))):
        own = own + jnp.where(tree == 1 + move, paid, 0)
    return path_sums(tree, own)
