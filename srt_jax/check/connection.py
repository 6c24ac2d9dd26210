"""The judge of joined regions: floods the map anew and says what is wrong with what joins them."""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np

from srt_jax.check.bound import exact, rounded_down
from srt_jax.check.floods import free_cells, holds_at, piece_of
from srt_jax.types import Array, Task

_MOST_SETS = 512
"""Floods, at most, for sets that cost less than the bound."""


def check_connection(
    task: Task,
    connection: object,
    cells: Array | Sequence[Sequence[int]] | None = None,
    *,
    min_cells: int = 1,
) -> list[str]:
    """Returns what is wrong with what `connect` says, a sentence each; an empty list when all is
    well.

    Checked are that what is destroyed can be; that the regions are then joined, by a flood of its
    own, and `joined` is the region that holds them; that nothing destroyed is needless; the sums,
    exactly; and `removal_bound`: no more than the cost, nor than any set of obstacles that joins
    the regions and is found within some floods: in small tasks all sets. Where nothing is said to
    join them, that they are apart with all gone that can be.

    Args:
      task: a single task.
      connection: what `connect` returned.
      cells: integer [k, 2], (row, col), as given to `connect`.
      min_cells: likewise.

    Returns:
      list of str.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.check import check_connection
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> connection = srt_jax.connect(task)
      >>> check_connection(task, connection)
      []
      >>> check_connection(task, connection._replace(removal_cost=2.0))
      ['removal_cost is 2.0, and what is destroyed costs 1.0']
    """
    destroyed, cost, bound, joined = connection  # pyright: ignore[reportGeneralTypeIssues]
    labels, flags = np.asarray(task.labels), np.asarray(task.destroyable)
    nothing = np.zeros(len(flags), bool)
    regions = _regions(free_cells(labels, nothing), min_cells) if cells is None else None
    named = [tuple(cell) for cell in np.asarray(cells).tolist()] if regions is None else regions

    def are_joined(ids: Iterable[int]) -> bool:
        free = free_cells(labels, _gone(len(flags), ids))
        first = piece_of(free, named[0])
        return all(holds_at(first, cell) for cell in named)

    if not named:
        is_empty = not destroyed and cost == bound == 0 and not joined.any()
        return [] if is_empty else ["there is no region to join, so nothing must be destroyed"]
    able = np.flatnonzero(flags).tolist()
    if cost == np.inf:
        problems = [] if bound == np.inf and not destroyed else ["without a way nothing is told"]
        return problems + (["the regions can be joined"] if are_joined(able) else [])
    # The set and its region.
    ids = list(destroyed)
    if ids != sorted(set(ids)) or not set(ids) <= set(able):
        return [f"destroyed must be ids of obstacles that can be destroyed, ascending, got {ids}"]
    if not are_joined(ids):
        return [f"with {ids} gone the regions are not joined"]
    problems = []
    if not np.array_equal(joined, piece_of(free_cells(labels, _gone(len(flags), ids)), named[0])):
        problems.append("joined is not the region that holds them all")
    problems += [
        f"obstacle {one} need not be destroyed"
        for one in ids
        if are_joined(other for other in ids if other != one)
    ]
    # The sums, and the bound against sets of few obstacles.
    costs = {one: exact(np.asarray(task.removal_cost)[one]) for one in able}
    true = float(rounded_down(sum(costs[one] for one in ids)))
    if cost != true:
        problems.append(f"removal_cost is {cost}, and what is destroyed costs {true}")
    if bound > cost:
        problems.append(f"removal_bound {bound} is above the cost")
    for number, some in enumerate(_sets(able)):
        if number >= _MOST_SETS:
            break
        paid = float(rounded_down(sum(costs[one] for one in some)))
        if paid < bound and are_joined(some):
            problems.append(f"removal_bound is {bound}, but {list(some)} join them for {paid}")
            break
    return problems


def _regions(free: np.ndarray, min_cells: int) -> list[tuple[int, ...]]:
    """A cell of each region of at least so many cells."""
    found, left = [], free.copy()
    while left.any():
        cell = tuple(np.argwhere(left)[0].tolist())
        region = piece_of(left, cell)
        left &= ~region
        if region.sum() >= min_cells:
            found.append(cell)
    return found


def _gone(number: int, ids: Iterable[int]) -> np.ndarray:
    gone = np.zeros(number, bool)
    gone[list(ids)] = True
    return gone


def _sets(ids: list[int]) -> Iterable[tuple[int, ...]]:
    """All sets, those of few obstacles first."""
    return (some for size in range(len(ids) + 1) for some in combinations(ids, size))
