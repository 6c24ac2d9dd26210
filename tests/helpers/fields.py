"""Bordered fields of costs, as `srt_jax.propagation.row_sweeps` has them, made without it."""

import numpy as np


def bordered(cost, free):
    """Returns a field uint32 [H + 2, W + 2] of costs of SciPy, inf where not reached."""
    value = np.where(free, np.where(np.isinf(cost), 2**31 - 1 - 8119, cost), 2**31)
    return np.pad(value.astype(np.uint32), 1, constant_values=2**31)


def new_cost(free, start):
    """Returns the flat field before any move, 0 at the start."""
    cost = np.full(free.shape, np.inf)
    if start is not None:
        cost[tuple(start)] = 0
    return bordered(cost, free).reshape(-1)


def flat_cell(free, cell):
    """Returns where a cell lies in a flat field."""
    return (int(cell[0]) + 1) * (free.shape[1] + 2) + int(cell[1]) + 1
