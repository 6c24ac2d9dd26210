"""The tree of shortest paths: each cell's parent, and sums along it, up to the root and down to the
leaves.

By the envelope theorem the derivative of the least cost is that of the cost of the path that is
least: a change of costs is added up along the tree from the start (`path_sums`), and the adjoint
runs back along it (`subtree_sums`). Both take one step a cell and a few arrays of the map's size,
however long the paths are.

The tree is a byte a cell: 1 + the index in `moves.MOVES` of the move from the cell to its parent;
ROOT, which is 0, at the start and at cells not reached.
"""

import functools
import operator
from collections.abc import Callable, Iterable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import compiled_whole, runs_in_place
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.engine.in_place import read_apart, write
from srt_jax.gradients.cell_costs import cost_of_move, move_costs, shifted
from srt_jax.moves import MOVES, is_on_map
from srt_jax.types import Array

ROOT = 0

_LENGTHS = tuple(2**0.5 if down and right else 1.0 for down, right in MOVES)
_BACK = tuple(MOVES.index((-down, -right)) for down, right in MOVES)


@batch_kernel
def parents(free: Array, cell_cost: Array, cost: Array) -> Array:
    """Returns the tree of each map: the move from each cell to the neighbour with the least cost
    plus move.

    Ties go to the first neighbour in row order. A parent costs strictly less than its child, so
    there is no cycle; where float32 has swallowed the cost of the move, see `_adopt_orphans`.

    Args:
      free: bool [B, H, W]. cell_cost: float32 [B, H, W]. cost: float32 [B, H, W], the least costs
        from the start.

    Returns:
      uint8 [B, H, W].
    """
    return parents_by(_into_each_cell, cost, free, cell_cost)


def parents_by(moves_of: Callable[..., list[Array]], cost: Array, *args: Array) -> Array:
    """Returns the tree of a batch, as `parents`, for moves of any costs.

    Args:
      moves_of: args -> for each of MOVES what it costs to come from the neighbour in that direction
        to each cell, float32 [..., H, W]; for one map and for a batch.
      cost: float32 [B, H, W]. args: [B, ...] each.
    """

    def one_map(cost: Array, *args: Array) -> tuple[Array, Array]:
        return _parents_of_map(moves_of(*args), cost)

    # In a marked call, since outside one XLA computes the tree again wherever it is read, and the
    # adjoint reads it ten times.
    tree, second = compiled_whole(functools.partial(each, one_map))(cost, *args)
    # cells without a parent that is right up to rounding: an equal neighbour, else the best one
    tree = _adopt_orphans(tree, lambda: moves_of(*args), cost)
    return jnp.where(tree == ROOT, second, tree)


def _into_each_cell(free: Array, cell_cost: Array) -> list[Array]:
    costs = move_costs(free, cell_cost)
    return [cost_of_move(costs, move)[..., 1:-1, 1:-1] for move in range(8)]


class _Round(NamedTuple):
    """tree: uint8 [B, H, W]; is_changing: bool [], whether another round may change it."""

    tree: Array
    is_changing: Array


def _adopt_orphans(tree: Array, moves: Callable[[], list[Array]], cost: Array) -> Array:
    """Gives a parent to cells whose last move costs too little to count beside the cost so far.

    Round by round, from neighbours of the same cost that have one. As a rule no cell needs it, and
    there is no round.
    """

    def is_orphan(tree: Array) -> Array:
        return (tree == ROOT) & (cost > 0) & (cost < jnp.inf)

    def adopt(state: _Round) -> _Round:
        tree = state.tree
        orphan, new = is_orphan(tree), tree
        for move, ((down, right), own) in enumerate(zip(MOVES, moves())):
            total = shifted(cost, down, right) + own
            fits = (
                orphan
                & (new == ROOT)
                & ~shifted(orphan, down, right, outside=True)
                & (total == cost)
            )
            new = jnp.where(fits, jnp.uint8(1 + move), new)
        return _Round(new, jnp.any(new != tree))

    # ends: every round but the last gives some cell a parent
    first = _Round(tree, is_orphan(tree).any())
    return lax.while_loop(lambda state: state.is_changing, adopt, first).tree


