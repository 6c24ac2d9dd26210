"""The judge of a coalition's answers: replays them on the host and says what is wrong with them.

Like the judge of single answers it shares nothing with the kernels: it floods for itself, decides
again what each agent can reach, alone and with help, and follows every route move by move.
"""

from types import SimpleNamespace

import numpy as np

from srt_jax.check import _arrays
from srt_jax.check.bound import exact, rounded_down
from srt_jax.check.floods import dilate, free_cells, holds_at, piece_of
from srt_jax.types import OUTSIDE, Status

_TASK_FORM = {
    "labels": ("int32", "LHW"),
    "removal_cost": ("float32", "M"),
    "able": ("bool", "AM"),
    "start": ("int32", "A2"),
    "goal": ("int32", "A2"),
    "size": ("int32", "2"),
}
_SOLUTION_FORM = {
    "status": ("int32", ""),
    "help": ("int32", "A"),
    "removal_cost": ("float32", ""),
    "removal_bound": ("float32", ""),
    "destroyed": ("int32", "K"),
    "num_destroyed": ("int32", ""),
    "destroyed_by": ("int32", "K"),
    "destroyed_at": ("int32", "K"),
    "after": ("bool", "KK"),
    "cells": ("int32", "AN2"),
    "num_cells": ("int32", "A"),
    "needed": ("int32", "AK"),
    "cost": ("float32", "A"),
    "finish": ("float32", "A"),
    "firm": ("bool", "M"),
}
_ALONE, _WITH_HELP, _NEVER, _HELPER, _START_BLOCKED = range(5)
_MOST_SETS = 64
"""Sets of obstacles tried against one bound."""

_TOLERANCE = 1e-4


def check_coalition(task: object, solution: object) -> list[str]:
    """Returns what is wrong with the answer to a coalition's task, a sentence each; an empty list
    when all is well.

    Checked are the form of every array; the status and what help each agent needs, by floods of its
    own; the proof `firm`; every route, move by move on the map as it then stands; that who destroys
    an obstacle is able to, stands beside it, and that what its way there needs is destroyed before
    in the partial order `after`, whatever else is; that nothing is destroyed in vain; lengths,
    times and exact sums; and that some sets of obstacles that cost less than the bound do not
    suffice, in small tasks all sets. Not checked: that the removal is the least where there are
    more sets.

    Args:
      task: `CoalitionTask`, one or a batch.
      solution: `CoalitionSolution`, with the same batch dimensions.

    Returns:
      list of str; for a batch each begins with the task's index: "task 3: ".

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import check_coalition, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> check_coalition(task, solve_coalition(task))
      []
    """
    sides: dict[str, int] = {}
    tasks, problems = _arrays("task", task, _TASK_FORM, sides)
    solutions, more = _arrays("solution", solution, _SOLUTION_FORM, sides)
    if problems or more:
        return problems + more
    batch = tasks["size"].shape[:-1]
    for index in np.ndindex(batch):
        one = SimpleNamespace(**{name: array[index] for name, array in tasks.items()})
        answer = SimpleNamespace(**{name: array[index] for name, array in solutions.items()})
        name = "" if not batch else f"task {index[0] if len(batch) == 1 else index}: "
        problems += [name + problem for problem in _check_one(one, answer)]
    return problems


class _World:
    """One task, with the floods that the judge makes."""

    def __init__(self, task: SimpleNamespace) -> None:
        height, width = task.size
        self.labels = task.labels[:, :height, :width]
        self.able, self.costs = task.able, [exact(cost) for cost in task.removal_cost]
        self.start = [tuple(cell) for cell in task.start.tolist()]
        self.goal = [None if min(cell) < 0 else tuple(cell) for cell in task.goal.tolist()]
        self.any_able = task.able.any(axis=0)
        around = [dilate((self.labels == i).any(axis=0)) for i in range(task.able.shape[1])]
        self.beside = np.stack(around)

    def reach(self, agents: list[int], allowed: np.ndarray) -> tuple[dict, np.ndarray]:
        """What these agents reach, and what is gone, if all that is allowed may be destroyed."""
        gone = np.zeros_like(allowed)
        while True:
            free = free_cells(self.labels, gone)
            floods = {agent: piece_of(free, self.start[agent]) for agent in agents}
            new = gone.copy()
            for agent, flood in floods.items():
                open_before = self._stands(agent)
                for obstacle in np.flatnonzero(self.able[agent] & allowed & ~new):
                    new[obstacle] = open_before and bool((flood & self.beside[obstacle]).any())
            if (new == gone).all():
                return {
                    a: flood if self._stands(a) else flood & False for a, flood in floods.items()
                }, gone
            gone = new

    def _stands(self, agent: int) -> bool:
        nothing = np.zeros(len(self.costs), bool)
        return holds_at(free_cells(self.labels, nothing), self.start[agent])

    def are_home(self, allowed: np.ndarray) -> bool:
        """Whether every agent with a goal reaches it with what is allowed."""
        agents = list(range(len(self.start)))
        floods, _ = self.reach(agents, allowed)
        goals = zip(agents, self.goal)
        return all(goal is None or holds_at(floods[agent], goal) for agent, goal in goals)


