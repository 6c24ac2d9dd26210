"""Closed rings of points and whether they bound a polygon, decided exactly.

Points are in metres and are taken to the nearest nanometre; from there on all is decided
in whole numbers, so that no answer depends on rounding. Floats may decide first, where they are
farther from a tie than they can be off; the few that are not are decided by Python's integers.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sign_model.foundation.extras import install_command

UNITS_PER_METRE = 10**9
_MAX_METRES = 1e9
"""Farther out the nanometres of a coordinate no longer fit into 64 bits."""
_FINEST_METRES = 9e6
"""Farther out float64 is coarser than a nanometre, and there is nothing to round."""
_MAX_PAIRS = 1 << 20
"""Pairs of edges held in memory at once."""
_ROUNDING = 2.0**-50
"""By which share a sum of two products of float64 may be off, no less."""
_FEW = 16
"""Edges of an owner of which all pairs are looked at."""

Ring = tuple[tuple[float, float], ...]
Parts = tuple[tuple[Ring, ...], ...]
"""The polygons of an obstacle, each an outer ring followed by its holes."""


def as_metres(name: str, values: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Returns `values` as float64 of `shape` (-1: any length), each taken to the nearest nanometre.

    Raises:
      TypeError: not numbers. ValueError: a wrong shape, NaN, infinity, or more than 1e9 m.
    """
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(
            f"{name} must have shape {_shape_text(shape)}, but its rows differ in length"
        ) from error
    if array.size and not (
        np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)
    ):
        raise TypeError(f"{name} must hold numbers (metres), got {array.dtype}")
    if array.ndim != len(shape) or any(
        want not in (-1, have) for want, have in zip(shape, array.shape)
    ):
        raise ValueError(f"{name} must have shape {_shape_text(shape)}, got {list(array.shape)}")
    array = array.astype(np.float64)
    wrong = ~(np.abs(array) <= _MAX_METRES)
    if wrong.any():
        raise ValueError(
            f"{name} holds {array[wrong][0]}: coordinates must be finite and at most 1e9 metres"
        )
    return _to_nanometres(array)


def _to_nanometres(metres: np.ndarray) -> np.ndarray:
    return np.where(np.abs(metres) < _FINEST_METRES, np.round(metres, 9), metres) + 0.0


def as_units(metres: ArrayLike) -> np.ndarray:
    """Returns metres as whole nanometres, int64 of the same shape."""
    return np.rint(np.asarray(metres, np.float64) * UNITS_PER_METRE).astype(np.int64)


def as_ring(name: str, points: ArrayLike) -> Ring:
    """Returns the ring through `points` without a closing point and without points that repeat the
    one before.

    Raises:
      TypeError, ValueError: not numbers [K, 2], NaN, or fewer than three different points.
    """
    given = [(x, y) for x, y in as_metres(name, points, (-1, 2)).tolist()]
    num_different = len(set(given))
    if num_different < 3:
        raise ValueError(
            f"{name} has {num_different} different points: a polygon needs at least three"
        )
    return tuple(point for point, after in zip(given, given[1:] + given[:1]) if point != after)


def as_rings(many: Sequence[ArrayLike]) -> list[Ring | None]:
    """Returns `as_ring` of each of many rings, all at once; None where `as_ring` would raise."""
    arrays = [_numbers(points) for points in many]
    kept = [index for index, array in enumerate(arrays) if array is not None]
    found: list[Ring | None] = [None] * len(arrays)
    if not kept:
        return found
    sizes = np.array([len(arrays[index]) for index in kept])  # type: ignore[arg-type]
    flat = np.concatenate([arrays[index] for index in kept], dtype=np.float64)  # type: ignore[list-item]
    is_wrong = ~(np.abs(flat) <= _MAX_METRES).all(axis=1)
    metres = _to_nanometres(np.where(is_wrong[:, None], 0.0, flat))
    ends = np.cumsum(sizes)
    following = np.arange(1, len(metres) + 1)
    following[ends - 1] = ends - sizes
    repeats = (metres == metres[following]).all(axis=1).tolist()
    points = list(zip(metres[:, 0].tolist(), metres[:, 1].tolist()))
    has_wrong = np.logical_or.reduceat(is_wrong, ends - sizes).tolist()
    for index, first, end, wrong in zip(kept, (ends - sizes).tolist(), ends.tolist(), has_wrong):
        if not wrong and len(set(points[first:end])) >= 3:
            found[index] = tuple(points[place] for place in range(first, end) if not repeats[place])
    return found


