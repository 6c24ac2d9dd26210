"""The least removal: which obstacles to destroy so that start and goal are joined at the least total cost.

Destroying obstacle after obstacle is a shortest-path problem over {free regions, obstacles}, solved by flooding in levels:
with what can be afforded for a price, flood; every obstacle that the flood meets by a side can be had for the price plus
its own cost; raise the price to the next such sum; until the goal is flooded. That price is

- a lower bound on the cost of every solution, whatever the obstacles look like: whoever walks to the goal has met by a side,
  and paid for, each obstacle on the way, and the flood is never behind;
- the optimum where each obstacle is connected by sides and no two overlap, for then a chain of obstacles found backwards from
  the goal, each paying for the next, opens a way at that very price.

By a side, not a corner: a diagonal move needs both side cells free, so whatever can be entered can be entered from the side.
Where obstacles overlap or lie in several pieces the chain may fail to open a way (with overlaps the problem is NP-hard: Hauser
2014, Erickson & LaValle 2013). Then everything affordable is opened, a shortest route is walked, and of the obstacles it meets
those are put back, dearest first, that are not needed: an upper bound, told apart from the lower one in the solution.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax.distance import cost_field
from srt_jax.objects import beside, cells_of, free_cells, met_by, only_cell, open_cells, owners_at, value_at
from srt_jax.path import trace_field
from srt_jax.reach import flood
from srt_jax.route import NEVER, first_needed
from srt_jax.types import Array, Path, Task


class Prices(NamedTuple):
    """What each obstacle costs together with all that must go before it.

    reached: bool [B, H, W], the cells reached with nothing destroyed.
    met_at: float32 [B, M], the price at which the flood first meets the obstacle, inf where it never does.
    open_at: float32 [B, M], `met_at` plus the obstacle's own cost.
    goal: float32 [B], the price at which the goal is flooded, the lower bound: 0 where a path exists, inf where nothing helps.
    """

    reached: Array
    met_at: Array
    open_at: Array
    goal: Array


def price_levels(task: Task) -> Prices:
    """Returns the price of every obstacle and of the goal for a batch of tasks; all inf where the start is blocked."""
    _, _, H, W = task.labels.shape
    num_obstacles = task.destroyable.shape[1]

    def level(state):
        is_first, price, met_at, reached, prices_reached, goal_price, is_active = state
        passable = open_cells(task.labels, met_at + task.removal_cost <= price[:, None]) & is_active[:, None, None]
        reached = jnp.where(is_active[:, None, None], flood(passable, reached & passable, through_corners=False), reached)
        is_there = is_active & value_at(reached, task.goal)
        is_active &= ~is_there
        met = met_by(task.labels, beside(reached) & is_active[:, None, None], num_obstacles) & task.destroyable
        met_at = jnp.where(met, jnp.minimum(met_at, price[:, None]), met_at)
        open_at = met_at + task.removal_cost
        next_price = jnp.where(open_at > price[:, None], open_at, jnp.inf).min(axis=1)
        is_active &= jnp.isfinite(next_price)
        return (
            jnp.bool_(False),
            jnp.where(is_active, next_price, price),
            met_at,
            reached,
            jnp.where(is_first, reached, prices_reached),
            jnp.where(is_there, price, goal_price),
            is_active,
        )

    at_start = only_cell(task.start, H, W) & free_cells(task.labels)
    nothing = jnp.zeros(task.start.shape[0], jnp.float32)
    never = jnp.full(task.destroyable.shape, jnp.inf, jnp.float32)
    state = (jnp.bool_(True), nothing, never, at_start, at_start, nothing + jnp.inf, at_start.any(axis=(1, 2)))
    # Ends: each level opens at least one more obstacle of every task still active.
    _, _, met_at, _, reached, goal_price, _ = lax.while_loop(lambda state: state[-1].any(), level, state)
    return Prices(reached, met_at, met_at + task.removal_cost, goal_price)


def cheapest_chain(task: Task, prices: Prices, *, max_destroyed: int) -> Array:
    """Returns obstacles whose costs add up to the goal's price, found backwards from the goal: bool [B, M].

    At each step: from the obstacle (or goal) in hand flood the free cells, and take an obstacle met there that opens at the
    very price at which the one in hand is met; ties go to the lowest id. The chain is cut after `max_destroyed` links.
    """
    _, _, H, W = task.labels.shape
    num_obstacles = task.destroyable.shape[1]
    free = free_cells(task.labels)
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)[None]

    def take(near, price, chain, is_active):
        fits = near & (prices.open_at == price[:, None]) & task.destroyable & ~chain & is_active[:, None]
        taken = fits & (ids == fits.argmax(axis=1).astype(jnp.int32)[:, None])
        price = jnp.where(taken, prices.met_at, 0.0).sum(axis=1)  # 0: met from the start itself, the chain is whole
        return cells_of(task.labels, taken), price, chain | taken, price > 0

    def link(state):
        num_links, cells, *rest = state
        region = flood(free | cells, cells, through_corners=False)
        return num_links + 1, *take(met_by(task.labels, beside(region), num_obstacles), *rest)

    is_asked = jnp.isfinite(prices.goal) & (prices.goal > 0)
    owners = owners_at(task.labels, task.goal, num_obstacles)  # a goal inside an obstacle: that is the first link
    is_covered = is_asked & owners.any(axis=1)
    cells, price, chain, is_active = take(owners, prices.goal, jnp.zeros_like(owners), is_covered)
    at_goal = only_cell(task.goal, H, W) & (is_asked & ~is_covered)[:, None, None]
    price, is_active = jnp.where(is_covered, price, prices.goal), jnp.where(is_covered, is_active, is_asked)
    state = (chain.any().astype(jnp.int32), cells | at_goal, price, chain, is_active)
    # Ends: capped; and every link lowers the price.
    return lax.while_loop(lambda state: state[-1].any() & (state[0] < max_destroyed), link, state)[3]


class Passage(NamedTuple):
    """The shortest route once the obstacles `gone` (bool [B, M]) are, and when it needs each of them gone (`first_needed`)."""

    gone: Array
    path: Path
    needed: Array


def open_passage(task: Task, prices: Prices, room: Array, *, max_destroyed: int, capacity: int) -> Passage:
    """Returns the obstacles to destroy and the route; none of either where the goal's price is inf.

    `room` (int32 [B]) is how many of the `capacity` cells a route may use. Three attempts at most: the cheapest chain; where
    that opens no way, all that is affordable; then what is needed of it.
    """
    num_obstacles = task.destroyable.shape[1]
    affordable = prices.open_at <= prices.goal[:, None]

    def attempt(state):
        num_tried, passage, is_active = state
        field = cost_field(open_cells(task.labels, passage.gone) & is_active[:, None, None], task.start)
        path = trace_field(field, task.goal, max_cells=capacity)
        needed = first_needed(task.labels, path.cells, path.num_cells, num_obstacles=num_obstacles)
        is_there = path.num_cells > 0
        is_last = (num_tried == 2) | (path.num_cells > room) | (is_there & (num_tried == 0))
        next_active = is_active & ~is_last
        used = (needed < NEVER) & (is_active & is_there & (num_tried == 1))[:, None]
        next_gone = jnp.where(is_there[:, None], _without_needless(task, used), affordable)
        tried = Passage(jnp.where(next_active[:, None], next_gone, passage.gone), path, needed)
        return num_tried + 1, _where(is_active, tried, passage), next_active

    B = task.start.shape[0]
    none = jnp.zeros(B, jnp.int32)
    nowhere = Path(cells=jnp.full((B, capacity, 2), -1, jnp.int32), num_cells=none, cost=jnp.full(B, jnp.inf, jnp.float32))
    gone = cheapest_chain(task, prices, max_destroyed=max_destroyed)
    state = (jnp.int32(0), Passage(gone, nowhere, jnp.full(gone.shape, NEVER, jnp.int32)), jnp.isfinite(prices.goal))
    return lax.while_loop(lambda state: state[-1].any(), attempt, state)[1]


def _without_needless(task: Task, used: Array) -> Array:
    """Returns the obstacles `used` (bool [B, M]) less those, dearest first, without whose removal the goal is still reached."""
    _, _, H, W = task.labels.shape
    ids = jnp.arange(used.shape[1], dtype=jnp.int32)[None]

    def put_back(state):
        kept, in_doubt = state
        dearest = jnp.where(in_doubt, task.removal_cost, -jnp.inf).argmax(axis=1).astype(jnp.int32)
        one = in_doubt & (ids == dearest[:, None])
        passable = open_cells(task.labels, (kept | in_doubt) & ~one) & one.any(axis=1)[:, None, None]
        joined = value_at(flood(passable, only_cell(task.start, H, W) & passable, through_corners=False), task.goal)
        return kept | (one & ~joined[:, None]), in_doubt & ~one

    # Ends: each pass decides on one obstacle of every task.
    return lax.while_loop(lambda state: state[1].any(), put_back, (jnp.zeros_like(used), used))[0]


def _where(chosen: Array, new: Passage, old: Passage) -> Passage:
    """Returns `new` for the tasks `chosen` (bool [B]), else `old`."""
    return jax.tree.map(lambda a, b: jnp.where(chosen.reshape(-1, *[1] * (a.ndim - 1)), a, b), new, old)
