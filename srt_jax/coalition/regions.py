"""The regions of one map: cells covered by the same obstacles and connected by sides, and which
regions lie beside which.

Where agents walk matters only up to regions, and there are few: everything that a coalition decides
is decided on this small graph. It is built from the runs of each row, the longest stretches of
cells with equal labels: two rows are compared run by run, as two sorted lists are merged, and runs
that share a side and their labels are joined. A region is named by the first of its runs.

For use inside a marked call, map by map. The arrays have room for the worst map and are never
cleared: what a map uses of them it writes first (`Scratch`).
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.ground.marks import apart
from srt_jax.engine import packing
from srt_jax.engine.in_place import read_apart
from srt_jax.obstacles import Labels
from srt_jax.types import FREE, OUTSIDE, Array

_CACHE = 256
"""Pairs of regions remembered so that few of them are linked twice; a power of two."""


class Scratch(NamedTuple):
    """Room for the graph of any map of this shape, and for the floods over it. N is the number of
    cells, M the obstacles, Z the words of a set of M + 1 obstacles: the last stands for what lies
    outside the map.

    first: int32 [N + 2], the first cell of each run, row by row. parent: int32 [N + 1], a run of
      the same region, itself if it is the first one; the last entry is written where there is
      nothing to write.
    own, near: uint32 [N + 1, Z], the obstacles on the cells of each run (region), and those beside.
    head: int32 [N + 1], the first link of each region, -1 none.
    to, after: int32 [6 N + 2], the region to which a link leads, and the next link of its region.
    low, high: int32 [_CACHE], the pairs of regions linked last.
    mark, queue: int32 [F * N], for F floods: the epoch in which each region was reached, and the
      regions reached, in order. epoch: int32 [], the last one.
    """

    first: Array
    parent: Array
    own: Array
    near: Array
    head: Array
    to: Array
    after: Array
    low: Array
    high: Array
    mark: Array
    queue: Array
    epoch: Array


class Graph(NamedTuple):
    """The graph of one map: `Scratch` as far as it is filled. num_runs: int32 []."""

    num_runs: Array
    room: Scratch


class _Scan(NamedTuple):
    """upper, lower: int32 [], the runs compared. kind: int32 [], 0 one below the other, 1 and 2 the
    corners where both end in one column, 3 neighbours in one row. num_links: int32 [].
    """

    upper: Array
    lower: Array
    kind: Array
    num_links: Array
    room: Scratch


class _Roots(NamedTuple):
    """parent: int32 [N + 1]. one, other: int32 [], runs on the way to their regions."""

    parent: Array
    one: Array
    other: Array


def scratch(num_cells: int, num_obstacles: int, num_floods: int) -> Scratch:
    """Returns room for maps of `num_cells` cells; every number in it is without meaning."""
    words = packing.num_words(num_obstacles + 1)

    def numbers(*shape: int) -> Array:
        return jnp.zeros(shape, jnp.int32)

    return Scratch(
        first=numbers(num_cells + 2),
        parent=numbers(num_cells + 1),
        own=jnp.zeros((num_cells + 1, words), jnp.uint32),
        near=jnp.zeros((num_cells + 1, words), jnp.uint32),
        head=numbers(num_cells + 1),
        to=numbers(6 * num_cells + 2),
        after=numbers(6 * num_cells + 2),
        low=numbers(_CACHE),
        high=numbers(_CACHE),
        mark=numbers(num_floods * num_cells),
        queue=numbers(num_floods * num_cells),
        epoch=jnp.int32(0),
    )


def graph_of(labels: Labels, may_go: Array, room: Scratch) -> Graph:
    """Returns the graph of one map; `may_go` (bool [M]): what can ever be destroyed.

    Regions of which some cell can never be opened are linked with none.
    """
    num_obstacles = len(may_go)
    num_runs, second_row, room = _list_runs(labels, room)
    never = set_of(~jnp.pad(may_go, (0, 1)))
    room = _with_owners(labels, num_runs, num_obstacles, room)

    # Two passes: the first joins runs, the second links the regions.
    def one_pass(number: Array, room: Scratch) -> Scratch:
        return _compare(labels, num_runs, second_row, never, room, number == 1)

    return Graph(num_runs, lax.fori_loop(jnp.int32(0), jnp.int32(2), one_pass, room))


def set_of(which: Array) -> Array:
    """Returns bool [M + 1] as a set, uint32 [Z]."""
    return packing.pack(which[None, None])[0, 0]


def members(words: Array, count: int) -> Array:
    """Returns a set as bool [count]."""
    return packing.unpack(words[None, None], count)[0, 0]


def regions_at(graph: Graph, cells: Array, height: int, width: int) -> tuple[Array, Graph]:
    """Returns the region of each cell, int32 [n, 2] -> [n]; -1 where it lies outside the array."""
    is_inside = (cells >= 0).all(axis=1) & (cells[:, 0] < height) & (cells[:, 1] < width)
    place = cells[:, 0] * width + cells[:, 1]

    def halve(_: Array, state: _Ends) -> _Ends:
        middle = (state.low + state.high) // 2
        is_before = jnp.take(state.first, middle) <= place
        low, high = (
            jnp.where(is_before, middle, state.low),
            jnp.where(is_before, state.high, middle),
        )
        return _Ends(low, high, state.first)

    # The last run that begins no later. Ends: the two are neighbours then.
    steps = jnp.int32((height * width + 1).bit_length())
    low = jnp.zeros_like(place)
    begin = _Ends(low, jnp.full_like(low, graph.num_runs), graph.room.first)
    end = lax.fori_loop(jnp.int32(0), steps, halve, begin)
    room = graph.room._replace(first=end.first)
    regions = jnp.take(room.parent, end.low)
    return jnp.where(is_inside, regions, -1), graph._replace(room=room)


class _Ends(NamedTuple):
    """low, high: int32 [n], runs between which the one in search lies. first: as in `Scratch`."""

    low: Array
    high: Array
    first: Array


def run_starts(labels: Labels, row: Array) -> Array:
    """Returns where in a row a run begins, which is where the label of any layer changes: bool
    [W].
    """
    _, num_layers, _, width = labels.all.shape
    changes = jnp.arange(width, dtype=jnp.int32) == 0
    for layer in range(num_layers):
        ids = labels.row(layer, row)
        changes = changes | (ids != jnp.pad(ids[:-1], (1, 0)))
    return changes


def _list_runs(labels: Labels, room: Scratch) -> tuple[Array, Array, Scratch]:
    """The number of runs, the first run of the second row, and the first cell of each; every run is
    a region of its own as yet.
    """
    _, _, height, width = labels.all.shape

    def begins(row: Array) -> Array:
        return packing.pack(run_starts(labels, row)[None, None])[0, 0]

    starts = lax.map(begins, jnp.arange(height, dtype=jnp.int32))

    def note(out: tuple, row: Array, col: Array, is_set: Array) -> tuple:
        num, second, first, parent, head = out
        row, col = row.astype(jnp.int32), col.astype(jnp.int32)
        cell = row * width + col
        # one place further is overwritten by the next run
        first, parent = put(first, cell, num), put(parent, num, num)
        head = put(head, jnp.int32(-1), num)
        second = jnp.where(is_set & (cell == width), num, second)
        return num + is_set.astype(jnp.int32), second, first, parent, head

    out = (jnp.int32(0), jnp.int32(-1), room.first, room.parent, room.head)
    num, second, first, parent, head = packing.for_each_cell(starts, note, out)
    first = put(first, jnp.int32(height * width), num)
    second = jnp.where(second < 0, num, second)  # a map of one row
    return num, second, room._replace(first=first, parent=parent, head=head)


def _with_owners(labels: Labels, num_runs: Array, num_obstacles: int, room: Scratch) -> Scratch:
    """The obstacles on each run; none beside it as yet, and no pair of regions linked."""
    _, num_layers, _, width = labels.all.shape
    words = room.own.shape[1]

    def of_run(run: Array, room: Scratch) -> Scratch:
        cell = at(room.first, run)
        place = jnp.arange(words, dtype=jnp.int32)
        owners = jnp.zeros(words, jnp.uint32)
        for layer in range(num_layers):
            owner = labels.at(layer, cell // width, cell % width)
            owner = jnp.where(owner == OUTSIDE, num_obstacles, owner)
            bit = jnp.uint32(1) << (owner & 31).astype(jnp.uint32)
            owners = owners | jnp.where((owner != FREE) & (place == owner >> 5), bit, 0)
        return room._replace(
            own=put_row(room.own, owners, run),
            near=put_row(room.near, jnp.zeros_like(owners), run),
        )

    none = jnp.full(_CACHE, -1, jnp.int32)
    return lax.fori_loop(jnp.int32(0), num_runs, of_run, room._replace(low=none, high=none))


def _compare(
    labels: Labels,
    num_runs: Array,
    second_row: Array,
    never: Array,
    room: Scratch,
    links: Array,
) -> Scratch:
    """Compares all runs that touch: joins those of one region, or where `links` links regions."""
    _, num_layers, _, width = labels.all.shape

    def step(state: _Scan) -> _Scan:
        upper, lower, kind, num_links, room = state
        # The two runs, and whether they touch: neighbours in a row do unless a row ends between.
        one = upper + (kind == 2).astype(jnp.int32)
        other = lower + (kind == 1).astype(jnp.int32)
        is_apart = (kind == 3) & (at(room.first, other) % width == 0)
        are_alike = jnp.all(row(room.own, one) == row(room.own, other))
        by_side = kind % 3 == 0
        # Alike they are joined, by sides; else linked. What is seldom done stands in a loop of one
        # step or none, which leaves the arrays in place.
        joins = ~links & by_side & are_alike & ~is_apart
        matters = joins | (links & ~are_alike & ~is_apart)
        num_links, room = lax.fori_loop(
            jnp.int32(0),
            matters.astype(jnp.int32),
            lambda _, both: _relate(one, other, joins, by_side, never, *both),
            (num_links, room),
        )

        # The next two. Both rows are covered by runs, so the one that ends first is left behind.
        # Where both end in one column they touch two more by a corner, which matters only if the
        # one is not part of the other's region.
        end = at(room.first, upper + 1)
        end_below = at(room.first, lower + 1) - width
        has_corners = links & (end == end_below) & (end % width != 0) & ~are_alike
        goes_on = jnp.where(kind == 0, ~has_corners, kind == 2)
        upper_on = goes_on & ((kind == 2) | (end <= end_below))
        lower_on = goes_on & ((kind == 2) | (end >= end_below))
        # In the rows first: then from the top.
        is_row, is_last = kind == 3, other + 1 >= num_runs
        to_upper = upper + (is_row | upper_on).astype(jnp.int32)
        to_lower = lower + (is_row | lower_on).astype(jnp.int32)
        begins = is_row & is_last
        return _Scan(
            jnp.where(begins, 0, to_upper),
            jnp.where(begins, second_row, to_lower),
            jnp.where(begins | goes_on, 0, jnp.where(is_row, 3, kind + 1)),
            num_links,
            room,
        )

    # Two runs of one row may be alike only where labels lie in several layers.
    in_rows = (num_runs > 1) & (links | (num_layers > 1))
    begin = _Scan(
        jnp.int32(0),
        jnp.where(in_rows, 1, second_row),
        jnp.where(in_rows, jnp.int32(3), jnp.int32(0)),
        jnp.int32(0),
        room,
    )
    # Ends: every step but two at a corner leaves a run behind.
    room = lax.while_loop(lambda state: state.lower < num_runs, step, begin).room

    # Every run learns its region: those of the runs before it are known.
    def settle(run: Array, parent: Array) -> Array:
        return put(parent, at(parent, at(parent, run)), run)

    parent = lax.fori_loop(jnp.int32(0), num_runs, settle, room.parent)
    return room._replace(parent=parent)


def _relate(
    one: Array,
    other: Array,
    joins: Array,
    by_side: Array,
    never: Array,
    num_links: Array,
    room: Scratch,
) -> tuple[Array, Scratch]:
    """Joins or links the regions of two runs that touch."""
    roots = lax.while_loop(
        lambda state: (
            (at(state.parent, state.one) != state.one)
            | (at(state.parent, state.other) != state.other)
        ),
        lambda state: _Roots(
            state.parent, at(state.parent, state.one), at(state.parent, state.other)
        ),
        _Roots(room.parent, one, other),
    )
    low, high = jnp.minimum(roots.one, roots.other), jnp.maximum(roots.one, roots.other)
    # The later run becomes part of the region of the earlier one.
    was = at(roots.parent, high)
    parent = put(roots.parent, jnp.where(joins, low, was), high)

    # What each region has beside it, and the way between them, once for most pairs.
    slot = (low * 31 + high) & (_CACHE - 1)
    was_low, was_high = at(room.low, slot), at(room.high, slot)
    is_new = ~joins & (low != high) & ((was_low != low) | (was_high != high) | ~by_side)
    is_kept = is_new & by_side
    room = room._replace(
        parent=parent,
        low=put(room.low, jnp.where(is_kept, low, was_low), slot),
        high=put(room.high, jnp.where(is_kept, high, was_high), slot),
    )

    def link(_: Array, state: tuple[Array, Scratch]) -> tuple[Array, Scratch]:
        num_links, room = state
        own_low, own_high = row(room.own, low), row(room.own, high)
        near = put_row(room.near, row(room.near, low) | own_high, low)
        near = put_row(near, row(near, high) | own_low, high)
        is_way = by_side & jnp.all((own_low | own_high) & never == 0)
        head, to, after = room.head, room.to, room.after
        for region, there in ((low, high), (high, low)):
            before = at(head, region)
            to, after = put(to, there, num_links), put(after, before, num_links)
            head = put(head, jnp.where(is_way, num_links, before), region)
            num_links = num_links + is_way.astype(jnp.int32)
        return num_links, room._replace(near=near, head=head, to=to, after=after)

    return lax.fori_loop(jnp.int32(0), is_new.astype(jnp.int32), link, (num_links, room))


def at(array: Array, index: Array) -> Array:
    """Returns array[index], index int32 from 0 on."""
    return read_apart(array, _u(index))


def put(array: Array, value: Array, index: Array) -> Array:
    """Returns `array` with `value` at `index`, int32 from 0 on."""
    return lax.dynamic_update_slice(array, value[None], (_u(index),))


def row(array: Array, index: Array) -> Array:
    """Returns one row of an array of two axes."""
    return _read_row(array, _u(index))


def put_row(array: Array, values: Array, index: Array) -> Array:
    """Returns an array of two axes with `values` as one of its rows."""
    return lax.dynamic_update_slice(array, values[None], (_u(index), jnp.uint32(0)))


def _u(index: Array) -> Array:
    # a signed index would be tested for being negative
    return index.astype(jnp.uint32)


@apart
def _read_row(array: Array, index: Array) -> Array:
    return lax.dynamic_slice(array, (index, jnp.uint32(0)), (1, array.shape[1]))[0]
