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

    As no move cuts a corner, what the agent reaches by eight moves is connected by sides. The flood
    goes over the runs of cells in each row, linked where they touch a run of the next row.
    """
    if not holds_at(mask, cell):
        return np.zeros_like(mask)
    # a blocked cell at both ends of a row: no run continues in the next
    flat = np.pad(mask, ((0, 0), (1, 1))).ravel()
    width = mask.shape[1] + 2
    run = np.cumsum(flat & ~np.concatenate([[False], flat[:-1]])) - 1
    links: list[list[int]] = [[] for _ in range(run[-1] + 1)]
    for ahead in (width - 1, width, width + 1) if by_corners else (width,):
        touching = np.flatnonzero(flat[:-ahead] & flat[ahead:])
        upper, lower = run[touching], run[touching + ahead]
        # two runs meet in one stretch of cells: its first is enough
        is_new = np.ones(len(touching), bool)
        is_new[1:] = (upper[1:] != upper[:-1]) | (lower[1:] != lower[:-1])
        for above, below in zip(upper[is_new].tolist(), lower[is_new].tolist(), strict=True):
            links[above].append(below)
            links[below].append(above)
    waiting = [int(run[cell[0] * width + cell[1] + 1])]
    met = set(waiting)
    while waiting:
        new = [other for other in links[waiting.pop()] if other not in met]
        met.update(new)
        waiting += new
    is_in = np.zeros(len(links), bool)
    is_in[list(met)] = True
    return (flat & is_in[run]).reshape(-1, width)[:, 1:-1]
