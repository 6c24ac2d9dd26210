"""The whole task of a coalition: what to destroy at the least cost so that every agent reaches its
goal, who does it, from where, after what, and every agent's route.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import jitted
from srt_jax.coalition import batches, regions
from srt_jax.coalition.least_removal import Team, search
from srt_jax.coalition.plan import Plan, list_schedule
from srt_jax.coalition.reach import Feasible, feasible, prepare
from srt_jax.coalition.regions import Graph, Scratch
from srt_jax.coalition.task import CoalitionTask
from srt_jax.coalition.types import CoalitionSolution, Help
from srt_jax.engine.arguments import is_traced
from srt_jax.engine.batching import batch_kernel
from srt_jax.moves import max_path_cells
from srt_jax.obstacles import Labels
from srt_jax.removal import sums
from srt_jax.removal.branch_and_bound import search_least
from srt_jax.removal.route import NEVER
from srt_jax.types import Array, Status, Task

MAX_BRANCHES = 256

_SMALL = 256
"""Sides of maps up to which LLVM's level 2 is used: it takes a quarter off the time to compile, and
answers take no longer there.
"""


def solve_coalition(
    task: CoalitionTask,
    *,
    max_destroyed: int = 8,
    max_cells: int | None = None,
    max_branches: int = MAX_BRANCHES,
) -> CoalitionSolution:
    """Returns what to destroy so that every agent reaches its goal, who does it, and the routes;
    `status` says what went wrong, nothing is raised.

    The obstacles destroyed are of the least total removal cost: `removal_bound` proves it where the
    two agree. The routes and their order are a list schedule for that set, not the quickest or
    shortest: `schedule_coalition` improves them. With one agent this is `solve`: the same status,
    costs, bound and length. One task or any batch of them; may be called inside jit, vmap and scan;
    the same bits whatever the batch around a task.

    Args:
      task: from `make_coalition` or `stack_coalitions`.
      max_destroyed: K, the room for obstacles destroyed; more needed: BUDGET_SPENT.
      max_cells: N, the room for each agent's route in cells; more needed: BUDGET_SPENT. By default
        twice what any shortest path on a map of this shape can need.
      max_branches: choices of obstacles looked into before the best answer so far is returned.

    Raises:
      TypeError, ValueError: an array of the task has a wrong dtype or shape, or an option is out of
        range.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> solution = solve_coalition(task)
      >>> solution.status.item(), solution.removal_cost.item(), solution.removal_bound.item()
      (1, 1.0, 1.0)
    """
    for name, value in (
        ("max_destroyed", max_destroyed),
        ("max_cells", 1 if max_cells is None else max_cells),
        ("max_branches", max_branches),
    ):
        if value < 1:
            raise ValueError(f"{name} must be at least 1, got {value}")
    batches.coalition_batch(task)
    room = max_cells or 2 * max_path_cells(*task.labels.shape[-2:])
    has_lone = is_traced(task) or bool(_are_lone(np.asarray(task.start)).any())
    has_lone = has_lone or task.start.shape[-2] == 1
    is_small = max(task.labels.shape[-2:]) <= _SMALL
    options = _Options(max_destroyed, max_cells, max_branches, has_lone, is_small)
    axes = {"help": "A", "cells": "AN.", "num_cells": "A", "needed": "A.", "cost": "A"}
    axes |= {"finish": "A", "firm": "M"}
    return batches.call(_solver, task, options, axes, room=room)


class _Options(NamedTuple):
    """As in `solve_coalition`; has_lone: whether there may be a task of one agent; is_small:
    whether the maps are (`_SMALL`).
    """

    max_destroyed: int
    max_cells: int | None
    max_branches: int
    has_lone: bool
    is_small: bool


def _are_lone(start: Array) -> Array:
    """Returns which tasks have one agent, the others being padding: bool [...]."""
    return (start >= 0).all(axis=-1).sum(axis=-1, dtype=np.int32) == 1


@functools.cache
def _solver(options: _Options, is_part: bool) -> Callable:
    names = ("labels", "removal_cost", "able", "start", "goal", "size")

    @batch_kernel
    def of_arrays(room: Array, *arrays: Array) -> CoalitionSolution:
        return _solve(CoalitionTask(**dict(zip(names, arrays))), room, options)

    return jitted(
        lambda task, room: of_arrays(room, *(getattr(task, name) for name in names)),
        is_part=is_part,
        is_large=True,
        level=2 if options.is_small else None,
        name=("solve_coalition", options, is_part),
    )


class _Found(NamedTuple):
    """What the search found on each map. chosen, firm: bool [B, M]. bound, cost: float32 [B].

    help: int32 [B, A]. begins: bool [B, A], who stands on a free cell. is_inside, is_blocked: bool
    [B], whether some goal lies where nobody can ever open it, or some agent with a goal is blocked.
    """

    chosen: Array
    firm: Array
    bound: Array
    cost: Array
    help: Array
    begins: Array
    is_inside: Array
    is_blocked: Array


def _solve(task: CoalitionTask, room: Array, options: _Options) -> CoalitionSolution:
    """`solve_coalition` for one leading batch axis."""
    batch, agents, obstacles = task.able.shape
    layers, height, width = task.labels.shape[1:]
    capacity = options.max_cells or 2 * max_path_cells(height, width)
    arrays = (task.able, task.start, task.goal)
    # A marked call has no operand that it does not use: the compiler would end the process.
    if agents == 1:  # then every task is one of `search_least`
        search_one = _only_feasible
    else:
        search_one = functools.partial(_search, max_branches=options.max_branches)
        arrays = (*arrays, task.removal_cost)
    found = batches.of_all(
        search_one,
        lambda: regions.scratch(height * width, layers, obstacles, 2 * agents),
        task.labels,
        *arrays,
    )

    # What is destroyed, and whether it fits into the answer.
    is_lone = jnp.zeros(batch, bool)
    plan_lone = None
    if options.has_lone:
        is_lone = _are_lone(task.start)
        if agents == 1:
            is_lone = jnp.ones(batch, bool)
        found, plan_lone = _lone(task, found, is_lone, room, capacity, options)
    is_solved = jnp.isfinite(found.cost)
    count = found.chosen.sum(axis=1, dtype=jnp.int32)
    fits = is_solved & (count <= options.max_destroyed)
    if agents == 1 and plan_lone is not None:
        plan = plan_lone
    else:
        acts = found.begins & (fits & ~is_lone)[:, None]
        plan = list_schedule(
            task.labels, task.able, task.start, task.goal, found.chosen, acts, capacity
        )
        if plan_lone is not None:
            plan = jax.tree.map(functools.partial(_select, is_lone), plan_lone, plan)
    return _as_solution(found, plan, fits, is_solved, count, room, options)


def _select(is_one: Array, one: Array, other: Array) -> Array:
    return jnp.where(is_one.reshape(-1, *[1] * (one.ndim - 1)), one, other)


def _search(
    labels: Labels,
    room: Scratch,
    able: Array,
    start: Array,
    goal: Array,
    cost: Array,
    *,
    max_branches: int,
) -> tuple[_Found, Scratch]:
    """The search on one map."""
    begin, graph, known = _known(labels, room, able, start, goal)
    costs = sums.costs_of(cost, able.any(axis=0))
    gone = begin.together.gone
    team = Team(begin.begin, begin.goal, known.able, known.never | ~gone, costs)
    least, graph = search(graph, team, known.is_solvable, max_branches)
    bound, total = sums.to_float32(jnp.stack([least.bound, least.cost], axis=1), costs)
    chosen = regions.members(least.chosen, len(cost)) & jnp.isfinite(total)
    return _Found(chosen, bound=bound, cost=total, **_reported(begin, known, len(cost))), graph.room


def _only_feasible(
    labels: Labels, room: Scratch, able: Array, start: Array, goal: Array
) -> tuple[_Found, Scratch]:
    """Whether all goals of one map can be reached; then 0 stands for the bound and the cost."""
    begin, graph, known = _known(labels, room, able, start, goal)
    nothing = jnp.where(known.is_solvable, jnp.float32(0), jnp.inf)
    chosen = jnp.zeros(able.shape[1], bool)
    reported = _reported(begin, known, able.shape[1])
    return _Found(chosen, bound=nothing, cost=nothing, **reported), graph.room


class _Known(NamedTuple):
    """able: uint32 [A, Z]. never: uint32 [Z], what nobody is able to destroy. The others: bool [],
    about one map.
    """

    able: Array
    never: Array
    is_solvable: Array
    is_inside: Array
    is_blocked: Array


def _known(
    labels: Labels, room: Scratch, able: Array, start: Array, goal: Array
) -> tuple[Feasible, Graph, _Known]:
    graph, able_words, never = prepare(labels, able, start, room)
    found, graph = feasible(labels, graph, able_words, never, start, goal)
    has_goal = (goal >= 0).any(axis=1)
    is_never = jnp.any(
        jnp.take(graph.room.own, found.goal.clip(0), axis=0) & never[None] != 0, axis=1
    )
    is_inside = has_goal & ((found.goal < 0) | is_never)
    is_blocked = (found.help == Help.START_BLOCKED) & has_goal
    is_solvable = ~jnp.any((found.help == Help.NEVER) | is_blocked)
    flags = (is_solvable, jnp.any(is_inside), jnp.any(is_blocked))
    return found, graph, _Known(able_words, never, *flags)


def _reported(found: Feasible, known: _Known, num_obstacles: int) -> dict[str, Array]:
    return {
        "firm": ~regions.members(found.together.gone, num_obstacles),
        "help": found.help,
        "begins": found.begin >= 0,
        "is_inside": known.is_inside,
        "is_blocked": known.is_blocked,
    }


def _lone(
    task: CoalitionTask,
    found: _Found,
    is_lone: Array,
    room: Array,
    capacity: int,
    options: _Options,
) -> tuple[_Found, Plan]:
    """What `solve` answers where there is but one agent, which may be any in the row."""
    batch, agents, _ = task.able.shape
    ids = jnp.arange(batch, dtype=jnp.int32)
    agent = jnp.argmax((task.start >= 0).all(axis=2), axis=1).astype(jnp.int32)
    goal = task.goal[ids, agent]
    one = Task(
        labels=task.labels,
        destroyable=task.able[ids, agent],
        removal_cost=task.removal_cost,
        start=task.start[ids, agent],
        goal=goal,
        size=task.size,
    )
    among = is_lone & jnp.isfinite(found.cost) & (goal >= 0).all(axis=1)
    least = search_least(one, room, among, capacity=capacity, max_nodes=options.max_branches)
    needed, path = least.needed, least.route
    chosen = needed < NEVER
    ids_of = jnp.arange(needed.shape[1], dtype=jnp.int32)
    # the place of each obstacle in the order of need, ties by id
    later = (needed[:, None] < needed[:, :, None]) | (
        (needed[:, None] == needed[:, :, None]) & (ids_of[None] < ids_of[:, None])[None]
    )
    order = jnp.where(chosen, (later & chosen[:, None]).sum(axis=2, dtype=jnp.int32), -1)
    is_mine = (jnp.arange(agents, dtype=jnp.int32)[None] == agent[:, None]) & among[:, None]
    none = jnp.full_like(needed, -1)
    length = jnp.where(among & (path.num_cells > 0), path.cost, 0)
    stays = is_lone & ~among & found.begins.any(axis=1)
    first = jnp.arange(capacity, dtype=jnp.int32)[None, None, :, None] == 0
    stay = jnp.where(first & stays[:, None, None, None], task.start[:, :, None], -1)
    plan = Plan(
        cells=jnp.where(is_mine[:, :, None, None], path.cells[:, None], stay),
        num_cells=jnp.where(
            is_mine,
            path.num_cells[:, None],
            (stays[:, None] & found.begins).astype(jnp.int32),
        ),
        cost=jnp.where(is_mine, length[:, None], 0),
        finish=jnp.where(is_mine, length[:, None], 0),
        order=order,
        by=jnp.where(chosen, agent[:, None], none),
        at=jnp.where(chosen, needed, none),
        when=jnp.zeros_like(task.removal_cost),
        needed=jnp.where(is_mine[:, :, None], needed[:, None], NEVER),
    )
    return found._replace(
        chosen=jnp.where(among[:, None], chosen, found.chosen),
        bound=jnp.where(among, least.bound, found.bound),
        cost=jnp.where(among, least.cost, found.cost),
    ), plan


def _as_solution(
    found: _Found,
    plan: Plan,
    fits: Array,
    is_solved: Array,
    count: Array,
    room: Array,
    options: _Options,
) -> CoalitionSolution:
    num_slots, num_obstacles = options.max_destroyed, found.chosen.shape[1]
    is_short = (plan.num_cells <= room[:, None]).all(axis=1)
    is_there = fits & is_short & ((plan.order >= 0).sum(axis=1, dtype=jnp.int32) == count)

    # The obstacles in the order of the plan.
    slots = jnp.arange(num_slots, dtype=jnp.int32)[None, :, None]
    is_at = (plan.order[:, None] == slots) & is_there[:, None, None]
    some = is_at.any(axis=2)

    def in_slots(values: Array) -> Array:
        return jnp.where(
            some, jnp.where(is_at, values[:, None], 0).sum(axis=2, dtype=jnp.int32), -1
        )

    ids = jnp.arange(num_obstacles, dtype=jnp.int32)[None]
    destroyed = in_slots(jnp.broadcast_to(ids, plan.order.shape))
    by, at = in_slots(plan.by), in_slots(plan.at)
    needed = jnp.take_along_axis(plan.needed, destroyed.clip(0)[:, None], axis=2)
    is_needed = (needed < NEVER) & some[:, None]
    needed = jnp.where(is_needed, needed, -1)
    # k waits for j: on the way there, or of one agent's list.
    row = jnp.arange(len(by), dtype=jnp.int32)
    mine = needed[row[:, None], by.clip(0)]
    is_other = ~jnp.eye(num_slots, dtype=bool)[None]
    passes = (mine >= 0) & (mine < at[:, :, None])
    same = (by[:, :, None] == by[:, None]) & jnp.tri(num_slots, k=-1, dtype=bool)[None]
    after = (passes | same) & is_other & some[:, :, None] & some[:, None]

    status = jnp.full(count.shape, Status.SOLVED, jnp.int32)
    for applies, value in (  # the first that applies, so it is set last
        (count == 0, Status.PATH_EXISTS),
        (~is_there, Status.BUDGET_SPENT),
        (~is_solved, Status.UNSOLVABLE),
        (found.is_inside & ~is_solved, Status.GOAL_BLOCKED),
        (found.is_blocked & ~is_solved, Status.START_BLOCKED),
    ):
        status = jnp.where(applies, jnp.int32(value), status)
    are_too_many = is_solved & (count > num_slots)
    is_too_long = fits & ~is_short
    return CoalitionSolution(
        status=status,
        help=found.help,
        removal_cost=jnp.where(is_there, found.cost, jnp.inf),
        removal_bound=found.bound,
        destroyed=destroyed,
        num_destroyed=jnp.where(is_there | are_too_many, count, 0),
        destroyed_by=by,
        destroyed_at=at,
        after=after,
        cells=jnp.where(is_there[:, None, None, None], plan.cells, -1),
        num_cells=jnp.where((is_there | is_too_long)[:, None], plan.num_cells, 0),
        needed=needed,
        cost=jnp.where(is_there[:, None], plan.cost, jnp.inf),
        finish=jnp.where(is_there[:, None], plan.finish, jnp.inf),
        firm=found.firm,
    )