def _numbers(points: ArrayLike) -> np.ndarray | None:
    """Returns [K, 2] numbers, K at least 1; None for anything else."""
    try:
        array = np.asarray(points)
    except (ValueError, TypeError, OverflowError):
        return None
    return (
        array
        if array.ndim == 2 and array.shape[1] == 2 and len(array) and array.dtype.kind in "iuf"
        else None
    )


def conflict(parts: Parts) -> str:
    """Returns what keeps the rings from bounding polygons, in words; "" where nothing does.

    A ring must not meet itself; two rings may touch in points but neither cross nor run along one
    another; holes lie inside their outer ring and outside each other; polygons of one obstacle do
    not lie inside each other.
    """
    return conflicts([parts])[0]


def conflicts(many: Sequence[Parts]) -> list[str]:
    """Returns `conflict` of each of many obstacles, all at once."""
    crossings = _crossings(many)
    return [crossings.get(index) or _placement_error(parts) for index, parts in enumerate(many)]


def repaired(parts: Parts) -> Parts:
    """Returns valid polygons that cover what `parts` enclose (by shapely's make_valid); () where
    they enclose nothing.

    A bow-tie becomes two triangles, a ring that runs over itself is cut there, and lines without
    area vanish. A hole takes away what it shares with its polygon; what lies outside adds nothing.
    """
    try:
        import shapely
    except ImportError as error:
        raise ImportError(
            f"repairing polygons needs shapely: {install_command('world', 'shapely')}"
        ) from error

    def filled(ring: Ring) -> Any:
        valid = shapely.get_parts(shapely.get_parts(shapely.make_valid(shapely.Polygon(ring))))
        return shapely.union_all([one for one in valid if isinstance(one, shapely.Polygon)])

    # Each polygon without its holes, then all together.
    polygons = [
        filled(outer).difference(shapely.union_all([filled(hole) for hole in holes]))
        for outer, *holes in parts
    ]
    valid = shapely.union_all(polygons)
    # Back to whole units, which may leave lines and points: they are dropped.
    snapped = shapely.get_parts(
        shapely.get_parts(shapely.set_precision(valid, 1 / UNITS_PER_METRE))
    )
    return tuple(
        tuple(
            as_ring("a repaired ring", np.asarray(ring.coords))
            for ring in (polygon.exterior, *polygon.interiors)
        )
        for polygon in snapped
        if isinstance(polygon, shapely.Polygon) and not polygon.is_empty
    )


def _crossings(many: Sequence[Parts]) -> dict[int, str]:
    """Returns by obstacle the first meeting of its edges that must not be."""
    rings = [(owner, ring) for owner, parts in enumerate(many) for part in parts for ring in part]
    if not rings:
        return {}
    # All edges of all rings as arrays: the obstacle, the ring and the next edge of each.
    sizes = np.array([len(ring) for _, ring in rings])
    tails = as_units(points_of(ring for _, ring in rings))
    ring_of = np.repeat(np.arange(len(rings)), sizes)
    owner = np.array([owner for owner, _ in rings])[ring_of]
    ends = np.cumsum(sizes)
    next_edge = np.arange(1, len(tails) + 1)
    next_edge[ends - 1] = ends - sizes
    # Relative to a corner of the obstacle the numbers are small, and floats decide most.
    origin = np.minimum.reduceat(tails, np.flatnonzero(np.diff(owner, prepend=-1)), axis=0)[
        np.unique(owner, return_inverse=True)[1]
    ]
    tails = tails - origin
    heads = tails[next_edge]
    # Only edges whose boxes meet are compared; the first wrong pair of an obstacle is kept.
    found: dict[int, str] = {}
    for a, b in _close_pairs(np.minimum(tails, heads), np.maximum(tails, heads), owner):
        is_same_ring = ring_of[a] == ring_of[b]
        for wrong in _wrong_pairs(tails, heads, a, b, is_same_ring, next_edge).tolist():
            first, second = a[wrong], b[wrong]
            others = (
                "itself"
                if ring_of[first] == ring_of[second]
                else "another ring of the same obstacle"
            )
            edges = [
                _edge_text(tails[edge] + origin[edge], heads[edge] + origin[edge])
                for edge in (first, second)
            ]
            found.setdefault(
                int(owner[first]),
                f"a ring meets {others} where edge {edges[0]} meets edge {edges[1]}",
            )
    return found


