"""Tasks of a coalition on the host: one from arrays, many as one padded batch, and back."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from srt_jax.task import make_task, stack, unstack
from srt_jax.types import Array, Record, Task, record

NOWHERE = (-1, -1)
"""The goal of an agent that has none, and the start of an agent that only fills up the batch."""


@record
class CoalitionTask(Record):
    """One task of several agents on one map, or a batch of them padded to one shape.

    The collective smart relocation task that PY16 refers to (its [18]): some agents cannot reach
    their goals alone, but the agents destroy obstacles for each other. Agents do not block each
    other: collisions are not part of the task.

    Attributes:
      labels: int32 [..., L, H, W], as in `Task`.
      removal_cost: float32 [..., M], positive; what destroying obstacle i costs, whoever does it.
      able: bool [..., A, M], whether agent a can destroy obstacle i.
      start: int32 [..., A, 2], cells; (-1, -1) for an agent that is padding.
      goal: int32 [..., A, 2], cells; (-1, -1) for an agent without a goal, which only helps.
      size: int32 [..., 2], height and width before padding.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> task.able.tolist(), task.goal.tolist()
      ([[False], [True]], [[0, 6], [-1, -1]])
    """

    labels: Array
    removal_cost: Array
    able: Array
    start: Array
    goal: Array
    size: Array


class NamedCoalition(NamedTuple):
    """A task of a coalition with the name it goes by in tables, files and pictures."""

    name: str
    task: CoalitionTask


def make_coalition(
    free_or_labels: Array,
    start: Array | Sequence[Sequence[int]],
    goal: Array | Sequence[int] | Sequence[Sequence[int] | None],
    *,
    able: bool | Array | Sequence[bool | Collection[int]] = True,
    removal_cost: float | Array | Sequence[float] = 1.0,
) -> CoalitionTask:
    """Returns the task of a coalition on one map.

    Args:
      free_or_labels: bool [H, W], True where the agents fit, or integer labels [H, W] or
        [L, H, W], as in `make_task`.
      start: integer [A, 2], a cell for each agent; agents may share one.
      goal: one cell, which every agent has to reach (PY16 [18]); or a sequence of A, a cell for
        each agent or None for an agent that only helps.
      able: who can destroy what: True or False for all agents and obstacles; bool [A, M]; or a
        sequence of A, each True, False or a collection of obstacle ids.
      removal_cost: a number for all, or float [M]; positive and finite.

    Returns:
      CoalitionTask of NumPy arrays without batch dimensions.

    Raises:
      TypeError: a wrong dtype. ValueError: a wrong rank, length or range; the message names the
        agent.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> make_coalition(free, [(2, 0), (2, 6)], (0, 6)).goal.tolist()  # a shared goal
      [[0, 6], [0, 6]]
    """
    starts = _starts(start)
    goals = _goals(goal, len(starts))
    abilities = _abilities(able, len(starts))
    tasks = []
    for agent, (cell, end, ability) in enumerate(zip(starts, goals, abilities)):
        end = cell if end is None else end
        given = tasks[0].labels if tasks else free_or_labels
        try:
            tasks.append(
                make_task(given, cell, end, destroyable=ability, removal_cost=removal_cost)
            )
        except (TypeError, ValueError) as error:
            raise type(error)(f"agent {agent}: {error}") from None
    num_obstacles = max(len(task.destroyable) for task in tasks)
    unlike = next((i for i, one in enumerate(tasks) if len(one.destroyable) < num_obstacles), None)
    if unlike is not None:
        raise ValueError(
            f"agent {unlike}: able has {len(tasks[unlike].destroyable)} entries, but there are"
            f" {num_obstacles} obstacles: give every agent as many"
        )
    first = tasks[0]
    return CoalitionTask(
        labels=first.labels,
        removal_cost=first.removal_cost,
        able=np.stack([task.destroyable for task in tasks]),
        start=np.stack([task.start for task in tasks]),
        goal=np.stack(
            [
                np.array(NOWHERE, np.int32) if end is None else task.goal
                for end, task in zip(goals, tasks)
            ]
        ),
        size=first.size,
    )


def stack_coalitions(tasks: Sequence[CoalitionTask]) -> CoalitionTask:
    """Returns one batch of all `tasks`, in order, padded to the largest map and the most layers,
    obstacles and agents.

    Padding agents stand nowhere, have no goal and can destroy nothing.

    Raises:
      ValueError: no task at all, or one that already is a batch.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, stack_coalitions
      >>> free = np.ones((5, 7), bool)
      >>> pair = make_coalition(free, [(2, 0), (2, 6)], (0, 6))
      >>> batch = stack_coalitions([pair, make_coalition(free, [(0, 0)], (0, 6))])
      >>> batch.start.shape, batch.start[1].tolist()
      ((2, 2, 2), [[0, 0], [-1, -1]])
    """
    tasks = list(tasks)
    maps = stack([on_one_map(task) for task in tasks])
    num_agents = max(len(task.start) for task in tasks)
    able = np.zeros((len(tasks), num_agents, maps.removal_cost.shape[1]), bool)
    start = np.full((len(tasks), num_agents, 2), NOWHERE, np.int32)
    goal = start.copy()
    for index, task in enumerate(tasks):
        agents, obstacles = np.shape(task.able)
        able[index, :agents, :obstacles] = task.able
        start[index, :agents] = task.start
        goal[index, :agents] = task.goal
    return CoalitionTask(
        labels=maps.labels,
        removal_cost=maps.removal_cost,
        able=able,
        start=start,
        goal=goal,
        size=maps.size,
    )


def unstack_coalitions(batch: CoalitionTask) -> list[CoalitionTask]:
    """Returns the single tasks of a batch without their padding: the inverse of
    `stack_coalitions`.

    What looks like padding at the end goes, as in `unstack`; so do agents at the end that stand
    nowhere (one always stays).

    Raises:
      ValueError: `batch` has not exactly one batch dimension.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, stack_coalitions, unstack_coalitions
      >>> free = np.ones((5, 7), bool)
      >>> pair = make_coalition(free, [(2, 0), (2, 6)], (0, 6))
      >>> lone = make_coalition(free, [(0, 0)], (0, 6))
      >>> [len(one.start) for one in unstack_coalitions(stack_coalitions([pair, lone]))]
      [2, 1]
    """
    able, start, goal = (np.asarray(leaf) for leaf in (batch.able, batch.start, batch.goal))
    maps = Task(
        labels=batch.labels,
        destroyable=able.any(axis=-2),
        removal_cost=batch.removal_cost,
        start=start[..., 0, :],
        goal=goal[..., 0, :],
        size=batch.size,
    )
    singles = []
    for index, one in enumerate(unstack(maps)):
        is_there = (start[index] != NOWHERE).any(axis=-1)
        num_agents = max(1, *(np.flatnonzero(is_there)[-1:] + 1).tolist())
        singles.append(
            CoalitionTask(
                labels=one.labels,
                removal_cost=one.removal_cost,
                able=able[index, :num_agents, : len(one.removal_cost)].copy(),
                start=start[index, :num_agents].copy(),
                goal=goal[index, :num_agents].copy(),
                size=one.size,
            )
        )
    return singles


def on_one_map(task: CoalitionTask, agent: int = 0) -> Task:
    """Returns the map of a coalition's task as the task of one agent: what any of the agents can
    destroy is destroyable; the goal is the start where the agent has none.
    """
    goal, start = np.asarray(task.goal)[..., agent, :], np.asarray(task.start)[..., agent, :]
    return Task(
        labels=task.labels,
        destroyable=np.asarray(task.able).any(axis=-2),
        removal_cost=task.removal_cost,
        start=start,
        goal=np.where((goal == NOWHERE).all(axis=-1, keepdims=True), start, goal),
        size=task.size,
    )


def _starts(start: object) -> list:
    starts = list(np.asarray(start)) if isinstance(start, np.ndarray) else list(start)  # pyright: ignore
    if not starts or np.ndim(starts[0]) != 1:
        raise ValueError(
            "start must hold a cell (row, col) for each agent, such as [(0, 0), (4, 6)]:"
            f" got {start!r}"
        )
    return starts


def _goals(goal: object, num_agents: int) -> list:
    goals = list(goal)  # pyright: ignore
    if len(goals) == 2 and all(np.ndim(value) == 0 and value is not None for value in goals):
        return [goals] * num_agents  # one cell: shared
    if len(goals) != num_agents:
        raise ValueError(
            f"goal has {len(goals)} entries, but there are {num_agents} agents: give one cell for"
            " all, or a cell or None for each agent"
        )
    return [None if cell is None or (np.asarray(cell) == NOWHERE).all() else cell for cell in goals]


def _abilities(able: object, num_agents: int) -> list:
    if isinstance(able, bool | np.bool_):
        return [bool(able)] * num_agents
    abilities = list(able)  # pyright: ignore
    if len(abilities) != num_agents:
        raise ValueError(
            f"able has {len(abilities)} entries, but there are {num_agents} agents: give True,"
            " False or the ids of obstacles for each agent"
        )
    return abilities
