"""Lanes and their queue: a lane that is done with its task writes the plan down and takes the next
task from the queue.

So no lane rides along idle while others need more steps, and a task that wanders holds up nobody
but itself. All of it is scalar work inside the one compiled loop, about a microsecond a task.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import lax


class Queue(NamedTuple):
    """The tasks, one after the other: what a lane needs of each. Q tasks, of which the first
    `count` count.
    """

    count: jax.Array  # int32
    start: jax.Array  # uint32 [Q, W]
    goal: jax.Array  # uint32 [Q, W]
    parts: tuple[jax.Array, ...]  # uint32 [Q, F, S] each, the tables made from the start


class Lanes(NamedTuple):
    """What each of B lanes is at. `task` -1: idle. A finished lane waits to be emptied and
    filled again.
    """

    clock: jax.Array  # int32, steps taken by all
    waiting: jax.Array  # int32, the first task of the queue that no lane has taken
    task: jax.Array  # int32 [B]
    age: jax.Array  # int32 [B], steps taken for the task
    finished: jax.Array  # bool [B]
    solved: jax.Array  # bool [B]
    start: jax.Array  # uint32 [W, B]
    parts: tuple[jax.Array, ...]  # uint32 [F, S, B] each
    situations: jax.Array  # uint32 [W, K, B]
    alive: jax.Array  # bool [K, B]
    seen: jax.Array  # uint32 [memory, B], hashes of what was kept in earlier steps
    # int32 [steps, K, B], action << 8 | parent, of the step at `clock` in row clock % steps
    trail: jax.Array


class Answers(NamedTuple):
    """One row a task, and a last one for what is nobody's."""

    length: jax.Array  # int32 [Q + 1], -1 where no plan was found
    plan: jax.Array  # int32 [Q + 1, steps], actions in the order of execution, -1 after the last


def empty(
    queue: Queue, *, num_lanes: int, beam: int, steps: int, memory: int
) -> tuple[Lanes, Answers]:
    """Returns lanes that all wait for a task, and answers yet to be given."""
    size, num_words = queue.start.shape
    lanes = Lanes(
        clock=jnp.int32(0),
        waiting=jnp.int32(0),
        task=jnp.full(num_lanes, -1, jnp.int32),
        age=jnp.zeros(num_lanes, jnp.int32),
        finished=jnp.ones(num_lanes, bool),
        solved=jnp.zeros(num_lanes, bool),
        start=jnp.zeros((num_words, num_lanes), jnp.uint32),
        parts=tuple(jnp.zeros((*part.shape[1:], num_lanes), jnp.uint32) for part in queue.parts),
        situations=jnp.zeros((num_words, beam, num_lanes), jnp.uint32),
        alive=jnp.zeros((beam, num_lanes), bool),
        seen=jnp.zeros((memory, num_lanes), jnp.uint32),
        trail=jnp.zeros((steps, beam, num_lanes), jnp.int32),
    )
    return lanes, Answers(
        jnp.full(size + 1, -1, jnp.int32), jnp.full((size + 1, steps), -1, jnp.int32)
    )


def turn_over(queue: Queue, lanes: Lanes, answers: Answers) -> tuple[Lanes, Answers]:
    """Empties every finished lane into the answers and fills it from the queue, as long as there
    is something in it.
    """

    def one_lane(state: tuple[Lanes, Answers]) -> tuple[Lanes, Answers]:
        lanes, answers = state
        numbers = jnp.arange(lanes.task.shape[0], dtype=jnp.int32)
        lane = jnp.where(lanes.finished, numbers, jnp.int32(numbers.shape[0])).min()
        return _filled(queue, lanes, lane), _written(lanes, answers, lane)

    return lax.while_loop(lambda state: state[0].finished.any(), one_lane, (lanes, answers))


def _written(lanes: Lanes, answers: Answers, lane: jax.Array) -> Answers:
    """The action chosen last is the first to execute: walking the trail back gives the plan in
    the order of execution.
    """
    task, solved, age = (
        lax.dynamic_index_in_dim(x, lane, keepdims=False)
        for x in (lanes.task, lanes.solved, lanes.age)
    )
    row = jnp.where(task < 0, jnp.int32(answers.length.shape[0] - 1), task)
    steps = lanes.trail.shape[0]

    def back(state):
        number, at, plan = state
        place = jnp.remainder(lanes.clock - 1 - number, jnp.int32(steps))
        entry = lax.dynamic_slice(lanes.trail, (place, at, lane), (1, 1, 1))
        plan = lax.dynamic_update_slice(plan, entry[0] >> 8, (row, number))
        return number + 1, entry[0, 0, 0] & 255, plan

    length = jnp.where(solved, age, 0)
    _, _, plan = lax.while_loop(
        lambda s: s[0] < length, back, (jnp.int32(0), jnp.int32(0), answers.plan)
    )
    told = jnp.where(solved, age, -1)[None]
    return Answers(lax.dynamic_update_slice(answers.length, told, (row,)), plan)


def _filled(queue: Queue, lanes: Lanes, lane: jax.Array) -> Lanes:
    """The lane with the next task of the queue in it, or idle where there is none. A goal that
    holds is finished at once.
    """
    is_some = lanes.waiting < queue.count
    source = jnp.minimum(lanes.waiting, queue.start.shape[0] - 1)

    def of(rows: jax.Array) -> jax.Array:
        return jnp.moveaxis(lax.dynamic_slice_in_dim(rows, source, 1), 0, -1)

    def put(whole: jax.Array, column: jax.Array) -> jax.Array:
        return lax.dynamic_update_slice_in_dim(whole, column, lane, whole.ndim - 1)

    start, goal = of(queue.start), of(queue.goal)
    beam, memory = lanes.alive.shape[0], lanes.seen.shape[0]
    is_done = is_some & ((goal & ~start) == 0).all()
    return lanes._replace(
        waiting=lanes.waiting + is_some.astype(jnp.int32),
        task=put(lanes.task, jnp.where(is_some, source, -1)[None]),
        age=put(lanes.age, jnp.zeros(1, jnp.int32)),
        finished=put(lanes.finished, is_done[None]),
        solved=put(lanes.solved, is_done[None]),
        start=put(lanes.start, start),
        parts=tuple(put(whole, of(rows)) for whole, rows in zip(lanes.parts, queue.parts)),
        situations=put(lanes.situations, jnp.broadcast_to(goal[:, None], (goal.shape[0], beam, 1))),
        alive=put(lanes.alive, (jnp.arange(beam)[:, None] == 0) & is_some & ~is_done),
        seen=put(lanes.seen, jnp.zeros((memory, 1), jnp.uint32)),
    )
