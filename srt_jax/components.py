"""The 8-connected pieces of a mask, numbered, on the host: how obstacles are told apart where
only `free` is given.
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
    root = _joined(len(first), *_touching(first, last, blocked.shape[1] + 1))
    # A root is the first run of its component, and runs are in row-major order.
    _, number = np.unique(root, return_inverse=True)
    flat = np.full(blocked.size, -1, np.int32)
    length = last - first + 1
    flat[blocked.ravel()] = np.repeat(number.astype(np.int32), length)
    return flat.reshape(blocked.shape)


def _runs(blocked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last cell of every run, as row * (W + 1) + col: one free column is added, so
    that no run passes a row's end.
    """
    height, width = blocked.shape
    wide = np.zeros((height, width + 1), np.int8)
    wide[:, :width] = blocked
    step = np.diff(wide.ravel(), prepend=np.int8(0))
    return np.flatnonzero(step == 1), np.flatnonzero(step == -1) - 1


def _touching(first: np.ndarray, last: np.ndarray, stride: int) -> tuple[np.ndarray, np.ndarray]:
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


def _joined(num: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The least member of every node's component, given edges a-b: hooking roots onto smaller ones,
    then jumping to the root.

    It ends, because every round in which an edge still joins two roots takes at least one root
    away; all but few in practice.
    """
    root = np.arange(num)
    while True:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        apart = low != high
        if not apart.any():
            return root
        a, b = low[apart], high[apart]
        np.minimum.at(root, b, a)
        while True:
            further = root[root]
            if np.array_equal(further, root):
                break
            root = further
