"""What each obstacle costs together with all that must go before it: floods, level by level.

Destroying obstacle after obstacle is a shortest-path problem over {free regions, obstacles}, solved
by flooding in levels: with what can be afforded for a price, flood; every obstacle that the flood
meets by a side can be had for the price plus its own cost; raise the price to the next such sum;
until the target is flooded. That price is

- a lower bound on the cost of every solution, whatever the obstacles look like: whoever walks to
  the target has met by a side, and paid for, each obstacle on the way, and the flood is never
  behind;
- the optimum where each obstacle is connected by sides and no two overlap, for then a chain of
  obstacles, each paying for the next, opens a way at that very price.

By a side, not a corner: a diagonal move needs both side cells free, so whatever can be entered can
be entered from the side.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from srt_jax import obstacles
from srt_jax.engine.packing import num_words
from srt_jax.obstacles import Labels
from srt_jax.paths.reach import flood_group
from srt_jax.types import Task

_SLACK = 1e-5
"""Sums of the same costs in another order may differ by this part; an obstacle too many among
the tight ones does no harm.
"""


class Terms(NamedTuple):
    """Between which cells of one map, int32 [2] inside it, and at which costs, float32 [M], inf
    for what must stay.
    """

    start: Array
    goal: Array
    cost: Array


class Prices(NamedTuple):
    """reached: the mask of cells reached before any price is paid.

    goal: float32 [], the price of the goal: 0 where a path exists, inf where none can be opened (or
      only for `most` and more).
    affordable: bool [M], what can be had for that price; all of these gone, the goal is reached.
    tight: bool [M], what can be had and leads on to the goal within that price: all members of the
      cheapest chains.
    """

    reached: Array
    goal: Array
    affordable: Array
    tight: Array


def goal_prices(task: Task, among: Array) -> tuple[Array, Array]:
    """Returns the cells reached with nothing destroyed and the price of the goal, for the tasks in
    `among` (bool [B]).

    Their start is free and their goal on the map; for the others: no cell, and inf.

    Returns:
      uint32 [B, H, words], packed; float32 [B].
    """

    def one_map(
        labels: Labels, cost: Array, start: Array, goal: Array, is_asked: Array
    ) -> tuple[Array, Array]:
        never, nothing = jnp.full(cost.shape, jnp.inf, jnp.float32), jnp.zeros(cost.shape, bool)
        most = jnp.where(is_asked, jnp.float32(jnp.inf), jnp.float32(0))
        reached, _, price = _levels(labels, start, goal, nothing, cost, never, most)
        return jnp.where(is_asked, reached, jnp.uint32(0)), jnp.where(is_asked, price, jnp.inf)

    cost = jnp.where(task.destroyable, task.removal_cost, jnp.inf)
    return obstacles.of_all(one_map, task.labels, cost, task.start, task.goal, among)


def prices_of(labels: Labels, terms: Terms, gone: Array, most: Array) -> Prices:
    """Returns the prices once the obstacles `gone` (bool [M]) are, without theirs; `terms.start` is
    a free cell.

    First from the start until the goal is reached, then from the goal as far as that price goes.
    """
    num_obstacles = len(gone)
    height, width = labels.all.shape[2:]
    nothing = jnp.zeros((height, num_words(width)), jnp.uint32)
    cost = jnp.where(gone, jnp.inf, terms.cost)
    in_goal = obstacles.owners_of(labels, terms.goal, num_obstacles)
    never = jnp.full(num_obstacles, jnp.inf, jnp.float32)

    def one_way(state: tuple) -> tuple:
        direction, reached, price, forth, _ = state
        is_back = direction == 1
        source, target = (
            jnp.where(is_back, *ends)
            for ends in ((terms.goal, terms.start), (terms.start, terms.goal))
        )
        met = jnp.where(is_back & in_goal & jnp.isfinite(cost), jnp.float32(0), never)
        first, met, found = _levels(
            labels, source, target, gone, cost, met, jnp.where(is_back, price, most)
        )
        return (
            direction + 1,
            jnp.where(is_back, reached, first),
            jnp.where(is_back, price, found),
            jnp.where(is_back, forth, met),
            jnp.where(is_back, met, never),
        )

    def goes_on(state: tuple) -> Array:
        direction, _, price, _, _ = state
        return (direction == 0) | ((direction == 1) & (price > 0) & jnp.isfinite(price))

    state = (jnp.int32(0), nothing, jnp.float32(jnp.inf), never, never)
    _, reached, price, forth, back = lax.while_loop(goes_on, one_way, state)
    affordable = forth + cost <= price
    tight = affordable & (forth + cost + back <= price * jnp.float32(1 + _SLACK)) & (price > 0)
    is_there = jnp.isfinite(price)
    return Prices(reached, price, affordable & is_there, tight & is_there)


def _levels(
    labels: Labels, source: Array, target: Array, gone: Array, cost: Array, met: Array, most: Array
) -> tuple[Array, Array, Array]:
    """Floods from `source` until `goal_bound` is reached, or the next price would be `most` or
    more.

    Args:
      met: float32 [M], the price at which each obstacle is met from the beginning.

    Returns:
      the mask reached at price 0; the prices at which obstacles are met, float32 [M]; that of the
      target, float32 [].
    """
    num_obstacles = len(gone)
    height, width = labels.all.shape[2:]
    at_source = obstacles.only(source, height, num_words(width))

    def level(state: tuple) -> tuple:
        price, met, first, reached, _, _ = state
        passable = obstacles.open_cells(labels, gone | (met + cost <= price))
        reached = flood_group(
            passable, (reached | at_source) & passable, group=1, through_corners=False
        )
        is_there = obstacles.holds(reached, target)

        def noted(met: Array) -> Array:
            border = obstacles.beside(reached) & ~passable
            is_new = obstacles.met_by(labels, border, num_obstacles) & jnp.isfinite(cost)
            return jnp.where(is_new, jnp.minimum(met, price), met)

        met = lax.cond(is_there, lambda met: met, noted, met)
        open_at = met + cost
        next_price = jnp.min(jnp.where(open_at > price, open_at, jnp.inf))
        goes_on = ~is_there & (next_price < most)
        found = jnp.where(is_there, price, jnp.inf)
        first = jnp.where(price == 0, reached, first)
        return jnp.where(goes_on, next_price, price), met, first, reached, found, goes_on

    nothing = jnp.zeros_like(at_source)
    state = (jnp.float32(0), met, nothing, nothing, jnp.float32(jnp.inf), jnp.bool_(True))
    # Ends: each level opens at least one more obstacle.
    _, met, first, _, found, _ = lax.while_loop(lambda state: state[5], level, state)
    return first, met, found
