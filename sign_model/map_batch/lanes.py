"""The slots of a batch and their queue: a slot whose task is finished writes the plan down and
takes the next task from the queue.

A slot (`lanes` counts them) is one place of the batch axis: it holds the search for one task at a
time. So no slot idles while others need more steps, and a task that takes long delays no other. All
of this is scalar work inside the one compiled loop, about a microsecond per task.

Q tasks in the queue, B slots, K situations in the beam, W words of features, F features, S words of
a row of the tables made from a start.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.foundation.records import Array


class Queue(NamedTuple):
    """The tasks in order: what a slot needs of each. Only the first `count` of the Q rows are
    tasks, the rest is padding.
    """

    count: Array  # int32 []
    start: Array  # uint32 [Q, W]
    goal: Array  # uint32 [Q, W]
    start_tables: tuple[Array, ...]  # uint32 [Q, F, S] each


class Slots(NamedTuple):
    """The state of the B slots. `task` is -1 where a slot is idle. A finished slot waits until its
    answer is written and its next task loaded.
    """

    clock: Array  # int32 [], steps taken by all
    waiting: Array  # int32 [], the first task of the queue that no slot has taken
    task: Array  # int32 [B], number in the queue
    age: Array  # int32 [B], steps taken for the task
    finished: Array  # bool [B]
    solved: Array  # bool [B]
    start: Array  # uint32 [W, B]
    start_tables: tuple[Array, ...]  # uint32 [F, S, B] each
    situations: Array  # uint32 [W, K, B], the beam
    alive: Array  # bool [K, B], which situations of the beam are in use
    visited: Array  # uint32 [memory, B], hashes of the situations kept in earlier steps
    # int32 [steps, K, B], action << 8 | parent, of the step at `clock` in row clock % steps
    trail: Array


class Answers(NamedTuple):
    """One row per task, and a last row for the answers of idle slots, which nobody reads."""

    length: Array  # int32 [Q + 1], -1 where no plan was found
    plan: Array  # int32 [Q + 1, steps], actions in the order of execution, -1 after the last


class Search(NamedTuple):
    """The carry of the search loop."""

    slots: Slots
    answers: Answers


def empty_search(queue: Queue, *, num_slots: int, beam: int, steps: int, memory: int) -> Search:
    """Returns slots that all wait for a task, and answers that are all still open.

    Args:
      queue: the tasks to come.
      num_slots: B.
      beam: K, situations kept in each step.
      steps: the longest plan.
      memory: hashes that each slot remembers.
    """
    # Finished slots without a task: the first refill writes nothing of theirs that is read.
    size, num_words = queue.start.shape
    slots = Slots(
        clock=jnp.int32(0),
        waiting=jnp.int32(0),
        task=jnp.full(num_slots, -1, jnp.int32),
        age=jnp.zeros(num_slots, jnp.int32),
        finished=jnp.ones(num_slots, bool),
        solved=jnp.zeros(num_slots, bool),
        start=jnp.zeros((num_words, num_slots), jnp.uint32),
        start_tables=tuple(
            jnp.zeros((*table.shape[1:], num_slots), jnp.uint32) for table in queue.start_tables
        ),
        situations=jnp.zeros((num_words, beam, num_slots), jnp.uint32),
        alive=jnp.zeros((beam, num_slots), bool),
        visited=jnp.zeros((memory, num_slots), jnp.uint32),
        trail=jnp.zeros((steps, beam, num_slots), jnp.int32),
    )
    answers = Answers(jnp.full(size + 1, -1, jnp.int32), jnp.full((size + 1, steps), -1, jnp.int32))
    return Search(slots, answers)


def refill(queue: Queue, search: Search) -> Search:
    """Returns the search after every finished slot wrote its answer and took the next task.

    A task whose goal holds at its start is finished at once, so a slot may be served more than
    once. Ends: each round takes a task from the queue or leaves a slot idle, hence not finished.
    """

    def serve_slot(search: Search) -> Search:
        slots, answers = search
        numbers = jnp.arange(slots.task.shape[0], dtype=jnp.int32)
        number = jnp.where(slots.finished, numbers, jnp.int32(numbers.shape[0])).min()
        return Search(_load_next(queue, slots, number), _write_answer(slots, answers, number))

    return lax.while_loop(lambda search: search.slots.finished.any(), serve_slot, search)


class _Backtrack(NamedTuple):
    """The carry of the walk back along the trail."""

    number: Array  # int32 [], actions written so far
    parent: Array  # int32 [], the situation of the beam to follow
    plan: Array  # int32 [Q + 1, steps], of `Answers`


def _write_answer(slots: Slots, answers: Answers, number: Array) -> Answers:
    """Returns the answers with that of slot `number`, int32 [].

    The action chosen last is executed first, so walking the trail back gives the plan in the order
    of execution.
    """
    task, solved, age = (
        lax.dynamic_index_in_dim(x, number, keepdims=False)
        for x in (slots.task, slots.solved, slots.age)
    )
    row = jnp.where(task < 0, jnp.int32(answers.length.shape[0] - 1), task)
    steps = slots.trail.shape[0]

    # Each round writes one action and follows its parent. Ends: after `age` rounds, if solved.
    def step_back(walk: _Backtrack) -> _Backtrack:
        place = jnp.remainder(slots.clock - 1 - walk.number, jnp.int32(steps))
        entry = lax.dynamic_slice(slots.trail, (place, walk.parent, number), (1, 1, 1))
        plan = lax.dynamic_update_slice(walk.plan, entry[0] >> 8, (row, walk.number))
        return _Backtrack(walk.number + 1, entry[0, 0, 0] & 255, plan)

    num_actions = jnp.where(solved, age, 0)
    walk = lax.while_loop(
        lambda walk: walk.number < num_actions,
        step_back,
        _Backtrack(jnp.int32(0), jnp.int32(0), answers.plan),
    )
    length = jnp.where(solved, age, -1)[None]
    return Answers(lax.dynamic_update_slice(answers.length, length, (row,)), walk.plan)


def _load_next(queue: Queue, slots: Slots, number: Array) -> Slots:
    """Returns the slots with the next task of the queue in slot `number`, int32 []; the slot is
    idle where the queue is empty, and finished at once where the goal holds at the start.
    """
    # The next task, as columns of one slot.
    is_some = slots.waiting < queue.count
    source = jnp.minimum(slots.waiting, queue.start.shape[0] - 1)

    def column_of(rows: Array) -> Array:
        return jnp.moveaxis(lax.dynamic_slice_in_dim(rows, source, 1), 0, -1)

    def put(whole: Array, column: Array) -> Array:
        return lax.dynamic_update_slice_in_dim(whole, column, number, whole.ndim - 1)

    start, goal = column_of(queue.start), column_of(queue.goal)
    beam, memory = slots.alive.shape[0], slots.visited.shape[0]
    is_done = is_some & ((goal & ~start) == 0).all()

    # The beam begins with the goal alone, and nothing has been visited.
    return slots._replace(
        waiting=slots.waiting + is_some.astype(jnp.int32),
        task=put(slots.task, jnp.where(is_some, source, -1)[None]),
        age=put(slots.age, jnp.zeros(1, jnp.int32)),
        finished=put(slots.finished, is_done[None]),
        solved=put(slots.solved, is_done[None]),
        start=put(slots.start, start),
        start_tables=tuple(
            put(whole, column_of(rows))
            for whole, rows in zip(slots.start_tables, queue.start_tables)
        ),
        situations=put(slots.situations, jnp.broadcast_to(goal[:, None], (goal.shape[0], beam, 1))),
        alive=put(
            slots.alive, (jnp.arange(beam, dtype=jnp.int32)[:, None] == 0) & is_some & ~is_done
        ),
        visited=put(slots.visited, jnp.zeros((memory, 1), jnp.uint32)),
    )
