"""What the grid level reports becomes a situation of signs, and MAP's plans become acts on
obstacles (PY16 §3).

Working memory has slots, obstacles have ids: this module fills the slots and reads them back.
Everything runs inside jit.
"""

import functools
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import compiled_whole
from sign_model.map_algorithm.heuristics import OVERLAP
from sign_model.map_algorithm.map_planner import plan_map
from sign_model.relocation.domain import AGENT
from sign_model.relocation.map_in_jit import plan_situations
from sign_model.relocation.working_memory import (
    BREAKABLE,
    INDESTRUCTIBLE,
    WorkingMemory,
    area,
    chain_memory,
    contour_memory,
    slot,
)
from srt_jax.types import Act, Array

ATTENDED = 8
"""Obstacles of one contour that are attended to at a time: those that can be destroyed, nearest the
goal first.
"""

_STEPS_PER_OBSTACLE = 3
"""Approach, destroy, pass."""

_MOST_TABLED = 16
"""Slots of a chain for which plans are made beforehand: 0.4 s of planning for 16, 6 s for 32."""

_MOST_EXPANSIONS = 100_000  # far more than a chain takes

_STEPS_ON_CONTOUR = 4  # one more than the longest plan there: approach, destroy, pass


class Acts(NamedTuple):
    """A plan: act int32 [B, P], an `Act`, slot int32 [B, P]; -1 where there is none. is_proof bool
    [B]: there is no plan.
    """

    act: Array
    slot: Array
    is_proof: Array


def plan_on_contour(is_filled: Array, is_breakable: Array) -> Acts:
    """Returns how to get past one contour, MAP's plan over the obstacles on it: approach, destroy,
    pass.

    Each obstacle is taken to be all that blocks; of those that I can destroy the first slot wins.

    Args:
      is_filled: bool [B, S], which slots hold an obstacle.
      is_breakable: bool [B, S], the kind of each.
    """
    attention = contour_memory(is_filled.shape[1])

    def run(is_filled: Array, is_breakable: Array) -> Acts:
        start = _start(attention, is_filled, is_breakable)
        goal = jnp.asarray(attention.situation(("at", AGENT, area(1))))
        return _plan_acts(
            attention, start, jnp.broadcast_to(goal[:, None], start.shape), _STEPS_ON_CONTOUR
        )

    return compiled_whole(run)(is_filled, is_breakable)


def plan_along_chain(num_obstacles: Array, is_here: Array, *, num_slots: int) -> Acts:
    """Returns how to get through a chain of obstacles one after the other; a relocation where there
    is none.

    A chain differs from another in nothing but its length, so MAP plans each length once, before
    the call is compiled, and the plans are read from a table. Beyond `_MOST_TABLED` slots it plans
    inside the call: it then takes longer to plan every length than to compile the planner.

    Args:
      num_obstacles: int32 [B], 0 to `num_slots`; a task with more has no plan.
      is_here: bool [B], whether the agent is in the goal area already.
    """
    if num_slots > _MOST_TABLED:
        return chain_in_jit(num_obstacles, is_here, num_slots=num_slots)
    acts, slots = _chain_table(num_slots)
    has_plan = ~is_here & (num_obstacles >= 0) & (num_obstacles <= num_slots)
    row = jnp.where(has_plan, num_obstacles, num_slots + 1)
    return Acts(jnp.asarray(acts)[row], jnp.asarray(slots)[row], jnp.zeros_like(is_here))


