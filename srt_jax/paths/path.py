"""A shortest path, read off the costs from the goal back to the start (PY16 §3.2)."""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import arguments, eager
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.moves import DIAGONAL_MOVES, MOVES, STRAIGHT_MOVES, is_on_map
from srt_jax.propagation import fixed_point
from srt_jax.propagation.lengths import UNREACHED, Field
from srt_jax.types import Array, Path


def trace_path(cost: Array, goal: Array, *, max_cells: int) -> Path:
    """Returns a shortest path to `goal`, start first; num_cells 0 and cost inf where `goal` is not
    reached.

    Each cell's parent is the neighbour with the least cost plus move (PY16 §3.2); ties go to the
    first in row order.

    Args:
      cost: float32 [..., H, W], from `cost_to_come`.
      goal: int32 [..., 2], (row, col); may lie outside the map.
      max_cells: how many cells `cells` holds, at least 1. `moves.max_path_cells` is enough for
        every path. If the path is longer, `cells` is all -1 and `num_cells` is its true number of
        cells: retry with a larger `max_cells`.

    Returns:
      Path: cells int32 [..., max_cells, 2], -1 after the goal; num_cells int32 [...]; cost float32
        [...].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit, or max_cells < 1.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> path = srt_jax.trace_path(srt_jax.cost_to_come(free, (2, 0)), (0, 2), max_cells=8)
      >>> path.cells[: int(path.num_cells)].tolist()
      [[2, 0], [1, 1], [0, 2]]
    """
    cost, goal = arguments.as_floats("cost", cost), arguments.as_cells("goal", goal)
    batch = arguments.common_batch(cost=(cost, 2), goal=(goal, 1))
    if max_cells < 1:
        raise ValueError(f"max_cells must be at least 1, got {max_cells}: a path holds its start")
    return Path(
        **eager.call(_trace_lengths, batch, cost, goal, is_light=True, max_cells=int(max_cells))
    )


def trace_field(field: Field, goal: Array, *, max_cells: int) -> Path:
    """Returns `trace_path` of a batch, from exact costs: goal int32 [B, 2]."""

    @batch_kernel
    def run(cost: Array, scale: Array, goal: Array) -> dict[str, Array]:
        straight, diagonal = fixed_point.pairs(scale)
        cells, num_cells, at_goal = _trace(cost, goal, straight, diagonal, UNREACHED, max_cells)
        length = fixed_point.length_where(num_cells > 0, at_goal, scale)
        return {"cells": cells, "num_cells": num_cells, "cost": length}

    return Path(**run(field.cost, field.scale, goal))


def first_path(cost: Array, scale: Array, goal: Array, max_cells: int) -> tuple[Array, Array]:
    """Returns the cells, int32 [max_cells, 2], and their number of the path that `jump_points`
    defines, from the exact costs of one map; 0 where `goal` is not reached.

    Args:
      cost, scale: int32 [H, W] and [], from `propagation.lengths.solve_map`.
      goal: int32 [2].
    """
    straight, diagonal = fixed_point.pairs(scale)
    at = _reader(cost[None], jnp.int32(0), UNREACHED)
    order = STRAIGHT_MOVES + DIAGONAL_MOVES
    cells, num_cells, at_goal = _walk(at, goal, straight, diagonal, max_cells, order)
    return cells, jnp.where(at_goal == UNREACHED, 0, num_cells)


def _trace_lengths(cost: Array, goal: Array, *, max_cells: int) -> dict[str, Array]:
    @batch_kernel
    def run(cost: Array, goal: Array) -> dict[str, Array]:
        straight = jnp.ones(cost.shape[0], jnp.float32)
        diagonal = jnp.full(cost.shape[0], 2**0.5, jnp.float32)
        cells, num_cells, at_goal = _trace(
            cost, goal, straight, diagonal, np.float32(np.inf), max_cells
        )
        return {
            "cells": cells,
            "num_cells": num_cells,
            "cost": jnp.where(num_cells > 0, at_goal, jnp.inf),
        }

    return run(cost, goal)


def _trace(
    cost: Array,
    goal: Array,
    straight: Array,
    diagonal: Array,
    unreached: int | np.float32,
    max_cells: int,
) -> tuple[Array, Array, Array]:
    """Cells, their number, and the cost at the goal; `cost`, `straight` and `diagonal` are of one
    dtype.
    """

    def all_maps(cost: Array, *rest: Array) -> tuple[Array, Array, Array]:
        def one_map(
            which: Array, goal: Array, straight: Array, diagonal: Array
        ) -> tuple[Array, Array, Array]:
            # Read cell by cell from the whole batch: a map cut out of it would be a copy, which
            # takes ten times as long as the walk.
            return _walk(_reader(cost, which, unreached), goal, straight, diagonal, max_cells)

        return each(one_map, jnp.arange(cost.shape[0], dtype=jnp.int32), *rest)

    cells, num_cells, at_goal = compiled_whole(all_maps)(cost, goal, straight, diagonal)
    return cells, jnp.where(at_goal == unreached, 0, num_cells), at_goal