def points_of(rings: Iterable[Ring]) -> np.ndarray:
    """Returns the points of all rings, one ring after the other, float64 [K, 2]."""
    numbers = itertools.chain.from_iterable(itertools.chain.from_iterable(rings))
    return np.fromiter(numbers, np.float64).reshape(-1, 2)


def _close_pairs(
    low: np.ndarray, high: np.ndarray, owner: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields pairs of edges of one owner, whose edges follow one another, whose bounding boxes
    meet, in blocks.

    All pairs of an owner with few edges, which costs less than sorting them; for the others a sweep
    from left to right.
    """
    sizes = np.bincount(owner)
    starts = np.cumsum(sizes) - sizes
    for size in range(2, _FEW + 1):
        firsts, seconds = np.triu_indices(size, 1)
        alike = starts[sizes == size]
        at_once = max(1, _MAX_PAIRS // len(firsts))
        for part in range(0, len(alike), at_once):
            begin = alike[part : part + at_once, None]
            a, b = (begin + firsts).ravel(), (begin + seconds).ravel()
            is_close = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
            yield a[is_close], b[is_close]
    many = np.flatnonzero(sizes[owner] > _FEW)
    if len(many):
        for a, b in _swept_pairs(low[many], high[many], owner[many]):
            yield many[a], many[b]


def _swept_pairs(
    low: np.ndarray, high: np.ndarray, owner: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields what `_close_pairs` does, by a sweep from left to right, owner by owner."""
    _, rank = np.unique(np.concatenate([low[:, 0], high[:, 0]]), return_inverse=True)
    left, right = (owner * len(rank) + ranks for ranks in np.split(rank.reshape(-1), 2))
    order = np.argsort(left, kind="stable")
    num_after = np.searchsorted(left[order], right[order], side="right") - np.arange(len(order)) - 1
    ends = np.cumsum(num_after)
    first = 0
    while first < len(order):
        spent = int(ends[first - 1]) if first else 0
        last = max(first + 1, int(np.searchsorted(ends, spent + _MAX_PAIRS, side="right")))
        count = num_after[first:last]
        a = np.repeat(np.arange(first, last), count)
        b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count)
        a, b = order[a], order[b]
        is_close = (low[a, 1] <= high[b, 1]) & (low[b, 1] <= high[a, 1])
        yield a[is_close], b[is_close]
        first = last


def _wrong_pairs(
    tails: np.ndarray,
    heads: np.ndarray,
    a: np.ndarray,
    b: np.ndarray,
    is_same_ring: np.ndarray,
    next_edge: np.ndarray,
) -> np.ndarray:
    """Returns the places in the pairs (a, b) of edges that meet as they must not; their bounding
    boxes do meet.
    """
    is_wrong = np.zeros(len(a), bool)
    # Most pairs are an edge and the next one. They share a point and are wrong only where the one
    # runs back along the other: on one line, and so by one product.
    is_before, is_after = next_edge[a] == b, next_edge[b] == a
    near = np.flatnonzero(is_before | is_after)
    other_end = np.where(is_before[near, None], heads[b[near]], tails[b[near]])
    near = near[_side(tails[a[near]], heads[a[near]], other_end) == 0]
    is_wrong[near] = _share_a_stretch(tails, heads, a[near], b[near])
    # The others: on which sides of each edge the ends of the other lie.
    far = np.flatnonzero(~(is_before | is_after))
    tail_a, head_a, tail_b, head_b = tails[a[far]], heads[a[far]], tails[b[far]], heads[b[far]]
    sides = [_side(tail_a, head_a, tail_b), _side(tail_a, head_a, head_b)]
    sides += [_side(tail_b, head_b, tail_a), _side(tail_b, head_b, head_a)]
    first, second = sides[0] * sides[1], sides[2] * sides[3]
    is_wrong[far] = np.where(
        is_same_ring[far], (first <= 0) & (second <= 0), (first < 0) & (second < 0)
    )
    on_one_line = far[~(sides[0] | sides[1] | sides[2] | sides[3]).astype(bool)]
    is_wrong[on_one_line] |= _share_a_stretch(tails, heads, a[on_one_line], b[on_one_line])
    return np.flatnonzero(is_wrong)


