"""Random STRIPS tasks, and breadth-first search on sets: the slow, obvious twin of every planner
here.
"""

from collections import deque

import numpy as np

from sign_model.pddl.planning_task import PlanningTask, task_from_arrays


def random_task(seed: int, max_features: int = 12, max_actions: int = 10) -> PlanningTask:
    """A task of 1 to 12 features and 0 to 10 actions with few conditions and effects: about half
    of them can be solved.
    """
    rng = np.random.default_rng(seed)
    num_features, num_actions = (
        int(rng.integers(1, max_features + 1)),
        int(rng.integers(0, max_actions + 1)),
    )

    def few(most: int) -> np.ndarray:
        rows = np.zeros((num_actions, num_features), bool)
        for row in rows:
            row[rng.integers(0, num_features, rng.integers(0, most + 1))] = True
        return rows

    start = rng.random(num_features) < 0.3
    goal = np.zeros(num_features, bool)
    goal[rng.integers(0, num_features, rng.integers(1, 4))] = True
    return task_from_arrays(few(3), few(2), few(3), start, goal)


def shortest_length(task: PlanningTask) -> int | None:
    """The length of a shortest plan by breadth-first search over sets of features; None where
    there is none.
    """
    conditions, adds, deletes = (
        [frozenset(np.flatnonzero(row)) for row in m]
        for m in (task.conditions, task.adds, task.deletes)
    )
    start, goal = frozenset(np.flatnonzero(task.start)), frozenset(np.flatnonzero(task.goal))
    queue, seen = deque([(start, 0)]), {start}
    while queue:
        state, length = queue.popleft()
        if goal <= state:
            return length
        for needs, gives, takes in zip(conditions, adds, deletes):
            after = (state - takes) | gives
            if needs <= state and after not in seen:
                seen.add(after)
                queue.append((after, length + 1))
    return None


def reachable_states(task: PlanningTask) -> np.ndarray:
    """All reachable states, bool [N, F]."""
    states, waiting = {task.start.tobytes(): task.start}, [task.start]
    while waiting:
        state = waiting.pop()
        for needs, gives, takes in zip(task.conditions, task.adds, task.deletes):
            after = (state & ~takes) | gives
            if not (needs & ~state).any() and after.tobytes() not in states:
                states[after.tobytes()] = after
                waiting.append(after)
    return np.array(list(states.values()))
