"""What the kernels must say, by SciPy and by exact arithmetic; shares no line with them. Maps come
as batches [B, H, W].
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from srt_jax.moves import FIXED_POINTS

ROOT = 2**0.5
HALF_AGAIN = 1.5 * 2.0**-23
"""Relative error of a length that is rounded to float32 within 1.5 units in the last place."""

_SIDES = np.array([[[0, 0, 0]] * 3, [[0, 1, 0], [1, 1, 1], [0, 1, 0]], [[0, 0, 0]] * 3])
"""Cells of a map are connected by their sides, maps not at all."""


def starts_inside(free: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns bool [B], whether each start is a free cell of its map."""
    inside = ((starts >= 0) & (starts < free.shape[1:])).all(1)
    row, col = np.where(inside[:, None], starts, 0).T
    return inside & free[np.arange(len(free)), row, col]


def reached_by_scipy(free: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns bool [B, H, W], the cells that are connected with each start: no diagonal passes a
    corner.
    """
    pieces = np.asarray(ndimage.label(free, _SIDES)[0])  # type: ignore[index]
    is_free = starts_inside(free, starts)
    row, col = np.where(is_free[:, None], starts, 0).T
    own = np.where(is_free, pieces[np.arange(len(free)), row, col], -1)
    return pieces == own[:, None, None]


def lengths_by_scipy(free: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Returns float64 [B, H, W], lengths by Dijkstra's search, inf where none leads.

    A diagonal needs both cells beside it free. The maps are pieces of one graph, searched from all
    starts at once.
    """
    number = np.full(free.shape, -1)
    number[free] = np.arange(free.sum())
    whole = free[:, :-1, :-1] & free[:, 1:, 1:] & free[:, :-1, 1:] & free[:, 1:, :-1]
    moves = [
        (number[:, :, :-1], number[:, :, 1:], free[:, :, :-1] & free[:, :, 1:], 1.0),
        (number[:, :-1], number[:, 1:], free[:, :-1] & free[:, 1:], 1.0),
        (number[:, :-1, :-1], number[:, 1:, 1:], whole, ROOT),
        (number[:, :-1, 1:], number[:, 1:, :-1], whole, ROOT),
    ]
    lengths = np.full(free.shape, np.inf)
    is_free = starts_inside(free, starts)
    if not is_free.any():
        return lengths
    ends = np.concatenate([np.stack([a[legal], b[legal]]) for a, b, legal, _ in moves], axis=1)
    costs = np.concatenate([np.full(legal.sum(), cost) for _, _, legal, cost in moves])
    graph = sparse.coo_matrix((costs, tuple(ends)), (free.sum(),) * 2).tocsr()
    sources = number[np.flatnonzero(is_free), *starts[is_free].T]
    lengths[free] = csgraph.dijkstra(graph, directed=False, indices=sources, min_only=True)
    return lengths


def pieces_by_scipy(blocked: np.ndarray) -> np.ndarray:
    """Returns int [H, W], the number of each blocked cell's 8-connected piece in row order of its
    first cell; -1 elsewhere.
    """
    return np.asarray(ndimage.label(blocked, np.ones((3, 3)))[0]) - 1  # type: ignore[index]


def off_by(scale: int) -> float:
    """Returns by how much the fixed point with this index misses sqrt 2, relatively."""
    straight, diagonal = FIXED_POINTS[scale]
    return abs(diagonal / straight / ROOT - 1)


def relative_errors(got: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Returns |got - truth| / truth of every map, the largest: inf where one is infinite and the
    other not.
    """
    is_finite = np.isfinite(truth)
    agree = (np.isfinite(got) == is_finite).all(axis=(1, 2))
    with np.errstate(invalid="ignore"):
        apart = np.where(is_finite, np.abs(got - truth), 0) / np.where(
            is_finite & (truth > 0), truth, 1
        )
    return np.where(agree, apart.max(axis=(1, 2)), np.inf)


def nearest_of(cells_of: np.ndarray, goal: Sequence[int]) -> tuple[int, int]:
    """Returns the nearest cell of a mask, the first in row order; on small maps distances differ by
    more than rounding.
    """
    cells = np.argwhere(cells_of)
    apart = abs(cells - np.asarray(goal))
    place = (apart.max(axis=1) + (ROOT - 1) * apart.min(axis=1)).argmin()
    return tuple(cells[place].tolist())


def route_problem(
    free: np.ndarray, start: Sequence[int], goal: Sequence[int], cells: np.ndarray, length: float
) -> str:
    """Returns what is wrong with a route int [n, 2] of the length stated, "" if nothing."""
    route = [tuple(cell) for cell in cells.tolist()]
    if not route or route[0] != tuple(start) or route[-1] != tuple(goal):
        return "it does not lead from the start to the goal"
    num_diagonal = 0
    for (a, b), (c, d) in pairwise(route):
        if max(abs(a - c), abs(b - d)) != 1:
            return f"from {(a, b)} to {(c, d)} is no move"
        if not (free[a, b] and free[c, d] and free[a, d] and free[c, b]):
            return f"the move from {(a, b)} to {(c, d)} hits a blocked cell"
        num_diagonal += a != c and b != d
    walked = len(route) - 1 - num_diagonal + num_diagonal * ROOT
    return (
        ""
        if abs(walked - length) <= length * (off_by(0) + HALF_AGAIN)
        else f"it is {walked} long, not {length}"
    )
