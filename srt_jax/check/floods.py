"""What the judge finds out about maps by itself: floods over runs of cells, where the kernels
sweep.
"""

import numpy as np


def free_cells(labels: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the cells that no obstacle covers once those marked in `gone` are
    gone.
    """
    # OUTSIDE (-2) and FREE (-1) index it from its end
    is_open = np.concatenate([gone, [False, True]])
    return np.all(is_open[labels], axis=0)


def holds_at(mask: np.ndarray, cell: tuple[int, ...]) -> bool:
    return 0 <= cell[0] < mask.shape[0] and 0 <= cell[1] < mask.shape[1] and bool(mask[cell])


def nearest_cell(reached: np.ndarray, goal: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the reached cell of least octile distance to the goal; of several the one in the
    lowest row, then column.
    """
    cells = np.argwhere(reached)  # in row order
    apart = abs(cells - np.array(goal))
    distance = apart.max(axis=1) - apart.min(axis=1) + apart.min(axis=1) * 2**0.5
    return tuple(cells[distance.argmin()].tolist())


def cell_ahead(free: np.ndarray, seed: tuple[int, ...], goal: tuple[int, ...]) -> tuple[int, ...]:
    """Returns the blocked cell on the greedy octile step; (-1, -1) where the step leaves the map.

    The step is diagonal unless row or column agree already. Where its cell is free but not reached,
    both cells beside it are blocked (else they were reached, and nearer to the goal than the seed);
    as they touch, either stands for the obstacle.
    """
    row, col = (int(np.sign(there - here)) for here, there in zip(seed, goal, strict=True))
    steps = [(seed[0] + row, seed[1] + col), (seed[0] + row, seed[1]), (seed[0], seed[1] + col)]
    return next((cell for cell in steps if cell != seed and holds_at(~free, cell)), (-1, -1))


def dilate(mask: np.ndarray) -> np.ndarray:
    """Returns the cells with a cell of `mask` among themselves and their 8 neighbours."""
    wide = np.pad(mask, 1)
    wide = wide[:-2] | wide[1:-1] | wide[2:]
    return wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]


def piece_of(mask: np.ndarray, cell: tuple[int, ...], *, by_corners: bool = False) -> np.ndarray:
    """Returns the part of `mask` that is connected with `cell` by sides (or corners too); empty
    where `cell` is not on it.

    As no move cuts a corner, what the agent reaches by eight moves is connected by sides. The runs
    of cells in each row are joined where they touch a run of the next row.
    """
    if not holds_at(mask, cell):
        return np.zeros_like(mask)
    # one line of cells, with a blocked one at both ends of each row: no run goes on in the next
    wide = np.pad(mask, ((0, 0), (1, 1))).view(np.int8)
    width, line = wide.shape[1], wide.ravel()
    ends = np.flatnonzero(np.diff(line, prepend=np.int8(0)))
    first, behind = ends[::2], ends[1::2]
    # of the next row a run touches those that end behind its first cell and begin before its end
    more = int(by_corners)
    lowest = np.searchsorted(behind, first + width - more, side="right")
    number = np.searchsorted(first, behind + width + more, side="left") - lowest
    upper = np.repeat(np.arange(len(first)), number)
    lower = np.arange(len(upper)) + np.repeat(lowest - np.cumsum(number) + number, number)
    group = _joined(len(first), upper, lower)
    own = np.searchsorted(first, cell[0] * width + cell[1] + 1, side="right") - 1
    chosen = group == group[own]
    change = np.zeros(len(line), np.int8)
    change[first[chosen]], change[behind[chosen]] = 1, -1
    return np.cumsum(change, dtype=np.int8).view(bool).reshape(wide.shape)[:, 1:-1]


def _joined(number: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns a number for each of `number` things, the same for those that a chain of pairs
    (`one`, `other`) joins: the least of them.
    """
    group = np.arange(number)
    while len(one):
        # Each group that has a pair with a lesser one becomes a part of that, all at once. Ends:
        # as long as a pair is apart, there is such a group, and so there is one group less.
        greater, lesser = np.maximum(one, other), np.minimum(one, other)
        group[greater] = lesser
        while not np.array_equal(group, joined := group[group]):  # halves all chains of these
            group = joined
        one, other = group[greater], group[lesser]
        apart = one != other
        one, other = one[apart], other[apart]
    return group
