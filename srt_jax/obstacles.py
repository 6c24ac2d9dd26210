"""One map of a batch in machine words: which cells are open once obstacles are gone, which
obstacles border a region.

`owners_at` and `opens_at` answer for one cell of each map of a batch. The rest is for use inside a
marked call (`sign_model.foundation.marks`), map by map: rows of labels are read from the whole
batch, since a map cut out of it would be a copy. A mask is uint32 [H, words], packed as in
`packing`.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import apart, compiled_whole, runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.batching import each
from srt_jax.engine.in_place import read_apart, write
from srt_jax.moves import is_on_map, octile_order
from srt_jax.types import FREE, Array

FAR = 2**28
"""Farther than any two cells of a map, in `octile_order`."""

_ALWAYS_SELECTED = 2
"""Of so few words of obstacles, each is compared with, empty or not."""

MANY = 1024
"""From which on obstacles may lie scattered; programs for fewer, such as a street has, do without
what pays among those alone: they would take a quarter longer to compile. Noise of 192 x 192, with
some 700, takes a fifth longer to answer so.
"""

_MOST_SELECTED = 16
"""Up to so many words of obstacles, comparing with each is faster than a table look-up per cell."""


class Labels(NamedTuple):
    """The labels of one map: all int32 [B, L, H, W], and which of the batch, int32 []."""

    all: Array
    which: Array

    def row(self, layer: int, row: Array) -> Array:
        """Returns int32 [W]."""
        width = self.all.shape[3]
        return lax.dynamic_slice(
            self.all, (self.which, jnp.int32(layer), row, jnp.int32(0)), (1, 1, 1, width)
        ).reshape(width)

    def at(self, layer: int, row: Array, col: Array) -> Array:
        """Returns int32 [], the nearest cell's label where the cell lies outside."""
        return lax.dynamic_slice(self.all, (self.which, jnp.int32(layer), row, col), (1, 1, 1, 1))[
            0, 0, 0, 0
        ]


def as_words(which: Array) -> Array:
    """Returns a set of obstacles, bool [M], as uint32 [ceil(M / 32)]."""
    return packing.pack(which[None, None])[0, 0]


def ids_of(which: Array) -> Array:
    """Returns the obstacles of each set of a batch, ascending, then -1: bool [B, M] -> int32 [B,
    M].
    """
    num = which.shape[1]

    def ids_of_one(which: Array) -> Array:
        # the sets hold few of thousands: to sort them would take longer than all that found them
        def note(state: tuple[Array, Array], _: Array, col: Array) -> tuple[Array, Array]:
            count, ids = state
            return count + jnp.uint32(1), write(ids, col.astype(jnp.int32), count)

        begin = jnp.uint32(0), jnp.full(num, -1, jnp.int32)
        return packing.for_each_cell(as_words(which)[None], note, begin)[1]

    def all_sets(which: Array) -> Array:
        if runs_in_place():
            return each(ids_of_one, which)
        ids = jnp.sort(jnp.where(which, jnp.arange(num, dtype=jnp.int32)[None], num), axis=1)
        return jnp.where(ids < num, ids, -1)

    return compiled_whole(all_sets)(which)


def open_cells(labels: Labels, gone: Array) -> Array:
    """Returns the cells that are free once the obstacles `gone` (bool [M]) are: every owner of a
    cell has to go.
    """
    return _row_by_row(labels, gone, _is_open, jnp.logical_and)


def _is_open(ids: Array, is_one: Array) -> Array:
    return (ids == FREE) | is_one


def cells_of(labels: Labels, which: Array) -> Array:
    """Returns the cells that at least one of the obstacles `which` (bool [M]) covers."""
    return _row_by_row(labels, which, lambda ids, is_one: is_one, jnp.logical_or)


def _row_by_row(
    labels: Labels,
    which: Array,
    test: Callable[[Array, Array], Array],
    join: Callable[[Array, Array], Array],
) -> Array:
    """Returns the cells whose labels pass the test, of all layers joined, as a mask.

    Args:
      which: bool [M], a set of obstacles.
      test: takes labels and whether each is of the set.
    """
    return lax.map(_row_reader(labels, which, test, join), _rows(labels))


