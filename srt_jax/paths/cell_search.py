"""The first of the shortest paths to one goal, as `jump_points` defines it, by A* cell by cell.

Where walls end at every other cell, runs of jump points are short, and each corner tries again what
others around it have tried. Here every cell is visited once, hardly ever twice, by the moves of the
canonical ordering (`propagation.cell_queue`, which says why nothing is lost), and no tables are
needed.

Cells wait in buckets of f, the cost plus the octile distance to the goal, which falls by no move
more than that costs. So a cell on a shortest path to the goal has f no more than the goal's cost,
and so have the cells before it on its own shortest paths. All these are expanded: they, and the
goal, have exact costs in the end. Other costs may be too high, none is too low; so the walk back
takes no cell for one of a shortest path that is none.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from sign_model.foundation.sizes import next_power_of_two
from srt_jax import moves
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.propagation import corner_queue
from srt_jax.propagation.cell_queue import ANY, CLOCKWISE, moves_to_try, neighbours
from srt_jax.types import Array

_ONE, _NO_COST = np.uint32(1), np.uint32(2**32 - 1)
# how many buckets there are, a power of two. Each is no wider than a straight move costs, and no
# narrower than half of that; no move lengthens the least path through its end by more than twice
# the cost of a diagonal one.
_BUCKETS = 16
_PLACES = 4  # of an entry of the queue; the last one is not used
# where the cell before may lie, in the order that defines the path, as indices of CLOCKWISE
_ORDER = tuple(CLOCKWISE.index(move) for move in moves.STRAIGHT_MOVES + moves.DIAGONAL_MOVES)
_FIRST_DIAGONAL = np.uint32(len(moves.STRAIGHT_MOVES))


class Costs(NamedTuple):
    """cost: uint32 [N], a flat bordered field, exact on the shortest paths to the goal;
    free_beside: uint8 [N], as of `cell_queue.neighbours`; goal: uint32 [], where it lies there, 0
    where no path leads there, and at_goal: uint32 [], its cost then; is_short: bool [], whether the
    queue was too short: then all this is of no use.
    """

    cost: Array
    free_beside: Array
    goal: Array
    at_goal: Array
    is_short: Array


class _Search(NamedTuple):
    """num: uint32 [], cells that wait; spare: uint32 [], the first entry not in use, 0 where there
    is none; is_short: bool [], whether there was no room for a cell; bucket: uint32 [], the one in
    work, not modulo their number; first: uint32 [buckets], the first entry of each bucket, or 0;
    entries: uint32 [4 * room], an entry every fourth place: the next one of the same bucket, or the
    next spare one; 16 times the cell plus the move that led into it; its cost; cost: uint32 [N].
    """

    num: Array
    spare: Array
    is_short: Array
    bucket: Array
    first: Array
    entries: Array
    cost: Array


class _Trial(NamedTuple):
    """moves: uint32 [], a bit for each move left to try from `cell`, whose cost is `here`, uint32
    [] each.
    """

    moves: Array
    cell: Array
    here: Array
    search: _Search


def search(
    free: Array,
    start: Array,
    goal: Array,
    straight: Array,
    diagonal: Array,
    width: int,
    room: int | None = None,
) -> Costs:
    """Returns the costs of one map from start to goal; for use inside a marked call.

    Args:
      free: uint32 [H, words], packed.
      start, goal: int32 [2]; may be blocked or lie outside.
      straight, diagonal: uint32 [], the fixed point.
      width: W.
      room: of the queue, a power of two; by default enough for most maps.
    """
    height, stride = free.shape[0], np.uint32(width + 2)
    room = room or max(256, next_power_of_two(height * width // 16))
    shift, ring = np.uint32(31) - lax.clz(straight), np.uint32(_BUCKETS - 1)
    zero = jnp.uint32(0)
    free_beside = neighbours(free, width)
    cost, begin = corner_queue.begin(free, width, start, diagonal)
    unreached = read(cost, zero)
    end = corner_queue.place_of(free, width, goal)
    table, offset = jnp.asarray(moves_to_try()), jnp.asarray(_offsets(range(8), width + 2))
    goal_row, goal_col = end // stride, end % stride

    def bucket_of(cell: Array, cost: Array) -> Array:
        """By the cost plus the octile distance."""
        row, col = cell // stride, cell % stride
        down, across = (
            jnp.where(a > b, a - b, b - a) for a, b in ((row, goal_row), (col, goal_col))
        )
        low, high = jnp.minimum(down, across), jnp.maximum(down, across)
        return (cost + high * straight + low * (diagonal - straight)) >> shift

    def moves_of(free_beside: Array, table: Array, entry: Array) -> Array:
        beside = read(free_beside, entry >> np.uint32(4)).astype(jnp.uint32)
        return read(table, (beside << np.uint32(4)) | (entry & np.uint32(15))).astype(jnp.uint32)

    def try_lowest(trial: _Trial) -> _Trial:
        """Tries the lowest of the moves. Without a branch: what is not to change is written again
        as it was.
        """
        left, cell, here, search = trial
        move = lax.population_count((left & -left) - _ONE)
        to = cell + read(offset, move)
        total = here + jnp.where(move & _ONE != 0, diagonal, straight)
        old, spare = read_apart(search.cost, to), search.spare
        is_better = total < old
        is_queued = is_better & (spare != 0)
        bucket = bucket_of(to, total) & ring
        after, head = read_apart(search.entries, spare), read_apart(search.first, bucket)
        entries = write(search.entries, jnp.where(is_queued, head, after), spare)
        entries = write(entries, (to << np.uint32(4)) | move, spare + _ONE)
        search = _Search(
            search.num + is_queued.astype(jnp.uint32),
            jnp.where(is_queued, after, spare),
            search.is_short | (is_better & (spare == 0)),
            search.bucket,
            write(search.first, jnp.where(is_queued, spare, head), bucket),
            write(entries, total, spare + np.uint32(2)),
            write(search.cost, jnp.minimum(old, total), to),
        )
        return _Trial(left & (left - _ONE), cell, here, search)

    def take(search: _Search) -> _Search:
        """Tries the moves from the next cell out of the queue."""
        bucket = lax.while_loop(
            lambda bucket: read(search.first, bucket & ring) == 0,
            lambda bucket: bucket + _ONE,
            search.bucket,
        )
        index = read_apart(search.first, bucket & ring)
        after, entry, then = (read_apart(search.entries, index + np.uint32(i)) for i in range(3))
        cell = entry >> np.uint32(4)
        here = read_apart(search.cost, cell)
        is_past = (bucket << shift) > read_apart(search.cost, end)
        # one that has been reached at a lower cost waits in a lower bucket as well
        is_wanted = ~is_past & (here == then)
        todo = jnp.where(is_wanted, apart(moves_of)(free_beside, table, entry), zero)
        # always the spare one, but written in this form it has to wait for the reads
        is_none = (entry == 0) | (then == _NO_COST)
        search = search._replace(
            num=jnp.where(is_past, zero, search.num - _ONE),
            spare=index,
            bucket=bucket,
            first=write(search.first, after, bucket & ring),
            entries=write(search.entries, jnp.where(is_none, after, search.spare), index),
        )
        trial = _Trial(todo, cell, here, search)
        return lax.while_loop(lambda trial: trial.moves != 0, try_lowest, trial).search

    # entry 0 stands for none; the first one holds the start, the others are spare
    places = np.uint32(_PLACES * room)
    entries = (jnp.arange(places, dtype=jnp.uint32) + np.uint32(_PLACES)) & (places - _ONE)
    first_entry, bucket = jnp.uint32(_PLACES), bucket_of(begin, zero)
    for i, value in enumerate((zero, (begin << np.uint32(4)) | np.uint32(ANY), zero)):
        entries = write(entries, value, first_entry + np.uint32(i))
    done = lax.while_loop(
        lambda search: (search.num != 0) & ~search.is_short,
        take,
        _Search(
            ((begin != 0) & (end != 0)).astype(jnp.uint32),
            jnp.uint32(2 * _PLACES) & (places - _ONE),
            jnp.bool_(False),
            bucket,
            write(jnp.zeros(_BUCKETS, jnp.uint32), first_entry, bucket & ring),
            write(entries, zero, zero),
            cost,
        ),
    )
    at_goal = read(done.cost, end)
    reached = jnp.where(at_goal == unreached, zero, end)
    return Costs(done.cost, free_beside, reached, at_goal, done.is_short)


def _offsets(order: range | tuple[int, ...], stride: int) -> np.ndarray:
    """uint32 [8]: the distances of the neighbours in a flat bordered field."""
    steps = [CLOCKWISE[move] for move in order]
    return np.array([down * stride + right for down, right in steps], np.int32).astype(np.uint32)


class _Walk(NamedTuple):
    """at, here: uint32 [], the cell reached, and its cost; num: int32 [], cells so far; cells:
    int32 [max_cells, 2], written from the back.
    """

    at: Array
    here: Array
    num: Array
    cells: Array


class _Before(NamedTuple):
    """left: uint32 [], the moves to a cell before that are not tried yet; at, here: uint32 [], the
    cell by the last one tried, and what it would cost; is_other: bool [], whether it costs
    something else.
    """

    left: Array
    at: Array
    here: Array
    is_other: Array


def walk_back(
    costs: Costs, goal: Array, straight: Array, diagonal: Array, width: int, cells: Array
) -> tuple[Array, Array]:
    """Returns the cells of the path at the end of the array `cells`, int32 [max_cells, 2], and how
    many they are, int32 []; for use inside a marked call.

    Args:
      costs, straight, diagonal, width: of `search`; where the goal is not reached, it is the path.
      goal: int32 [2].
    """
    stride, max_cells = np.uint32(width + 2), len(cells)
    offset, legal = jnp.asarray(_offsets(_ORDER, width + 2)), jnp.asarray(_legal_moves())

    def step(walk: _Walk) -> _Walk:
        def one(before: _Before) -> _Before:
            move = lax.population_count((before.left & -before.left) - _ONE)
            at = walk.at + read(offset, move)
            here = walk.here - jnp.where(move < _FIRST_DIAGONAL, straight, diagonal)
            left = before.left & (before.left - _ONE)
            return _Before(left, at, here, read(costs.cost, at) != here)

        beside = read(costs.free_beside, walk.at).astype(jnp.uint32)
        left = read(legal, beside).astype(jnp.uint32)
        begin = _Before(left, walk.at, walk.here, jnp.bool_(True))
        found = lax.while_loop(lambda before: before.is_other, one, begin)
        cell = jnp.stack([found.at // stride - _ONE, found.at % stride - _ONE]).astype(jnp.int32)
        place = (max_cells - 1 - walk.num, np.int32(0))
        cells = lax.dynamic_update_slice(walk.cells, cell[None], place)
        return _Walk(found.at, found.here, walk.num + 1, cells)

    cells = lax.dynamic_update_slice(cells, goal[None], (np.int32(max_cells - 1), np.int32(0)))
    here = jnp.where(costs.goal == 0, jnp.uint32(0), costs.at_goal)
    walk = _Walk(costs.goal, here, jnp.int32(1), cells)
    walk = lax.while_loop(lambda walk: walk.here != 0, step, walk)
    return walk.cells, walk.num


def _legal_moves() -> np.ndarray:
    """uint8 [256]: the moves from a cell, bit i for the i-th in the order, by its free neighbours;
    each can be made back as well.
    """
    legal = moves_to_try().reshape(256, 16)[:, ANY]
    bits = [(legal >> move & 1) << i for i, move in enumerate(_ORDER)]
    return np.bitwise_or.reduce(bits).astype(np.uint8)
