"""Who destroys what, from where and when, for a set that suffices: a list schedule.

The pair of agent and obstacle that is done first is next: the agent walks the shortest way to a
cell beside the obstacle, as the map is then, and destroys it. As destroying never hurts and every
way can be walked back, this never gets stuck. When all is gone, each agent walks to its goal.

An agent that comes to an obstacle before it is gone waits there. For use inside jit, on a whole
batch: each step is one leg of some agent on each map.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.moves import max_path_cells
from srt_jax.obstacles import Labels
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.paths.path import trace_path
from srt_jax.removal.route import NEVER
from srt_jax.types import Array, Path


class Plan(NamedTuple):
    """The routes so far. A agents, M obstacles, N cells a route may have.

    cells: int32 [B, A, N, 2]. num_cells: int32 [B, A]. cost, finish: float32 [B, A].
    order: int32 [B, M], the how-manieth each obstacle is destroyed, -1 not yet. by, at: int32 [B,
      M], by which agent, and at which index of its route. when: float32 [B, M].
    needed: int32 [B, A, M], the index from which each route needs each obstacle gone, NEVER if not.
    """

    cells: Array
    num_cells: Array
    cost: Array
    finish: Array
    order: Array
    by: Array
    at: Array
    when: Array
    needed: Array


class _State(NamedTuple):
    """here: int32 [B, A, 2]. is_home: bool [B, A], has walked to its goal. continues: bool []."""

    plan: Plan
    here: Array
    is_home: Array
    continues: Array


class _Pick(NamedTuple):
    """The next leg of each map: when it ends at best, as the bits of a float, _FAR where there is
    none; the agent; the cell it ends in. length: float32 [B, H, W], of the ways looked at last.
    """

    end: Array
    agent: Array
    cell: Array
    length: Array


_FAR = 2**31 - 1


def list_schedule(
    labels: Array, able: Array, start: Array, goal: Array, chosen: Array, acts: Array, room: int
) -> Plan:
    """Returns the routes of a batch of maps.

    Args:
      labels: int32 [B, L, H, W]. able: bool [B, A, M]. start, goal: int32 [B, A, 2].
      chosen: bool [B, M], what is to be destroyed: all goals are reached with it, and each can be.
      acts: bool [B, A], the agents that stand on free cells of maps for which a plan is wanted.
      room: N, how many cells of a route are kept.
    """
    batch, num_agents, num_obstacles = able.shape
    here = jnp.where(acts[:, :, None], start, -1)
    first = jnp.arange(room, dtype=jnp.int32)[None, None, :, None] == 0
    nothing = jnp.zeros((batch, num_agents), jnp.float32)
    none = jnp.full((batch, num_obstacles), -1, jnp.int32)
    plan = Plan(
        cells=jnp.where(first, here[:, :, None], -1),
        num_cells=acts.astype(jnp.int32),
        cost=nothing,
        finish=nothing,
        order=none,
        by=none,
        at=none,
        when=jnp.zeros((batch, num_obstacles), jnp.float32),
        needed=jnp.full((batch, num_agents, num_obstacles), NEVER, jnp.int32),
    )
    begin = _State(plan, here, ~acts | (goal < 0).any(axis=2), acts.any())
    # Ends: each leg destroys one more of the chosen obstacles, or brings one more agent home.
    end = lax.while_loop(
        lambda state: state.continues,
        lambda state: _leg(state, labels, able, goal, chosen & acts.any(axis=1)[:, None]),
        begin,
    )
    return end.plan


def _leg(state: _State, labels: Array, able: Array, goal: Array, chosen: Array) -> _State:
    """One more leg on each map that is not done."""
    plan = state.plan
    batch, num_agents, num_obstacles = able.shape
    height, width = labels.shape[2:]
    gone = plan.order >= 0
    left = chosen & ~gone
    free = packing.unpack(obstacles.all_open_cells(labels, gone), width)
    goes_home = ~left.any(axis=1)

    ids = jnp.arange(batch, dtype=jnp.int32)

    def consider(turn: Array, best: _Pick) -> _Pick:
        # Where the agent could go next: beside what it is able to destroy, at last to its goal. In
        # the turn after the last agent's, the ways of the one picked are computed again: one and
        # the same code for all, for it takes long to compile.
        agent, is_again = turn.clip(0, num_agents - 1), turn == num_agents
        of = lambda array: lax.dynamic_index_in_dim(array, agent, 1, keepdims=False)  # noqa: E731
        targets = left & of(able)
        beside = packing.dilate(obstacles.all_cells_of(labels, targets))
        home = packing.words_of_cell(of(goal), height, width)
        home = jnp.where((goes_home & ~of(state.is_home))[:, None, None], home, jnp.uint32(0))
        ends = jnp.where(goes_home[:, None, None], home, beside)
        wants = (ends != 0).any(axis=(1, 2))
        source = jnp.where(wants[:, None], of(state.here), -1)
        picked = jnp.where((best.end < _FAR)[:, None], state.here[ids, best.agent], -1)
        length = cost_to_come(free, jnp.where(is_again, picked, source))
        far = (
            jnp.where(packing.unpack(ends, width), length, jnp.inf) + of(plan.finish)[:, None, None]
        )
        # As whole numbers the bits of floats that are not negative have the same order.
        bits = jnp.where(jnp.isfinite(far), lax.bitcast_convert_type(far, jnp.int32), _FAR)
        bits = bits.reshape(batch, -1)
        end = bits.min(axis=1)
        place = jnp.argmax(bits == end[:, None], axis=1).astype(jnp.int32)
        is_better = (end < best.end) & ~is_again
        cell = jnp.stack([place // width, place % width], axis=1)
        return _Pick(
            jnp.where(is_better, end, best.end),
            jnp.where(is_better, agent, best.agent),
            jnp.where(is_better[:, None], cell, best.cell),
            length,
        )

    nobody = jnp.zeros(batch, jnp.int32)
    nowhere = jnp.full((batch, 2), -1, jnp.int32)
    none = _Pick(nobody + _FAR, nobody, nowhere, jnp.zeros(free.shape, jnp.float32))
    pick = lax.fori_loop(jnp.int32(0), jnp.int32(num_agents + 1), consider, none)
    goes = pick.end < _FAR

    # The way there, and when the agent arrives: it waits for what is not gone yet.
    agent, length = pick.agent, pick.length
    path = trace_path(length, pick.cell, max_cells=max_path_cells(height, width))
    enter = functools.partial(_entered, num_obstacles=num_obstacles)
    entered = obstacles.of_all(enter, labels, path.cells, path.num_cells)
    is_met = entered < NEVER
    at = jnp.take_along_axis(path.cells, entered.clip(0, path.cells.shape[1] - 1)[:, :, None], 1)
    before = length[ids[:, None], at[:, :, 0], at[:, :, 1]]
    way = jnp.where(goes, path.cost, jnp.float32(0))
    waits = jnp.where(is_met, plan.when + (way[:, None] - jnp.where(is_met, before, 0)), 0)
    arrival = jnp.maximum(plan.finish[ids, agent] + way, waits.max(axis=1))

    # What it destroys there: of what it is able to, the first.
    is_mine = jnp.arange(num_agents, dtype=jnp.int32)[None] == agent[:, None]
    is_mine = is_mine & goes[:, None]
    near = obstacles.all_met_by(
        labels, packing.dilate(packing.words_of_cell(pick.cell, height, width)), num_obstacles
    )
    targets = near & left & able[ids, agent] & goes[:, None]
    is_one = targets & (jnp.cumsum(targets, axis=1, dtype=jnp.int32) == 1)
    offset = plan.num_cells[ids, agent] - 1
    last = offset + path.num_cells - 1
    num_gone = gone.sum(axis=1, dtype=jnp.int32)

    def put(of_agent: Array, value: Array) -> Array:
        shape = (batch,) + (1,) * (of_agent.ndim - 1)
        mask = is_mine.reshape(batch, num_agents, *[1] * (of_agent.ndim - 2))
        return jnp.where(
            mask, value.reshape(shape) if value.ndim == 1 else value[:, None], of_agent
        )

    plan = Plan(
        cells=put(plan.cells, _appended(plan.cells[ids, agent], offset, path)),
        num_cells=put(plan.num_cells, last + 1),
        cost=put(plan.cost, plan.cost[ids, agent] + way),
        finish=put(plan.finish, arrival),
        order=jnp.where(is_one, num_gone[:, None], plan.order),
        by=jnp.where(is_one, agent[:, None], plan.by),
        at=jnp.where(is_one, last[:, None], plan.at),
        when=jnp.where(is_one, arrival[:, None], plan.when),
        needed=jnp.minimum(
            plan.needed,
            jnp.where(
                is_mine[:, :, None] & is_met[:, None],
                (offset[:, None] + jnp.where(is_met, entered, 0))[:, None],
                NEVER,
            ),
        ),
    )
    is_home = state.is_home | (is_mine & goes_home[:, None])
    here = jnp.where(is_mine[:, :, None], pick.cell[:, None], state.here)
    return _State(plan, here, is_home, goes.any())


def _appended(cells: Array, offset: Array, path: Path) -> Array:
    """Returns routes, int32 [B, N, 2], continued by a path that begins with cell `offset` of
    each.
    """
    place = jnp.arange(cells.shape[1], dtype=jnp.int32)[None] - offset[:, None]
    more = jnp.take_along_axis(
        path.cells, place.clip(0, path.cells.shape[1] - 1)[:, :, None], axis=1
    )
    return jnp.where(((place > 0) & (place < path.num_cells[:, None]))[:, :, None], more, cells)


def _entered(labels: Labels, cells: Array, num_cells: Array, *, num_obstacles: int) -> Array:
    """Returns the index of the cell before the first move of a path for which each obstacle has to
    be gone, NEVER where there is none: int32 [M].
    """

    def move(index: Array, entered: Array) -> Array:
        pair = lax.dynamic_slice(cells, (index, jnp.int32(0)), (2, 2))
        (row, col), (to_row, to_col) = pair

        def layer_of(which: Array, entered: Array) -> Array:
            # the cell entered, and the two that a diagonal passes
            layer, corner = which // 3, which % 3
            place = (jnp.where(corner == 2, row, to_row), jnp.where(corner == 1, col, to_col))
            owner = lax.dynamic_slice(
                labels.all, (labels.which, layer, *place), (1, 1, 1, 1)
            ).reshape(())
            # the last place takes what belongs to no obstacle
            owner = jnp.where(owner < 0, num_obstacles, owner)
            known = lax.dynamic_slice(entered, (owner,), (1,))
            return lax.dynamic_update_slice(entered, jnp.minimum(known, index), (owner,))

        count = jnp.int32(3 * labels.all.shape[1])
        return lax.fori_loop(jnp.int32(0), count, layer_of, entered)

    nothing = jnp.full(num_obstacles + 1, NEVER, jnp.int32)
    if cells.shape[0] < 2:  # no room for a move
        return nothing[:num_obstacles]
    num_moves = jnp.maximum(num_cells - 1, 0)
    return lax.fori_loop(jnp.int32(0), num_moves, move, nothing)[:num_obstacles]