def _check_one(task: SimpleNamespace, solution: SimpleNamespace) -> list[str]:
    height, width = task.size
    if not (0 < height <= task.labels.shape[1] and 0 < width <= task.labels.shape[2]):
        return [f"task.size {task.size.tolist()} does not fit the labels"]
    known = len(task.removal_cost)
    if task.labels.min() < OUTSIDE or task.labels.max() >= known:
        return [f"task.labels must lie between {OUTSIDE} and {known - 1}, the last id"]
    if int(solution.status) not in list(Status):
        return [f"status {solution.status} is no Status"]
    world = _World(task)
    truth, help, firm = _truth(world)
    status = Status(int(solution.status))
    problems = []
    is_budget = status is Status.BUDGET_SPENT
    is_over = (
        solution.num_destroyed > len(solution.destroyed)
        or (solution.num_cells > solution.cells.shape[1]).any()
    )
    if status is not truth and not (
        is_budget and truth in (Status.SOLVED, Status.PATH_EXISTS) and is_over
    ):
        problems.append(f"status is {status.name}, but the truth is {truth.name}: {truth.meaning}")
    if solution.help.tolist() != help:
        problems.append(f"help is {solution.help.tolist()}, but must be {help}")
    if (solution.firm != firm).any():
        problems.append(
            f"firm names {np.flatnonzero(solution.firm).tolist()}, but what nobody can ever destroy"
            f" is {np.flatnonzero(firm).tolist()}"
        )
    problems += _bound_problems(world, solution, truth)
    if not status.is_solved:
        return problems + _empty_problems(solution, is_budget)
    return problems + _answer_problems(world, solution)


def _truth(world: _World) -> tuple[Status, list[int], np.ndarray]:
    """How the task ends for one who has no limits, what help each agent needs, what stands firm."""
    agents = list(range(len(world.start)))
    everything = np.ones(len(world.costs), bool)
    floods, gone = world.reach(agents, everything)
    help = []
    for agent in agents:
        goal = world.goal[agent]
        if not world._stands(agent):
            help.append(_START_BLOCKED)
        elif goal is None:
            help.append(_HELPER)
        elif holds_at(world.reach([agent], everything)[0][agent], goal):
            help.append(_ALONE)
        else:
            help.append(_WITH_HELP if holds_at(floods[agent], goal) else _NEVER)
    wanting = [agent for agent in agents if world.goal[agent] is not None]
    at_most = free_cells(world.labels, world.any_able)
    if any(help[agent] == _START_BLOCKED for agent in wanting):
        status = Status.START_BLOCKED
    elif any(goal and not holds_at(at_most, goal) for goal in world.goal):
        status = Status.GOAL_BLOCKED
    elif any(help[agent] == _NEVER for agent in wanting):
        status = Status.UNSOLVABLE
    else:
        is_open = world.are_home(~everything)
        status = Status.PATH_EXISTS if is_open else Status.SOLVED
    return status, help, ~gone


def _bound_problems(world: _World, solution: SimpleNamespace, truth: Status) -> list[str]:
    """A set of obstacles that suffices for less than the bound, if one is found among some."""
    if truth not in (Status.SOLVED, Status.PATH_EXISTS):
        wrong = solution.removal_bound != np.inf
        return ["removal_bound must be inf where nothing helps"] if wrong else []
    if not 0 <= solution.removal_bound < np.inf:
        return [f"removal_bound is {solution.removal_bound}, but the task can be solved"]
    bound = exact(solution.removal_bound)
    ids = [int(i) for i in np.flatnonzero(world.any_able)]
    sets = [()]
    for number in ids:
        if 2 * len(sets) > _MOST_SETS:
            break
        sets += [(*chosen, number) for chosen in sets]
    sets += [tuple(i for i in ids if i != left_out) for left_out in ids]
    for chosen in sets:
        cost = sum(world.costs[i] for i in chosen)
        allowed = np.isin(np.arange(len(world.costs)), chosen)
        if cost < bound and world.are_home(allowed):
            return [
                f"removal_bound is {solution.removal_bound}, but destroying {list(chosen)} suffices"
                f" and costs {rounded_down(cost)}"
            ]
    return []


