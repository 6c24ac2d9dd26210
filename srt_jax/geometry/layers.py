"""Obstacles that overlap, in layers: as few as the most owners of one cell."""

import numpy as np

from srt_jax.types import FREE


def layered(owner: np.ndarray, cell: np.ndarray, height: int, width: int) -> np.ndarray:
    """Returns labels int32 [L, H, W]; one layer of FREE where nothing is covered.

    The owners of a cell lie in layers 0, 1, ... by ascending id: there are only as many layers as
    the most owners of a cell.

    Args:
      owner, cell: int64 [N], an obstacle and a cell (row * width + column) that it covers; each
        pair once, owners ascending for every cell.
    """
    num_owners = np.bincount(cell, minlength=height * width)
    labels = np.full((max(1, int(num_owners.max())), height, width), FREE, np.int32)
    flat = labels.reshape(len(labels), -1)
    is_alone = num_owners[cell] == 1
    flat[0, cell[is_alone]] = owner[is_alone]
    shared_cell, its_owner = cell[~is_alone], owner[~is_alone]
    order = np.argsort(shared_cell, kind="stable")
    shared_cell, its_owner = shared_cell[order], its_owner[order]
    layer = np.arange(len(order)) - np.searchsorted(shared_cell, shared_cell)
    flat[layer, shared_cell] = its_owner
    return labels
