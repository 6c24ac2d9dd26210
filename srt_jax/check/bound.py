"""What the judge finds out about removal costs by itself: exact sums, cheaper ways, and what was
destroyed in vain.

A float32 is a whole number of the least positive one, 2^-149, and Python's whole numbers have no
end: sums of them are exact.
"""

import math
from types import SimpleNamespace

import numpy as np

from srt_jax.check.floods import free_cells, holds_at, piece_of

_BEYOND = 2**400
_MOST_FLOODS = 64
_CELLS_AT_MOST = 2**20
"""Of all floods that test one bound; a large map gets at least four."""

Cell = tuple[int, ...]


def exact(cost: float | np.floating) -> int:
    """Returns a float32 in units of 2^-149; what is not finite is more than any sum."""
    return int(float(cost) * 2.0**149) if math.isfinite(cost) else _BEYOND


def rounded_down(total: int) -> np.float32:
    """Returns the greatest finite float32 that is no more than a sum of `exact` costs."""
    if total >= exact(np.finfo(np.float32).max):
        return np.finfo(np.float32).max
    kept = max(0, total.bit_length() - 24)
    return np.float32((total >> kept) * 2.0 ** (kept - 149))


def bound_problems(
    task: SimpleNamespace, solution: SimpleNamespace, labels: np.ndarray, start: Cell, goal: Cell
) -> list[str]:
    """A set of obstacles that opens the way for less than the bound, if one is found within some
    floods.

    Who opens a way has to destroy one of the obstacles beside what the agent reaches. So each of
    these that the bound leaves money for is destroyed in turn, and after it those beside what is
    reached then; what was tried before a sibling stays.
    """
    bound, costs = exact(solution.removal_bound), [exact(cost) for cost in task.removal_cost]
    floods_left = max(4, min(_MOST_FLOODS, _CELLS_AT_MOST // labels[0].size))
    everything = np.flatnonzero(task.destroyable).tolist()
    if sum(costs[i] for i in everything) < bound:  # then all of it is a set that costs less
        opened = piece_of(free_cells(labels, task.destroyable), start)
        if holds_at(opened, goal):
            return [_too_high(solution, everything, costs)]
        return []
    # Depth first. No set is tried twice, for an obstacle tried before a sibling stays. Ends: no set
    # is left that costs less than the bound, or the floods are used up.
    waiting: list[tuple[tuple[int, ...], frozenset[int]]] = [((), frozenset())]
    while waiting and floods_left:
        chosen, stays = waiting.pop()
        gone = np.zeros_like(task.destroyable)
        gone[list(chosen)] = True
        free = free_cells(labels, gone)
        reached = piece_of(free, start)
        floods_left -= 1
        if holds_at(reached, goal):
            return [_too_high(solution, list(chosen), costs)]
        paid = sum(costs[i] for i in chosen)
        met = np.unique(labels[:, _beside(reached) & ~free])
        for obstacle in met[met >= 0].tolist():
            if (
                task.destroyable[obstacle]
                and not gone[obstacle]
                and obstacle not in stays
                and paid + costs[obstacle] < bound
            ):
                waiting.append(((*chosen, obstacle), stays))
                stays = stays | {obstacle}
    return []


def needless_problems(
    task: SimpleNamespace, solution: SimpleNamespace, labels: np.ndarray, start: Cell, goal: Cell
) -> list[str]:
    """The obstacles destroyed without which the others open the way, too."""
    ids = [i for i in solution.destroyed.tolist() if 0 <= i < len(task.destroyable)]
    problems = []
    for obstacle in ids:
        gone = np.zeros_like(task.destroyable)
        gone[[i for i in ids if i != obstacle]] = True
        if holds_at(piece_of(free_cells(labels, gone), start), goal):
            problems.append(
                f"obstacle {obstacle} was destroyed, but need not be: the others destroyed open"
                " a way"
            )
    return problems


def _too_high(solution: SimpleNamespace, ids: list[int], costs: list[int]) -> str:
    total = rounded_down(sum(costs[i] for i in ids))
    named = f"{ids[:8]}{' and more' if len(ids) > 8 else ''}"
    return (
        f"removal_bound is {solution.removal_bound}, but obstacles {named} open a way, and they"
        f" cost {total}"
    )


def _beside(mask: np.ndarray) -> np.ndarray:
    """Returns the cells that share a side with one of the mask's."""
    wide = np.pad(mask, 1)
    return wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
