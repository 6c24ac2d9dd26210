"""Costs of shortest paths over cells of unequal cost: what a move costs, and a queue that spreads
costs from the start.

A move costs its length times the mean of the costs of its two cells: the integral of the cost along
the move by the trapezoid rule, the same both ways, and the plain length where every cell costs 1.

Sums are float32, added up from the start, each move's cost rounded once. Rounding is monotone, so
the least such sum over all walks to a cell is one number, whatever the order in which moves are
tried: any search that stops only when no move can improve a cell ends at the same bits, in a queue
or by relaxing all cells at once, in any batch and on any machine.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole, runs_in_place
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.engine.in_place import read_apart, write
from srt_jax.moves import MOVES, is_on_map
from srt_jax.propagation.lengths import length_map
from srt_jax.types import Array


class MoveCosts(NamedTuple):
    """What a move costs from each cell to its neighbour, and back: float32 [..., H + 2, W + 2],
    bordered; inf where illegal.
    """

    east: Array
    south: Array
    south_east: Array
    south_west: Array


_EDGE = ((2, True), (1, True), (3, True), (0, True), (0, False), (3, False), (1, False), (2, False))
"""For each of MOVES the index into MoveCosts, and whether the entry is that of the cell moved to.
"""


def is_open(free: Array, cell_cost: Array) -> Array:
    """Returns the cells that a path may visit: free ones whose cost is positive and finite."""
    return free & (cell_cost > 0) & (cell_cost < jnp.inf)


def move_costs(free: Array, cell_cost: Array) -> MoveCosts:
    """Returns the costs of all moves: free bool [..., H, W], cell_cost float32 [..., H, W]."""
    border = [(0, 0)] * (free.ndim - 2) + [(1, 1)] * 2
    half = jnp.where(is_open(free, cell_cost), cell_cost * jnp.float32(0.5), jnp.inf)
    half = jnp.pad(half, border, constant_values=jnp.inf)
    left, right, below = shifted(half, 0, -1), shifted(half, 0, 1), shifted(half, 1, 0)
    root = jnp.float32(2**0.5)
    south_east = (half + shifted(half, 1, 1)) * root
    south_west = (half + shifted(half, 1, -1)) * root
    return MoveCosts(
        east=half + right,
        south=half + below,
        south_east=jnp.where((right < jnp.inf) & (below < jnp.inf), south_east, jnp.inf),
        south_west=jnp.where((left < jnp.inf) & (below < jnp.inf), south_west, jnp.inf),
    )


def shifted(field: Array, down: int, right: int, outside: float = np.inf) -> Array:
    """Returns `field` [..., H, W] read at the cell `down` rows below and `right` columns to the
    right of each.
    """
    *_, height, width = field.shape
    border = [(0, 0)] * (field.ndim - 2) + [(1, 1)] * 2
    around = jnp.pad(field, border, constant_values=np.array(outside, field.dtype))
    return around[..., 1 + down : 1 + down + height, 1 + right : 1 + right + width]


def cost_of_move(costs: MoveCosts, move: int) -> Array:
    """Returns what `MOVES[move]` costs from each cell: float32 [..., H + 2, W + 2]."""
    which, is_back = _EDGE[move]
    return shifted(costs[which], *MOVES[move]) if is_back else costs[which]


def cost_maps(free: Array, start: Array, cell_cost: Array) -> Array:
    """Returns the least costs from the start of a batch; inf where no path leads.

    A map whose free cells all cost the same takes plain lengths (`propagation.lengths`), times that
    cost: faster, and exact.

    Args:
      free: bool [B, H, W]. start: int32 [B, 2]; may lie outside. cell_cost: float32 [B, H, W]; a
        cell whose cost is not positive and finite counts as blocked.

    Returns:
      float32 [B, H, W].
    """

    def one_map(free: Array, start: Array, cell_cost: Array, uniform: Array, step: Array) -> Array:
        def by_length(free: Array, cell_cost: Array) -> Array:
            return length_map(free, start) * uniform

        def by_cost(free: Array, cell_cost: Array) -> Array:
            return solve_map(free, cell_cost, start, step)

        return lax.cond(uniform > 0, by_length, by_cost, free, cell_cost)

    @batch_kernel
    def run(free: Array, start: Array, cell_cost: Array) -> Array:
        # the cost that all free cells share, 0 where they differ; and the mean cost of a move
        may_enter = is_open(free, cell_cost)
        least = jnp.where(free, cell_cost, jnp.inf).min(axis=(1, 2))
        most = jnp.where(free, cell_cost, 0).max(axis=(1, 2))
        uniform = jnp.where((least == most) & (most < jnp.inf), most, 0)
        total = jnp.where(may_enter, cell_cost, 0).sum(axis=(1, 2))
        mean = total / jnp.maximum(may_enter.sum(axis=(1, 2), dtype=jnp.float32), 1)
        return compiled_whole(functools.partial(each, one_map))(
            free, start, cell_cost, uniform, mean
        )

    return run(free, start, cell_cost)


def solve_map(
    free: Array, cell_cost: Array, start: Array, step: Array, paid: Array | None = None
) -> Array:
    """Returns the costs to come on one map, float32 [H, W]; for use inside a marked call.

    Args:
      step: float32 [], about the cost of a move; only the time depends on it.
      paid: float32 [8, H + 2, W + 2], what each of MOVES costs besides, from each cell of the
        bordered map.
    """
    height, width = free.shape
    row, col = start
    is_inside = is_on_map(row, col, height, width)
    at = jnp.where(is_inside, row, 0), jnp.where(is_inside, col, 0)
    may_start = is_inside & is_open(
        *(lax.dynamic_slice(field, at, (1, 1))[0, 0] for field in (free, cell_cost))
    )
    cell = jnp.where(may_start, (row + 1) * (width + 2) + col + 1, 0).astype(jnp.uint32)
    cost = jnp.full((height + 2) * (width + 2), jnp.inf, jnp.float32)
    cost = write(cost, jnp.where(may_start, jnp.float32(0), jnp.inf), cell)
    costs = move_costs(free, cell_cost)
    if runs_in_place():
        cost = _spread(cost, costs, cell, step, paid).reshape(height + 2, width + 2)
    else:
        cost = _relax_all(cost.reshape(height + 2, width + 2), costs, paid)
    return cost[1:-1, 1:-1]


class _Round(NamedTuple):
    """cost: float32 [H + 2, W + 2]; is_changing: bool [], whether the last round lowered any."""

    cost: Array
    is_changing: Array


def _relax_all(cost: Array, costs: MoveCosts, paid: Array | None) -> Array:
    """Tries all moves of all cells at once until no cost falls: as many rounds as the longest
    shortest path has moves.
    """
    per_move = [cost_of_move(costs, move) for move in range(8)]
    # Of the move back from each neighbour. In MOVES the opposite of a move stands as far from the
    # end as the move does from the beginning.
    to_pay = None if paid is None else [shifted(paid[7 - i], *MOVES[i]) for i in range(8)]

    def of_move(move: int) -> Array:
        return per_move[move] if to_pay is None else per_move[move] + to_pay[move]

    def once_more(state: _Round) -> _Round:
        offers = [shifted(state.cost, *MOVES[move]) + of_move(move) for move in range(8)]
        least = functools.reduce(jnp.minimum, offers, state.cost)
        return _Round(least, jnp.any(least < state.cost))

    return lax.while_loop(
        lambda state: state.is_changing, once_more, _Round(cost, jnp.bool_(True))
    ).cost


class _Ring(NamedTuple):
    """head, tail: uint32 [], counts of cells taken from the ring and put into it; end: uint32 [],
    the tail when this pass began; limit, least: float32 [], what may be tried in this pass, and the
    least cost left for the next; cost, waits: float32 and uint8 [N]; queue: uint32 [room].
    """

    head: Array
    tail: Array
    end: Array
    limit: Array
    least: Array
    cost: Array
    waits: Array
    queue: Array


class _Trial(NamedTuple):
    """is_due: bool [], whether the moves of `cell`, whose cost is `here`, are still to be tried;
    the others as in `_Ring`.
    """

    is_due: Array
    cell: Array
    here: Array
    tail: Array
    least: Array
    cost: Array
    waits: Array
    queue: Array


def _spread(cost: Array, costs: MoveCosts, start: Array, step: Array, paid: Array | None) -> Array:
    """Returns the costs to come: float32 [N], flat and bordered, inf where no path leads.

    Cells wait in a ring, each at most once. Those that cost more than a limit go to its end
    untried; the limit rises, pass by pass over the ring, to the least cost that waits plus `step`.
    So cells are tried nearly in the order of their costs, and few twice. It ends, because costs
    only fall, and then no move can improve any cell.

    Args:
      cost: float32 [N], flat and bordered: 0 at the start, else inf.
      start: uint32 [], a flat index; 0, which is on the border, where there is no start.
      step: float32 []; about the cost of a move is best.
      paid: as in `solve_map`.
    """
    size, stride = cost.shape[0], costs.east.shape[1]
    edges = jnp.concatenate([edge.reshape(-1) for edge in costs])
    besides = None if paid is None else paid.reshape(-1)
    room = 1 << size.bit_length()
    mask, one = jnp.uint32(room - 1), jnp.uint32(1)

    def try_moves(trial: _Trial) -> _Trial:
        _, cell, here, tail, least, cost, waits, queue = trial
        for move, ((which, is_back), (down, right)) in enumerate(zip(_EDGE, MOVES)):
            to = cell + jnp.uint32((down * stride + right) % 2**32)
            edge = read_apart(edges, (to if is_back else cell) + jnp.uint32(which * size))
            if besides is not None:
                edge = edge + read_apart(besides, cell + jnp.uint32(move * size))
            total, old, waited = here + edge, read_apart(cost, to), read_apart(waits, to)
            is_better = total < old
            # a cell whose cost falls is queued, unless it waits already
            cost = write(cost, jnp.minimum(old, total), to)
            waits = write(waits, waited | is_better.astype(jnp.uint8), to)
            queue = write(queue, to, tail & mask)
            tail = tail + (is_better & (waited == 0)).astype(jnp.uint32)
            least = jnp.minimum(least, jnp.where(is_better, total, jnp.inf))
        return _Trial(jnp.bool_(False), cell, here, tail, least, cost, waits, queue)

    def take(ring: _Ring) -> _Ring:
        # the next cell: one that costs more than the limit goes to the end of the ring
        cell = read_apart(ring.queue, ring.head & mask)
        here = read_apart(ring.cost, cell)
        is_late = here > ring.limit
        waits = write(ring.waits, is_late.astype(jnp.uint8), cell)
        queue = write(ring.queue, cell, ring.tail & mask)
        tail = ring.tail + is_late.astype(jnp.uint32)
        least = jnp.minimum(ring.least, jnp.where(is_late, here, jnp.inf))
        # the moves of any other are tried: a loop of one step or none
        trial = _Trial(~is_late, cell, here, tail, least, ring.cost, waits, queue)
        trial = lax.while_loop(lambda trial: trial.is_due, try_moves, trial)
        # at the end of a pass the limit rises
        head = ring.head + one
        is_end = head == ring.end
        return _Ring(
            head=head,
            tail=trial.tail,
            end=jnp.where(is_end, trial.tail, ring.end),
            limit=jnp.where(is_end, trial.least + step, ring.limit),
            least=jnp.where(is_end, jnp.inf, trial.least),
            cost=trial.cost,
            waits=trial.waits,
            queue=trial.queue,
        )

    num = (start != 0).astype(jnp.uint32)
    ring = _Ring(
        head=jnp.uint32(0),
        tail=num,
        end=num,
        limit=jnp.float32(0),
        least=jnp.float32(np.inf),
        cost=cost,
        waits=jnp.zeros(size, jnp.uint8),
        queue=write(jnp.zeros(room, jnp.uint32), start, jnp.uint32(0)),
    )
    return lax.while_loop(lambda ring: ring.head != ring.tail, take, ring).cost
