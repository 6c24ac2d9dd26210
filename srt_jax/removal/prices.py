"""What each obstacle costs together with all that must go before it: floods, level by level.

Destroying obstacle after obstacle is a shortest-path problem over {free regions, obstacles}, solved
by flooding in levels: with what can be afforded for a price, flood; every obstacle that the flood
meets by a side can be had for the price plus its own cost; raise the price to the least such sum of
what is not open yet; until the target is flooded. That price is

- a lower bound on the cost of every solution, whatever the obstacles look like: whoever walks to
  the target has met by a side, and paid for, each obstacle on the way, and the flood is never
  behind;
- the optimum where each obstacle is connected by sides and no two overlap, for then a chain of
  obstacles, each paying for the next, opens a way at that very price.

By a side, not a corner: a diagonal move needs both side cells free, so whatever can be entered can
be entered from the side. Prices are exact sums (`sums`), so that no cost is too small beside
another.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax

from srt_jax import obstacles
from srt_jax.engine.packing import num_words
from srt_jax.obstacles import Labels, Survey
from srt_jax.paths.reach import flood_group
from srt_jax.removal import sums
from srt_jax.removal.sums import Costs
from srt_jax.types import Array, Task


class Terms(NamedTuple):
    """Between which cells of one map, int32 [2] inside it, at which costs, and what may go: bool
    [M].
    """

    start: Array
    goal: Array
    costs: Costs
    may_go: Array


class Prices(NamedTuple):
    """reached: the mask of cells reached before any price is paid.

    goal: the price of the goal, a number of `sums`: `never` where none can be opened (or only for
      `most` and more).
    affordable: bool [M], what can be had for that price; all of these gone, the goal is reached.
    tight: bool [M], what can be had and leads on to the goal within that price: all members of the
      cheapest chains.
    """

    reached: Array
    goal: Array
    affordable: Array
    tight: Array


def goal_prices(task: Task, among: Array) -> tuple[Array, Array, Array]:
    """Returns the free cells, of these the ones reached with nothing destroyed, and the price of
    the goal, for the tasks in `among` (bool [B]).

    Their start is free and their goal on the map; for the others: no cell reached, and inf.

    Returns:
      uint32 [B, H, words] twice, packed; float32 [B], rounded down.
    """

    num_obstacles = task.destroyable.shape[1]

    def one_map(labels: Labels, *args: Array) -> tuple[Array, Array, Array]:
        known = obstacles.survey(labels, num_obstacles)
        return known.free, *goal_price(labels, known, *args)

    return obstacles.of_all(
        one_map, task.labels, task.destroyable, task.removal_cost, task.start, task.goal, among
    )


def goal_price(
    labels: Labels,
    known: Survey,
    may_go: Array,
    cost: Array,
    start: Array,
    goal: Array,
    is_requested: Array,
) -> tuple[Array, Array]:
    """Returns of one map what `goal_prices` does, but for the free cells."""
    terms = Terms(start, goal, sums.costs_of(cost, may_go), may_go)
    nothing = jnp.zeros(cost.shape, bool)
    most = jnp.where(is_requested, sums.never(), sums.zero())
    found = _levels(labels, known, start, goal, nothing, terms, nothing, sums.zero(), most)
    (price,) = sums.to_float32(found.price[:, None], terms.costs)
    return (
        jnp.where(is_requested, found.first, jnp.uint32(0)),
        jnp.where(is_requested, price, jnp.inf),
    )


def prices_of(
    labels: Labels, known: Survey, terms: Terms, gone: Array, paid: Array, most: Array
) -> Prices:
    """Returns the prices once the obstacles `gone` (bool [M]) are, with the cost `paid` for them;
    `terms.start` is free.

    First from the start until the goal is reached, then from the goal as far as that price goes.
    """
    num_obstacles = len(gone)
    height, width = labels.all.shape[2:]
    in_goal = obstacles.owners_of(labels, terms.goal, num_obstacles)

    def one_way(state: _Ways) -> _Ways:
        # One body for both directions: it takes long to compile.
        is_back = state.direction == 1
        source, target = (
            jnp.where(is_back, *ends)
            for ends in ((terms.goal, terms.start), (terms.start, terms.goal))
        )
        limit = jnp.where(is_back, state.found.price[0], most)
        found = _levels(labels, known, source, target, gone, terms, in_goal & is_back, paid, limit)
        both = jax.tree.map(
            lambda old, new: lax.dynamic_update_index_in_dim(old, new, state.direction, 0),
            state.found,
            found,
        )
        return _Ways(state.direction + 1, both)

    def continues(state: _Ways) -> Array:
        found = state.found
        is_closed = found.is_there[0] & ~obstacles.holds(found.first[0], terms.goal)
        return (state.direction == 0) | ((state.direction == 1) & is_closed)

    # nothing yet, of both directions
    nothing = jnp.zeros((2, height, num_words(width)), jnp.uint32)
    none, numbers = (
        jnp.zeros((2, num_obstacles), bool),
        jnp.zeros((2, sums.WORDS, num_obstacles), jnp.uint32),
    )
    never, no = jnp.stack([sums.never()] * 2), jnp.zeros(2, bool)
    nowhere = _Found(nothing, never, no, numbers, none, none)
    # Ends: after the way back, or after the way forth where nothing has to be destroyed or nothing
    # leads to the goal.
    both = lax.while_loop(continues, one_way, _Ways(jnp.int32(0), nowhere)).found
    forth, back = (_Found(*(field[i] for field in both)) for i in (0, 1))
    affordable = forth.is_open & forth.is_there
    # An obstacle's number from either side holds `paid` and its own cost, which count once.
    is_short = sums.are_within(forth.open_at, back.open_at, terms.costs, forth.price, paid)
    return Prices(forth.first, forth.price, affordable, affordable & back.is_met & is_short)


class _Found(NamedTuple):
    """What the floods in one direction found.

    first: the mask reached before any price is paid. price: the number at which the target is
      reached, else `never`.
    is_there: bool [], whether it is. open_at: uint32 [WORDS, M], the number at which each obstacle
      opens that is_met, bool [M].
    is_open: bool [M], whether it was opened.
    """

    first: Array
    price: Array
    is_there: Array
    open_at: Array
    is_met: Array
    is_open: Array


class _Ways(NamedTuple):
    """direction: int32 [], the next one: 0 forth, 1 back. found: what was found so far, forth and
    back along one more axis: to choose between arrays takes longer than to write into one.
    """

    direction: Array
    found: _Found


class _Level(NamedTuple):
    """price: the number that is paid. reached: the mask. passable: the mask of open cells before
    the obstacles `new` (bool [M]) were. is_first, continues: bool []. The others as in `_Found`.
    """

    price: Array
    first: Array
    reached: Array
    passable: Array
    new: Array
    open_at: Array
    is_met: Array
    is_open: Array
    is_first: Array
    is_there: Array
    continues: Array


def _levels(
    labels: Labels,
    known: Survey,
    source: Array,
    target: Array,
    gone: Array,
    terms: Terms,
    met: Array,
    paid: Array,
    most: Array,
) -> _Found:
    """Floods from `source` until `target` is reached, or the next price would be `most` or
    more.

    Args:
      met: bool [M], obstacles that are met from the beginning.
      paid: the number to begin with. most: a number.
    """
    costs, may_go = terms.costs, terms.may_go & ~gone
    num_obstacles = len(gone)
    height, width = labels.all.shape[2:]
    at_source = obstacles.only(source, height, num_words(width))

    def level(state: _Level) -> _Level:
        # Flood on over what is open at this price.
        is_gone = gone | state.is_open
        passable = obstacles.opened(labels, known, is_gone, state.passable, state.new)
        reached = flood_group(
            passable,
            (state.reached | at_source) & passable,
            group=1,
            through_corners=False,
            may_be_small=True,
        )
        is_there = obstacles.holds(reached, target)

        # What the flood meets opens at this price and its own cost.
        def opening() -> Array:
            among = may_go & ~state.is_met
            return obstacles.met_beside(labels, known, reached, passable, among) | (met & among)

        is_new = lax.cond(is_there, lambda: jnp.zeros(num_obstacles, bool), opening)
        open_at = sums.with_costs(state.open_at, is_new, state.price, costs)
        is_met = state.is_met | is_new
        # The next price. Also an obstacle that costs nothing, or nothing more, opens at a level of
        # its own.
        price, is_next = sums.least(open_at, is_met & ~state.is_open, costs.num_words)
        continues = ~is_there & sums.is_less(price, most)
        return _Level(
            price=jnp.where(continues, price, state.price),
            first=jnp.where(state.is_first, reached, state.first),
            reached=reached,
            passable=passable,
            new=is_next & continues,
            open_at=open_at,
            is_met=is_met,
            is_open=state.is_open | (is_next & continues),
            is_first=jnp.bool_(False),
            is_there=is_there,
            continues=continues,
        )

    nothing, none = jnp.zeros_like(at_source), jnp.zeros(num_obstacles, bool)
    numbers = jnp.zeros((sums.WORDS, num_obstacles), jnp.uint32)
    yes, no = jnp.bool_(True), jnp.bool_(False)
    begin = _Level(
        paid,
        nothing,
        nothing,
        known.free,
        gone,  # opened by the first level
        numbers,
        none,
        none,
        is_first=yes,
        is_there=no,
        continues=yes,
    )
    # Ends: each level opens at least one more obstacle.
    end = lax.while_loop(lambda state: state.continues, level, begin)
    price = jnp.where(end.is_there, end.price, sums.never())
    return _Found(end.first, price, end.is_there, end.open_at, end.is_met, end.is_open)
