"""The first of the shortest paths to one goal, by jump point search on machine words (Harabor &
Grastien 2012 and 2014; a diagonal move needs both cells beside it).

THE PATH. Of all shortest paths one is defined by the costs alone, whatever the search: going back
from the goal, the cell before is always the first neighbour from which a shortest path comes, the
four straight neighbours before the four diagonal ones, in row order each. So a walk over the field
of costs (`path.first_path`) gives the same cells.

THE SEARCH. A leg is any number of diagonal moves in one direction, then a run: straight moves in
one direction up to the first stop. A stop is the goal or a corner, a free cell beside which, to one
side, a wall has just ended. From a corner legs begin straight on, and towards such sides, straight
and diagonally; from the start in all directions. A leg may also reach the goal by diagonal moves
alone. Corners wait in buckets of f, the least length of a path through them. All with f no more
than the goal's cost are expanded, in whatever order, those of equal f too; one that is reached at
its cost by another run is expanded for that run as well.

WHY THE LENGTHS ARE EXACT. Let a, b be two moves in a row of the path defined, x the cell between
them. Then (1) b = a; or (2) a is diagonal and b one of its components; or (3) a is straight, b
leads to a side of it, straight or diagonally, and on that side of x a wall has just ended: x is a
corner. For in all other cases a shorter way leads past x, with one exception: a is straight, b is
diagonal with the component a, and no wall ends on that side. Then b and a can change places, and
the path defined would have come to the cell after x by the straight move. So the path consists of
legs that the search tries, and by induction each corner where it turns gets its exact cost. No cost
is too low, for legs are walks.

WHY THE CELLS ARE THE ONES DEFINED. Each corner, and the goal, keeps the first of the legs that
reach it at its cost, in this order: by the direction of the run, row order of the cells it comes
from; the longest run; no diagonal part, then the two in row order. Let `jump_walk.walk_back` be at
a cell y of the path defined, b the move after y on it, and a straight, the last move of a shortest
path to y. Then that path followed by b fulfils (1) to (3) in y: where a = b the run goes on, else y
is a corner, and the search knows of a leg that ends there by a. So at a corner where the path turns
the first leg kept has the right direction. Along its run the path comes straight as long as some
shortest path does, which is as long as the longest run of a leg with that end, unless at a cell on
the way a direction earlier in the order leads in; that cell is then such a corner. On the diagonal
part the first corner reached at the right cost ends it in the same way. So `walk_back` compares the
cost of every cell on the way with the cost kept there, and takes up the leg of a corner it finds.

THE QUEUE never overflows: where all its entries are in use, a corner is flagged instead, and when
the queue is done with, flagged corners are looked for and expanded. It all ends, since each corner
is queued or flagged at most four times, once a run, for each of its costs, which only fall.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import apart
from sign_model.foundation.sizes import next_power_of_two
from srt_jax import moves
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.paths.corners import (
    NO_COST,
    Corners,
    Room,
    corner_at,
    is_corner,
    none_of,
    room_of,
    with_corner,
)
from srt_jax.paths.jump_tables import JumpTables, groups_of, jump_tables, next_stop, walls_at
from srt_jax.types import Array

LONGEST_SIDE = 2**22 - 1
"""The longest side of a map that can be searched: a leg has room for so long a run."""

_LEAST_BUCKETS = 4096

# A leg in a word; the least comes first. Bits 29 to 31: whence it comes to its end, in the order
# of `jump_walk`; 7 to 28: LONGEST_SIDE less the length of its run; 5 and 6: its diagonal part, 0
# none, else 1 or 2; 4: the corner waits outside the queue; 0 to 3: by which runs it was reached at
# its cost.
COMES, RUN, SIDE = (np.uint32(n) for n in (29, 7, 5))
_WAITS, _LEG = np.uint32(16), np.uint32(2**32 - 32)

_ONE, _LOW = np.uint32(1), np.uint32(31)
_NO_DIAGONAL = np.uint32(4)


# Runs are numbered as in `jump_tables`, diagonals 0 down right, 1 down left, 2 up right, 3 up left.
# Sets of moves: bits 0 to 3 runs, 4 to 7 diagonals.
_COMPONENTS = np.array([0b0011, 0b0110, 0b1001, 0b1100], np.uint32)
_DOWN = np.array([1, 1, -1, -1], np.int32).astype(np.uint32)
_RIGHT = np.array([1, -1, 1, -1], np.int32).astype(np.uint32)


def moves_to_try() -> np.ndarray:
    """Returns uint32 [16]: the moves from a corner, by the run that reaches it and, bits 2 and 3,
    whether there is a wall in the line before and behind. Bits 0 to 3 are runs, 4 to 7 diagonals.
    """
    right, down, left, up, down_right, down_left, up_right, up_left = (1 << i for i in range(8))
    before = (up | up_right, left | down_left, up | up_left, left | up_left)
    behind = (down | down_right, right | down_right, down | down_left, right | up_right)
    table = [
        1 << run | before[run] * (walls & 1) | behind[run] * (walls >> 1)
        for walls in range(4)
        for run in range(4)
    ]
    return np.array(table, np.uint32)


def _ends_of_legs() -> np.ndarray:
    """uint32 [20]: the bits of a leg that tell how it comes to its end and its diagonal part, by
    run and, times 4, that part.
    """
    order = np.array([1, 0, 2, 3]) << COMES
    side = [[1 + (part & 1 if run & 1 else part >> 1) for run in range(4)] for part in range(4)]
    return (order | np.array([*side, [0] * 4]) << SIDE).astype(np.uint32).reshape(-1)


class Best(NamedTuple):
    """cost, leg: uint32 [], of the goal; NO_COST until it is reached."""

    cost: Array
    leg: Array


class _Queue(NamedTuple):
    """num, num_outside: uint32 [], entries in use, and corners that wait outside; first_spare:
    uint32 [], the first entry not in use, 0 where there is none; first: uint32 [buckets], the
    first entry of each bucket, or 0; after: uint32 [room], the next entry of the same bucket, or
    the next spare one; entry: uint32 [room], 16 times a cell plus the run that reached it, and its
    walls.
    """

    num: Array
    num_outside: Array
    first_spare: Array
    first: Array
    after: Array
    entry: Array


class _Search(NamedTuple):
    """is_on: bool []; bucket: uint32 [], the one in work, not modulo their number; next_cell:
    uint32 [], where corners that wait outside are looked for; cell, todo: uint32 [], to be expanded
    by these moves.
    """

    is_on: Array
    bucket: Array
    next_cell: Array
    cell: Array
    todo: Array
    best: Best
    corners: Corners
    queue: _Queue


class _Place(NamedTuple):
    """Where legs are on their way, all uint32 []. runs: to be tried from (row, col), which costs
    `cost`; part: the diagonal that led there, or _NO_DIAGONAL; diagonals: to be tried yet from the
    corner.
    """

    runs: Array
    diagonals: Array
    part: Array
    row: Array
    col: Array
    cost: Array
    best: Best


class _Expansion(NamedTuple):
    """The place, and what changes where a run ends."""

    place: _Place
    corners: Corners
    queue: _Queue


def search(
    free: Array,
    start: Array,
    goal: Array,
    straight: Array,
    diagonal: Array,
    width: int,
    places: int | None = None,
    room: Room | None = None,
) -> tuple[Best, Corners]:
    """Returns the cost of a shortest path of one map and what `jump_walk` needs; for use inside a
    marked call.

    Args:
      free: uint32 [H, words], packed.
      start, goal: int32 [2]; may be blocked or lie outside: then NO_COST.
      straight, diagonal: uint32 [], the fixed point.
      width: W.
      places: of the queue, a power of two; by default enough for most maps.
      room: used, and returned in the corners; by default new.
    """
    height = free.shape[0]
    num_cells = height * width
    places = places or max(64, next_power_of_two(num_cells // 16))
    buckets, wider = _buckets(height, width)
    shift = np.uint32(31) - lax.clz(straight) + np.uint32(wider)
    # all that follows begins here, and would else hold these reads once more
    is_open, start, goal = apart(functools.partial(_ends, width=width))(free, start, goal)
    tables = jump_tables(free, goal, width)
    goal_row, goal_col = goal[0].astype(jnp.uint32), goal[1].astype(jnp.uint32)

    def to_goal(row: Array, col: Array) -> Array:
        """The octile distance."""
        down, across = (
            jnp.where(a > b, a - b, b - a) for a, b in ((row, goal_row), (col, goal_col))
        )
        low, high = jnp.minimum(down, across), jnp.maximum(down, across)
        return high * straight + low * (diagonal - straight)

    one_run = _runner(tables, goal_row, goal_col, straight, to_goal, height, width, shift, buckets)
    one_diagonal = _diagonal_walker(tables, goal_row, goal_col, diagonal, height, width)
    least = to_goal(start[0].astype(jnp.uint32), start[1].astype(jnp.uint32))
    take = _taker(least >> shift, shift, buckets, num_cells)

    def expand(search: _Search) -> _Search:
        row, col = search.cell // np.uint32(width), search.cell % np.uint32(width)
        here = read_apart(search.corners.room.cost, search.cell)

        def try_one(state: _Expansion) -> _Expansion:
            state = one_run(state)
            # the next place with runs to try, if those here are done
            place = lax.while_loop(
                lambda place: (
                    (place.runs == 0) & ((place.diagonals != 0) | (place.part != _NO_DIAGONAL))
                ),
                lambda place: one_diagonal(place, row, col, here),
                state.place,
            )
            return state._replace(place=place)

        runs, diagonals = search.todo & np.uint32(15), search.todo >> np.uint32(4)
        place = _Place(runs, diagonals, jnp.uint32(_NO_DIAGONAL), row, col, here, search.best)
        # every set of moves to try holds a run
        done = lax.while_loop(
            lambda state: state.place.runs != 0,
            try_one,
            _Expansion(place, search.corners, search.queue),
        )
        return take(search._replace(best=done.place.best, corners=done.corners, queue=done.queue))

    # the start, by all eight moves
    zero = jnp.uint32(0)
    cell = (start[0] * width + start[1]).astype(jnp.uint32)
    corners = with_corner(none_of(room or room_of(height, width)), cell, zero, zero)
    best = Best(jnp.where(least == 0, jnp.uint32(0), NO_COST), jnp.uint32(0))
    # entry 0 stands for none; 1 to places - 1 are spare, one after the other
    after = (jnp.arange(places, dtype=jnp.uint32) + _ONE) & np.uint32(places - 1)
    queue = _Queue(
        zero,
        zero,
        jnp.uint32(_ONE),
        jnp.zeros(buckets, jnp.uint32),
        write(after, zero, zero),
        jnp.zeros(places, jnp.uint32),
    )
    begin = _Search(
        is_open & (least != 0),
        least >> shift,
        zero,
        cell,
        jnp.uint32(255),
        best._replace(cost=jnp.where(is_open, best.cost, NO_COST)),
        corners,
        queue,
    )
    done = lax.while_loop(lambda search: search.is_on, expand, begin)
    return done.best, done.corners


def _buckets(height: int, width: int) -> tuple[int, int]:
    """Returns how many buckets the queue has, a power of two, and how many bits wider each is than
    the highest power of two in a straight move's cost.

    So buckets are about a cell side wide on maps of any size, whichever fixed point these take: in
    wide ones too many corners would be expanded before their turn, with costs that fall again.
    """
    # a leg lengthens the least path through its end by no more than twice its own length
    longest, shortest = max(height, width), min(height, width)
    most = max(
        2 * (straight * longest + diagonal * shortest) >> (straight.bit_length() - 1)
        for straight, diagonal in moves.FIXED_POINTS
    )
    # on long narrow maps not more buckets than corners that the queue has room for
    room = max(_LEAST_BUCKETS, next_power_of_two(height * width // 16))
    buckets = min(room, max(_LEAST_BUCKETS, next_power_of_two(most + 3)))
    return buckets, (most // (buckets - 2)).bit_length()


def _ends(free: Array, start: Array, goal: Array, width: int) -> tuple[Array, Array, Array]:
    """Whether both ends are free cells of the map, and these; the first cell where not."""
    is_open = packing.has(free, start, width) & packing.has(free, goal, width)
    return is_open, jnp.where(is_open, start, 0), jnp.where(is_open, goal, 0)


def _lowest(bits: Array) -> Array:
    """Returns the index of the lowest bit set; 32 where none is."""
    return lax.population_count((bits & -bits) - _ONE)


def _less(cost: Array, leg: Array, best: Best, where: Array) -> Best:
    """Returns (cost, leg) if it is better than the best and `where` holds, else the best."""
    is_less = (cost < best.cost) | ((cost == best.cost) & (leg < best.leg))
    is_better = where & is_less
    return Best(*(jnp.where(is_better, new, old) for new, old in zip((cost, leg), best)))


def _runner(
    tables: JumpTables,
    goal_row: Array,
    goal_col: Array,
    straight: Array,
    to_goal: Callable[[Array, Array], Array],
    height: int,
    width: int,
    shift: Array,
    buckets: int,
) -> Callable[[_Expansion], _Expansion]:
    """A function that tries the lowest of the runs, and queues the corner where it stops."""
    ends_of_legs = jnp.asarray(_ends_of_legs())
    walls = functools.partial(walls_at, height=height, width=width)

    def one_run(state: _Expansion) -> _Expansion:
        place, corners, queue = state
        run, runs = _lowest(place.runs), place.runs & (place.runs - _ONE)
        stop = next_stop(tables.stop, run, place.row, place.col, height, width)
        to, length = stop.to, stop.length
        is_vertical = run & _ONE != 0
        row, col = jnp.where(is_vertical, to, place.row), jnp.where(is_vertical, place.col, to)
        cost = place.cost + length * straight
        leg = (np.uint32(LONGEST_SIDE) - length) << RUN
        leg = leg | read(ends_of_legs, place.part * np.uint32(4) + run)
        best = _less(cost, leg, place.best, (row == goal_row) & (col == goal_col))
        found = apart(walls)(tables, stop, run)
        cell = row * np.uint32(width) + col

        def note(state: tuple[Array, Corners, _Queue]) -> tuple[Array, Corners, _Queue]:
            """Runs at most once, where there is a corner."""
            _, corners, queue = state
            old, old_leg = corner_at(corners, cell)
            least = cost + to_goal(row, col)
            is_less = (cost < old) & (least <= best.cost)
            is_tie = cost == old
            own = leg | (_ONE << run)
            merged = jnp.minimum(own & _LEG, old_leg & _LEG) | ((own | old_leg) & ~_LEG)
            new = jnp.where(is_less, own | (old_leg & _WAITS), jnp.where(is_tie, merged, old_leg))
            is_new = is_less | (is_tie & ((old_leg >> run) & _ONE == 0))
            # into the queue, if there is room
            spare = queue.first_spare
            is_queued = is_new & (spare != 0)
            is_outside = is_new & (spare == 0)
            new_flag = is_outside & (old_leg & _WAITS == 0)
            new = jnp.where(is_outside, new | _WAITS, new)
            corners = with_corner(corners, cell, jnp.where(is_less, cost, old), new)
            bucket = (least >> shift) & np.uint32(buckets - 1)
            head, next_spare = read_apart(queue.first, bucket), read_apart(queue.after, spare)
            queue = _Queue(
                queue.num + is_queued.astype(jnp.uint32),
                queue.num_outside + new_flag.astype(jnp.uint32),
                jnp.where(is_queued, next_spare, spare),
                write(queue.first, jnp.where(is_queued, spare, head), bucket),
                write(queue.after, jnp.where(is_queued, head, next_spare), spare),
                write(queue.entry, (cell << np.uint32(4)) | found | run, spare),
            )
            return jnp.bool_(False), corners, queue

        _, corners, queue = lax.while_loop(
            lambda state: state[0], note, (found != 0, corners, queue)
        )
        return _Expansion(place._replace(runs=runs, best=best), corners, queue)

    return one_run


def _diagonal_walker(
    tables: JumpTables, goal_row: Array, goal_col: Array, diagonal: Array, height: int, width: int
) -> Callable[[_Place, Array, Array, Array], _Place]:
    """A function that walks on along the diagonal, or along the next one from the corner, to the
    next cell whose runs may lead somewhere; without runs where there is none.
    """
    tall, wide = groups_of(height, width)
    size = np.uint32(32 * tall * wide)
    down_by, right_by = jnp.asarray(_DOWN), jnp.asarray(_RIGHT)
    components = jnp.asarray(_COMPONENTS)

    def bit_at(table: Array, part: Array | np.uint32, line: Array, pos: Array, words: int) -> Array:
        """The bit wanted is the lowest; the others have no meaning."""
        return read(table, part + line * np.uint32(words) + (pos >> np.uint32(5))) >> (pos & _LOW)

    def one_diagonal(place: _Place, row: Array, col: Array, here: Array) -> _Place:
        is_first = place.part == _NO_DIAGONAL
        part = jnp.where(is_first, _lowest(place.diagonals), place.part)
        diagonals = jnp.where(is_first, place.diagonals & (place.diagonals - _ONE), place.diagonals)
        row, col = jnp.where(is_first, row, place.row), jnp.where(is_first, col, place.col)
        here = jnp.where(is_first, here, place.cost)
        down, right = read_apart(down_by, part), read_apart(right_by, part)
        # the move goes across a square of four cells, whose top left one is followed
        is_up, is_left = part >> _ONE, part & _ONE
        to_down, to_right = _ONE - is_up, _ONE - is_left
        vertical, across = is_up * (size + size), size + is_left * (size + size)

        def is_quiet(at: tuple[Array, Array]) -> Array:
            top, left = at
            row, col = top + to_down, left + to_right
            loud = bit_at(tables.ahead, vertical, row, col, wide) | bit_at(
                tables.ahead, across, col, row, tall
            )
            return bit_at(tables.square, np.uint32(0), top, left, wide) & ~loud & _ONE != 0

        top, left = row - is_up, col - is_left
        top, left = lax.while_loop(is_quiet, lambda at: (at[0] + down, at[1] + right), (top, left))
        is_legal = bit_at(tables.square, np.uint32(0), top, left, wide) & _ONE != 0
        new_row, new_col = top + to_down, left + to_right
        length = jnp.where(is_up != 0, row - new_row, new_row - row)
        cost = here + length * diagonal
        leg = ((part + np.uint32(4)) << COMES) | np.uint32(LONGEST_SIDE << 7)
        is_goal = (new_row == goal_row) & (new_col == goal_col)
        return _Place(
            jnp.where(is_legal, read(components, part), jnp.uint32(0)),
            diagonals,
            jnp.where(is_legal, part, _NO_DIAGONAL),
            new_row,
            new_col,
            cost,
            _less(cost, leg, place.best, is_legal & is_goal),
        )

    return one_diagonal


def _taker(
    first_bucket: Array, shift: Array, buckets: int, num_cells: int
) -> Callable[[_Search], _Search]:
    """A function that takes the next corner to expand out of the queue; when it is done with, one
    of those that wait outside.
    """
    table = jnp.asarray(moves_to_try())
    ring = np.uint32(buckets - 1)

    def waits(corners: Corners, cell: Array) -> Array:
        return (read(corners.room.leg, cell) & _WAITS != 0) & is_corner(corners, cell)

    def take(search: _Search) -> _Search:
        queue, corners = search.queue, search.corners
        is_filled = queue.num != 0
        bucket = lax.while_loop(
            lambda bucket: is_filled & (read(queue.first, bucket & ring) == 0),
            lambda bucket: bucket + _ONE,
            search.bucket,
        )
        is_queued = is_filled & ((bucket << shift) <= search.best.cost)
        is_outside = ~is_queued & (queue.num_outside != 0)
        # out of the queue: entry 0, which is none, where nothing is taken
        head = read_apart(queue.first, bucket & ring)
        index = jnp.where(is_queued, head, jnp.uint32(0))
        entry, after = read_apart(queue.entry, index), read_apart(queue.after, index)
        first = write(queue.first, jnp.where(is_queued, after, head), bucket & ring)
        links = write(queue.after, jnp.where(is_queued, queue.first_spare, after), index)
        # from outside: the next one flagged, or cell 0 again once all have been looked at
        next_cell = lax.while_loop(
            lambda cell: is_outside & (cell < np.uint32(num_cells)) & ~waits(corners, cell),
            lambda cell: cell + _ONE,
            search.next_cell,
        )
        next_cell = jnp.where(next_cell < np.uint32(num_cells), next_cell, jnp.uint32(0))
        cell = jnp.where(is_queued, entry >> np.uint32(4), next_cell)
        _, own = corner_at(corners, cell)
        is_outside = is_outside & (own & _WAITS != 0)
        # a cell that is no corner is not seen, whatever is written
        leg = write(corners.room.leg, jnp.where(is_outside, own & ~_WAITS, own), cell)
        # an entry is out of date where a shorter way has come by another run
        is_current = is_queued & ((own >> (entry & np.uint32(3))) & _ONE != 0)
        todo = jnp.where(is_current, read(table, entry & np.uint32(15)), jnp.uint32(0))
        num_outside = queue.num_outside - is_outside.astype(jnp.uint32)
        return _Search(
            is_queued | (queue.num_outside != 0),
            # a corner from outside may put others into any bucket from the first one on
            jnp.where(is_outside, first_bucket, bucket),
            next_cell,
            cell,
            jnp.where(is_outside, jnp.uint32(255), todo),
            search.best,
            corners._replace(room=corners.room._replace(leg=leg)),
            _Queue(
                queue.num - is_queued.astype(jnp.uint32),
                num_outside,
                jnp.where(is_queued, index, queue.first_spare),
                first,
                links,
                queue.entry,
            ),
        )

    return take