def _reader(
    cost: Array, which: Array, unreached: int | np.float32
) -> Callable[[Array, Array], Array]:
    """A function that reads the cost of a cell of one map; `unreached` outside the map."""
    _, height, width = cost.shape

    def at(row: Array, col: Array) -> Array:
        value = lax.dynamic_slice(cost, (which, row, col), (1, 1, 1))[0, 0, 0]
        inside = is_on_map(row, col, height, width)
        return jnp.where(inside, value, unreached)

    return at


class _Walk(NamedTuple):
    """row, col: int32 [], the cell reached, and its cost `here`; num: int32 [], cells so far;
    cells: int32 [max_cells, 2], written from the back.
    """

    row: Array
    col: Array
    here: Array
    num: Array
    cells: Array


def _walk(
    at: Callable,
    goal: Array,
    straight: Array,
    diagonal: Array,
    max_cells: int,
    order: tuple[tuple[int, int], ...] = MOVES,
) -> tuple[Array, Array, Array]:
    """Walks from the goal to the start, from parent to parent, ties in the given order of their
    places; it ends, because the cost falls at every step.

    The cells are written from the back, so that the start comes first in the end.
    """

    def step(walk: _Walk) -> _Walk:
        row, col, there = _parent(at, walk.row, walk.col, walk.here, straight, diagonal, order)
        cells = lax.dynamic_update_slice(
            walk.cells, jnp.stack([row, col])[None], (max_cells - 1 - walk.num, np.int32(0))
        )
        return _Walk(row, col, there, walk.num + 1, cells)

    # the walk begins at the goal; where that is not reached, it ends at once
    at_goal = at(goal[0], goal[1])
    cells = jnp.full((max_cells, 2), -1, jnp.int32)
    cells = lax.dynamic_update_slice(cells, goal[None], (np.int32(max_cells - 1), np.int32(0)))
    is_reached = at_goal < at(jnp.int32(-1), jnp.int32(-1))
    here = jnp.where(is_reached, at_goal, jnp.zeros_like(at_goal))
    walk = _Walk(goal[0], goal[1], here, jnp.int32(1), cells)
    walk = lax.while_loop(lambda walk: walk.here > 0, step, walk)
    return at_front(walk.cells, walk.num, is_reached), walk.num, at_goal


def at_front(cells: Array, num: Array, is_there: Array) -> Array:
    """Returns the last `num` of the cells, int32 [max_cells, 2], in front, then -1; none of them
    where they do not fit or `is_there` is False.
    """
    max_cells = len(cells)
    padding = jnp.full((max_cells, 2), -1, jnp.int32)
    first = jnp.where(is_there & (num <= max_cells), max_cells - num, max_cells)
    return lax.dynamic_slice(
        jnp.concatenate([cells, padding]), (first, np.int32(0)), (max_cells, 2)
    )


def _parent(
    at: Callable,
    row: Array,
    col: Array,
    here: Array,
    straight: Array,
    diagonal: Array,
    order: tuple[tuple[int, int], ...],
) -> tuple[Array, Array, Array]:
    """The neighbour with the least cost plus move, and its cost; itself, at cost 0, where none
    costs less.
    """
    # the cost of every neighbour, since a diagonal move looks at the two cells beside it
    near = {move: at(row + move[0], col + move[1]) for move in MOVES}
    unreached = at(jnp.int32(-1), jnp.int32(-1))
    to_row, to_col, there, least = row, col, jnp.zeros_like(here), unreached
    # sums that differ by rounding alone are ties
    slack = here * 2.0**-21 if here.dtype == jnp.float32 else 0
    for down, right in order:
        cost = near[down, right]
        is_legal = cost < here
        move = straight
        if down and right:
            is_legal = is_legal & (near[down, 0] < unreached) & (near[0, right] < unreached)
            move = diagonal
        total = jnp.where(is_legal, cost + move, unreached)
        is_better = total + slack < least  # strict: the first in the order stays
        to_row, to_col = (
            jnp.where(is_better, row + down, to_row),
            jnp.where(is_better, col + right, to_col),
        )
        there, least = jnp.where(is_better, cost, there), jnp.where(is_better, total, least)
    return to_row, to_col, there
