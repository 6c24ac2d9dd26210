"""What an answer means, in words and as plain data: who helps whom, in which order, and why it is
the least.
"""

from typing import Any

import numpy as np

from sign_model.foundation.legible import finite_or_none
from srt_jax.coalition.task import CoalitionTask
from srt_jax.coalition.types import CoalitionSolution, Help
from srt_jax.symbols.scene_of_coalition import Message, coalition_messages
from srt_jax.types import Status


def help_edges(solution: CoalitionSolution) -> list[tuple[int, int, int]]:
    """Returns who helps whom: (helper, agent, obstacle), in the order of the plan.

    The helper destroys the obstacle, and the agent's route meets it.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import help_edges, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> help_edges(solve_coalition(task))
      [(1, 0, 0)]
    """
    by, needed = np.asarray(solution.destroyed_by), np.asarray(solution.needed)
    ids = np.asarray(solution.destroyed).tolist()
    return [
        (int(by[k]), agent, ids[k])
        for k in range(int(solution.num_destroyed) if _is_solved(solution) else 0)
        for agent in np.flatnonzero(needed[:, k] >= 0).tolist()
        if agent != by[k]
    ]


def explain_coalition(task: CoalitionTask, solution: CoalitionSolution) -> str:
    """Returns one answer in words: what each agent needs, who destroys what from where and after
    what, the messages, the routes, and the proof.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import explain_coalition, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> print(explain_coalition(task, solve_coalition(task)))
      Every agent with a goal reaches it after 1 obstacle is destroyed.
      Agent 0 reaches its goal after others have destroyed something for it.
      Agent 1 has no goal, and may help the others.
      Step 1: agent 1 destroys obstacle 0 from (2, 4); it does so for agent 0.
      0 to 1: please destroy obstacle 0.
      1 to 0: I have destroyed obstacle 0 from (2, 4).
      Agent 0 walks 6.83 cell sides to its goal.
      Agent 1 walks 2.00 cell sides and stays at (2, 4).
      The total removal cost is 1; no set of obstacles that suffices costs less.
    """
    if np.ndim(solution.status):
        raise ValueError("explain_coalition takes one task and its answer, not a batch")
    status = Status(int(solution.status))
    number = int(solution.num_destroyed)
    lines = [_headline(status, number)]
    agents = [a for a, cell in enumerate(np.asarray(task.start).tolist()) if min(cell) >= 0]
    for agent in agents:
        lines.append(f"Agent {agent} {Help(int(solution.help[agent])).meaning}.")
    if status.is_solved:
        lines += _steps(solution)
        lines += [in_words(message, solution) for message in coalition_messages(task, solution)]
        lines += [_walk(task, solution, agent) for agent in agents]
        lines.append(_proof(solution))
    elif status in (Status.UNSOLVABLE, Status.GOAL_BLOCKED):
        standing = np.flatnonzero(np.asarray(solution.firm)).tolist()
        covers = [i for i in standing if (np.asarray(task.labels) == i).any()]
        lines.append(
            f"Whatever the agents do, {_named(covers)} cannot be destroyed: with everything else"
            " gone, no agent able to destroy one of these comes beside it."
        )
    return "\n".join(lines)


def in_words(message: Message, solution: CoalitionSolution) -> str:
    """Returns a message as one agent says it to another."""
    if message.act == "ask":
        return (
            f"{message.speaker} to {message.listener}: please destroy obstacle {message.obstacle}."
        )
    place = np.asarray(solution.destroyed).tolist().index(message.obstacle)
    cell = _cell_of(solution, place)
    return (
        f"{message.speaker} to {message.listener}: I have destroyed obstacle {message.obstacle}"
        f" from {cell}."
    )