def _parents_of_map(moves: list[Array], cost: Array) -> tuple[Array, Array]:
    """The tree where cost plus move is the cell's cost up to rounding, and the tree without that
    condition.
    """
    best, least = jnp.full(cost.shape, ROOT, jnp.uint8), jnp.full(cost.shape, jnp.inf, jnp.float32)
    for move, ((down, right), own) in enumerate(zip(MOVES, moves)):
        there = shifted(cost, down, right)
        total = jnp.where(there < cost, there + own, jnp.inf)
        best, least = jnp.where(total < least, jnp.uint8(1 + move), best), jnp.minimum(least, total)
    return jnp.where(least <= cost * jnp.float32(1 + 2**-20), best, jnp.uint8(ROOT)), best


def from_parent(tree: Array, field: Array) -> Array:
    """Returns the value of `field` [..., H, W] at each cell's parent; 0 at roots. Linear, and
    transposed by JAX.
    """
    return _total(
        jnp.where(tree == 1 + move, shifted(field, *MOVES[move], outside=0), 0) for move in range(8)
    )


def move_integral(tree: Array, field: Array) -> Array:
    """Returns the integral of `field` [..., H, W] over the move from each cell's parent; 0 at
    roots. Linear likewise.
    """
    halves = [
        jnp.where(tree == 1 + move, jnp.float32(0.5 * _LENGTHS[move]), 0) for move in range(8)
    ]
    return _total(
        half * (field + shifted(field, *MOVES[move], outside=0)) for move, half in enumerate(halves)
    )


def path_sums(tree: Array, field: Array) -> Array:
    """Returns the sum of `field` over each cell and all its ancestors: x with x(cell) = field(cell)
    + x(parent).

    Linear in `field`; its transpose is `subtree_sums`, which is linear likewise.
    """
    return lax.custom_linear_solve(
        lambda x: x - from_parent(tree, x),
        field,
        solve=lambda _, b: _sums(tree, b, downwards=True),
        transpose_solve=lambda _, b: _sums(tree, b, downwards=False),
    )


def subtree_sums(tree: Array, field: Array) -> Array:
    """Returns the sum of `field` [..., H, W] over each cell and all its descendants."""
    return _sums(tree, field, downwards=False)


class _Climb(NamedTuple):
    """cell: uint32 [], flat; is_on_path: bool [], whether it belongs to the path and is not yet
    marked; mask: bool [H * W].
    """

    cell: Array
    is_on_path: Array
    mask: Array


def path_mask(tree: Array, goal: Array) -> Array:
    """Returns the cells on the way from the root to `goal`, both ends among them; none where `goal`
    lies outside the map.

    Args:
      tree: uint8 [B, H, W]. goal: int32 [B, 2].

    Returns:
      bool [B, H, W].
    """
    height, width = tree.shape[1:]

    def one_map(tree: Array, goal: Array) -> Array:
        row, col = goal
        is_inside = is_on_map(row, col, height, width)
        cell = jnp.where(is_inside, row * width + col, 0).astype(jnp.uint32)
        step_to, tree, mask = _steps(width), tree.reshape(-1), jnp.zeros(height * width, bool)

        def step(climb: _Climb) -> _Climb:
            move = read_apart(tree, climb.cell).astype(jnp.uint32)
            return _Climb(
                climb.cell + read_apart(step_to, move),
                move != ROOT,
                write(climb.mask, jnp.bool_(True), climb.cell),
            )

        # ends at a root: the tree has no cycle
        climb = _Climb(cell, is_inside, mask)
        climb = lax.while_loop(lambda climb: climb.is_on_path, step, climb)
        return climb.mask.reshape(height, width)

    return batch_kernel(compiled_whole(functools.partial(each, one_map)))(tree, goal)


def _total(terms: Iterable[Array]) -> Array:
    return functools.reduce(operator.add, terms)


def _steps(width: int) -> Array:
    """ROOT, 0, and the moves as steps in a flat map."""
    return jnp.asarray(
        np.array([0, *(down * width + right for down, right in MOVES)], np.int32).astype(np.uint32)
    )


def _sums(tree: Array, field: Array, *, downwards: bool) -> Array:
    """`path_sums` or `subtree_sums`, by one kernel over all batch dimensions."""

    def one_map(tree: Array, num_children: Array, field: Array) -> Array:
        add = _add_in_order if runs_in_place() else _add_at_once
        return add(tree, num_children, field, downwards)

    @batch_kernel
    def run(tree: Array, field: Array) -> Array:
        return compiled_whole(functools.partial(each, one_map))(tree, _num_children(tree), field)

    core = tree.shape[-2:]
    return run(tree.reshape(-1, *core), field.reshape(-1, *core)).reshape(field.shape)


def _num_children(tree: Array) -> Array:
    """How many children each cell has: uint8 [..., H, W]."""
    return _total((_moved_back(tree, move) == 1 + move).astype(jnp.uint8) for move in range(8))


