"""The MAP iteration over a queue of tasks, jitted: M-, P- and A-step on packed situations, with all
batch slots in lockstep (PY16 §3.1).

    S := goal situation of each slot's task
    repeat  M-step  actions whose causal matrices fit: they explain a part of S, break nothing of it
            P-step  the situation before each: (S & ~adds) | conditions
            A-step  rate it by the heuristic sign, forget what was kept before, keep the best K
    until S is included in the start, nothing is left, or the plan is too long

The batch is the LAST axis: situations are uint32 [W, K, B] (words, beam, slots), so that every
operation is one contiguous vector operation over tasks that do the same thing. The three
steps are in `steps`; what keeps the best and ends the search is here. There is no sort and no
top-k: the best K of all candidates are selected by K passes of a masked minimum, and each pass also
drops every candidate that equals or contains the selected one, compared bit by bit.

What was kept in earlier steps is remembered by a hash, so a task left unsolved here is NOT proven
unsolvable: proofs are left to the exact search (`map_planner`). No slot reads another, so an answer
does not depend on the tasks beside it.

`lanes` is the number of slots, B: tasks searched side by side (`map_batch.lanes`).
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.marks import compiled_whole, jitted_wide
from sign_model.foundation.records import Array
from sign_model.foundation.sizes import next_power_of_two
from sign_model.foundation.words import WORD
from sign_model.map_batch.counts import digits_of, hash_of
from sign_model.map_batch.detours import have_detours
from sign_model.map_batch.lanes import Answers, Queue, Search, empty_search, refill
from sign_model.map_batch.one_step import NO_CANDIDATE, Candidates, StepTables, expand
from sign_model.map_batch.start_tables import landmark_table, relaxed_plan_table
from sign_model.map_batch.tables import SignWeights, Tables

MAX_BEAM = 256
"""The widest beam, and the most actions tried for each situation: ranks and passes, 0 to 255, fit
into 8 bits of a key.
"""

_OPTIONS = ("beam", "branch", "steps", "lanes", "uses_landmarks", "uses_plan")


def _regress(
    tables: Tables,
    weights: SignWeights,
    start: Array,
    goal: Array,
    count: Array,
    *,
    beam: int,
    branch: int,
    steps: int,
    lanes: int,
    uses_landmarks: bool = True,
    uses_plan: bool = False,
) -> tuple[Array, Array, Array]:
    """Returns (length int32 [Q], plan int32 [Q, steps], has_detour bool [Q]) of a queue of tasks of
    one domain.

    Length -1: no plan was found. The plan holds action numbers of the tables in the order of
    execution, -1 after the last; a goal included in the start is solved with length 0.

    Args:
      tables, weights: of the domain and of one heuristic sign.
      start, goal: uint32 [Q, W], features packed into words.
      count: int32 [], how many of them are tasks; the rest is padding.
      beam: situations kept in each step, K, up to `MAX_BEAM`.
      branch: actions tried for each situation, up to `MAX_BEAM`.
      steps: the longest plan.
      lanes: batch slots, B: tasks searched side by side; Q is a multiple.
      uses_landmarks, uses_plan: which tables the sign reads at all.
    """
    # What is made once: the tables of each start, and the weights as binary digits.
    make = functools.partial(
        _start_tables, tables, num_slots=lanes, uses_landmarks=uses_landmarks, uses_plan=uses_plan
    )
    queue = Queue(count, start, goal, make(start, count))
    digits = [
        d for d, used in ((weights.landmarks, uses_landmarks), (weights.plan, uses_plan)) if used
    ]
    domain = StepTables(
        tables.explains,
        tables.breaks,
        tables.keeps,
        tables.needs,
        digits_of(weights.held),
        digits_of(weights.unmet),
        tuple(map(digits_of, digits)),
    )

    # The search. Ends: every task is finished after `steps` steps, and then no slot holds one.
    def search(queue: Queue, domain: StepTables) -> Answers:
        first = empty_search(
            queue,
            num_slots=lanes,
            beam=beam,
            steps=steps,
            memory=32 * next_power_of_two(beam),
        )
        iterate = functools.partial(_iterate, queue, domain, branch)
        return lax.while_loop(
            lambda s: (s.slots.task >= 0).any() | s.slots.finished.any(), iterate, first
        ).answers

    answers = compiled_whole(search)(queue, domain)
    length, plan = answers.length[:-1], answers.plan[:-1]
    detour = have_detours(
        tables.keeps, tables.needs, tables.deletes, start, goal, plan, lanes=lanes
    )
    return length, plan, detour & (length > 0)


regress = jitted_wide(_regress, static_argnames=_OPTIONS)


def _regress_domains(
    tables: Tables,
    weights: SignWeights,
    start: Array,
    goal: Array,
    count: Array,
    **options: int,
) -> tuple[Array, Array, Array]:
    """Returns what `regress` returns for several domains of one bucket, one after the other; every
    argument and result has a leading axis [D].
    """
    return lax.map(lambda one: _regress(*one, **options), (tables, weights, start, goal, count))


regress_domains = jitted_wide(_regress_domains, static_argnames=_OPTIONS)


def _start_tables(
    tables: Tables,
    start: Array,
    count: Array,
    *,
    num_slots: int,
    uses_landmarks: bool,
    uses_plan: bool,
) -> tuple[Array, ...]:
    """Returns the tables made from each start, uint32 [Q, F, S] each; as many tasks at a time as
    there are slots.
    """
    makers = [
        maker
        for maker, used in ((landmark_table, uses_landmarks), (relaxed_plan_table, uses_plan))
        if used
    ]
    if not makers:
        return ()

    # Each chunk of starts is unpacked into bits, and its tables are written behind those before.
    size, num_words = start.shape
    places = jnp.arange(WORD, dtype=jnp.uint32)

    def make_chunk(at: Array, done: tuple[Array, ...]) -> tuple[Array, ...]:
        words = lax.dynamic_slice_in_dim(start, at * num_slots, num_slots).T
        bits = (
            ((words[:, None] >> places[None, :, None]) & 1)
            .astype(bool)
            .reshape(num_words * WORD, num_slots)
        )
        rows = (jnp.moveaxis(make(tables, bits), -1, 0) for make in makers)
        return tuple(
            lax.dynamic_update_slice_in_dim(whole, new, at * num_slots, 0)
            for whole, new in zip(done, rows)
        )

    shapes = [
        jax.eval_shape(make, tables, jnp.zeros((num_words * WORD, num_slots), bool))
        for make in makers
    ]
    first = tuple(jnp.zeros((size, *shape.shape[:-1]), jnp.uint32) for shape in shapes)
    return lax.fori_loop(np.int32(0), (count + num_slots - 1) // num_slots, make_chunk, first)


class _Picked(NamedTuple):
    """The candidates kept by a step, best first."""

    number: Array  # int32 [K, B], which candidate
    key: Array  # uint32 [K, B], NO_CANDIDATE where there is none
    situations: Array  # uint32 [W, K, B]


def _iterate(queue: Queue, domain: StepTables, branch: int, search: Search) -> Search:
    """Returns the search after one step of all slots, before which finished slots are refilled."""
    slots, answers = refill(queue, search)

    # M-, P- and A-step, and the best K.
    candidates = expand(domain, branch, slots)
    number, key, situations = _pick(candidates, beam=slots.alive.shape[0])

    # The trail: the action and the parent of each situation kept.
    alive = key != NO_CANDIDATE
    action = jnp.take_along_axis(candidates.action, number, 0, mode="promise_in_bounds")
    entry = jnp.where(alive, (action << 8) | ((key >> 8) & jnp.uint32(0xFF)).astype(jnp.int32), 0)
    row = jnp.remainder(slots.clock, jnp.int32(slots.trail.shape[0]))

    # Stop: the best situation is included in the start (rating 0, which is always picked first),
    # none is left, or the plan has reached its greatest length.
    is_busy, age = slots.task >= 0, slots.age + 1
    solved = is_busy & alive[0] & (key[0] >> 16 == 0)
    slots = slots._replace(
        clock=slots.clock + 1,
        age=age,
        solved=solved,
        finished=is_busy & (solved | ~alive.any(axis=0) | (age >= slots.trail.shape[0])),
        situations=situations,
        alive=alive & is_busy[None],
        visited=_remember(slots.visited, situations, alive),
        trail=lax.dynamic_update_slice_in_dim(slots.trail, entry[None], row, 0),
    )
    return Search(slots, answers)


def _pick(candidates: Candidates, *, beam: int) -> _Picked:
    """Returns the K candidates of least key; each one picked removes all that contain it."""
    before = candidates.before
    num_words, size, num_slots = before.shape

    def pick_best(key: Array, _: None) -> tuple[Array, tuple[Array, ...]]:
        # The key tells where its candidate lies; NO_CANDIDATE tells a place outside.
        low = key.min(axis=0)
        rank, turn = (low >> 8) & jnp.uint32(0xFF), low & jnp.uint32(0xFF)
        number = jnp.minimum((turn * jnp.uint32(beam) + rank).astype(jnp.int32), size - 1)
        index = jnp.broadcast_to(number[None, None], (num_words, 1, num_slots))
        best = jnp.take_along_axis(before, index, 1, mode="promise_in_bounds")
        # It contains itself, so it is removed too.
        contains = ((best & ~before) == 0).all(axis=0)
        return jnp.where(contains, NO_CANDIDATE, key), (number, low, best[:, 0])

    number, key, situations = lax.scan(pick_best, candidates.key, None, length=beam)[1]
    return _Picked(number, key, situations.swapaxes(0, 1))


def _remember(visited: Array, situations: Array, alive: Array) -> Array:
    """Returns the memory, uint32 [memory, B], with the hashes of the situations kept now, uint32
    [W, K, B]; a later situation overwrites an earlier one at the same address.

    They are written one after the other: a scatter would not be compiled here (`foundation.marks`).
    """
    beam, num_slots = alive.shape
    tag = hash_of(situations)
    address = (tag % jnp.uint32(visited.shape[0])).astype(jnp.int32)
    # A place that is not in use writes back what is there.
    tag = jnp.where(alive, tag, jnp.take_along_axis(visited, address, 0, mode="promise_in_bounds"))

    def write_one(i: Array, visited: Array) -> Array:
        place = (i // num_slots, i % num_slots)
        one = lax.dynamic_slice(tag, place, (1, 1))
        return lax.dynamic_update_slice(
            visited, one, (lax.dynamic_slice(address, place, (1, 1))[0, 0], place[1])
        )

    return repeat(beam * num_slots, write_one, visited)
