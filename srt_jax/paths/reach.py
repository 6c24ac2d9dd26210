"""Which cells can be reached? Bit-packed wavefront sweeps over a batch of maps (PY16 §3.2: CLOSED).

A flood needs a step per cell of its longest path; a sweep carries it across the whole map in one
pass over the rows, top to bottom, then bottom to top, until nothing changes. A diagonal needs both
side cells free, so eight moves reach what four reach, and `reach` floods through sides only.
`flood` can also pass corners, through which obstacles are connected.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, compiled_whole, runs_in_place
from srt_jax.engine import arguments, eager, packing
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.moves import is_on_map
from srt_jax.propagation.word_queue import chosen, flood_rest
from srt_jax.types import Array

_MAX_ROUNDS = 4  # streets need three or four, the last of which finds that nothing changes
_WORTH_A_ROUND = 16
"""One word of so many has to have changed in a round for the next one to be worth more than a queue
of the words that may change: in a small region, or among scattered obstacles, few do.
"""

_FEW = 32
"""Of so many words one may be taken by the queue before the sweeps."""


def reach(free: Array, start: Array) -> Array:
    """Returns which cells can be reached from `start`; all False where `start` is blocked or
    outside the map.

    The set that A* has in CLOSED when it fails (PY16 §3.2).

    Memory besides argument and result: 0.3 bytes a cell of a batch of hundreds, up to 2 of a small
    one.

    Args:
      free: bool [..., H, W], True where the agent fits.
      start: int32 [..., 2], (row, col); may lie outside the map.

    Returns:
      bool [..., H, W].

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> srt_jax.reach(free, (2, 0)).sum().item()  # the 15 cells on this side of the wall
      15
    """
    (free, start), batch = arguments.mask_and_cells(free=free, start=start)
    return eager.call(reach_maps, batch, free, start, on_quads=_reach_quads)


@batch_kernel
def reach_maps(free: Array, start: Array) -> Array:
    """Returns `reach` of a batch: free bool [B, H, W], start int32 [B, 2] -> bool [B, H, W]."""
    return packing.unpack(
        reach_words(packing.pack(free), start, width=free.shape[2]), free.shape[2]
    )


def reach_words(free: Array, start: Array, *, width: int) -> Array:
    """Returns `reach` of packed masks, packed: free uint32 [B, H, words], `width` the W that was
    packed.
    """
    batch, height, _ = free.shape
    group = packing.group_size(batch, height, width)
    start = jnp.pad(start, ((0, -batch % group), (0, 0)), constant_values=-1)
    return packing.from_lanes(
        _reach_lanes(packing.to_lanes(free, group), start, group=group), group, batch
    )


def _reach_quads(free: Array, start: Array) -> Array:
    """`reach` of masks as quads (`packing`); B a power of two."""
    batch, height, count = free.shape
    group = packing.group_size(batch, height, 4 * count)
    lanes = _reach_lanes(packing.quads_to_lanes(free, group), start, group=group)
    return packing.unpack(packing.from_lanes(lanes, group, batch), 4 * count)


def _reach_lanes(free: Array, start: Array, *, group: int) -> Array:
    """Groups run one after the other, and each stops when it is done."""

    def one_group(free: Array, start: Array) -> Array:
        return flood_group(free, cells_in_group(free, start), group=group, through_corners=False)

    return compiled_whole(functools.partial(each, one_group))(free, start.reshape(-1, group, 2))


def flood(passable: Array, sources: Array, *, through_corners: bool) -> Array:
    """Returns the passable cells connected with any source, itself passable; all False where there
    is none.

    Args:
      passable, sources: bool [B, H, W].
      through_corners: whether cells that share only a corner are connected (8-connected), else
        sides only (4-connected).

    Returns:
      bool [B, H, W].
    """

    @batch_kernel
    def run(passable: Array, sources: Array) -> Array:
        words = flood_words(
            packing.pack(passable), packing.pack(sources), through_corners=through_corners
        )
        return packing.unpack(words, passable.shape[2])

    return run(passable, sources)


def flood_words(passable: Array, sources: Array, *, through_corners: bool) -> Array:
    """Returns `flood` of packed masks, packed: uint32 [B, H, words]."""
    batch, height, words = passable.shape
    group = packing.group_size(batch, height, words * packing.WORD)
    lanes = [packing.to_lanes(mask, group) for mask in (passable, sources)]
    return packing.from_lanes(
        flood_lanes(*lanes, group=group, through_corners=through_corners), group, batch
    )


def flood_lanes(free: Array, sources: Array, *, group: int, through_corners: bool) -> Array:
    """Returns `flood` of masks in lanes, in lanes."""
    one_group = functools.partial(flood_group, group=group, through_corners=through_corners)
    return compiled_whole(functools.partial(each, one_group))(free, sources & free)


def cells_in_group(free: Array, cell: Array) -> Array:
    """Returns one cell of each map of a group, none where it is not free or lies outside.

    Args:
      free: uint32 [H, lanes], one group in lanes.
      cell: int32 [group, 2], (row, col).
    """
    height, lanes = free.shape
    group = cell.shape[0]

    def mark(which: Array, marks: Array) -> Array:
        row, col = lax.dynamic_index_in_dim(cell, which, keepdims=False)
        word = col // packing.WORD
        inside = is_on_map(row, word, height, lanes // group)
        at = (jnp.where(inside, row, 0), jnp.where(inside, word, 0) * group + which)
        bit = jnp.where(
            inside, jnp.uint32(1) << (col % packing.WORD).astype(jnp.uint32), jnp.uint32(0)
        )
        return lax.dynamic_update_slice(marks, bit & lax.dynamic_slice(free, at, (1, 1)), at)

    return repeat(group, mark, jnp.zeros_like(free))


class _Phases(NamedTuple):
    """reached: uint32 [H + 2, lanes + 2 * group]; sweeps: bool [], whether the next phase begins
    with sweeps, after which a queue is never cut short; is_done: bool [].
    """

    reached: Array
    sweeps: Array
    is_done: Array


class _Rounds(NamedTuple):
    """reached: uint32 [H + 2, lanes + 2 * group]; num_changed: uint32 [], words in the last round;
    num_rounds: int32 [].
    """

    reached: Array
    num_changed: Array
    num_rounds: Array


class _Row(NamedTuple):
    """line, bare: uint32 [lanes + 2 * group] and [lanes], the row before with guards and without
    (to cut it out again costs 30 %); changed: uint32 [lanes], how many rows changed; reached:
    uint32 [H + 2, lanes + 2 * group].
    """

    line: Array
    bare: Array
    changed: Array
    reached: Array


class _Swept(NamedTuple):
    """reached: uint32 [H + 2, lanes + 2 * group]; changed: uint32 [lanes], how often a row changed
    in this round.
    """

    reached: Array
    changed: Array


def flood_group(
    free: Array,
    reached: Array,
    *,
    group: int,
    through_corners: bool | Array,
    may_be_small: bool = False,
) -> Array:
    """Returns the flood of one group in lanes, uint32 [H, lanes], from `reached`, part of `free`.

    Sweeps down and up while that changes much, some rounds at most; a queue of words does the rest.
    Inside, the lanes lie between two groups of empty ones, and the rows between two empty ones, so
    that no word lacks a neighbour.

    Args:
      through_corners: may be decided while it runs (bool []), so that one compiled body serves
        both.
      may_be_small: whether the flood may well add little to `reached`: then a queue that is cut
        short soon comes before the sweeps, each of which passes over the whole map.
    """
    # empty lanes and rows around
    height, lanes = free.shape
    guarded = jnp.zeros((height + 2, lanes + 2 * group), jnp.uint32)
    free, reached = (
        lax.dynamic_update_slice(guarded, words, (1, group)) for words in (free, reached)
    )

    def one_round(state: _Rounds) -> _Rounds:
        # One body for both directions: it takes long to compile.
        def one_way(upwards: Array, swept: _Swept) -> _Swept:
            return _sweep(
                free, swept, group=group, through_corners=through_corners, upwards=upwards == 1
            )

        begin = _Swept(state.reached, jnp.zeros(lanes, jnp.uint32))
        reached, changed = repeat(2, one_way, begin)
        return _Rounds(reached, jnp.sum(changed, dtype=jnp.uint32), state.num_rounds + 1)

    # sweeps to the end where a queue does not pay
    most = np.uint32(height * lanes)
    begin = _Rounds(reached, jnp.uint32(most), jnp.int32(0))
    if not runs_in_place():
        reached = lax.while_loop(lambda state: state.num_changed != 0, one_round, begin).reached
        return reached[1:-1, group:-group]
    worth_it, few = (np.uint32(max(1, most // share)) for share in (_WORTH_A_ROUND, _FEW))

    # else some rounds and then the queue; or a short queue first, and if that was too short, both
    def phase(state: _Phases) -> _Phases:
        begin = _Rounds(state.reached, jnp.where(state.sweeps, most, np.uint32(0)), jnp.int32(0))
        swept = lax.while_loop(
            lambda state: (state.num_changed >= worth_it) & (state.num_rounds < _MAX_ROUNDS),
            one_round,
            begin,
        )

        def by_queue(reached: Array) -> tuple[Array, Array]:
            limit = jnp.where(state.sweeps, np.uint32(2**32 - 1), few)
            return flood_rest(
                free,
                reached,
                group=group,
                through_corners=through_corners,
                fill_runs=fill_runs,
                limit=limit,
            )

        is_complete = state.sweeps & (swept.num_changed == 0)
        reached, is_done = lax.cond(
            is_complete, lambda reached: (reached, jnp.bool_(True)), by_queue, swept.reached
        )
        return _Phases(reached, jnp.bool_(True), is_done)

    no, yes = jnp.bool_(False), jnp.bool_(True)
    if may_be_small:
        # the queue needs whole runs; it ends: that of the second phase is not cut short
        first = _Phases(fill_runs(free, reached), no, no)
        last = lax.while_loop(lambda state: ~state.is_done, phase, first)
    else:
        last = phase(_Phases(reached, yes, no))
    return last.reached[1:-1, group:-group]


def _sweep(
    free: Array, swept: _Swept, *, group: int, through_corners: bool | Array, upwards: Array
) -> _Swept:
    """One pass over the rows of a group, `free` [H + 2, lanes + 2 * group], from the last to the
    first where `upwards` (bool []).

    The carry between words comes from the row before and from the last sweep, not from the row in
    work, which would be a serial chain. That is sound (only reached cells are passed on) and
    complete (when nothing changes, old and new agree).
    """
    inner = slice(group, -group)
    height, num_lanes = free.shape[0] - 2, free.shape[1] - 2 * group
    one, top = jnp.uint32(1), jnp.uint32(31)

    def row_of(rows: Array, at: tuple[Array, Array]) -> Array:
        return lax.dynamic_slice(rows, at, (1, rows.shape[1]))[0]

    def row_step(i: Array, state: _Row) -> _Row:
        # The rows in work; the last sweep's row is where the new one is written.
        line, bare, changed, reached = state
        at = (jnp.where(upwards, height - i, i + 1), jnp.int32(0))
        free_line, old_line = row_of(free, at), apart(row_of)(reached, at)
        # what comes in: from above (or below), and from the neighbouring words
        here, old = free_line[inner], old_line[inner]
        before_left, before_right = line[:num_lanes], line[2 * group :]
        left = (before_left & free_line[:num_lanes]) | old_line[:num_lanes]
        right = (before_right & free_line[2 * group :]) | old_line[2 * group :]
        new = (bare & here) | old | (left >> top) | (right << top)
        if through_corners is not False:
            corner = (bare << one) | (bare >> one) | (before_left >> top) | (before_right << top)
            new = new | chosen(corner, through_corners)
        # and from there along the row, inside each word
        new = fill_runs(here, new & here)
        line = jnp.pad(new, (group, group))
        reached = lax.dynamic_update_slice(reached, line[None], at)
        return _Row(line, new, changed + (new != old).astype(jnp.uint32), reached)

    nothing = jnp.zeros_like(free[0])
    begin = _Row(nothing, nothing[inner], swept.changed, swept.reached)
    end = repeat(height, row_step, begin)
    return _Swept(end.reached, end.changed)


def fill_runs(free: Array, reached: Array) -> Array:
    """Spreads every bit of `reached` over its run of 1s in `free`, inside each word."""
    # towards high bits: the carry of the sum runs along the 1s
    reached = reached | (free & ~(free + reached))
    run = free
    for shift in (1, 2, 4, 8, 16):  # towards low bits: prefix doubling
        reached = reached | (run & (reached >> jnp.uint32(shift)))
        run = run & (run >> jnp.uint32(shift))
    return reached
