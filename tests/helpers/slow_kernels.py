"""Slow and obvious twins of the kernels, on one map each; they share no line with them. SciPy does
the larger ones.
"""

import collections
import heapq
import math

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph


def reach_by_steps(free: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """Breadth-first, by all eight moves, a diagonal only between two free cells."""
    reached = np.zeros(free.shape, bool)
    if not (0 <= start[0] < free.shape[0] and 0 <= start[1] < free.shape[1] and free[tuple(start)]):
        return reached
    reached[tuple(start)] = True
    queue = collections.deque([tuple(start)])
    while queue:
        cell = queue.popleft()
        for to, _ in legal_moves(free, cell):
            if not reached[to]:
                reached[to] = True
                queue.append(to)
    return reached


def legal_moves(free: np.ndarray, cell: tuple[int, int]) -> list[tuple[tuple[int, int], float]]:
    r, c = cell
    out = []
    for dr in (-1, 0, 1):
        for dc in (-1, 0, 1):
            rr, cc = r + dr, c + dc
            inside = 0 <= rr < free.shape[0] and 0 <= cc < free.shape[1]
            if (dr or dc) and inside and free[rr, cc] and free[r, cc] and free[rr, c]:
                out.append(((rr, cc), math.sqrt(2) if dr and dc else 1.0))
    return out


def lengths_by_heap(free: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    """Dijkstra's algorithm with a heap, in float64."""
    length = np.full(free.shape, np.inf)
    if not (0 <= start[0] < free.shape[0] and 0 <= start[1] < free.shape[1] and free[tuple(start)]):
        return length
    length[tuple(start)] = 0
    heap = [(0.0, (int(start[0]), int(start[1])))]
    while heap:
        here, cell = heapq.heappop(heap)
        if here > length[cell]:
            continue
        for to, move in legal_moves(free, cell):
            if here + move < length[to] - 1e-9:
                length[to] = here + move
                heapq.heappush(heap, (here + move, to))
    return length


def reach_by_label(free: np.ndarray, start: tuple[int, int]) -> np.ndarray:
    if not free[tuple(start)]:
        return np.zeros(free.shape, bool)
    labels, _ = ndimage.label(free)
    return labels == labels[tuple(start)]


def costs_by_scipy(
    free: np.ndarray, start: tuple[int, int], straight: int, diagonal: int
) -> np.ndarray:
    """Exact integer costs, float64; inf where not reached."""
    if not free[tuple(start)]:
        return np.full(free.shape, np.inf)
    cell = np.arange(free.size).reshape(free.shape)
    edges = []
    for a, b in (
        ((slice(None), slice(-1)), (slice(None), slice(1, None))),
        ((slice(-1), slice(None)), (slice(1, None), slice(None))),
    ):
        ok = free[a] & free[b]
        edges.append((cell[a][ok], cell[b][ok], straight))
    square = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    edges.append((cell[:-1, :-1][square], cell[1:, 1:][square], diagonal))
    edges.append((cell[:-1, 1:][square], cell[1:, :-1][square], diagonal))
    tail, head = (np.concatenate([edge[i] for edge in edges]) for i in (0, 1))
    cost = np.concatenate([np.full(len(edge[0]), float(edge[2])) for edge in edges])
    graph = sparse.coo_matrix((cost, (tail, head)), (free.size, free.size)).tocsr()
    return csgraph.dijkstra(graph, directed=False, indices=cell[tuple(start)]).reshape(free.shape)


def seed_by_sorting(reached: np.ndarray, goal: tuple[int, int]) -> tuple[int, int]:
    """The least (distance, row, col), distance as exact (straight, diagonal) counts compared by
    squares of integers.
    """
    best = None
    for r, c in np.argwhere(reached):
        long, short = (
            max(abs(r - goal[0]), abs(c - goal[1])),
            min(abs(r - goal[0]), abs(c - goal[1])),
        )
        key = (int(long - short), int(short), int(r), int(c))
        if best is None or _is_less(key, best):
            best = key
    return (-1, -1) if best is None else best[2:]


def _is_less(a: tuple, b: tuple) -> bool:
    """Whether a0 + a1 sqrt 2 < b0 + b1 sqrt 2, or equal and the cell comes first."""
    left, right = a[0] - b[0], b[1] - a[1]  # left < right sqrt 2 ?
    if left == 0 and right == 0:
        return a[2:] < b[2:]
    if left >= 0 and right >= 0:
        return left * left < 2 * right * right
    if left < 0 and right < 0:
        return left * left > 2 * right * right
    return left < right


def contour_by_label(free: np.ndarray, seed: tuple[int, int], goal: tuple[int, int]) -> np.ndarray:
    """The free cells, on the seed's side, round the 8-connected piece that owns the blocked cell
    ahead.
    """
    nothing = np.zeros(free.shape, bool)
    height, width = free.shape
    if min(seed) < 0 or not free[tuple(seed)]:
        return nothing
    r, c = seed
    dr, dc = (int(np.sign(g - s)) for g, s in zip(goal, seed))
    ahead = [(r + dr, c + dc), (r + dr, c), (r, c + dc)]
    blocked = [(y, x) for y, x in ahead if 0 <= y < height and 0 <= x < width and not free[y, x]]
    if not blocked:
        return nothing
    labels, _ = ndimage.label(~free, np.ones((3, 3)))
    round_it = ndimage.binary_dilation(labels == labels[blocked[0]], np.ones((3, 3)))
    return round_it & reach_by_label(free, seed)


def weighted_costs_by_scipy(
    free: np.ndarray, start: tuple[int, int], costs: np.ndarray
) -> np.ndarray:
    """Least costs in float64, a move costing its length times the mean of its two cells; inf where
    not reached.
    """
    inside = 0 <= start[0] < free.shape[0] and 0 <= start[1] < free.shape[1]
    if not (inside and free[tuple(start)]):
        return np.full(free.shape, np.inf)
    cell, costs = np.arange(free.size).reshape(free.shape), np.asarray(costs, np.float64)
    up, down, left, right = (
        slice(-1),
        slice(1, None),
        (slice(None), slice(-1)),
        (slice(None), slice(1, None)),
    )
    square = free[up, up] & free[up, down] & free[down, up] & free[down, down]
    pairs = [
        (left, right, free[left] & free[right], 1.0),
        (up, down, free[up] & free[down], 1.0),
        ((up, up), (down, down), square, math.sqrt(2)),
        ((up, down), (down, up), square, math.sqrt(2)),
    ]
    tail, head = (np.concatenate([cell[pair[side]][pair[2]] for pair in pairs]) for side in (0, 1))
    cost = np.concatenate([(costs[a] + costs[b])[ok] / 2 * length for a, b, ok, length in pairs])
    graph = sparse.coo_matrix((cost, (tail, head)), (free.size, free.size)).tocsr()
    return csgraph.dijkstra(graph, directed=False, indices=cell[tuple(start)]).reshape(free.shape)
