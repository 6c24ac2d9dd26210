"""A solved task of a coalition as a scene of the coalition's domain, which any planner can check,
its plan in the words of that domain, and the messages in it.
"""

from typing import Any, NamedTuple

import numpy as np

from sign_model.relocation.messages import (
    COALITION_DOMAIN,
    CoalitionScene,
    area_name,
    coalition_problem,
    coalition_signs,
    coalition_task,
)
from sign_model.signs.world_model import WorldModel

__all__ = [
    "Message",
    "coalition_lines",
    "coalition_messages",
    "coalition_scene",
    "coalition_texts",
    "planned_by_map",
    "signs_of",
]


class Message(NamedTuple):
    """What one agent says to another about an obstacle: "ask" for it, or "tell" that it is gone."""

    act: str
    speaker: int
    listener: int
    obstacle: int


def coalition_scene(task: Any, solution: Any) -> CoalitionScene:
    """Returns what one solved task of a coalition comes down to on the symbolic level.

    Each agent's chain are the obstacles that its route passes, in order; what it destroys it comes
    beside in the area that it is in there.
    """
    able = np.asarray(task.able)
    agents = np.flatnonzero(np.asarray(solution.num_cells) > 0).tolist()
    ids = _destroyed(solution)
    needed, by, at = (
        np.asarray(array)
        for array in (solution.needed, solution.destroyed_by, solution.destroyed_at)
    )
    chains, beside, abilities = {}, {}, {}
    for agent in agents:
        passed = _passed(needed[agent], len(ids))
        chain = tuple(_obstacle(ids[k]) for _, k in passed)
        moves = int(solution.num_cells[agent]) > 1
        chains[_agent(agent)] = chain or ((None,) if moves else ())
        # of the obstacles passed those before the place count
        beside[_agent(agent)] = tuple(
            (_obstacle(ids[k]), sum(index < at[k] for index, _ in passed))
            for k in range(len(ids))
            if by[k] == agent
        )
        abilities[_agent(agent)] = tuple(_obstacle(i) for i in ids if able[agent, i])
    goals = [_agent(a) for a in agents if (np.asarray(task.goal)[a] >= 0).all()]
    return CoalitionScene(chains, beside, abilities, tuple(goals))


def coalition_texts(task: Any, solution: Any, name: str = "scene") -> tuple[str, str]:
    """Returns domain and problem in PDDL: plain typed STRIPS.

    Args:
      task, solution: one task and its answer, solved.
      name: of the problem.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import coalition_texts, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> domain, problem = coalition_texts(task, solve_coalition(task))
      >>> domain.splitlines()[0], problem.splitlines()[0]
      ('(define (domain coalition-relocation)', '(define (problem scene)')
    """
    return COALITION_DOMAIN, coalition_problem(coalition_scene(task, solution), name)


def coalition_lines(task: Any, solution: Any) -> list[str]:
    """Returns the plan of one solved task as actions of its scene, messages included.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import coalition_lines, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> for line in coalition_lines(task, solve_coalition(task)):
      ...     print(line)
      (ask agent-0 agent-1 obstacle-0)
      (approach agent-1 obstacle-0 agent-1-area-0)
      (destroy agent-1 obstacle-0 agent-1-area-0)
      (tell agent-1 agent-0 obstacle-0)
      (pass agent-0 agent-0-area-0 agent-0-area-1 obstacle-0)
    """
    lines, _ = _plan(task, solution)
    return lines


def coalition_messages(task: Any, solution: Any) -> list[Message]:
    """Returns who asks whom for what, and who tells whom what is done, in the order of the plan:
    tuples (act, speaker, listener, obstacle) with the fields of these names.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import coalition_messages, make_coalition, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> [tuple(message) for message in coalition_messages(task, solve_coalition(task))]
      [('ask', 0, 1, 0), ('tell', 1, 0, 0)]
    """
    _, messages = _plan(task, solution)
    return messages