def _empty_problems(solution: SimpleNamespace, is_budget: bool) -> list[str]:
    wanted = {
        "cells": (solution.cells == -1).all(),
        "num_cells": is_budget or (solution.num_cells == 0).all(),
        "destroyed": (solution.destroyed == -1).all(),
        "destroyed_by": (solution.destroyed_by == -1).all(),
        "destroyed_at": (solution.destroyed_at == -1).all(),
        "num_destroyed": is_budget or solution.num_destroyed == 0,
        "after": not solution.after.any(),
        "needed": (solution.needed == -1).all(),
        "cost": (solution.cost == np.inf).all(),
        "finish": (solution.finish == np.inf).all(),
        "removal_cost": solution.removal_cost == np.inf,
    }
    wrong = [name for name, is_right in wanted.items() if not is_right]
    return [f"{name} must be empty, 0 or inf without an answer" for name in wrong]


def _answer_problems(world: _World, solution: SimpleNamespace) -> list[str]:
    """The obstacles destroyed, the routes, and the order in which they depend on each other."""
    problems = _list_problems(world, solution)
    if problems:
        return problems
    number = int(solution.num_destroyed)
    ids = solution.destroyed[:number].tolist()
    routes = []
    for agent in range(len(world.start)):
        num = int(solution.num_cells[agent])
        route = solution.cells[agent, :num]
        problems += _route_problems(world, solution, agent, route, ids)
        routes.append(route)
    if problems:
        return problems
    before = _closure(solution.after[:number, :number])
    if before is None:
        return ["after goes round in a circle, or against the order of destroyed"]
    needed = [[_entered(world.labels, route, i) for i in ids] for route in routes]
    if needed != solution.needed[:, :number].tolist() or (solution.needed[:, number:] != -1).any():
        return [f"needed is {solution.needed[:, :number].tolist()}, but must be {needed}"]
    for k, obstacle in enumerate(ids):
        by, at = int(solution.destroyed_by[k]), int(solution.destroyed_at[k])
        on_the_way = {j for j in range(number) if 0 <= needed[by][j] < at and j != k}
        if not on_the_way <= before[k]:
            missing = [ids[j] for j in sorted(on_the_way - before[k])]
            problems.append(
                f"obstacle {obstacle} is destroyed by agent {by}, whose way there needs {missing}"
                " gone, but the order does not say so"
            )
        if 0 <= needed[by][k] < at:
            problems.append(f"agent {by} passes obstacle {obstacle} before it destroys it")
    return problems or _time_problems(solution, routes, needed, number)


def _list_problems(world: _World, solution: SimpleNamespace) -> list[str]:
    number, room = int(solution.num_destroyed), len(solution.destroyed)
    if not 0 <= number <= room:
        return [f"num_destroyed is {number}, but there is room for 0 to {room}"]
    rest = (solution.destroyed, solution.destroyed_by, solution.destroyed_at)
    if any((array[number:] != -1).any() for array in rest):
        return [f"destroyed, destroyed_by and destroyed_at must be -1 from {number} on"]
    ids, by = solution.destroyed[:number].tolist(), solution.destroyed_by[:number].tolist()
    if any(not 0 <= i < len(world.costs) for i in ids) or len(set(ids)) < number:
        return [f"destroyed {ids} must name obstacles, none twice"]
    if any(not 0 <= agent < len(world.start) for agent in by):
        return [f"destroyed_by {by} must name agents"]
    if solution.after[number:].any() or solution.after[:, number:].any():
        return ["after must be empty beyond the obstacles destroyed"]
    problems = [
        f"agent {agent} destroys obstacle {i}, but is not able to"
        for i, agent in zip(ids, by)
        if not world.able[agent, i]
    ]
    for k, (i, agent) in enumerate(zip(ids, by)):
        at = int(solution.destroyed_at[k])
        if not 0 <= at < solution.num_cells[agent]:
            problems.append(f"destroyed_at {at} lies not on the route of agent {agent}")
        elif not world.beside[i][tuple(solution.cells[agent, at])]:
            problems.append(f"agent {agent} destroys obstacle {i} without being beside it")
    total = sum(world.costs[i] for i in ids)
    if solution.removal_cost != rounded_down(total):
        problems.append(
            f"removal_cost is {solution.removal_cost}, but the sum is {rounded_down(total)}"
        )
    if exact(solution.removal_bound) > total:
        problems.append(f"removal_bound {solution.removal_bound} is more than the removal cost")
    if solution.status == Status.PATH_EXISTS and ids:
        problems.append(f"status PATH_EXISTS, but {ids} were destroyed")
    for i in ids:
        if world.are_home(np.isin(np.arange(len(world.costs)), [j for j in ids if j != i])):
            problems.append(f"obstacle {i} is destroyed, but need not be")
    return problems