def coalition_record(name: str, task: CoalitionTask, solution: CoalitionSolution) -> dict[str, Any]:
    """Returns one answer as JSON types: what `srt-jax solve --json` prints for it.

    `destroyed` holds a record for each obstacle: its id, the agent, the cell, the index into that
    agent's route, and the ids that have to be gone before; `agents` one for each agent.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import coalition_record, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> record = coalition_record("wall", task, solve_coalition(task))
      >>> record["destroyed"]
      [{'obstacle': 0, 'agent': 1, 'cell': [2, 4], 'index': 2, 'after': []}]
      >>> record["helps"], [agent["help"] for agent in record["agents"]]
      ([{'helper': 1, 'agent': 0, 'obstacle': 0}], ['WITH_HELP', 'HELPER'])
    """
    is_solved = _is_solved(solution)
    number = int(solution.num_destroyed) if is_solved else 0
    ids = np.asarray(solution.destroyed)[:number].tolist()
    after, goals = np.asarray(solution.after), np.asarray(task.goal)
    steps = [
        {
            "obstacle": ids[k],
            "agent": int(solution.destroyed_by[k]),
            "cell": list(_cell_of(solution, k)),
            "index": int(solution.destroyed_at[k]),
            "after": [ids[j] for j in np.flatnonzero(after[k, :number]).tolist()],
        }
        for k in range(number)
    ]
    agents = []
    for agent, cell in enumerate(np.asarray(task.start).tolist()):
        count = int(solution.num_cells[agent]) if is_solved else 0
        agents.append(
            {
                "start": cell,
                "goal": goals[agent].tolist() if goals[agent][0] >= 0 else None,
                "help": Help(int(solution.help[agent])).name,
                "cells": np.asarray(solution.cells)[agent, :count].tolist(),
                "cost": finite_or_none(solution.cost[agent]),
                "finish": finite_or_none(solution.finish[agent]),
            }
        )
    edges = help_edges(solution)
    return {
        "name": name,
        "status": Status(int(solution.status)).name,
        "removal_cost": finite_or_none(solution.removal_cost),
        "removal_bound": finite_or_none(solution.removal_bound),
        "destroyed": steps,
        "agents": agents,
        "helps": [{"helper": h, "agent": a, "obstacle": o} for h, a, o in edges],
        "makespan": finite_or_none(np.max(np.asarray(solution.finish))),
        "firm": np.flatnonzero(np.asarray(solution.firm)).tolist(),
        "explanation": explain_coalition(task, solution),
    }


def _is_solved(solution: CoalitionSolution) -> bool:
    return Status(int(solution.status)).is_solved


def _headline(status: Status, number: int) -> str:
    if status is Status.PATH_EXISTS:
        return "Every agent with a goal reaches it, and nothing has to be destroyed."
    if status is Status.SOLVED:
        what = "1 obstacle is" if number == 1 else f"{number} obstacles are"
        return f"Every agent with a goal reaches it after {what} destroyed."
    if status is Status.UNSOLVABLE:
        return "Some agent cannot reach its goal, whatever the agents destroy."
    return f"There is no plan: {status.meaning}."


def _steps(solution: CoalitionSolution) -> list[str]:
    number = int(solution.num_destroyed)
    ids, after = np.asarray(solution.destroyed).tolist(), np.asarray(solution.after)
    edges, lines = help_edges(solution), []
    for k in range(number):
        waits = [ids[j] for j in np.flatnonzero(after[k, :number]).tolist()]
        helped = [agent for _, agent, obstacle in edges if obstacle == ids[k]]
        lines.append(
            f"Step {k + 1}: agent {int(solution.destroyed_by[k])} destroys obstacle {ids[k]} from"
            f" {_cell_of(solution, k)}"
            + (f", after {_named(waits)} is gone" if len(waits) == 1 else "")
            + (f", after {_named(waits)} are gone" if len(waits) > 1 else "")
            + (f"; it does so for {_named(helped, 'agent')}." if helped else ".")
        )
    return lines


def _walk(task: CoalitionTask, solution: CoalitionSolution, agent: int) -> str:
    count, cost = int(solution.num_cells[agent]), float(solution.cost[agent])
    if not count:
        return f"Agent {agent} does nothing."
    last = tuple(np.asarray(solution.cells)[agent, count - 1].tolist())
    has_goal = np.asarray(task.goal)[agent, 0] >= 0
    end = "to its goal" if has_goal else f"and stays at {last}"
    late = float(solution.finish[agent]) - cost
    waits = f", and waits {late:.2f} on the way" if late > 1e-3 * max(1.0, cost) else ""
    return f"Agent {agent} walks {cost:.2f} cell sides {end}{waits}."


def _proof(solution: CoalitionSolution) -> str:
    cost, bound = float(solution.removal_cost), float(solution.removal_bound)
    if cost == bound:
        return f"The total removal cost is {cost:g}; no set of obstacles that suffices costs less."
    return f"The total removal cost is {cost:g}; every set that suffices costs at least {bound:g}."


def _cell_of(solution: CoalitionSolution, place: int) -> tuple[int, int]:
    agent, index = int(solution.destroyed_by[place]), int(solution.destroyed_at[place])
    row, col = np.asarray(solution.cells)[agent, index].tolist()
    return row, col


def _named(ids: list[int], what: str = "obstacle") -> str:
    if len(ids) == 1:
        return f"{what} {ids[0]}"
    return f"{what}s {', '.join(map(str, ids[:-1]))} and {ids[-1]}" if ids else "nothing"
