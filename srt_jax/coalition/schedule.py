"""Better routes for the set of obstacles that was chosen: the least total length, or an early end.

Least total length: exact, a best-first search over who destroys which obstacle next and from which
cell. Each step is a shortest way on the map as it is then, so nothing is left out; what is still to
be walked at least is the way to each goal on the map without the whole set. Where the search is
ended by its budget, the least estimate left is a proven bound.

Early end (makespan): the best of some list schedules, with a bound. It lets each agent be in
several places at once: the obstacles fall at the times when any agent able to destroy them could
come beside them. Choosing who goes first holds the path problem of a travelling salesman.

On the host, one task at a time; the ways are computed by the kernels.
"""

import heapq
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from srt_jax.coalition.task import CoalitionTask
from srt_jax.coalition.types import CoalitionSolution
from srt_jax.paths.cost_to_come import cost_to_come
from srt_jax.paths.path import trace_path
from srt_jax.types import Status

OBJECTIVES = ("makespan", "length")


class Deed(NamedTuple):
    """One step of a plan: the agent destroys the obstacle from the cell."""

    agent: int
    obstacle: int
    cell: tuple[int, int]


class Schedule(NamedTuple):
    """A plan for the set of obstacles of a solution.

    solution: the same answer with these routes and this order.
    value: what was to be small: the total length, or the time at which the last agent has done its
      part.
    bound: proven, no plan for this set has less; both equal up to rounding: it is the least.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, schedule_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> schedule = schedule_coalition(task, solve_coalition(task))
      >>> round(schedule.value, 3), round(schedule.bound, 3), schedule.is_proven
      (6.828, 6.828, True)
    """

    solution: CoalitionSolution
    value: float
    bound: float

    @property
    def is_proven(self) -> bool:
        """Whether the value is the least there is."""
        return self.value <= self.bound * (1 + 1e-5) + 1e-5