def _rows(labels: Labels) -> Array:
    return jnp.arange(labels.all.shape[2], dtype=jnp.int32)


def _owners_in_row(labels: Labels, row: Array) -> Array:
    """The labels of a row: int32 [L, W]."""
    return jnp.stack([labels.row(layer, row) for layer in range(labels.all.shape[1])])


def _as_row(passes: Array, join: Callable[[Array, Array], Array]) -> Array:
    """The layers of a row, bool [L, W], joined and packed: uint32 [words]."""
    return packing.pack_row(functools.reduce(join, (passes[i] for i in range(len(passes)))))


def _row_reader(
    labels: Labels,
    which: Array,
    test: Callable[[Array, Array], Array],
    join: Callable[[Array, Array], Array],
) -> Callable[[Array], Array]:
    """Returns what gives one row of `_row_by_row`, uint32 [words]."""
    words = as_words(which)
    filled = _filled(words) if runs_in_place() and len(words) > _ALWAYS_SELECTED else None

    def row_of(row: Array) -> Array:
        ids = _owners_in_row(labels, row)
        return _as_row(test(ids, _is_one_of(ids, words, filled)), join)

    return row_of


class Survey(NamedTuple):
    """What one pass over the labels of a map tells.

    free: uint32 [H, words], the cells open with nothing gone. traces: uint32 [_TRACES, H], which
    obstacles a row may hold cells of: those of which it has each of the `_traces`. as_left,
    as_above: uint32 [H, words], the cells with the labels of the one to the left, and of the one
    above; None where there are few obstacles.
    """

    free: Array
    traces: Array
    as_left: Array | None
    as_above: Array | None


_TRACES = 2
"""Words of traces a row: with two, one row in five is read in vain where a row holds 20
obstacles, as on streets.
"""


def survey(labels: Labels, num_obstacles: int) -> Survey:
    """Returns the cells open with nothing gone, and what `opened` and `met_beside` need to look at
    few rows and few cells.
    """
    are_many = num_obstacles >= MANY

    def one_row(row: Array) -> tuple[Array, Array, Any]:
        ids = _owners_in_row(labels, row)
        traces = functools.reduce(jnp.bitwise_or, _traces(ids).transpose(1, 0, 2))
        free, same = _as_row(ids == FREE, jnp.logical_and), None
        if are_many:
            left = jnp.pad(ids, ((0, 0), (1, 0)), constant_values=FREE)[:, :-1]
            above = _owners_in_row(labels, jnp.maximum(row - 1, 0))
            same = tuple(_as_row(ids == other, jnp.logical_and) for other in (left, above))
        return free, _joined(traces), same

    free, traces, same = lax.map(one_row, _rows(labels))
    return Survey(free, traces.T, *(same or (None, None)))


def opened(labels: Labels, known: Survey, gone: Array, before: Array, new: Array) -> Array:
    """Returns `open_cells(labels, gone)`, of which only rows that may hold cells of the obstacles
    `new` are read anew.

    Args:
      gone, new: bool [M].
      before: what it was before these, which are among `gone`, were gone.
    """
    if not runs_in_place():
        return open_cells(labels, gone)
    row_of = _row_reader(labels, gone, _is_open, jnp.logical_and)

    def read_row(mask: Array, _: Array, row: Array) -> Array:
        # read in vain, a row is what it was
        row = row.astype(jnp.int32)
        return lax.dynamic_update_slice(mask, row_of(row)[None], (row, jnp.int32(0)))

    due = packing.pack(_rows_of(known, new)[None, None])[0]
    return packing.for_each_cell(due, read_row, before)


def _rows_of(known: Survey, which: Array) -> Array:
    """Returns the rows that may hold cells of the obstacles `which` (bool [M]): bool [H]."""
    traces = _traces(jnp.arange(len(which), dtype=jnp.int32))
    bits = _joined(jnp.where(which, traces, jnp.uint32(0)))
    return functools.reduce(
        jnp.logical_and, (known.traces[i] & bits[i] != 0 for i in range(_TRACES))
    )


