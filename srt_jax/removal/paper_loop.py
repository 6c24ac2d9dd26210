"""The paper's loop: plan, walk until blocked, report to the symbolic level what blocks, destroy as
it plans, walk on (PY16 §3.2).

The symbolic level assumes that the way to the goal is open until the path planner fails. Then what
the planner reports becomes the next situation: the obstacles on the contour, a few at a time, and
which of them can be destroyed. The plan for that situation is carried out until something is
destroyed; whether that opened the way only a path planner can say, so the loop continues.

Two readings. The paper destroys "the" blocking obstacle, yet on real maps a separating piece is
often many objects that touch, some of them indestructible. Read kindly, all objects on the contour
are attended to, those that can be destroyed first, and of those the ones whose cells beside the
contour come nearest the goal. Then the loop is complete, for each pass destroys an obstacle, and a
contour without destroyable objects is a proof that the goal cannot be reached; it is not optimal.
Read literally, only what lies ahead of the seed is attended to, and the loop stops short where that
is indestructible.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax.engine.packing import dilate, unpack
from srt_jax.obstacles import (
    FAR,
    all_cells_of,
    all_nearest_of,
    all_open_cells,
    holds,
    owners_at,
)
from srt_jax.paths.blockage import Blockage, find_blockage
from srt_jax.paths.contour import obstacle_ahead
from srt_jax.paths.path import trace_field
from srt_jax.paths.reach import reach_words
from srt_jax.propagation.lengths import cheapest, cost_field
from srt_jax.types import Act, Array, Path, Task


class Symbolic(NamedTuple):
    """The symbolic level, as the loop sees it.

    first_act: planned while nothing is known to block.
    plan: (is_filled, is_breakable: bool [B, S], the obstacles attended to) -> (act, slot: int32 [B,
      T], the plan, -1 after its end; is_proof: bool [B], there is none).
    num_slots: S.
    is_literal: whether only what lies ahead of the seed is attended to.
    """

    first_act: Act
    plan: Callable
    num_slots: int
    is_literal: bool


class Walk(NamedTuple):
    """How far the loop has come; the arrays as in `Solution`.

    pending: int32 [B, 2], the step planned that is not yet carried out: it leads to the goal.
    gone: bool [B, M]. is_active: bool [B], whether the task continues. is_there: bool [B], whether
      the goal is reached.
    is_stuck: bool [B], whether the symbolic level found no plan.
    """

    cells: Array
    num_cells: Array
    destroyed: Array
    num_destroyed: Array
    destroyed_at: Array
    plan: Array
    plan_at: Array
    pending: Array
    cost: Array
    gone: Array
    is_active: Array
    is_there: Array
    is_stuck: Array


def greedy_walk(
    task: Task, among: Array, room: Array, symbolic: Symbolic, *, max_destroyed: int, capacity: int
) -> Walk:
    """Returns the walk of every task in `among` (bool [B]): to the goal, or as far as it got.

    `room` (int32 [B]) is how many of the `capacity` cells the walk may use; one that needs more
    ends with their number.
    """
    walk = _standing_still(task, among, symbolic, max_destroyed, capacity)
    # Ends: every pass reaches the goal, destroys one more obstacle (at most max_destroyed), or
    # gives up.
    return lax.while_loop(
        lambda walk: walk.is_active.any(), lambda walk: _one_pass(task, walk, room, symbolic), walk
    )


def _standing_still(
    task: Task, among: Array, symbolic: Symbolic, max_destroyed: int, capacity: int
) -> Walk:
    B, M = task.destroyable.shape
    none, no = jnp.zeros(B, jnp.int32), jnp.zeros(B, bool)
    return Walk(
        cells=jnp.full((B, capacity, 2), -1, jnp.int32).at[:, 0].set(task.start),
        num_cells=none + 1,
        destroyed=jnp.full((B, max_destroyed), -1, jnp.int32),
        num_destroyed=none,
        destroyed_at=jnp.full((B, max_destroyed), -1, jnp.int32),
        plan=jnp.full((B, 3 * max_destroyed + 1, 2), -1, jnp.int32),
        plan_at=jnp.full((B, 3 * max_destroyed + 1), -1, jnp.int32),
        pending=jnp.broadcast_to(jnp.array([[symbolic.first_act, -1]], jnp.int32), (B, 2)),
        cost=jnp.zeros(B, jnp.float32),
        gone=jnp.zeros((B, M), bool),
        is_active=among,
        is_there=no,
        is_stuck=no,
    )


def _one_pass(task: Task, walk: Walk, room: Array, symbolic: Symbolic) -> Walk:
    W, num_obstacles, K = task.labels.shape[3], task.destroyable.shape[1], walk.destroyed.shape[1]
    # Flood from where the agent stands: who reaches the goal has only to walk there.
    here = _last_cell(walk)
    free = jnp.where(
        walk.is_active[:, None, None], all_open_cells(task.labels, walk.gone), jnp.uint32(0)
    )
    reached = reach_words(free, here, width=W)
    is_there = walk.is_active & jax.vmap(holds)(reached, task.goal)
    is_cut_off = walk.is_active & ~is_there

    # The others report what blocks, and the symbolic level plans: at most one obstacle is destroyed
    # in a pass.
    found = find_blockage(
        task.labels,
        free,
        reached,
        task.goal,
        task.size,
        num_obstacles=num_obstacles,
        among=is_cut_off,
    )
    ids = _attended(task, walk, free, found, symbolic)
    act, slot, is_proof = symbolic.plan(
        ids >= 0, jnp.take_along_axis(task.destroyable, ids.clip(0), axis=1)
    )
    is_act = jnp.where(is_cut_off[:, None], act, -1) >= 0
    # [2, B, T]
    steps = jnp.where(is_act, jnp.stack([act, jnp.take_along_axis(ids, slot.clip(0), axis=1)]), -1)
    continues = is_act.any(axis=1) & (walk.num_destroyed < K)
    target = jnp.where(steps[0] == Act.DESTROY, steps[1], -1).max(axis=1)
    chosen = (jnp.arange(num_obstacles, dtype=jnp.int32)[None] == target[:, None]) & continues[
        :, None
    ]

    # Walk to the goal, or to the cheapest cell of the contour beside the obstacle chosen.
    beside_it = found.contour & dilate(all_cells_of(task.labels, chosen))
    field = cost_field(unpack(free, W), here)
    stop = jnp.where(is_there[:, None], task.goal, cheapest(field, beside_it))
    leg = trace_field(field, stop, max_cells=walk.cells.shape[1])

    # Note what was done: the step that was pending ends at the goal, the new ones where the
    # obstacle is destroyed. A walk that no longer fits ends here.
    moved = _append(walk, leg, is_there | continues)
    arrived = _note(moved, moved.pending, is_there & (moved.num_cells > 1))
    return _carry_out(arrived, steps, chosen, continues)._replace(
        is_active=continues & (moved.num_cells <= room),
        is_there=walk.is_there | is_there,
        is_stuck=walk.is_stuck | (is_cut_off & is_proof),
    )


def _attended(task: Task, walk: Walk, free: Array, found: Blockage, symbolic: Symbolic) -> Array:
    """Returns the obstacles attended to, int32 [B, S], -1 after the last: those that can be
    destroyed first, by nearness.
    """
    blocking = found.on_contour
    W, num_obstacles = task.labels.shape[3], blocking.shape[1]
    if symbolic.is_literal:
        blocking = owners_at(
            task.labels, obstacle_ahead(unpack(free, W), found.seed, task.goal), num_obstacles
        )
    blocking &= ~walk.gone  # where obstacles overlap, what is gone still has its labels
    h = all_nearest_of(task.labels, dilate(found.contour), task.goal, num_obstacles)
    h = jnp.where(task.destroyable, h, h + FAR)
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)[None]

    def take(left: Array, _: None) -> tuple[Array, Array]:
        best = lax.argmin(jnp.where(left, h, 2 * FAR + 1), 1, jnp.int32)
        return left & (ids != best[:, None]), jnp.where(left.any(axis=1), best, -1)

    return lax.scan(take, blocking, None, length=symbolic.num_slots)[1].T


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
    return walk._replace(
        cells=cells, num_cells=num_cells, cost=jnp.where(goes, walk.cost + leg.cost, walk.cost)
    )


def _note(walk: Walk, step: Array, goes: Array) -> Walk:
    """Returns the walk with `step` (int32 [B, 2]) carried out at its last cell, where `goes` is
    True.
    """
    num_steps = (walk.plan_at >= 0).sum(axis=1, dtype=jnp.int32)
    is_slot = (
        jnp.arange(walk.plan_at.shape[1], dtype=jnp.int32)[None] == num_steps[:, None]
    ) & goes[:, None]
    return walk._replace(
        plan=jnp.where(is_slot[..., None], step[:, None], walk.plan),
        plan_at=jnp.where(is_slot, walk.num_cells[:, None] - 1, walk.plan_at),
    )


def _carry_out(walk: Walk, steps: Array, chosen: Array, goes: Array) -> Walk:
    """Returns the walk with the steps of a plan (int32 [2, B, T]) up to the destroying carried out
    at its last cell.

    What follows the destroying is pending. chosen: bool [B, M], what is destroyed, at most one.
    """
    is_over = jnp.zeros_like(goes)
    for act, obstacle in zip(steps[0].T, steps[1].T):
        step = jnp.stack([act, obstacle], axis=1)
        is_step = goes & (act >= 0)
        walk = _note(walk, step, is_step & ~is_over)
        walk = walk._replace(pending=jnp.where((is_step & is_over)[:, None], step, walk.pending))
        is_over = is_over | (act == Act.DESTROY)
    K = walk.destroyed.shape[1]
    is_slot = (jnp.arange(K, dtype=jnp.int32)[None] == walk.num_destroyed[:, None]) & goes[:, None]
    ids = lax.argmax(chosen, 1, jnp.int32)[:, None]
    return walk._replace(
        destroyed=jnp.where(is_slot, ids, walk.destroyed),
        destroyed_at=jnp.where(is_slot, walk.num_cells[:, None] - 1, walk.destroyed_at),
        num_destroyed=walk.num_destroyed + goes.astype(jnp.int32),
        gone=walk.gone | chosen,
    )
