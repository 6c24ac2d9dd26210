"""A*, weighted A* and greedy best-first search over the matrices of a task: one forward search,
three orderings.

    astar   f = g + h        the cheapest plan where h never overestimates (hmax, blind)
    wastar  f = g + w h      at most w times the cheapest, under the same proviso
    gbfs    f = h

The baselines of PY16 Figure 2. Ties in f go to the lower h, then to the state met first.
"""

import heapq
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sign_model.bits import pack
from sign_model.clock import NO_LIMIT, Clock, OutOfTime
from sign_model.forward_search.relaxation import StateHeuristic, make_heuristic
from sign_model.pddl.planning_task import PlanningTask

DEFAULT_HEURISTIC = {"astar": "hmax", "wastar": "ff", "gbfs": "ff"}

_Ordering = Callable[[float, float], float]


@dataclass(frozen=True)
class Search:
    """What a search ended with: plan (action numbers) or None; is_proof: every state was seen,
    there is no plan.
    """

    plan: list[int] | None
    expansions: int
    is_proof: bool


def best_first(
    task: PlanningTask,
    planner: str,
    max_expansions: int,
    clock: Clock = NO_LIMIT,
    *,
    heuristic: str | None = None,
    weight: float = 2.0,
) -> Search:
    """Returns the plan that the search `planner` (astar, wastar, gbfs) finds, a proof that there
    is none, or a spent budget.
    """
    orderings: dict[str, _Ordering] = {
        "astar": lambda g, h: g + h,
        "wastar": lambda g, h: g + weight * h,
        "gbfs": lambda g, h: h,
    }
    if planner not in orderings:
        raise ValueError(f"planner '{planner}' is not known: choose map, astar, wastar or gbfs")
    closed: set[int] = set()
    try:
        rate = make_heuristic(heuristic or DEFAULT_HEURISTIC[planner], task, clock)
        return _search(task, rate, orderings[planner], max_expansions, clock, closed)
    except OutOfTime:
        return Search(None, len(closed), False)


def _search(
    task: PlanningTask,
    rate: StateHeuristic,
    order: _Ordering,
    max_expansions: int,
    clock: Clock,
    closed: set[int],
) -> Search:
    """The search; `closed` fills with the numbers of the states expanded."""
    conditions = pack(task.conditions)
    first = float(rate(task.start[None])[0])
    open_ = [] if np.isinf(first) else [(order(0.0, first), first, 0)]
    states, cost_to_come, parent = [task.start], [0.0], [(-1, -1)]
    number_of = {task.start.tobytes(): 0}
    while open_:
        _, _, number = heapq.heappop(open_)
        if number in closed:
            continue
        state = states[number]
        if not (task.goal & ~state).any():
            return Search(_plan_to(number, parent), len(closed), False)
        clock.check()
        if len(closed) >= max_expansions:
            return Search(None, len(closed), False)
        closed.add(number)
        actions = np.flatnonzero(~(conditions & ~pack(state)).any(axis=1))
        after = (state & ~task.deletes[actions]) | task.adds[actions]
        better = []
        for action, successor in zip(actions, after):
            cost = cost_to_come[number] + float(task.costs[action])
            known = number_of.setdefault(successor.tobytes(), len(states))
            if known == len(states):
                states.append(successor)
                cost_to_come.append(cost)
                parent.append((number, int(action)))
            elif cost < cost_to_come[known]:
                cost_to_come[known], parent[known] = cost, (number, int(action))
                closed.discard(known)  # a cheaper way to a state already expanded: open it again
            else:
                continue
            better.append(known)
        if better:
            for known, h in zip(better, rate(np.array([states[k] for k in better])).tolist()):
                if not np.isinf(h):
                    heapq.heappush(open_, (order(cost_to_come[known], h), h, known))
    return Search(None, len(closed), True)


def _plan_to(number: int, parent: list[tuple[int, int]]) -> list[int]:
    plan = []
    while parent[number][0] >= 0:
        number, action = parent[number]
        plan.append(action)
    return plan[::-1]
