"""Connected components of a mask, numbered, on the host.

`label` joins cells by sides and corners: obstacles are those components where only `free` is given.
`regions` joins cells by sides only, as an agent walks; `pieces` does so among cells of one kind.
"""

import numpy as np


def label(blocked: np.ndarray) -> np.ndarray:
    """Returns the number of the 8-connected component of each blocked cell; -1 where the cell is
    not blocked.

    Components are numbered from 0 in row-major order of their first cell. They are joined run by
    run: runs of blocked cells in a row are the nodes, and runs of neighbouring rows that touch by
    side or corner are the edges.

    Args:
      blocked: bool [H, W], NumPy.

    Returns:
      int32 [H, W].
    """
    blocked = np.asarray(blocked, dtype=bool)
    first, last = _runs(blocked)
    root = _least_members(len(first), *_touching_runs(first, last, blocked.shape[1] + 1))
    # A root is the first run of its component, and runs are in row-major order.
    _, number = np.unique(root, return_inverse=True)
    flat = np.full(blocked.size, -1, np.int32)
    length = last - first + 1
    flat[blocked.ravel()] = np.repeat(number.astype(np.int32), length)
    return flat.reshape(blocked.shape)


def regions(mask: np.ndarray) -> np.ndarray:
    """Returns int64 [H, W], for each cell of `mask` the number of its component, connected by
    sides; -1 elsewhere.

    Runs of cells in a row are linked to those below.
    """
    flat = np.pad(mask, ((0, 0), (0, 1))).ravel()
    stride = mask.shape[1] + 1
    run = np.cumsum(flat & ~np.concatenate([[False], flat[:-1]])) - 1
    touching = np.flatnonzero(flat[:-stride] & flat[stride:])
    least = _joined(run[-1] + 1, run[touching], run[touching + stride])
    return np.where(flat, np.append(least, -1)[run], -1).reshape(-1, stride)[:, :-1]


def pieces(kind: np.ndarray) -> np.ndarray:
    """Returns int64 [H, W], for each cell the number of its component among cells of the same kind,
    connected by sides.

    Args:
      kind: int64 [H, W], from 0 on.

    Numbers go from 0 on in row-major order of the first cells.
    """
    flat = np.pad(kind, ((0, 0), (0, 1)), constant_values=-1).ravel()
    stride = kind.shape[1] + 1
    run = np.cumsum(flat != np.concatenate([[-1], flat[:-1]])) - (flat[0] >= 0)
    touching = np.flatnonzero((flat[:-stride] == flat[stride:]) & (flat[stride:] >= 0))
    least = _joined(run[-1] + 1, run[touching], run[touching + stride])
    own = least[run].reshape(-1, stride)[:, :-1]
    return np.unique(own, return_inverse=True)[1].reshape(kind.shape)


def _joined(num: int, upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """The least member of every run's component, given pairs of runs that touch: a run takes the
    least number among its links until none changes.
    """
    least = np.arange(num)
    while len(upper):
        np.minimum.at(least, np.maximum(upper, lower), np.minimum(upper, lower))
        while (least != least[least]).any():
            least = least[least]
        upper, lower = least[upper], least[lower]
        is_apart = upper != lower
        upper, lower = upper[is_apart], lower[is_apart]
    return least


def largest_region(free: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the largest component of `free`, connected by sides; the first in row
    order among equals.
    """
    numbers = regions(free)
    return numbers == np.argmax(np.bincount(numbers[free])) if free.any() else free.copy()


def _runs(blocked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last cell of every run, as row * (W + 1) + col: one free column is added, so that
    no run passes a row's end.
    """
    height, width = blocked.shape
    wide = np.zeros((height, width + 1), np.int8)
    wide[:, :width] = blocked
    step = np.diff(wide.ravel(), prepend=np.int8(0))
    return np.flatnonzero(step == 1), np.flatnonzero(step == -1) - 1


def _touching_runs(
    first: np.ndarray, last: np.ndarray, stride: int
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of runs (upper, lower) in neighbouring rows that touch: the lower one's columns, one
    more at each end, meet.
    """
    # first run that ends no earlier than one column left of the run above
    low = np.searchsorted(last, first - stride - 1)
    # first run that begins more than one column right of it
    high = np.searchsorted(first, last - stride + 1, side="right")
    count = np.maximum(high - low, 0)
    lower = np.repeat(np.arange(len(first)), count)
    offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(low, count) + offset, lower


def _least_members(num: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The least member of every node's component, given edges a-b: roots are hooked onto smaller
    ones, then every node jumps to its root.

    It ends, because every round in which an edge still joins two roots removes at least one root,
    in practice nearly all.
    """
    root = np.arange(num)
    while True:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        apart = low != high
        if not apart.any():
            return root
        a, b = low[apart], high[apart]
        np.minimum.at(root, b, a)
        # pointer jumping, until every node points to a root
        while True:
            further = root[root]
            if np.array_equal(further, root):
                break
            root = further
