"""The least removal: which obstacles to destroy so that start and goal are joined at the least total cost.

Destroying obstacle after obstacle is a shortest-path problem over {free regions, obstacles}, solved by flooding in levels: with
what can be afforded for a price, flood; every obstacle that the flood meets by a side can be had for the price plus its own cost;
raise the price to the next such sum; until the goal is flooded. That price is

- a lower bound on the cost of every solution, whatever the obstacles look like: whoever walks to the goal has met by a side, and
  paid for, each obstacle on the way, and the flood is never behind;
- the optimum where each obstacle is connected by sides and no two overlap, for then a chain of obstacles found backwards from
  the goal, each paying for the next, opens a way at that very price.

By a side, not a corner: a diagonal move needs both side cells free, so whatever can be entered can be entered from the side.
Where obstacles overlap or lie in several pieces the chain may fail to open a way (with overlaps the problem is NP-hard: Hauser
2014, Erickson & LaValle 2013). Then everything affordable is opened, a shortest route is walked, and of the obstacles it meets
those are put back, dearest first, that are not needed: an upper bound, told apart from the lower one in the solution.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.distance import cost_field
from srt_jax.moves import max_path_cells
from srt_jax.objects import beside, cells_of, free_cells, met_by, only_cell, open_cells, owners_at, value_at
from srt_jax.path import trace_field
from srt_jax.reach import flood
from srt_jax.route import NEVER, first_needed
from srt_jax.types import Array, Task


class Prices(NamedTuple):
    """What each obstacle costs together with all that must go before it.

    met_at: float32 [B, M], the price at which the flood first meets the obstacle, inf where it never does.
    open_at: float32 [B, M], `met_at` plus the obstacle's own cost.
    goal: float32 [B], the price at which the goal is flooded: the lower bound; inf for tasks left out.
    """

    met_at: Array
    open_at: Array
    goal: Array


def price_levels(task: Task, reached: Array, among: Array) -> Prices:
    """Returns the price of every obstacle and of the goal; a task is left out where `among` is False.

    Args:
      task: a batch of tasks, solvable by destroying all that is destroyable where `among` is True.
      reached: bool [B, H, W], the cells reached with nothing destroyed.
      among: bool [B].
    """
    num_obstacles = task.destroyable.shape[1]
    never = jnp.full(task.destroyable.shape, jnp.inf, jnp.float32)

    def level(state):
        reached, price, met_at, goal_price, is_active = state
        met = met_by(task.labels, beside(reached) & is_active[:, None, None], num_obstacles) & task.destroyable
        met_at = jnp.where(met, jnp.minimum(met_at, price[:, None]), met_at)
        open_at = met_at + task.removal_cost
        next_price = jnp.where(open_at > price[:, None], open_at, jnp.inf).min(axis=1)
        is_active &= jnp.isfinite(next_price)
        price = jnp.where(is_active, next_price, price)
        passable = open_cells(task.labels, open_at <= price[:, None]) & is_active[:, None, None]
        reached = jnp.where(is_active[:, None, None], flood(passable, reached & passable, through_corners=False), reached)
        is_there = is_active & value_at(reached, task.goal)
        return reached, price, met_at, jnp.where(is_there, price, goal_price), is_active & ~is_there

    price = jnp.zeros(among.shape, jnp.float32)
    state = (reached, price, never, jnp.full(among.shape, jnp.inf, jnp.float32), among)
    # Ends: each level opens at least one more obstacle of every task still active.
    _, _, met_at, goal_price, _ = lax.while_loop(lambda state: state[4].any(), level, state)
    return Prices(met_at, met_at + task.removal_cost, goal_price)


def cheapest_chain(task: Task, prices: Prices, *, max_destroyed: int) -> Array:
    """Returns obstacles whose costs add up to the goal's price, found backwards from the goal: bool [B, M].

    At each step: from the obstacle (or goal) in hand flood the free cells, and take an obstacle met there that opens at the very
    price at which the one in hand is met; ties go to the lowest id. The chain is cut after `max_destroyed` links.
    """
    _, _, H, W = task.labels.shape
    num_obstacles = task.destroyable.shape[1]
    free = free_cells(task.labels)
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)[None]

    def met_from(cells):
        region = flood(free | cells, cells, through_corners=False)
        return met_by(task.labels, beside(region), num_obstacles)

    def take(near, price, chain, is_active):
        fits = near & (prices.open_at == price[:, None]) & task.destroyable & ~chain & is_active[:, None]
        taken = fits & (ids == fits.argmax(axis=1).astype(jnp.int32)[:, None])
        price = jnp.where(taken, prices.met_at, 0.0).sum(axis=1)
        return taken, price, chain | taken, price > 0  # at price 0 the obstacle is met from the start itself

    def link(state):
        num_links, taken, *rest = state
        near = met_from(cells_of(task.labels, taken & rest[2][:, None]))
        return num_links + 1, *take(near, *rest)

    among = jnp.isfinite(prices.goal)
    owners = owners_at(task.labels, task.goal, num_obstacles) & among[:, None]
    is_covered = owners.any(axis=1)
    near = jnp.where(is_covered[:, None], owners, met_from(only_cell(task.goal, H, W) & (among & ~is_covered)[:, None, None]))
    state = (jnp.int32(1), *take(near, prices.goal, jnp.zeros_like(task.destroyable), among))
    # Ends: capped; and every link lowers the price.
    state = lax.while_loop(lambda state: state[4].any() & (state[0] < max_destroyed), link, state)
    return state[3]


def least_removal(task: Task, reached: Array, among: Array, *, max_destroyed: int) -> tuple[Array, Array]:
    """Returns the obstacles to destroy, bool [B, M], and a lower bound on the cost of any choice, float32 [B].

    The two agree (the choice is proven least) where obstacles are connected by sides and do not overlap. Nothing is chosen and
    the bound is inf where `among` is False. Args as for `price_levels`.
    """
    prices = price_levels(task, reached, among)
    chain = cheapest_chain(task, prices, max_destroyed=max_destroyed)
    opens = joins(task, chain, among)
    affordable = (prices.open_at <= prices.goal[:, None]) & (among & ~opens)[:, None]
    chosen = lax.cond(affordable.any(), _without_needless, lambda task, _: jnp.zeros_like(chain), task, affordable)
    return jnp.where(opens[:, None], chain, chosen), prices.goal


def joins(task: Task, gone: Array, among: Array) -> Array:
    """Returns whether start and goal are joined once the obstacles `gone` (bool [B, M]) are; False where `among` is."""
    _, _, H, W = task.labels.shape
    passable = open_cells(task.labels, gone) & among[:, None, None]
    return value_at(flood(passable, only_cell(task.start, H, W) & passable, through_corners=False), task.goal)


def _without_needless(task: Task, affordable: Array) -> Array:
    """Returns the obstacles on a shortest route through the `affordable`, less those that turn out not to be needed."""
    _, _, H, W = task.labels.shape
    among = affordable.any(axis=1)
    field = cost_field(open_cells(task.labels, affordable) & among[:, None, None], task.start)
    route = trace_field(field, task.goal, max_cells=max_path_cells(H, W))
    used = first_needed(task.labels, route.cells, route.num_cells, num_obstacles=affordable.shape[1]) < NEVER

    def put_back(state):
        kept, in_doubt = state
        dearest = jnp.where(in_doubt, task.removal_cost, -jnp.inf).argmax(axis=1).astype(jnp.int32)
        one = in_doubt & (jnp.arange(affordable.shape[1], dtype=jnp.int32)[None] == dearest[:, None])
        is_needed = ~joins(task, (kept | in_doubt) & ~one, one.any(axis=1))
        return kept | (one & is_needed[:, None]), in_doubt & ~one

    # Ends: each pass decides on one obstacle of every task.
    kept, _ = lax.while_loop(lambda state: state[1].any(), put_back, (jnp.zeros_like(used), used & among[:, None]))
    return kept
