"""The lengths of a MovingAI scenario, computed again: every row of it is an outside check of the
distances.
"""

from collections.abc import Callable, Sequence

import numpy as np

from srt_jax.engine.buckets import size_bucket
from srt_jax.formats.movingai import ScenRow
from srt_jax.paths.cost_to_come import cost_to_come

MATCH = 1e-5
"""The relative error up to which a length matches: scenarios round to six digits."""

_CELLS_AT_ONCE = 2**23


def optimal_lengths(
    free: np.ndarray, rows: Sequence[ScenRow], *, progress: Callable[[int], None] | None = None
) -> np.ndarray:
    """Returns the length of a shortest path for every row, inf where there is none: float32 [rows].

    Rows with the same start share one sweep. `progress` is called with the number of rows finished.
    """
    lengths = np.zeros(len(rows), np.float32)
    members: dict[tuple[int, int], list[int]] = {}
    for index, row in enumerate(rows):
        members.setdefault(row.start, []).append(index)
    starts = list(members)
    at_once = max(
        1, min(64, _CELLS_AT_ONCE // (size_bucket(free.shape[0]) * size_bucket(free.shape[1])))
    )
    for first in range(0, len(starts), at_once):
        chunk = starts[first : first + at_once]
        fields = np.asarray(
            cost_to_come(
                np.broadcast_to(free, (len(chunk), *free.shape)), np.array(chunk, np.int32)
            )
        )
        indices = [(place, index) for place, start in enumerate(chunk) for index in members[start]]
        for place, index in indices:
            lengths[index] = fields[place][rows[index].goal]
        if progress:
            progress(len(indices))
    return lengths


def relative_errors(lengths: np.ndarray, rows: Sequence[ScenRow]) -> np.ndarray:
    """Returns |length - stated| / stated for every row; inf where one of the two is infinite, 0
    where both are 0.
    """
    stated = np.array([row.length for row in rows])
    with np.errstate(invalid="ignore"):
        errors = np.abs(lengths - stated) / np.maximum(stated, 1.0 * (stated == 0))
    return np.where(np.isfinite(errors), errors, np.where(lengths == stated, 0.0, np.inf))
