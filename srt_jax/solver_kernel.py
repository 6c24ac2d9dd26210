"""What one jitted call of `solve` computes, for a batch of one shape: the way of each mode, what
blocks at first, the proof where nothing helps, and the status.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from srt_jax.engine.packing import unpack
from srt_jax.obstacles import holds, ids_of, opens_at
from srt_jax.removal.branch_and_bound import search_least
from srt_jax.removal.paper_loop import Symbolic, greedy_walk
from srt_jax.removal.prices import goal_prices
from srt_jax.removal.proof import blockages, covering
from srt_jax.removal.route import NEVER, Route, in_order
from srt_jax.removal.sums import totals
from srt_jax.symbols.acts import left_behind, place_plan
from srt_jax.symbols.planning import ATTENDED, first_act, plan_along_chain, plan_on_contour
from srt_jax.tolls.least_total import least_total
from srt_jax.types import Array, Solution, Status, Task


class Way(NamedTuple):
    """A route, what is destroyed on it and the plan, as in `Solution`; meaningful where `is_there`.

    `num_destroyed` and `num_cells` are the true numbers, which may exceed the room for them.
    `is_stuck`: the symbolic level found no plan, though there is one.
    """

    cells: Array
    num_cells: Array
    cost: Array
    removal_cost: Array
    destroyed: Array
    destroyed_at: Array
    num_destroyed: Array
    plan: Array
    plan_at: Array
    is_there: Array
    is_stuck: Array
    total: Array
    total_bound: Array


class First(NamedTuple):
    """What is known before anything is destroyed.

    free, reached: uint32 [B, H, words], packed; the cells that are free and those reached.
    bound: float32 [B], on the removal.
    """

    free: Array
    reached: Array
    bound: Array


Mode = Callable[..., tuple[First, Way]]
"""A mode's way: (task, among, room, max_destroyed=, capacity=) -> what is known at first, and the
way.
"""


def way_of(mode: str, toll: Array, max_branches: int) -> Mode:
    """Returns how a mode finds its way; toll: float32 [B], of mode "shortest"."""
    if mode == "least":
        return functools.partial(_least, max_branches=max_branches)
    if mode == "shortest":
        return functools.partial(_shortest, toll=toll, max_branches=max_branches)
    return functools.partial(_paper, is_literal=mode == "literal")


def answer_batch(
    task: Task,
    room: Array,
    walk: Mode,
    *,
    max_destroyed: int,
    capacity: int,
) -> Solution:
    """`solve` for one leading batch axis, every stage natively batched.

    Args:
      room: int32 [B], how many of the `capacity` cells a route may use.
      walk: of the mode, from `way_of`.
    """
    # The way, for all tasks whose ends may be joined at all.
    starts = opens_at(task.labels, task.start, jnp.zeros_like(task.destroyable))
    can_end = opens_at(task.labels, task.goal, task.destroyable)
    (free, reached, bound), way = walk(
        task, starts & can_end, room, max_destroyed=max_destroyed, capacity=capacity
    )
    # What blocks at first; where nothing helps, the proof.
    is_open, is_solvable = jax.vmap(holds)(reached, task.goal), jnp.isfinite(bound)
    is_cut_off = starts & ~is_open
    is_inside, is_apart = is_cut_off & ~can_end, is_cut_off & can_end & ~is_solvable
    first, separating = blockages(
        task, free, reached, is_cut_off=is_cut_off, is_inside=is_inside, is_apart=is_apart
    )
    separating = separating | covering(task, is_inside)
    blocking, separating = jnp.split(ids_of(jnp.concatenate([first.on_contour, separating])), 2)
    # What fits into the answer, and the status.
    has_route = way.is_there & (way.num_destroyed <= max_destroyed) & (way.num_cells <= room)
    status = jnp.full(starts.shape, Status.SOLVED, jnp.int32)
    for applies, value in (  # the first that applies, so it is set last
        (is_open, Status.PATH_EXISTS),
        (is_open & (way.num_destroyed > 0), Status.BROKE_THROUGH),
        (~has_route, Status.BUDGET_SPENT),
        (way.is_stuck, Status.STOPPED_SHORT),
        (is_apart, Status.UNSOLVABLE),
        (is_inside, Status.GOAL_BLOCKED),
        (~starts, Status.START_BLOCKED),
    ):
        status = jnp.where(applies, jnp.int32(value), status)
    # A route or a set that does not fit is not returned, but its true number is.
    is_too_long = way.num_cells > room
    are_too_many = way.is_there & (way.num_destroyed > max_destroyed) & ~is_too_long
    return Solution(
        status=status,
        cost=jnp.where(has_route, way.cost, jnp.inf),
        cells=jnp.where(has_route[:, None, None], way.cells, -1),
        num_cells=jnp.where(has_route | is_too_long, way.num_cells, 0),
        destroyed=jnp.where(has_route[:, None], way.destroyed, -1),
        num_destroyed=jnp.where(has_route | are_too_many, way.num_destroyed, 0),
        destroyed_at=jnp.where(has_route[:, None], way.destroyed_at, -1),
        removal_cost=jnp.where(has_route, way.removal_cost, jnp.inf),
        removal_bound=bound,
        total=jnp.where(has_route | (way.total == 0), way.total, jnp.inf),
        total_bound=way.total_bound,
        seed=first.seed,
        contour=unpack(first.contour, task.labels.shape[3]),
        blocking=blocking,
        plan=jnp.where(has_route[:, None, None], way.plan, -1),
        plan_at=jnp.where(has_route[:, None], way.plan_at, -1),
        separating=separating,
    )


def _least(
    task: Task, among: Array, room: Array, *, max_destroyed: int, capacity: int, max_branches: int
) -> tuple[First, Way]:
    """The cells reached, the bound, and the way of least removal: the shortest route, and MAP's
    plan over what must go.
    """
    found = search_least(task, room, among, capacity=capacity, max_nodes=max_branches)
    way = _way_of_chain(task, found.route, found.cost, found.needed, max_destroyed=max_destroyed)
    return First(found.free, found.reached, found.bound), way


def _way_of_chain(
    task: Task, path: Route, cost: Array, needed: Array, *, max_destroyed: int
) -> Way:
    """The way along a route from which obstacles are destroyed where it needs them gone, `needed`
    as in `Removal`, with MAP's plan; no totals.
    """
    destroyed, at, num_destroyed = in_order(needed, max_destroyed=max_destroyed)
    is_here = (task.start == task.goal).all(axis=1)
    acts = plan_along_chain(num_destroyed, is_here, num_slots=max_destroyed)
    left_at = left_behind(task.labels, path.cells, path.num_cells, destroyed, at)
    plan, plan_at = place_plan(acts.act, acts.slot, path.num_cells, destroyed, at, left_at)
    is_there, never = path.num_cells > 0, jnp.zeros_like(is_here)
    nothing = jnp.zeros_like(path.cost)
    return Way(
        *path,
        cost,
        destroyed,
        at,
        num_destroyed,
        plan,
        plan_at,
        is_there,
        is_stuck=never,
        total=nothing,
        total_bound=nothing,
    )


def _shortest(
    task: Task,
    among: Array,
    room: Array,
    *,
    toll: Array,
    max_destroyed: int,
    capacity: int,
    max_branches: int,
) -> tuple[First, Way]:
    """The least total of length and tolls; the bound on removals is the price of the goal."""
    found = least_total(task, toll, room, among, capacity=capacity, max_nodes=max_branches)
    cost = totals(task.removal_cost, found.needed < NEVER)
    cost = jnp.where(found.route.num_cells > 0, cost, jnp.inf)
    way = _way_of_chain(task, found.route, cost, found.needed, max_destroyed=max_destroyed)
    way = way._replace(total=found.total, total_bound=found.bound)
    return First(found.free, found.reached, found.price), way


def _paper(
    task: Task, among: Array, room: Array, *, max_destroyed: int, capacity: int, is_literal: bool
) -> tuple[First, Way]:
    """The greedy loop, run only where some way can be opened."""
    free, reached, bound = goal_prices(task, among)
    symbolic = Symbolic(first_act(), plan_on_contour, ATTENDED, is_literal)
    walk = greedy_walk(
        task, jnp.isfinite(bound), room, symbolic, max_destroyed=max_destroyed, capacity=capacity
    )
    cost = _total_cost(task, walk.destroyed)
    # what the loop carries besides the way is its own
    fields = {name: value for name, value in walk._asdict().items() if name in Way._fields}
    nothing = jnp.zeros_like(cost)
    way = Way(removal_cost=cost, total=nothing, total_bound=nothing, **fields)
    return First(free, reached, bound), way


def _total_cost(task: Task, ids: Array) -> Array:
    """Returns the removal costs of `ids` (int32 [B, K], -1 none) added up, rounded down: float32
    [B].
    """
    return totals(jnp.take_along_axis(task.removal_cost, ids.clip(0), axis=1), ids >= 0)