def planned_by_map(task: Any, solution: Any, *, max_expansions: int = 100_000) -> list[str]:
    """Returns the plan that MAP finds for the scene of one solved task; empty where it finds none
    in the budget, or nothing is to do.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, planned_by_map, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> plan = planned_by_map(task, solve_coalition(task))
      >>> len(plan), plan[0]
      (5, '(ask agent-0 agent-1 obstacle-0)')
    """
    from sign_model.plan_task import plan

    result = plan(
        coalition_task(coalition_scene(task, solution)),
        planner="map",
        max_expansions=max_expansions,
    )
    return list(result.actions or ())


def signs_of(task: Any, solution: Any, agent: int) -> WorldModel:
    """Returns what one agent knows as signs: "i", "they", and the messages of the plan.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import make_coalition, signs_of, solve_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> model = signs_of(task, solve_coalition(task), agent=1)
      >>> [name for name in ("i", "they", "(asked agent-1 obstacle-0)") if name in model.names]
      ['i', 'they', '(asked agent-1 obstacle-0)']
    """
    messages = tuple(
        (m.act, _agent(m.speaker), _agent(m.listener), _obstacle(m.obstacle))
        for m in coalition_messages(task, solution)
    )
    return coalition_signs(coalition_scene(task, solution), _agent(agent), messages)


def _plan(task: Any, solution: Any) -> tuple[list[str], list[Message]]:
    scene = coalition_scene(task, solution)
    ids = _destroyed(solution)
    by, at = np.asarray(solution.destroyed_by), np.asarray(solution.destroyed_at)
    needed = np.asarray(solution.needed)
    agents = np.flatnonzero(np.asarray(solution.num_cells) > 0).tolist()
    here = dict.fromkeys(agents, 0)
    lines, messages = [], []

    def walk(agent: int, until: int) -> None:
        # over the obstacles passed before that index of the route
        for index, k in _passed(needed[agent], len(ids))[here[agent] :]:
            if index >= until:
                break
            one, other = (area_name(_agent(agent), here[agent] + step) for step in (0, 1))
            lines.append(f"(pass {_agent(agent)} {one} {other} {_obstacle(ids[k])})")
            here[agent] += 1

    for k, obstacle in enumerate(ids):
        helper, name = int(by[k]), _agent(int(by[k]))
        others = [a for a in agents if needed[a, k] >= 0 and a != helper]
        is_own = needed[helper, k] >= 0
        for agent in others if not is_own else []:
            messages.append(Message("ask", agent, helper, obstacle))
            lines.append(f"(ask {_agent(agent)} {name} {_obstacle(obstacle)})")
        walk(helper, int(at[k]))
        area = area_name(name, here[helper])
        lines.append(f"(approach {name} {_obstacle(obstacle)} {area})")
        lines.append(f"(destroy {name} {_obstacle(obstacle)} {area})")
        for agent in others:
            messages.append(Message("tell", helper, agent, obstacle))
            lines.append(f"(tell {name} {_agent(agent)} {_obstacle(obstacle)})")
    for agent in agents:
        walk(agent, 2**31 - 1)
        if scene.chains[_agent(agent)] == (None,) and _agent(agent) in scene.goals:
            one, other = (area_name(_agent(agent), step) for step in (0, 1))
            lines.append(f"(relocate {_agent(agent)} {one} {other})")
    return lines, messages


def _passed(needed: np.ndarray, number: int) -> list[tuple[int, int]]:
    """The obstacles that a route passes: (index, place in the list), in order."""
    return sorted((int(needed[k]), k) for k in range(number) if needed[k] >= 0)


def _destroyed(solution: Any) -> list[int]:
    return np.asarray(solution.destroyed)[: int(solution.num_destroyed)].tolist()


def _agent(number: int) -> str:
    return f"agent-{number}"


def _obstacle(number: int) -> str:
    return f"obstacle-{number}"
