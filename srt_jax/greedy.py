"""The paper's loop: walk until blocked, destroy something on the contour of what blocks, walk on (PY16 §3.2).

Read kindly: the paper destroys "the" blocking obstacle, yet on real maps a separating piece is often many objects grown
together, some of which stand firm. So of the objects on the contour a destroyable one is taken: the one whose cells beside
the contour come nearest the goal. The loop is complete, for each pass destroys an obstacle, and a contour without
destroyable objects is a proof that the goal cannot be reached; it is not optimal.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.distance import cost_field, field_length
from srt_jax.moves import octile_distance
from srt_jax.objects import around, cells_of, open_cells, value_at
from srt_jax.packing import pack
from srt_jax.path import trace_field
from srt_jax.planner import find_blockage
from srt_jax.types import Array, Path, Task


class Walk(NamedTuple):
    """How far the loop has come; the arrays as in `Solution`.

    is_active: bool [B], whether the task goes on; is_there: bool [B], whether the goal is reached.
    """

    cells: Array
    num_cells: Array
    destroyed: Array
    num_destroyed: Array
    destroyed_at: Array
    cost: Array
    gone: Array
    is_active: Array
    is_there: Array


def greedy_walk(task: Task, among: Array, room: Array, *, max_destroyed: int, capacity: int) -> Walk:
    """Returns the walk of every task in `among` (bool [B]): to the goal, or as far as it got.

    `room` (int32 [B]) is how many of the `capacity` cells the walk may use; one that needs more ends with their number.
    """
    walk = _standing_still(task, among, max_destroyed, capacity)
    # Ends: every pass reaches the goal, destroys one more obstacle (at most max_destroyed), or gives up.
    return lax.while_loop(lambda walk: walk.is_active.any(), lambda walk: _one_pass(task, walk, room), walk)


def _standing_still(task: Task, among: Array, max_destroyed: int, capacity: int) -> Walk:
    B, M = task.destroyable.shape
    cells = jnp.full((B, capacity, 2), -1, jnp.int32).at[:, 0].set(task.start)
    nothing = jnp.full((B, max_destroyed), -1, jnp.int32)
    none = jnp.zeros(B, jnp.int32)
    cost = jnp.zeros(B, jnp.float32)
    return Walk(cells, none + 1, nothing, none, nothing, cost, jnp.zeros((B, M), bool), among, jnp.zeros(B, bool))


def _one_pass(task: Task, walk: Walk, room: Array) -> Walk:
    num_obstacles, K = task.destroyable.shape[1], walk.destroyed.shape[1]
    here = _last_cell(walk)
    free = open_cells(task.labels, walk.gone)
    field = cost_field(free & walk.is_active[:, None, None], here)
    length = field_length(field)
    reached = jnp.isfinite(length)
    is_there = walk.is_active & value_at(reached, task.goal)
    is_cut_off = walk.is_active & ~is_there
    found = find_blockage(
        task.labels, pack(free), pack(reached), task.goal, task.size, num_obstacles=num_obstacles, among=is_cut_off
    )
    choice = found.on_contour & task.destroyable & ~walk.gone  # where obstacles overlap, what is gone still has its labels
    goes_on = is_cut_off & choice.any(axis=1) & (walk.num_destroyed < K)
    chosen = _nearest_goal(task, found.contour, choice) & goes_on[:, None]
    beside_it = found.contour & around(cells_of(task.labels, chosen))
    stop = jnp.where(is_there[:, None], task.goal, _least(jnp.where(beside_it, length, jnp.inf)))
    leg = trace_field(field, stop, max_cells=walk.cells.shape[1])
    moved = _append(walk, leg, is_there | goes_on)
    return _destroy(moved, chosen, goes_on)._replace(
        is_active=goes_on & (moved.num_cells <= room),
        is_there=walk.is_there | is_there,
    )


def _nearest_goal(task: Task, contour: Array, choice: Array) -> Array:
    """Returns the one of the obstacles `choice` whose cells beside the contour come nearest the goal; ties: the lowest id."""
    B, L, H, W = task.labels.shape
    cells = jnp.stack(jnp.meshgrid(jnp.arange(H, dtype=jnp.int32), jnp.arange(W, dtype=jnp.int32), indexing="ij"), axis=-1)
    h = octile_distance(cells[None], task.goal[:, None, None])
    near = jnp.where(around(contour), h, jnp.inf)[:, None]
    num_obstacles = choice.shape[1]
    ids = jnp.where(task.labels < 0, num_obstacles, task.labels).reshape(B, -1)
    near = jnp.broadcast_to(near, (B, L, H, W)).reshape(B, -1)
    batch = jnp.arange(B, dtype=jnp.int32)[:, None]
    least = jnp.full((B, num_obstacles), jnp.inf, jnp.float32).at[batch, ids].min(near, mode="drop")
    best = jnp.where(choice, least, jnp.inf).argmin(axis=1).astype(jnp.int32)
    return choice & (jnp.arange(num_obstacles, dtype=jnp.int32)[None] == best[:, None])


def _least(length: Array) -> Array:
    """Returns the cell of least `length` [B, H, W], the first in row order: int32 [B, 2]."""
    W = length.shape[2]
    place = length.reshape(length.shape[0], -1).argmin(axis=1).astype(jnp.int32)
    return jnp.stack([place // W, place % W], axis=-1)


def _last_cell(walk: Walk) -> Array:
    last = (walk.num_cells - 1).clip(0, walk.cells.shape[1] - 1)
    return walk.cells[jnp.arange(last.shape[0], dtype=jnp.int32), last]


def _append(walk: Walk, leg: Path, goes: Array) -> Walk:
    """Returns the walk with `leg`, which begins at its last cell, added where `goes` is True."""
    N = walk.cells.shape[1]
    place = jnp.arange(N, dtype=jnp.int32)[None] - walk.num_cells[:, None] + 1
    moved = jnp.take_along_axis(leg.cells, place.clip(0)[..., None], axis=1)
    cells = jnp.where(((place > 0) & goes[:, None])[..., None], moved, walk.cells)
    num_cells = jnp.where(goes, walk.num_cells + leg.num_cells - 1, walk.num_cells)
    return walk._replace(cells=cells, num_cells=num_cells, cost=jnp.where(goes, walk.cost + leg.cost, walk.cost))


def _destroy(walk: Walk, chosen: Array, goes: Array) -> Walk:
    """Returns the walk with the obstacle `chosen` (bool [B, M], at most one) destroyed from its last cell."""
    K = walk.destroyed.shape[1]
    is_slot = (jnp.arange(K, dtype=jnp.int32)[None] == walk.num_destroyed[:, None]) & goes[:, None]
    ids = chosen.argmax(axis=1).astype(jnp.int32)[:, None]
    return walk._replace(
        destroyed=jnp.where(is_slot, ids, walk.destroyed),
        destroyed_at=jnp.where(is_slot, walk.num_cells[:, None] - 1, walk.destroyed_at),
        num_destroyed=walk.num_destroyed + goes.astype(jnp.int32),
        gone=walk.gone | chosen,
    )
