"""The regions of one map: cells covered by the same obstacles and connected by sides, and which
regions lie beside which.

Where agents walk matters only up to regions, and there are few: everything that a coalition decides
is decided on this small graph. It is built from the runs of each row, the longest stretches of
cells with equal labels: two rows are compared run by run, as two sorted lists are merged, and runs
that share a side and their owners are joined; those that touch and differ are noted, and their
regions linked once these are known. A region is named by the first of its runs.

For use inside a marked call, map by map. The arrays have room for the worst map and are never
cleared: what a map uses of them it writes first (`Scratch`).
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.marks import apart
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
    owners: int32 [N + 1, L], the labels of each run, sorted and none twice: the same numbers where
      the same obstacles lie on it.
    upper, lower: int32 [3 N + 2], runs of neighbouring rows that touch and differ; `lower` is
      complemented where they touch by a corner alone.
    own, near: uint32 [N + 1, Z], the obstacles on the cells of each run (region), and those beside.
    head: int32 [N + 1], the first link of each region, -1 none.
    to, after: int32 [6 N + 2], the region to which a link leads, and the next link of its region.
    low, high: int32 [_CACHE], the pairs of regions linked last.
    mark, queue: int32 [F * N], for F floods: the epoch in which each region was reached, and the
      regions reached, in order. epoch: int32 [], the last one.
    """

    first: Array
    parent: Array
    owners: Array
    upper: Array
    lower: Array
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
    """upper, lower: int32 [], the runs compared. num_pairs: int32 [], of those that differ."""

    upper: Array
    lower: Array
    num_pairs: Array
    room: Scratch


class _Roots(NamedTuple):
    """parent: int32 [N + 1]. one, other: int32 [], runs on the way to their regions."""

    parent: Array
    one: Array
    other: Array


