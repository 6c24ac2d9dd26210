"""What the judge finds out about totals by itself: sums of length and tolls, and routes for less.

A host's Dijkstra on maps where some obstacles are gone; it decides nothing that a kernel decided.
"""

import math
from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import combinations
from types import SimpleNamespace

import numpy as np

from srt_jax.check.floods import free_cells, holds_at
from srt_jax.types import Status

_RELATIVE = 1e-5
_MOST_CELLS = 2**15
"""Of all searches that test one bound; larger maps get none."""

_ROOT = math.sqrt(2)

Cell = tuple[int, ...]


def total_problems(
    task: SimpleNamespace,
    solution: SimpleNamespace,
    labels: np.ndarray,
    start: Cell,
    goal: Cell,
    toll: float,
) -> list[str]:
    """What is wrong with `total` and `total_bound` of a route of mode "shortest"."""
    ids = solution.destroyed[: max(0, int(solution.num_destroyed))].tolist()
    ids = [i for i in ids if 0 <= i < len(task.destroyable)]
    tolls = np.asarray(task.removal_cost, float) * float(toll)
    problems = []
    # The sum itself, up to the rounding of tolls to units of the kernel's fixed point.
    true = float(solution.cost) + float(tolls[ids].sum())
    slack = _RELATIVE * true + _unit(labels) * (len(ids) + 1)
    if not abs(float(solution.total) - true) <= slack:
        problems.append(
            f"total is {solution.total}, but the route and the tolls of what it destroys come to"
            f" {true:.6f}"
        )
    # Routes that would refute the bound: around everything, and with the sets that are tried gone.
    searches = _MOST_CELLS // labels[0].size
    for number, chosen in enumerate(_sets(task, ids)):
        if number >= searches:
            break
        gone = np.zeros_like(task.destroyable)
        gone[list(chosen)] = True
        length = _length(free_cells(labels, gone), start, goal)
        found = length + float(tolls[list(chosen)].sum())
        slack = _RELATIVE * found + _unit(labels) * (len(chosen) + 1)
        if found < float(solution.total_bound) - slack:
            problems.append(
                f"total_bound is {solution.total_bound}, but with {list(chosen)} gone a route of"
                f" {length:.4f} leads to the goal, {found:.4f} with its tolls"
            )
        if list(chosen) == sorted(ids) and length < float(solution.cost) * (1 - _RELATIVE):
            problems.append(
                f"the route is {solution.cost} long, but one of {length:.4f} needs no more"
                " destroyed"
            )
    return problems


def presence_problems(
    solution: SimpleNamespace, start: Cell, goal: Cell, mode: str | None, *, has_route: bool
) -> list[str]:
    """Whether `total` and `total_bound` are there where they must be, whatever the toll: 0 in the
    modes that look at none, else no less than the route, and the bound no less than a straight
    line.
    """
    total, bound = float(solution.total), float(solution.total_bound)
    rows, cols = (abs(a - b) for a, b in zip(start, goal))
    straight = (max(rows, cols) + (_ROOT - 1) * min(rows, cols)) * (1 - _RELATIVE)
    is_none = total == bound == 0
    if has_route:
        length, pays = float(solution.cost), solution.num_destroyed > 0
        is_whole = total >= length * (1 - _RELATIVE) and straight <= bound <= total
        is_whole &= bool(pays or total <= length * (1 + _RELATIVE))
    else:
        is_budget = solution.status == Status.BUDGET_SPENT
        is_whole = total == np.inf and (bound == np.inf or (is_budget and bound >= straight))
    if {"shortest": is_whole, None: is_none or is_whole}.get(mode, is_none):
        return []
    return [
        f"total is {solution.total} and total_bound {solution.total_bound}, which no answer of mode"
        f" {mode or 'shortest'} has: both are 0 in the modes that look at no tolls, else no less"
        " than the route and a straight line, inf without a route"
    ]


def _sets(task: SimpleNamespace, ids: list[int]) -> Iterator[tuple[int, ...]]:
    """What the solution destroys, nothing, all of it but one; then all sets, small ones first."""
    yield tuple(sorted(ids))
    yield ()
    yield from combinations(sorted(ids), len(ids) - 1) if ids else ()
    everything = np.flatnonzero(task.destroyable).tolist()
    for number in range(1, len(everything) + 1):
        yield from combinations(everything, number)


def _unit(labels: np.ndarray) -> float:
    """What a toll may be off by, in cell sides: the fixed point is coarser on large maps."""
    return 1e-4 if labels[0].size <= 700 * 700 else 0.05


def _length(free: np.ndarray, start: Cell, goal: Cell) -> float:
    """The length of a shortest path, inf where there is none."""
    if not (holds_at(free, start) and holds_at(free, goal)):
        return np.inf
    stride = free.shape[1] + 2
    is_open = np.pad(free, 1).ravel().tolist()
    source, target = ((cell[0] + 1) * stride + cell[1] + 1 for cell in (start, goal))
    lengths, heap, settled = {source: 0.0}, [(0.0, source)], set()
    while heap:
        here, cell = heappop(heap)
        if cell == target:
            return here
        if cell in settled:
            continue
        settled.add(cell)
        for down in (-stride, 0, stride):
            for right in (-1, 0, 1):
                to = cell + down + right
                if to == cell or not (
                    is_open[to] and is_open[cell + down] and is_open[cell + right]
                ):
                    continue
                length = here + (_ROOT if down and right else 1.0)
                if length < lengths.get(to, np.inf):
                    lengths[to] = length
                    heappush(heap, (length, to))
    return np.inf