def _route_problems(
    world: _World, solution: SimpleNamespace, agent: int, route: np.ndarray, ids: list[int]
) -> list[str]:
    """One route on the map without all that is destroyed."""
    name, goal = f"the route of agent {agent}", world.goal[agent]
    if not world._stands(agent):
        is_empty = not len(route) and solution.cost[agent] == 0 and solution.finish[agent] == 0
        return [] if is_empty else [f"{name} must be empty: it stands on no free cell"]
    if not len(route) or (solution.cells[agent, len(route) :] != -1).any():
        return [f"{name} must have num_cells cells, at least one, then -1"]
    if tuple(route[0]) != world.start[agent]:
        return [f"{name} begins in {tuple(route[0].tolist())}, not at its start"]
    if goal is not None and tuple(route[-1]) != goal:
        return [f"{name} ends in {tuple(route[-1].tolist())}, not at its goal"]
    free = free_cells(world.labels, np.isin(np.arange(len(world.costs)), ids))
    if (route < 0).any() or (route >= free.shape).any():
        return [f"{name} leaves the map"]
    before, after = route[:-1], route[1:]
    sides = free[before[:, 0], after[:, 1]] & free[after[:, 0], before[:, 1]]
    is_step = abs(after - before).max(axis=1, initial=0) == 1
    wrong = np.flatnonzero(~(is_step & free[tuple(before.T)] & free[tuple(after.T)] & sides))
    if len(wrong):
        return [f"{name} has an illegal move at index {wrong[0]}"]
    length = _lengths(route).sum()
    if abs(solution.cost[agent] - length) > _TOLERANCE * max(1, length):
        return [f"{name} has length {length}, not {solution.cost[agent]}"]
    return []


def _lengths(route: np.ndarray) -> np.ndarray:
    return np.where(abs(route[1:] - route[:-1]).sum(axis=1) == 2, 2**0.5, 1.0)


def _closure(after: np.ndarray) -> list[set[int]] | None:
    """What comes before each, directly or not; None where the order of the list contradicts."""
    before: list[set[int]] = []
    for k in range(len(after)):
        direct = set(np.flatnonzero(after[k]).tolist())
        if any(j >= k for j in direct):
            return None
        before.append(direct.union(*(before[j] for j in direct)))
    return before


def _entered(labels: np.ndarray, route: np.ndarray, obstacle: int) -> int:
    """The index of the cell before the first move that needs an obstacle gone, -1 for none."""
    own = (labels == obstacle).any(axis=0)
    before, after = route[:-1], route[1:]
    meets = own[tuple(after.T)] | own[before[:, 0], after[:, 1]] | own[after[:, 0], before[:, 1]]
    return int(np.argmax(meets)) if meets.any() else -1


def _time_problems(
    solution: SimpleNamespace, routes: list[np.ndarray], needed: list[list[int]], number: int
) -> list[str]:
    """When each agent has done its part, if it waits only for what it needs."""
    when: list[float] = []

    def arrival(agent: int, index: int) -> float:
        waits = {needed[agent][k]: 0.0 for k in range(len(when)) if needed[agent][k] >= 0}
        for k, time in enumerate(when):
            if needed[agent][k] >= 0:
                waits[needed[agent][k]] = max(waits[needed[agent][k]], time)
        now, steps = 0.0, _lengths(routes[agent]).tolist()
        for place in range(index):
            now = max(now, waits.get(place, 0.0)) + steps[place]
        return now

    for k in range(number):
        when.append(arrival(int(solution.destroyed_by[k]), int(solution.destroyed_at[k])))
    problems = []
    for agent, route in enumerate(routes):
        time = arrival(agent, len(route) - 1) if len(route) else 0.0
        if abs(solution.finish[agent] - time) > _TOLERANCE * max(1, time):
            problems.append(
                f"agent {agent} has done its part at {time}, not at {solution.finish[agent]}"
            )
    return problems