def _moved_back(field: Array, move: int, outside: int = ROOT) -> Array:
    """`field` at the neighbour whose move `move` leads to the cell."""
    return shifted(field, *MOVES[_BACK[move]], outside=outside)


def _add_in_order(tree: Array, num_children: Array, field: Array, downwards: bool) -> Array:
    """Cell by cell, in an order in which every cell comes after its children, or in the reverse of
    it.
    """
    width = tree.shape[1]
    step_to, flat = _steps(width), tree.reshape(-1)
    order, num = _leaves_first(flat, num_children.reshape(-1), step_to)

    def add(i: Array, sums: Array) -> Array:
        cell = read_apart(order, num - jnp.uint32(1) - i if downwards else i)
        parent = cell + read_apart(step_to, read_apart(flat, cell).astype(jnp.uint32))
        source, target = (parent, cell) if downwards else (cell, parent)
        given, had = read_apart(sums, source), read_apart(sums, target)
        return write(sums, had + given, target)

    return lax.fori_loop(jnp.uint32(0), num, add, field.reshape(-1)).reshape(field.shape)


class _Listing(NamedTuple):
    """cell, ahead: uint32 [], the cell in work, and the next one in row order; num: uint32 [],
    cells listed; order: uint32 [N + 1]; waiting: uint8 [N], children not yet listed, 255 once
    the cell is listed itself.
    """

    cell: Array
    ahead: Array
    num: Array
    order: Array
    waiting: Array


def _leaves_first(tree: Array, waiting: Array, step_to: Array) -> tuple[Array, Array]:
    """The cells that have a parent, every one after its children, and their number: uint32 [N] and
    uint32 [].

    From each leaf, in row order, upwards as long as the last child has been listed.
    """
    size, one = jnp.uint32(tree.shape[0]), jnp.uint32(1)
    done = jnp.uint8(255)

    def step(state: _Listing) -> _Listing:
        cell, ahead, num, order, waiting = state
        # a cell whose children are all listed is next, unless it is a root or listed already
        move = read_apart(tree, cell).astype(jnp.uint32)
        here = read_apart(waiting, cell)
        is_next = (here == 0) & (move != ROOT)
        waiting = write(waiting, jnp.where(is_next, done, here), cell)
        order = write(order, cell, num)
        num = num + is_next.astype(jnp.uint32)
        # its parent waits for one child less; if for none, it is next, else the next in row order
        parent = cell + read_apart(step_to, move)
        left = read_apart(waiting, parent) - is_next.astype(jnp.uint8)
        waiting = write(waiting, left, parent)
        goes_up = is_next & (left == 0)
        cell = jnp.where(goes_up, parent, ahead)
        return _Listing(cell, jnp.where(goes_up, ahead, ahead + one), num, order, waiting)

    order = jnp.zeros(tree.shape[0] + 1, jnp.uint32)
    state = _Listing(jnp.uint32(0), one, jnp.uint32(0), order, waiting)
    # ends: every step lists a cell or moves on in row order
    state = lax.while_loop(lambda state: state.cell < size, step, state)
    return state.order, state.num


class _Levels(NamedTuple):
    """sums: float32 [H, W]; is_waiting: bool [H, W], the cells whose sums may still change."""

    sums: Array
    is_waiting: Array


def _add_at_once(tree: Array, num_children: Array, field: Array, downwards: bool) -> Array:
    """All cells at once, level by level: for machines on which a loop over cells is slow.

    Ends after as many rounds as the tree has levels.
    """

    def towards(value: Array, outside: int) -> list[tuple[Array, Array]]:
        """For each move, `value` at the other end of it, and whether the tree has this move."""
        moves = range(8)
        if downwards:
            return [
                (tree == 1 + move, shifted(value, *MOVES[move], outside=outside)) for move in moves
            ]
        return [
            (_moved_back(tree, move) == 1 + move, _moved_back(value, move, outside))
            for move in moves
        ]

    def level(state: _Levels) -> _Levels:
        sums, is_waiting = state
        new = sum((jnp.where(is_there, value, 0) for is_there, value in towards(sums, 0)), field)
        still = [is_there & value for is_there, value in towards(is_waiting, 0)]
        return _Levels(new, functools.reduce(jnp.logical_or, still))

    is_waiting = (tree != ROOT) if downwards else num_children > 0
    first = _Levels(field, is_waiting)
    return lax.while_loop(lambda state: state.is_waiting.any(), level, first).sums