def _traces(ids: Array) -> Array:
    """The traces of obstacles, int32 [..., N] -> uint32 [_TRACES, ..., N]: a bit for each of the
    last two digits of the number to the base 32. Free cells have those of no obstacle below 1023.
    """
    return jnp.stack([jnp.uint32(1) << (ids >> 5 * i & 31).astype(jnp.uint32) for i in range(2)])


def _joined(bits: Array) -> Array:
    """Joins bits along the last axis by or: halves first, as many at once as a register holds."""
    while bits.shape[-1] % 2 == 0 and bits.shape[-1] > 32:
        half = bits.shape[-1] // 2
        bits = bits[..., :half] | bits[..., half:]
    return lax.reduce(bits, np.uint32(0), lax.bitwise_or, (bits.ndim - 1,))


class _Filled(NamedTuple):
    """The words of a set that hold an obstacle. num: int32 []; places: int32 [words], which they
    are, in the first `num` entries.
    """

    num: Array
    places: Array


def _filled(words: Array) -> _Filled:
    def note(i: Array, filled: _Filled) -> _Filled:
        # what is noted for an empty word, the next one overwrites
        places = lax.dynamic_update_slice(filled.places, i[None], (filled.num,))
        word = lax.dynamic_slice(words, (i,), (1,))[0]
        return _Filled(filled.num + (word != 0).astype(jnp.int32), places)

    return repeat(len(words), note, _Filled(jnp.int32(0), jnp.zeros(len(words), jnp.int32)))


def _is_one_of(ids: Array, words: Array, filled: _Filled | None) -> Array:
    """Whether each label is of a set of obstacles, by its words."""

    def compared(word: Array, i: Array) -> Array:
        return jnp.where(ids >> 5 == i, lax.dynamic_slice(words, (i,), (1,))[0], word)

    def looked_up() -> Array:
        return jnp.where(ids >= 0, jnp.take(words, (ids >> 5).clip(0)), jnp.uint32(0))

    none = jnp.zeros(ids.shape, jnp.uint32)
    if filled is not None:
        # mostly few obstacles are gone, so all but a word or two are empty
        def by_places() -> Array:
            return lax.fori_loop(
                jnp.int32(0),
                filled.num,
                lambda k, word: compared(word, lax.dynamic_slice(filled.places, (k,), (1,))[0]),
                none,
            )

        is_few = filled.num <= _MOST_SELECTED
        word = (
            by_places() if len(words) <= _MOST_SELECTED else lax.cond(is_few, by_places, looked_up)
        )
    elif len(words) <= _MOST_SELECTED:
        word = functools.reduce(compared, (jnp.int32(i) for i in range(len(words))), none)
    else:
        word = looked_up()
    return word >> (ids & 31).astype(jnp.uint32) & jnp.uint32(1) != 0


def all_open_cells(labels: Array, gone: Array) -> Array:
    """Returns `open_cells` of a batch: labels int32 [B, L, H, W], gone bool [B, M] -> uint32 [B, H,
    words].
    """
    return of_all(open_cells, labels, gone)


def all_cells_of(labels: Array, which: Array) -> Array:
    """Returns `cells_of` of a batch: labels int32 [B, L, H, W], which bool [B, M] -> uint32 [B, H,
    words].
    """
    return of_all(cells_of, labels, which)


def all_met_by(labels: Array, cells: Array, num_obstacles: int) -> Array:
    """Returns `met_by` of a batch: labels int32 [B, L, H, W], cells uint32 [B, H, words] -> bool
    [B, M].
    """
    return of_all(functools.partial(met_by, num_obstacles=num_obstacles), labels, cells)


def all_nearest_of(labels: Array, cells: Array, goal: Array, num_obstacles: int) -> Array:
    """Returns `nearest_of` of a batch: as `all_met_by`, goal int32 [B, 2] -> int32 [B, M]."""
    return of_all(functools.partial(nearest_of, num_obstacles=num_obstacles), labels, cells, goal)