def _share_a_stretch(
    tails: np.ndarray, heads: np.ndarray, a: np.ndarray, b: np.ndarray
) -> np.ndarray:
    """Returns bool [pairs], whether edges a and b on one line have more than a point in common."""
    low = np.maximum(np.minimum(tails[a], heads[a]), np.minimum(tails[b], heads[b]))
    high = np.minimum(np.maximum(tails[a], heads[a]), np.maximum(tails[b], heads[b]))
    return np.any(high > low, axis=1)


def _side(tail: np.ndarray, head: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Returns int8 [...], 1 where `point` lies to the left of the line from `tail` to `head`, -1 to
    the right, 0 on it.

    Args:
      tail, head, point: int64 [..., 2], broadcast; their differences fit into 64 bits.
    """
    along, out = np.broadcast_arrays(head - tail, point - tail)
    left = along[..., 0].astype(np.float64) * out[..., 1]
    right = along[..., 1].astype(np.float64) * out[..., 0]
    gap, size = left - right, np.abs(left) + np.abs(right)
    side = (gap > 0).astype(np.int8) - (gap < 0).astype(np.int8)
    # Either product is off by less than 4 roundings; where it is 0, a factor is, and it is exact.
    tie = (np.abs(gap) <= _ROUNDING * size) & (size > 0)
    if tie.any():
        (x, y), (out_x, out_y) = along[tie].astype(object).T, out[tie].astype(object).T
        left, right = x * out_y, y * out_x
        side[tie] = (left > right).astype(np.int8) - (left < right).astype(np.int8)
    return side


def _placement_error(parts: Parts) -> str:
    if len(parts) == 1 and len(parts[0]) == 1:
        return ""
    for index, (outer, *holes) in enumerate(parts):
        for place, hole in enumerate(holes):
            if (_where(hole, outer) < 0).any():
                return f"the hole at {hole[0]} lies outside its outer ring"
            if any((_where(hole, other) > 0).any() for other in holes[:place] + holes[place + 1 :]):
                return f"the hole at {hole[0]} lies inside another hole"
        for other in parts[:index] + parts[index + 1 :]:
            is_covered = _where(outer, other[0]) > 0
            for hole in other[1:]:
                is_covered &= _where(outer, hole) < 0
            if is_covered.any():
                return f"the polygon at {outer[0]} lies inside another polygon of the same obstacle"
    return ""


def _where(ring: Ring, around: Ring) -> np.ndarray:
    """Returns for each point and middle of an edge of `ring`: 1 inside `around`, 0 on it, -1
    outside (int64 [2 K]).
    """
    corners, tails = as_units(ring), 2 * as_units(around)
    points = np.concatenate([2 * corners, corners + np.roll(corners, -1, axis=0)])
    origin = np.minimum(points.min(axis=0), tails.min(axis=0))
    points, tails = points - origin, tails - origin
    heads, points = np.roll(tails, -1, axis=0), points[:, None]
    side = _side(tails, heads, points)
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    is_on = (side == 0) & ((low <= points) & (points <= high)).all(axis=-1)
    rises = (tails[:, 1] <= points[..., 1]) & (points[..., 1] < heads[:, 1])
    falls = (heads[:, 1] <= points[..., 1]) & (points[..., 1] < tails[:, 1])
    num_crossed = ((rises & (side > 0)) | (falls & (side < 0))).sum(axis=1)
    return np.where(is_on.any(axis=1), 0, np.where(num_crossed % 2 == 1, 1, -1))


def _edge_text(tail: np.ndarray, head: np.ndarray) -> str:
    return "-".join(
        f"({x / UNITS_PER_METRE:g}, {y / UNITS_PER_METRE:g})"
        for x, y in (tail.tolist(), head.tolist())
    )


def _shape_text(shape: tuple[int, ...]) -> str:
    return "[" + ", ".join("K" if side < 0 else str(side) for side in shape) + "]"