def scratch(num_cells: int, num_layers: int, num_obstacles: int, num_floods: int) -> Scratch:
    """Returns room for maps of `num_cells` cells; every number in it is without meaning."""
    words = packing.num_words(num_obstacles + 1)

    def numbers(*shape: int) -> Array:
        return jnp.zeros(shape, jnp.int32)

    return Scratch(
        first=numbers(num_cells + 2),
        parent=numbers(num_cells + 1),
        owners=numbers(num_cells + 1, num_layers),
        upper=numbers(3 * num_cells + 2),
        lower=numbers(3 * num_cells + 2),
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
    num_pairs, room = _join(labels, num_runs, second_row, room)
    return Graph(num_runs, _link(labels, num_runs, num_pairs, never, room))


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

    def note(out: tuple, row: Array, col: Array) -> tuple:
        num, second, first, parent, head = out
        row, col = row.astype(jnp.int32), col.astype(jnp.int32)
        cell = row * width + col
        first, parent = put(first, cell, num), put(parent, num, num)
        head = put(head, jnp.int32(-1), num)
        second = jnp.where(cell == width, num, second)
        return num + 1, second, first, parent, head

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
        owners = []
        for layer in range(num_layers):
            owner = labels.at(layer, cell // width, cell % width)
            is_again = functools.reduce(jnp.logical_or, (owner == one for one in owners), False)
            owners.append(jnp.where(is_again, FREE, owner))
        own = jnp.zeros(words, jnp.uint32)
        for owner in owners:
            number = jnp.where(owner == OUTSIDE, num_obstacles, owner)
            bit = jnp.uint32(1) << (number & 31).astype(jnp.uint32)
            own = own | jnp.where((owner != FREE) & (place == number >> 5), bit, 0)
        return room._replace(
            owners=put_row(room.owners, jnp.stack(_sorted(owners)), run),
            own=put_row(room.own, own, run),
            near=put_row(room.near, jnp.zeros_like(own), run),
        )

    none = jnp.full(_CACHE, -1, jnp.int32)
    return lax.fori_loop(jnp.int32(0), num_runs, of_run, room._replace(low=none, high=none))


def _sorted(numbers: list[Array]) -> list[Array]:
    """Returns a few numbers in order, by exchanging neighbours."""
    numbers = list(numbers)
    for last in range(len(numbers) - 1, 0, -1):
        for i in range(last):
            low, high = numbers[i], numbers[i + 1]
            numbers[i], numbers[i + 1] = jnp.minimum(low, high), jnp.maximum(low, high)
    return numbers


def _join(
    labels: Labels, num_runs: Array, second_row: Array, room: Scratch
) -> tuple[Array, Scratch]:
    """Joins all runs that share a side and their owners, and notes those that touch and differ.

    Returns how many pairs were noted; neighbours in one row are not.
    """
    _, num_layers, _, width = labels.all.shape

    def are_alike(room: Scratch, one: Array, other: Array) -> Array:
        return jnp.all(row(room.owners, one) == row(room.owners, other))

    # Neighbours in a row can be alike only where labels lie in several layers.
    def in_row(run: Array, room: Scratch) -> Scratch:
        is_apart = at(room.first, run) % width == 0
        joins = are_alike(room, run - 1, run) & ~is_apart
        return room._replace(parent=_joined(room.parent, run - 1, run, joins))

    if num_layers > 1:
        room = lax.fori_loop(jnp.int32(1), num_runs, in_row, room)

    # Both rows are covered by runs, so of two the one that ends first is left behind.
    def step(state: _Scan) -> _Scan:
        upper, lower, num, room = state
        joins = are_alike(room, upper, lower)
        end, end_below = at(room.first, upper + 1), at(room.first, lower + 1) - width
        room = room._replace(parent=_joined(room.parent, upper, lower, joins))
        num, room = _noted(num, room, ~joins, upper, lower)
        # Where both end in one column they touch two more by a corner, which matters only if the
        # one is not part of the other's region. What is seldom done stands in a loop of one step
        # or none, which leaves the arrays in place.
        has_corners = (end == end_below) & (end % width != 0) & ~joins

        def corners(_: Array, both: tuple[Array, Scratch]) -> tuple[Array, Scratch]:
            num, room = both
            differs = ~are_alike(room, upper, lower + 1)
            num, room = _noted(num, room, differs, upper, ~(lower + 1))
            differs = ~are_alike(room, upper + 1, lower)
            return _noted(num, room, differs, upper + 1, ~lower)

        num, room = lax.fori_loop(jnp.int32(0), has_corners.astype(jnp.int32), corners, (num, room))
        return _Scan(
            upper + (end <= end_below).astype(jnp.int32),
            lower + (end >= end_below).astype(jnp.int32),
            num,
            room,
        )

    # Ends: every step leaves a run behind.
    begin = _Scan(jnp.int32(0), second_row, jnp.int32(0), room)
    end = lax.while_loop(lambda state: state.lower < num_runs, step, begin)

    # Every run learns its region: those of the runs before it are known.
    def settle(run: Array, parent: Array) -> Array:
        return put(parent, at(parent, at(parent, run)), run)

    parent = lax.fori_loop(jnp.int32(0), num_runs, settle, end.room.parent)
    return end.num_pairs, end.room._replace(parent=parent)


def _joined(parent: Array, one: Array, other: Array, joins: Array) -> Array:
    """Returns `parent` with the regions of two runs joined, where `joins` (bool [])."""

    def join(_: Array, parent: Array) -> Array:
        roots = lax.while_loop(
            lambda state: (
                (at(state.parent, state.one) != state.one)
                | (at(state.parent, state.other) != state.other)
            ),
            lambda state: _Roots(
                state.parent, at(state.parent, state.one), at(state.parent, state.other)
            ),
            _Roots(parent, one, other),
        )
        # The later run becomes part of the region of the earlier one.
        low, high = jnp.minimum(roots.one, roots.other), jnp.maximum(roots.one, roots.other)
        return put(roots.parent, low, high)

    return lax.fori_loop(jnp.int32(0), joins.astype(jnp.int32), join, parent)


def _noted(
    num: Array, room: Scratch, is_one: Array, upper: Array, lower: Array
) -> tuple[Array, Scratch]:
    """Notes a pair of runs; what is noted where `is_one` (bool []) is False is overwritten."""
    room = room._replace(upper=put(room.upper, upper, num), lower=put(room.lower, lower, num))
    return num + is_one.astype(jnp.int32), room


def _link(
    labels: Labels, num_runs: Array, num_pairs: Array, never: Array, room: Scratch
) -> Scratch:
    """Links the regions of all runs that touch and differ: neighbours in a row, then the pairs that
    `_join` noted.
    """
    width = labels.all.shape[3]
    num_rows = num_runs - 1

    def step(number: Array, state: tuple[Array, Scratch]) -> tuple[Array, Scratch]:
        num_links, room = state
        is_row = number < num_rows
        pair = jnp.where(is_row, 0, number - num_rows)
        noted = at(room.lower, pair)
        one = jnp.where(is_row, number, at(room.upper, pair))
        other = jnp.where(is_row, number + 1, jnp.where(noted < 0, ~noted, noted))
        by_side = is_row | (noted >= 0)
        is_apart = is_row & (at(room.first, other) % width == 0)
        roots = at(room.parent, one), at(room.parent, other)
        low, high = jnp.minimum(*roots), jnp.maximum(*roots)

        # What each region has beside it, and the way between them, once for most pairs.
        slot = (low * 31 + high) & (_CACHE - 1)
        was_low, was_high = at(room.low, slot), at(room.high, slot)
        is_known = (was_low == low) & (was_high == high) & by_side
        is_new = ~is_apart & (low != high) & ~is_known
        is_kept = is_new & by_side
        room = room._replace(
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

    count = num_rows + num_pairs
    return lax.fori_loop(jnp.int32(0), count, step, (jnp.int32(0), room))[1]


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