def of_all(fun: Callable[..., Any], labels: Array, *args: Any) -> Any:
    """Returns fun(labels of one map, ...) of each map of a batch, in a marked call."""

    def all_maps(labels: Array, *args: Any) -> Any:
        return each(
            lambda which, *args: fun(Labels(labels, which), *args),
            jnp.arange(len(labels), dtype=jnp.int32),
            *args,
        )

    return compiled_whole(all_maps)(labels, *args)


def one_by_one(fun: Callable[..., Any], labels: Array, kept: Any, *args: Any) -> Any:
    """Returns fun(labels of one map, kept, ...)[0] of each map of a batch, in a loop that is in no
    marked call: `fun` makes such calls. Its second result is `kept` for the next map.
    """

    def one_map(kept: Any, which_and_args: tuple) -> tuple[Any, Any]:
        which, args = which_and_args
        out, kept = fun(Labels(labels, which), kept, *args)
        return kept, out

    if len(labels) == 1:
        out = one_map(kept, (jnp.int32(0), jax.tree.map(lambda arg: arg[0], args)))[1]
        return jax.tree.map(lambda leaf: leaf[None], out)
    return lax.scan(one_map, kept, (jnp.arange(len(labels), dtype=jnp.int32), args))[1]


def met_by(labels: Labels, cells: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover at least one of `cells` (a mask): bool [M]."""
    if not runs_in_place():
        ids, is_owned = _owners(labels, cells)
        return (
            jnp.zeros(num_obstacles, bool)
            .at[jnp.where(is_owned, ids, num_obstacles)]
            .set(True, mode="drop")
        )

    def note(met: Array, owner: Array, row: Array, col: Array) -> Array:
        return write(met, jnp.uint32(1), owner)

    return (
        _visit_owners(labels, cells, note, jnp.zeros(num_obstacles + 1, jnp.uint32))[:num_obstacles]
        != 0
    )


def met_beside(
    labels: Labels, known: Survey, reached: Array, passable: Array, among: Array
) -> Array:
    """Returns which of the obstacles `among` (bool [M]) a region meets by a side: those that cover
    a cell beside it which is not passable, bool [M].

    Args:
      reached, passable: masks.
    """
    border = beside(reached) & ~passable
    border = jnp.where(_rows_of(known, among)[:, None], border, jnp.uint32(0))
    if known.as_left is not None and known.as_above is not None:
        # one cell of a run, or of a column, that the same obstacles cover
        above = jnp.pad(border, ((1, 0), (0, 0)))[:-1]
        border = border & ~((border << jnp.uint32(1)) & known.as_left) & ~(above & known.as_above)
    return met_by(labels, border, len(among)) & among


def nearest_of(labels: Labels, cells: Array, goal: Array, num_obstacles: int) -> Array:
    """Returns how near `goal` (int32 [2]) each obstacle comes with those of `cells` that it covers:
    int32 [M].

    In the order of `octile_order`; FAR for an obstacle that covers none.
    """
    far = jnp.full(num_obstacles + 1, FAR, jnp.int32)
    if not runs_in_place():
        ids, is_owned = _owners(labels, cells)
        rows, cols = jnp.indices(labels.all.shape[2:], jnp.int32)
        h = jnp.broadcast_to(
            octile_order(rows - goal[0], cols - goal[1]), labels.all.shape[1:]
        ).reshape(-1)
        return far.at[jnp.where(is_owned, ids, num_obstacles)].min(h)[:num_obstacles]

    def note(near: Array, owner: Array, row: Array, col: Array) -> Array:
        return write(
            near,
            jnp.minimum(octile_order(row - goal[0], col - goal[1]), read_apart(near, owner)),
            owner,
        )

    return _visit_owners(labels, cells, note, far)[:num_obstacles]


def _owners(labels: Labels, cells: Array) -> tuple[Array, Array]:
    """The label of each cell and layer, and whether it is an obstacle's and the cell is in the mask
    `cells`: [L * H * W] each.
    """
    own = labels.all[labels.which]
    in_mask = packing.unpack(cells[None], own.shape[2])
    return own.reshape(-1), (in_mask & (own >= 0)).reshape(-1)


def _visit_owners(
    labels: Labels, cells: Array, note: Callable[[Array, Array, Array, Array], Array], out: Array
) -> Array:
    """Returns `out` after out = note(out, owner, row, col) for each cell of the mask and layer.

    Where no obstacle owns the cell, the last entry of `out` stands for nobody. Rows and columns are
    int32, owners uint32.
    """
    nobody = len(out) - 1

    def visit(out: Array, row: Array, col: Array) -> Array:
        row, col = row.astype(jnp.int32), col.astype(jnp.int32)
        for layer in range(labels.all.shape[1]):
            owner = apart(lambda labels, row, col, layer=layer: labels.at(layer, row, col))(
                labels, row, col
            )
            owner = jnp.where(owner >= 0, owner, nobody).astype(jnp.uint32)
            out = note(out, owner, row, col)
        return out

    return packing.for_each_cell(cells, visit, out)


def owners_of(labels: Labels, cell: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover `cell`, int32 [2] inside the map: bool [M]."""
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)
    owners = (labels.at(layer, cell[0], cell[1]) for layer in range(labels.all.shape[1]))
    return functools.reduce(jnp.logical_or, (ids == owner for owner in owners))