@functools.cache
def _chain_table(num_slots: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns MAP's plans for the chains of 0, 1, ... `num_slots` obstacles: acts and slots, int32
    [num_slots + 2, P], -1 after the last; the last row is empty.
    """
    attention = chain_memory(num_slots)
    features = attention.space.features
    shape = (num_slots + 2, _STEPS_PER_OBSTACLE * num_slots + 1)
    acts, slots = np.full(shape, -1, np.int32), np.full(shape, -1, np.int32)
    for length in range(num_slots + 1):
        # The situation: the agent before the chain, and what is known of its obstacles.
        start = [("at", AGENT, area(0))] + [("way", area(0), area(1))] * (length == 0)
        for name in map(slot, range(length)):
            about = np.flatnonzero(attention.about(name, except_for="of-kind"))
            start += [*(features[number] for number in about), ("of-kind", name, BREAKABLE)]
        task = attention.task_of(start, [("at", AGENT, area(max(1, length)))])
        plan = plan_map(task, [OVERLAP], max_expansions=_MOST_EXPANSIONS).plan
        assert plan is not None and len(plan) <= shape[1], (length, plan)
        actions = [task.actions[number] for number in plan]
        acts[length, : len(plan)] = [_act(action) for action in actions]
        slots[length, : len(plan)] = [_slot(action) for action in actions]
    return acts, slots


def chain_in_jit(num_obstacles: Array, is_here: Array, *, num_slots: int) -> Acts:
    """Returns `plan_along_chain`, planned by MAP inside the call."""
    attention = chain_memory(num_slots)
    is_open = attention.situation(("way", area(0), area(1)))
    goals = np.stack(
        [attention.situation(("at", AGENT, area(number))) for number in range(num_slots + 1)],
        axis=1,
    )

    def run(num_obstacles: Array, is_here: Array) -> Acts:
        is_filled = jnp.arange(num_slots, dtype=jnp.int32)[None] < num_obstacles[:, None]
        start = _start(attention, is_filled, is_filled) | (
            jnp.asarray(is_open)[:, None] & (num_obstacles == 0)[None]
        )
        last = jnp.where(is_here, 0, num_obstacles.clip(1))
        is_last = jnp.arange(num_slots + 1, dtype=jnp.int32)[:, None] == last[None]
        goal = (jnp.asarray(goals)[:, :, None] & is_last[None]).any(axis=1)
        # A task with too many obstacles has its goal beyond all areas. The goal situation is then
        # empty, so nothing is planned.
        return _plan_acts(attention, start, goal, _STEPS_PER_OBSTACLE * num_slots + 1)

    return compiled_whole(run)(num_obstacles, is_here)


@functools.cache
def first_act() -> Act:
    """Returns what MAP plans before anything is known to block, when the way to the goal area is
    taken to be open.
    """
    attention = contour_memory(1)
    task = attention.task_of(
        [("at", AGENT, area(0)), ("way", area(0), area(1))], [("at", AGENT, area(1))]
    )
    plan = plan_map(task, [OVERLAP], max_expansions=100).plan
    assert plan is not None and len(plan) == 1, plan
    return _act(task.actions[plan[0]])


def _start(attention: WorkingMemory, is_filled: Array, is_breakable: Array) -> Array:
    """Returns the situation at the start, bool [F, B]: the agent in area 0, and what is known of
    the obstacles in the slots.
    """
    slots = [slot(number) for number in range(attention.num_slots)]
    place = np.stack([attention.about(name, except_for="of-kind") for name in slots], axis=1)
    kinds = [
        np.stack([attention.situation(("of-kind", name, kind)) for name in slots], axis=1)
        for kind in (BREAKABLE, INDESTRUCTIBLE)
    ]
    always = attention.situation(("at", AGENT, area(0))) | attention.abilities

    def hold_for(facts: np.ndarray, of: Array) -> Array:
        """The facts of those slots that are in `of`: bool [F, S] and [B, S] -> [F, B]."""
        return (jnp.asarray(facts)[:, :, None] & of.T[None]).any(axis=1)

    known = (
        hold_for(place, is_filled)
        | hold_for(kinds[0], is_filled & is_breakable)
        | hold_for(kinds[1], is_filled & ~is_breakable)
    )
    return known | jnp.asarray(always)[:, None]


def _plan_acts(attention: WorkingMemory, start: Array, goal: Array, max_steps: int) -> Acts:
    plans = plan_situations(attention, start, goal, max_steps=max_steps)
    act_of = np.array([*map(_act, attention.actions), -1], np.int32)  # the last for -1, no action
    slot_of = np.array([*(_slot(action) for action in attention.actions), -1], np.int32)
    return Acts(
        jnp.asarray(act_of)[plans.actions.T], jnp.asarray(slot_of)[plans.actions.T], plans.is_proof
    )


def _act(action: tuple[str, ...]) -> Act:
    return Act[action[0].upper()]


def _slot(action: tuple[str, ...]) -> int:
    """Returns the slot of the obstacle that an action is about, -1 where it is about none."""
    return next(
        (int(name.removeprefix(slot(""))) for name in action if name.startswith(slot(""))), -1
    )