def schedule_coalition(
    task: CoalitionTask,
    solution: CoalitionSolution,
    *,
    objective: str = "makespan",
    max_steps: int = 2000,
) -> Schedule:
    """Returns a plan that destroys the same obstacles, with little total length or an early end.

    Args:
      task: one task.
      solution: its answer, solved.
      objective: "length": the lengths of all routes added up; "makespan": when the last agent has
        done its part, if a cell side takes one unit of time and destroying none.
      max_steps: of the search for the least length.

    Raises:
      ValueError: a batch, an answer without routes, or an unknown objective.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, schedule_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> schedule = schedule_coalition(task, solve_coalition(task), objective="length")
      >>> round(schedule.value, 3), schedule.is_proven
      (8.828, True)
    """
    if objective not in OBJECTIVES:
        raise ValueError(f"objective must be one of {', '.join(OBJECTIVES)}, got {objective!r}")
    if np.ndim(solution.status) != 0:
        raise ValueError("schedule_coalition takes one task and its answer, not a batch")
    if not Status(int(solution.status)).is_solved:
        raise ValueError(
            f"the answer has no routes (status {Status(int(solution.status)).name}): only solved"
            " tasks have a schedule"
        )
    maps = _Maps(task, solution)
    given = maps.deeds_of(solution)
    if objective == "length":
        deeds, bound = _least_length(maps, given, max_steps)
        best = maps.carried_out(deeds)
        return Schedule(best, _total(best), min(bound, _total(best)))
    plans = [solution, maps.carried_out(_by_turns(maps))]
    plans.append(maps.carried_out(_least_length(maps, given, max_steps // 10)[0]))
    best = min(plans, key=_end)
    return Schedule(best, _end(best), min(_earliest_end(maps), _end(best)))


def _total(solution: CoalitionSolution) -> float:
    return float(np.sum(np.asarray(solution.cost, np.float64)))


def _end(solution: CoalitionSolution) -> float:
    return float(np.max(np.asarray(solution.finish)))


class _Maps:
    """One task with the maps that its set of obstacles opens one after the other."""

    def __init__(self, task: CoalitionTask, solution: CoalitionSolution) -> None:
        self.task, self.solution = task, solution
        height, width = np.asarray(task.size).tolist()
        self.labels = np.asarray(task.labels)[:, :height, :width]
        self.able = np.asarray(task.able)
        number = int(solution.num_destroyed)
        self.chosen = frozenset(np.asarray(solution.destroyed)[:number].tolist())
        self.start = [tuple(cell) for cell in np.asarray(task.start).tolist()]
        acts = np.asarray(solution.num_cells) > 0
        self.agents = np.flatnonzero(acts).tolist()
        self.goal = {
            agent: tuple(cell)
            for agent, cell in enumerate(np.asarray(task.goal).tolist())
            if acts[agent] and min(cell) >= 0
        }
        self.beside = {obstacle: self._beside(obstacle) for obstacle in self.chosen}
        self._fields: dict = {}

    def _beside(self, obstacle: int) -> np.ndarray:
        wide = np.pad((self.labels == obstacle).any(axis=0), 1)
        wide = wide[:-2] | wide[1:-1] | wide[2:]
        return wide[:, :-2] | wide[:, 1:-1] | wide[:, 2:]

    def free(self, gone: frozenset) -> np.ndarray:
        return ((self.labels == -1) | np.isin(self.labels, list(gone))).all(axis=0)

    def field(self, gone: frozenset, cell: tuple) -> np.ndarray:
        """The lengths of the ways from a cell on the map without `gone`."""
        if (gone, cell) not in self._fields:
            length = cost_to_come(self.free(gone), np.array(cell, np.int32))
            self._fields[gone, cell] = np.asarray(length)
        return self._fields[gone, cell]

    def stands(self, gone: frozenset, cell: tuple, obstacle: int) -> list[tuple[float, tuple]]:
        """The cells beside an obstacle with their lengths from a cell, nearest first."""
        lengths = self.field(gone, cell)
        there = np.argwhere(self.beside[obstacle] & np.isfinite(lengths))
        return sorted((float(lengths[tuple(c)]), tuple(c.tolist())) for c in there)

    def deeds_of(self, solution: CoalitionSolution) -> list[Deed]:
        """The steps of a solution's plan, in order."""
        number = int(solution.num_destroyed)
        fields = (solution.destroyed, solution.destroyed_by, solution.destroyed_at)
        rows = zip(*(np.asarray(field)[:number].tolist() for field in fields))
        cells = np.asarray(solution.cells)
        return [Deed(agent, i, tuple(cells[agent, at].tolist())) for i, agent, at in rows]

    def carried_out(self, deeds: Sequence[Deed]) -> CoalitionSolution:
        """The solution that a plan leads to: routes, order and times."""
        shape = np.asarray(self.solution.cells).shape
        room, slots = shape[1], np.asarray(self.solution.destroyed).shape[0]
        routes = {agent: [self.start[agent]] for agent in self.agents}
        lengths = dict.fromkeys(self.agents, 0.0)
        gone: frozenset = frozenset()
        at = []
        for deed in [*deeds, *(Deed(agent, -1, cell) for agent, cell in self.goal.items())]:
            field = self.field(gone, routes[deed.agent][-1])
            path = trace_path(field, np.array(deed.cell, np.int32), max_cells=room)
            cells = np.asarray(path.cells)[: int(path.num_cells)].tolist()
            routes[deed.agent] += [tuple(cell) for cell in cells[1:]]
            lengths[deed.agent] += float(path.cost)
            if deed.obstacle >= 0:
                at.append(len(routes[deed.agent]) - 1)
                gone |= {deed.obstacle}
        ids = [deed.obstacle for deed in deeds]
        by = [deed.agent for deed in deeds]
        needed = np.full((shape[0], slots), -1, np.int32)
        for agent, route in routes.items():
            needed[agent, : len(ids)] = [self._entered(np.array(route), i) for i in ids]
        after = np.zeros((slots, slots), bool)
        for k, agent in enumerate(by):
            for j in range(len(ids)):
                after[k, j] = j != k and (
                    0 <= needed[agent, j] < at[k] or (by[j] == agent and j < k)
                )
        finish = self._times(routes, needed, by, at)
        cells = np.full(shape, -1, np.int32)
        longest = max((len(route) for route in routes.values()), default=0)
        if longest > room:
            return self.solution  # it does not fit: the routes stay as they were
        for agent, route in routes.items():
            cells[agent, : len(route)] = route

        def padded(values: list[int]) -> np.ndarray:
            return np.array([*values, *[-1] * (slots - len(values))], np.int32)

        def of_agents(values: dict, dtype: type) -> np.ndarray:
            return np.array([values.get(agent, 0) for agent in range(shape[0])], dtype)

        return self.solution.replace(
            destroyed=padded(ids),
            destroyed_by=padded(by),
            destroyed_at=padded(at),
            after=after,
            cells=cells,
            num_cells=of_agents({a: len(route) for a, route in routes.items()}, np.int32),
            needed=needed,
            cost=of_agents(lengths, np.float32),
            finish=of_agents(finish, np.float32),
        )

    def _entered(self, route: np.ndarray, obstacle: int) -> int:
        own = (self.labels == obstacle).any(axis=0)
        one, two = route[:-1], route[1:]
        meets = own[tuple(two.T)] | own[one[:, 0], two[:, 1]] | own[two[:, 0], one[:, 1]]
        return int(np.argmax(meets)) if meets.any() else -1

    def _times(self, routes: dict, needed: np.ndarray, by: list, at: list) -> dict[int, float]:
        when: list[float] = []

        def arrival(agent: int, index: int) -> float:
            route = np.array(routes[agent])
            steps = np.where(abs(np.diff(route, axis=0)).sum(axis=1) == 2, 2**0.5, 1.0)
            waits = np.zeros(len(route))
            for k, time in enumerate(when):
                if needed[agent, k] >= 0:
                    waits[needed[agent, k]] = max(waits[needed[agent, k]], time)
            now = 0.0
            for step, wait in zip(steps[:index].tolist(), waits.tolist()):
                now = max(now, wait) + step
            return now

        for agent, index in zip(by, at):
            when.append(arrival(agent, index))
        return {agent: arrival(agent, len(route) - 1) for agent, route in routes.items()}


def _least_length(maps: _Maps, given: list[Deed], max_steps: int) -> tuple[list[Deed], float]:
    """The plan of least total length, and a proven bound on it."""
    counter = itertools.count()

    def rest(cells: tuple) -> float:
        whole = [
            float(maps.field(maps.chosen, maps.goal[agent])[cell])
            for agent, cell in zip(maps.agents, cells)
            if agent in maps.goal
        ]
        return float(np.sum(whole))

    begin = tuple(maps.start[agent] for agent in maps.agents)
    queue: list[tuple] = [(rest(begin), next(counter), 0.0, frozenset(), begin, ())]
    settled = set()
    steps = 0
    while queue:
        estimate, _, walked, gone, cells, deeds = heapq.heappop(queue)
        if gone == maps.chosen:
            return list(deeds), estimate
        if (gone, cells) in settled:
            continue
        if steps == max_steps:
            return given, estimate
        settled.add((gone, cells))
        steps += 1
        for place, agent in enumerate(maps.agents):
            for obstacle in maps.chosen - gone:
                if not maps.able[agent, obstacle]:
                    continue
                for length, cell in maps.stands(gone, cells[place], obstacle):
                    there = (*cells[:place], cell, *cells[place + 1 :])
                    now = walked + length
                    deed = Deed(agent, obstacle, cell)
                    item = (now, gone | {obstacle}, there, (*deeds, deed))
                    if item[1:3] not in settled:
                        heapq.heappush(queue, (now + rest(there), next(counter), *item))
    return given, 0.0


def _by_turns(maps: _Maps) -> list[Deed]:
    """A list schedule: whoever could be beside an obstacle first goes there; of several obstacles
    the agent takes the one farthest from all others able to destroy it.
    """
    here, clock = {a: maps.start[a] for a in maps.agents}, dict.fromkeys(maps.agents, 0.0)
    gone: frozenset = frozenset()
    deeds: list[Deed] = []
    while gone != maps.chosen:
        options = []
        for agent in maps.agents:
            for obstacle in sorted(maps.chosen - gone):
                if maps.able[agent, obstacle]:
                    stands = maps.stands(gone, here[agent], obstacle)
                    if stands:
                        options.append((clock[agent] + stands[0][0], agent, obstacle, stands[0][1]))

        def others(option: tuple) -> float:
            times = [o[0] for o in options if o[2] == option[2] and o[1] != option[1]]  # noqa: B023
            return min(times, default=np.inf) - option[0]

        end, agent, obstacle, cell = max(options, key=lambda o: (others(o), -o[0], -o[1], -o[2]))
        here[agent], clock[agent] = cell, end
        gone |= {obstacle}
        deeds.append(Deed(agent, obstacle, cell))
    return deeds


def _earliest_end(maps: _Maps) -> float:
    """A time before which no plan for this set ends: each obstacle falls when the first agent able
    to destroy it could come beside it, even if that agent is elsewhere.
    """
    gone: frozenset = frozenset()
    now, ends = 0.0, dict.fromkeys(maps.goal, np.inf)
    while True:
        for agent, goal in maps.goal.items():
            length = float(maps.field(gone, maps.start[agent])[goal])
            ends[agent] = min(ends[agent], max(now, length) if gone else length)
        if gone == maps.chosen:
            return max([now, *ends.values()])
        times = [
            (stands[0][0], obstacle)
            for obstacle in sorted(maps.chosen - gone)
            for agent in maps.agents
            if maps.able[agent, obstacle]
            and (stands := maps.stands(gone, maps.start[agent], obstacle))
        ]
        first, obstacle = min(times)
        now = max(now, first)
        gone |= {obstacle}