def only(cell: Array, height: int, num_words: int) -> Array:
    """Returns the mask of one cell, int32 [2] inside the map."""
    mask = jnp.zeros((height, num_words), jnp.uint32)
    bit = jnp.uint32(1) << (cell[1] & 31).astype(jnp.uint32)
    return lax.dynamic_update_slice(mask, bit[None, None], (cell[0], cell[1] >> 5))


def holds(mask: Array, cell: Array) -> Array:
    """Returns whether `cell`, int32 [2] inside the map, is in the mask: bool []."""
    word = lax.dynamic_slice(mask, (cell[0], cell[1] >> 5), (1, 1))[0, 0]
    return word >> (cell[1] & 31).astype(jnp.uint32) & jnp.uint32(1) != 0


def beside(mask: Array) -> Array:
    """Returns the cells that share a side with one of the mask's, inside the mask or outside.

    Bits past the map's last column may be set as well.
    """
    one, top = jnp.uint32(1), jnp.uint32(31)
    tall, wide = jnp.pad(mask, ((1, 1), (0, 0))), jnp.pad(mask, ((0, 0), (1, 1)))
    along = (mask << one) | (mask >> one) | (wide[:, :-2] >> top) | (wide[:, 2:] << top)
    return along | tall[:-2] | tall[2:]


def owners_at(labels: Array, cell: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover `cell` (int32 [B, 2]): bool [B, M]; none where it lies
    outside the array.
    """
    owners, is_inside = _entry_at(jnp.moveaxis(labels, 1, -1), cell)  # [B, L]
    ids = jnp.arange(num_obstacles, dtype=jnp.int32)
    return (owners[:, :, None] == ids[None, None, :]).any(axis=1) & is_inside[:, None]


def opens_at(labels: Array, cell: Array, gone: Array) -> Array:
    """Returns whether `cell` (int32 [B, 2]) is on the map and free once the obstacles `gone` (bool
    [B, M]) are: bool [B].
    """
    owners, is_inside = _entry_at(jnp.moveaxis(labels, 1, -1), cell)  # [B, L]
    is_open = (owners == FREE) | (jnp.take_along_axis(gone, owners.clip(0), axis=1) & (owners >= 0))
    return is_open.all(axis=1) & is_inside


def _entry_at(array: Array, cell: Array) -> tuple[Array, Array]:
    """Returns the entry of `array` [B, H, W, ...] at `cell`, or the nearest it has, and whether it
    has `cell` (bool [B]).
    """
    _, H, W = array.shape[:3]
    row, col = cell[:, 0], cell[:, 1]
    is_inside = is_on_map(row, col, H, W)
    return array[
        jnp.arange(array.shape[0], dtype=jnp.int32), row.clip(0, H - 1), col.clip(0, W - 1)
    ], is_inside
