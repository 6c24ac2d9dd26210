"""The legs of a search (`paid_search`): where they lead from a label, and what they pay.

A leg goes any number of diagonal moves, then a run, which stops where `stops` says. Along a
diagonal nothing is done at cells from where no run comes to a corner, the goal, or a door that can
be paid for. A corner counts as long as the obstacle that makes it may stay. A leg ends where its
sum is more than the limit, with the octile distance to the goal, the toll of a door, and, where
nothing has been paid yet, the least toll, which some door ahead must ask.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.words import WORD
from srt_jax.engine.in_place import read, read_apart
from srt_jax.obstacles import Labels
from srt_jax.paths.jump_points import moves_to_try
from srt_jax.paths.jump_tables import groups_of, next_stop
from srt_jax.tolls import entry
from srt_jax.tolls.paid_labels import PAID, Candidate, Held, first_of, inserter
from srt_jax.tolls.paid_sets import Memory, Metric
from srt_jax.tolls.stops import Stops
from srt_jax.types import FREE, Array

_ONE = np.uint32(1)

# Moves: runs 0 right, 1 down, 2 left, 3 up, then diagonals 4 down right, 5 down left, 6 up right,
# 7 up left.
NO_MOVE, RUNS = np.uint32(8), np.uint32(15)
DOWN = np.array([0, 1, 0, -1, 1, 1, -1, -1, 0], np.int32).astype(np.uint32)
RIGHT = np.array([1, 0, -1, 0, 1, -1, 1, -1, 0], np.int32).astype(np.uint32)
_COMPONENTS = np.array([0] * 4 + [0b0011, 0b0110, 0b1001, 0b1100, 0], np.uint32)

# How a label was reached: by a move, through a door or not.
DOOR, ORIGIN = np.uint32(8), np.uint32(4)


class Leg(NamedTuple):
    """Where legs are on their way, all uint32 []. move: the one in work, NO_MOVE for none; row,
    col, sum: where. The diagonal that runs begin from: diagonal, its_row, its_col, its_sum. runs,
    diagonals: to be tried from there, and from the label.
    """

    move: Array
    row: Array
    col: Array
    sum: Array
    diagonal: Array
    its_row: Array
    its_col: Array
    its_sum: Array
    runs: Array
    diagonals: Array


def has_more(leg: Leg) -> Array:
    return (leg.move & leg.diagonal != NO_MOVE) | (leg.runs | leg.diagonals != 0)


def _lowest(bits: Array) -> Array:
    return lax.population_count((bits & -bits) - _ONE)


def advancer(
    labels: Labels,
    owner_at: Callable,
    stops: Stops,
    asked: Array,
    memory: Memory,
    metric: Metric,
    to_goal: Callable,
    least: Array,
    limit: Array,
    room: Array,
) -> Callable:
    """A function that goes on by a run to its next stop, or by a diagonal move, and makes a label
    where one is due.
    """
    bits = memory.bits
    num_layers, height, width = labels.all.shape[1:]
    tall, wide = groups_of(height, width)
    size = np.uint32(WORD * tall * wide)
    down_by, right_by, components, to_try = (
        jnp.asarray(table) for table in (DOWN, RIGHT, _COMPONENTS, moves_to_try())
    )
    goal = metric.goal.astype(jnp.uint32)
    insert = inserter(memory, metric, limit, room, width)

    def scan(move: Array, row: Array, col: Array) -> tuple[Array, Array, Array]:
        """The length of a run to its next stop, and whether there is a corner in the line before,
        and behind; 1 and none of a diagonal move.
        """
        is_run = move < np.uint32(4)
        run = move & np.uint32(3)
        at, bit, _, length = next_stop(stops.stop, run, row, col, height, width, is_asked=is_run)
        before, behind = ((read(table, at) >> bit) & _ONE for table in (stops.before, stops.behind))
        walls = jnp.where(is_run, before | behind << _ONE, jnp.uint32(0))
        return jnp.where(is_run, length, _ONE), walls, is_run

    def door(row: Array, col: Array, to_row: Array, to_col: Array, paid: Array) -> tuple:
        """What the move pays, the bits of what it needs gone, and whether it needs any that the
        cell before does not lie in and that is not known to be paid for.
        """
        cells = ((row, col), (to_row, to_col), (row, to_col), (to_row, col))
        owners = [[owner_at(layer, *cell) for layer in range(num_layers)] for cell in cells]
        known, low, high = owners[0], jnp.uint32(0), jnp.uint32(0)
        behind, is_door = jnp.uint32(0), jnp.bool_(False)
        for ids in owners[1:]:
            for i, owner in enumerate(ids):
                place = (owner + 2).astype(jnp.uint32)
                held = read(bits, place)
                is_new = owner != -1
                for other in [*known, *ids[:i]]:
                    is_new = is_new & (owner != other)
                # Obstacles that share a bit are paid for together, but each is noted.
                is_open = held & (paid | behind) != 0
                toll = jnp.where(is_new & ~is_open, read(asked, place), jnp.uint32(0))
                low, high = low + (toll & np.uint32(0xFFFF)), high + (toll >> np.uint32(16))
                behind = behind | held
                is_known = held & paid & ~memory.shared != 0
                is_door = is_door | (is_new & ~is_known)
            known = [*known, *ids]
        return entry.joined(low, high), behind, is_door

    def are_gone(row: Array, col: Array, run: Array, paid: Array) -> Array:
        """Whether what stands beside a cell, in the line before the run and behind, is known to be
        paid for: two bits.
        """
        is_vertical, gone = run & _ONE != 0, jnp.uint32(0)
        for side, step in enumerate((np.uint32(2**32 - 1), _ONE)):
            its_row = jnp.where(is_vertical, row, row + step)
            its_col = jnp.where(is_vertical, col + step, col)
            are_paid = []
            for layer in range(num_layers):
                owner = owner_at(layer, its_row, its_col)
                held = read(bits, (owner + 2).astype(jnp.uint32))
                are_paid.append((owner == FREE) | (held & paid & ~memory.shared != 0))
            is_one = functools.reduce(jnp.logical_and, are_paid)
            gone = gone | (is_one.astype(jnp.uint32) << np.uint32(side))
        return gone

    def is_free_somewhere(paid: Array) -> Array:
        """Whether there may be doors free of charge: into what is paid for, and where obstacles
        overlap, from a cell of two of them to one of a single one.
        """
        return paid != 0 if num_layers == 1 else jnp.bool_(True)

    def bit_at(table: Array, part: Array, line: Array, pos: Array, words: int) -> Array:
        word = read(table, part + line * np.uint32(words) + (pos >> np.uint32(5)))
        return (word >> (pos & np.uint32(31))) & _ONE

    def is_square(move: Array, row: Array, col: Array) -> Array:
        """Whether a diagonal move leads across four cells of the same labels."""
        is_up, is_left = (move >> _ONE) & _ONE, move & _ONE
        return bit_at(stops.square, jnp.uint32(0), row - is_up, col - is_left, wide) != 0

    def ahead(move: Array, doors: Array, row: Array, col: Array) -> Array:
        """Which runs from a cell that a diagonal leads to come to a stop that counts: a set."""
        is_up, is_left = (move >> _ONE) & _ONE, move & _ONE
        of_rows, of_cols = doors + is_up * (size + size), doors + size + is_left * (size + size)
        vertical = bit_at(stops.ahead, of_rows, row, col, wide)
        across = bit_at(stops.ahead, of_cols, col, row, tall)
        return vertical << (_ONE + is_up + is_up) | across << (is_left + is_left)

    def walk(leg: Leg, limit: Array, place: tuple, paid: Array, has_paid: Array) -> Leg:
        """Goes on along the diagonal, or the next one, to where runs are to be tried, or to the
        move that may lead through a door.
        """
        is_first = leg.diagonal == NO_MOVE
        move = jnp.where(is_first, _lowest(leg.diagonals) + np.uint32(4), leg.diagonal)
        row, col, here = (
            jnp.where(is_first, a, b)
            for a, b in zip(place, (leg.its_row, leg.its_col, leg.its_sum))
        )
        # Whoever has paid nothing has to; else doors count where there is something left for a
        # toll, or where some may be free of charge.
        owes = jnp.where(has_paid != 0, jnp.uint32(0), least)
        most = limit - jnp.minimum(limit, owes)
        to_row, to_col = row + read_apart(down_by, move), col + read_apart(right_by, move)
        base = here + metric.diagonal
        is_inside = (to_row < np.uint32(height)) & (to_col < np.uint32(width))
        far = base + to_goal(to_row, to_col)
        is_near = is_inside & (base <= most) & (far <= most)
        has_doors = (has_paid == 0) | is_free_somewhere(paid) | (limit - far >= least)
        doors = jnp.where(has_doors, np.uint32(4) * size, jnp.uint32(0))
        is_goal = (to_row == goal[0]) & (to_col == goal[1])
        is_even = ~is_goal & is_square(move, row, col)
        walks = is_near & is_even
        its_row, its_col, its_sum = (
            jnp.where(walks, a, b) for a, b in zip((to_row, to_col, base), (row, col, here))
        )
        runs = jnp.where(walks, ahead(move, doors, to_row, to_col), jnp.uint32(0))
        return Leg(
            jnp.where(is_near & ~is_even, move, NO_MOVE),
            row,
            col,
            here,
            jnp.where(is_near, move, NO_MOVE),
            its_row,
            its_col,
            its_sum,
            runs,
            jnp.where(is_first, leg.diagonals & (leg.diagonals - _ONE), leg.diagonals),
        )

    def advance(
        leg: Leg,
        held: Held,
        place: tuple,
        paid: Array,
        has_paid: Array,
        label: Array,
        bucket: Array,
    ) -> tuple[Leg, Held]:
        # Along the diagonals, where there is nothing else to do.
        leg = lax.while_loop(
            lambda leg: (leg.move == NO_MOVE) & (leg.runs == 0) & has_more(leg),
            lambda leg: walk(leg, held.limit, place, paid, has_paid),
            leg,
        )
        # Where the next move leads to, or the next run; without a corner that is at a door.
        is_waiting = leg.move != NO_MOVE
        is_asked = is_waiting | (leg.runs != 0)
        move = jnp.where(is_waiting, leg.move, _lowest(leg.runs))
        runs = jnp.where(is_waiting, leg.runs, leg.runs & (leg.runs - _ONE))
        row, col, here = (
            jnp.where(is_waiting, a, b)
            for a, b in zip((leg.row, leg.col, leg.sum), (leg.its_row, leg.its_col, leg.its_sum))
        )
        length, all_walls, is_run = scan(move, row, col)
        down, right = read_apart(down_by, move), read_apart(right_by, move)
        to_row, to_col = row + length * down, col + length * right
        base = here + length * jnp.where(is_run, metric.straight, metric.diagonal)
        is_inside = (to_row < np.uint32(height)) & (to_col < np.uint32(width))
        far = to_goal(to_row, to_col)
        is_goal = (to_row == goal[0]) & (to_col == goal[1])
        pays = is_run & (all_walls == 0) & ~is_goal & ~is_free_somewhere(paid)
        asks = jnp.where(pays | (has_paid == 0), least, jnp.uint32(0))
        is_near = is_inside & (base <= held.limit) & (base + far <= held.limit)
        is_near = is_near & (held.limit - base - far >= asks)

        def enter(state: tuple) -> tuple:
            last = to_row - down, to_col - right
            toll, behind, is_door = door(*last, to_row, to_col, paid)
            total, held = base + toll, state[2]
            is_gone = are_gone(*last, move, paid | behind)
            walls = jnp.where(is_goal, all_walls, all_walls & ~is_gone)
            is_near = (total <= held.limit) & (total + far <= held.limit)
            pays = has_paid | jnp.where(toll != 0, PAID, jnp.uint32(0))
            is_near = is_near & ((pays != 0) | (held.limit - total - far >= least))
            # A label, or on.
            is_due = is_near & (is_door | is_goal | (walls != 0))
            # Most are worse than the label that their cell has got.
            cell = jnp.where(is_due, to_row * np.uint32(width) + to_col, jnp.uint32(0))
            first, known = first_of(held, cell)
            is_less = (first != 0) & (known.sum < total)
            gives_up = (paid | behind) & ~known.paid

            def note(state: tuple[Array, Held]) -> tuple[Array, Held]:
                todo = jnp.where(
                    is_run,
                    read(to_try, move & np.uint32(3) | walls << np.uint32(2)),
                    _ONE << move | read(components, move),
                )
                origin = (label << ORIGIN) | move | jnp.where(is_door, DOOR, jnp.uint32(0))
                reached = (to_row, to_col, total, far, paid | behind, todo | pays, origin, is_goal)
                return jnp.bool_(False), insert(state[1], Candidate(*reached), first, bucket)

            _, held = lax.while_loop(
                lambda state: state[0], note, (is_due & ~(is_less & (gives_up == 0)), held)
            )
            return jnp.bool_(False), is_near & ~is_due, held

        _, goes_on, held = lax.while_loop(
            lambda state: state[0], enter, (is_near & is_asked, jnp.bool_(False), held)
        )
        walks_on, is_over = goes_on & ~is_run, is_waiting & ~is_run & ~goes_on
        its_row, its_col, its_sum = (
            jnp.where(walks_on, a, b)
            for a, b in zip((to_row, to_col, base), (leg.its_row, leg.its_col, leg.its_sum))
        )
        return Leg(
            jnp.where(goes_on & is_run, move, NO_MOVE),
            to_row,
            to_col,
            base,
            jnp.where(is_over, NO_MOVE, leg.diagonal),
            its_row,
            its_col,
            its_sum,
            jnp.where(walks_on, read(components, move), runs),
            leg.diagonals,
        ), held

    return advance
