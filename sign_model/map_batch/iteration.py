"""The MAP iteration over a queue of tasks, jitted: M-, P- and A-step on packed situations, with all
batch slots in lockstep (PY16 §3.1).

    S := goal situation of each slot's task
    repeat  M-step  actions whose causal matrices fit: they explain a part of S, break nothing of it
            P-step  the situation before each: (S & ~adds) | conditions
            A-step  rate it by the heuristic sign, forget what was kept before, keep the best K
    until S is included in the start, nothing is left, or the plan is too long

The batch is the LAST axis: situations are uint32 [W, K, B] (words, beam, slots), so that every
operation is one contiguous vector operation over tasks that do the same thing. There is no sort and
no top-k: the best K of all candidates are selected by K passes of a masked minimum, and each pass
also drops every candidate that equals or contains the selected one, compared bit by bit. A step
goes through its candidates pass by pass, one action for every situation of every slot, and ends
when all are exhausted: so its working set stays in the fastest cache.

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

from sign_model.ground.loops import repeat
from sign_model.ground.marks import compiled_whole, jitted_wide
from sign_model.ground.records import Array
from sign_model.ground.sizes import next_power_of_two
from sign_model.ground.words import WORD, pack_columns
from sign_model.map_batch.counts import (
    bit_index,
    digits_of,
    hash_of,
    lowest_bit,
    union_of_rows,
    weighted_count,
)
from sign_model.map_batch.detours import have_detours
from sign_model.map_batch.lanes import Answers, Queue, Search, Slots, empty_search, refill
from sign_model.map_batch.start_tables import landmark_table, relaxed_plan_table
from sign_model.map_batch.tables import SignWeights, Tables

MAX_BEAM = 256
"""The widest beam, and the most actions tried for each situation: ranks and passes, 0 to 255, fit
into 8 bits of a key.
"""

_ALL = np.uint32(0xFFFFFFFF)  # the key of no candidate: above that of every candidate
_MAX_RATING = (1 << 16) - 3  # so that rating + 1 fits into 16 bits and no key equals _ALL
_OPTIONS = ("beam", "branch", "steps", "lanes", "uses_landmarks", "uses_plan")
# Bits per pass of the M-step: few enough to compile fast, many enough to keep its sums in
# registers.
_BITS_A_PASS = 8


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
    domain = _Domain(
        tables.explains,
        tables.breaks,
        tables.keeps,
        tables.needs,
        digits_of(weights.held),
        digits_of(weights.unmet),
        tuple(map(digits_of, digits)),
    )

    # The search. Ends: every task is finished after `steps` steps, and then no slot holds one.
    def search(queue: Queue, domain: _Domain) -> Answers:
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


class _Domain(NamedTuple):
    """What all slots share."""

    explains: Array  # uint32 [F, A / 32]
    breaks: Array  # uint32 [F, A / 32]
    keeps: Array  # uint32 [W, A]
    needs: Array  # uint32 [W, A]
    held: Array  # uint32 [DIGITS, W, 1]
    unmet: Array  # uint32 [DIGITS, W, 1]
    table_digits: tuple[Array, ...]  # uint32 [DIGITS, S, 1], for each table made from a start


class _Candidates(NamedTuple):
    """The situations before the actions tried in a step; candidate m K + k came from situation k in
    pass m.
    """

    before: Array  # uint32 [W, M K, B]
    action: Array  # int32 [M K, B]
    key: Array  # uint32 [M K, B], of `_keys`


class _Picked(NamedTuple):
    """The candidates kept by a step, best first."""

    number: Array  # int32 [K, B], which candidate
    key: Array  # uint32 [K, B], _ALL where there is none
    situations: Array  # uint32 [W, K, B]


def _iterate(queue: Queue, domain: _Domain, branch: int, search: Search) -> Search:
    """Returns the search after one step of all slots, before which finished slots are refilled."""
    slots, answers = refill(queue, search)

    # M-, P- and A-step, and the best K.
    candidates = _expand(domain, branch, slots)
    number, key, situations = _pick(candidates, beam=slots.alive.shape[0])

    # The trail: the action and the parent of each situation kept.
    alive = key != _ALL
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


def _m_step(domain: _Domain, situations: Array, alive: Array) -> Array:
    """Returns the actions whose causal matrices fit: they explain a part of the situation and break
    nothing of it.

    Args:
      domain: `explains` and `breaks`.
      situations: uint32 [W, K, B].
      alive: bool [K, B].

    Returns:
      A bitmap of actions, uint32 [A / 32, K, B].
    """
    # The features, a few at a time: [W * passes, K, B].
    num_words, num_passes = situations.shape[0], WORD // _BITS_A_PASS
    shifts = jnp.arange(num_passes, dtype=jnp.uint32) * _BITS_A_PASS
    parts = (situations[:, None] >> shifts[None, :, None, None]).reshape(-1, *situations.shape[1:])
    rows = (
        m.reshape(num_words * num_passes, _BITS_A_PASS, -1)
        for m in (domain.explains, domain.breaks)
    )

    # OR the table rows of the features that each situation has.
    def add_features(
        sums: tuple[Array, Array], features: tuple[Array, Array, Array]
    ) -> tuple[tuple[Array, Array], None]:
        part, explains, breaks = features
        explained, broken = sums
        for bit in range(_BITS_A_PASS):
            has_feature = ((part & jnp.uint32(1 << bit)) != 0)[None]
            explained = explained | jnp.where(
                has_feature, explains[bit][:, None, None], jnp.uint32(0)
            )
            broken = broken | jnp.where(has_feature, breaks[bit][:, None, None], jnp.uint32(0))
        return (explained, broken), None

    nothing = jnp.zeros((domain.explains.shape[1], *situations.shape[1:]), jnp.uint32)
    explained, broken = lax.scan(add_features, (nothing, nothing), (parts, *rows))[0]
    return jnp.where(alive[None], explained & ~broken, jnp.uint32(0))


class _Expansion(NamedTuple):
    """The carry of the passes of a step."""

    number: Array  # int32 [], passes done, m
    untried: "_Untried"
    candidates: _Candidates  # those of the passes done; the rest have the key _ALL


def _expand(domain: _Domain, branch: int, slots: Slots) -> _Candidates:
    """Returns the candidates of a step: the first `branch` fitting actions of every situation, in
    ascending order.

    Pass m takes the m-th fitting action of every situation of every slot, and writes the situations
    before them as candidates m K to m K + K - 1.
    """
    num_words, beam, _ = slots.situations.shape

    # M-step, for all passes at once. The weight of a feature depends on whether it holds at the
    # start.
    bitmap = _m_step(domain, slots.situations, slots.alive)
    feature_digits = (domain.held & slots.start[None]) | (domain.unmet & ~slots.start[None])
    ranks = jnp.arange(beam, dtype=jnp.uint32)[:, None] << 8

    def one_pass(state: _Expansion) -> _Expansion:
        # The next action of each situation, -1 where none is left.
        m, untried, done = state
        untried, action = _take_one(bitmap, untried)
        is_valid, action = action >= 0, jnp.maximum(action, 0)

        # P-step and A-step.
        before = _p_step(domain, slots.situations, action)
        rating = _a_step(domain, feature_digits, slots.start_tables, before)
        key = _keys(slots, before, rating, is_valid, ranks, m)

        # Write the candidates of this pass.
        at = m * beam
        return _Expansion(
            m + 1,
            untried,
            _Candidates(
                lax.dynamic_update_slice_in_dim(done.before, before, at, 1),
                lax.dynamic_update_slice_in_dim(done.action, action, at, 0),
                lax.dynamic_update_slice_in_dim(done.key, key, at, 0),
            ),
        )

    first = _first_expansion(bitmap, num_words, branch)

    # Ends: after `branch` passes, or earlier when no situation has an untried action.
    def continues(state: _Expansion) -> Array:
        m, untried, _ = state
        return (m < branch) & (
            untried.word | functools.reduce(jnp.bitwise_or, untried.groups)
        ).any()

    return lax.while_loop(continues, one_pass, first).candidates


def _first_expansion(bitmap: Array, num_words: int, branch: int) -> _Expansion:
    """Returns the carry before the first pass: no candidate yet, and all actions of the bitmap,
    uint32 [A / 32, K, B], untried. `num_words` is W.
    """
    _, beam, num_slots = bitmap.shape
    size = branch * beam
    candidates = _Candidates(
        jnp.zeros((num_words, size, num_slots), jnp.uint32),
        jnp.zeros((size, num_slots), jnp.int32),
        jnp.full((size, num_slots), _ALL, jnp.uint32),
    )
    groups = _groups(bitmap)
    nothing = jnp.zeros((beam, num_slots), jnp.uint32)
    untried = _Untried(groups, nothing, nothing.astype(jnp.int32))
    return _Expansion(jnp.int32(0), untried, candidates)


def _keys(
    slots: Slots,
    before: Array,
    rating: Array,
    is_valid: Array,
    ranks: Array,
    m: Array,
) -> Array:
    """Returns the keys of the candidates of one pass, uint32 [K, B]; the least key is the best.

        bits 16-31   0 if the situation is included in the start, else its rating + 1
        bits 8-15    k, the rank of the situation it came from: ties go to the children of the best
        bits 0-7     m, the pass: then to the lowest action

    So no two candidates of a slot have the same key, and a key tells where its candidate lies.
    _ALL: there is no candidate, or its situation was kept before.

    Args:
      slots: their starts and visited situations.
      before: uint32 [W, K, B], the situations.
      rating: uint32 [K, B].
      is_valid: bool [K, B], whether there was an action left to try.
      ranks: uint32 [K, 1], k << 8.
      m: int32 [], the pass.
    """
    # Forget what was kept in an earlier step.
    tag = hash_of(before)
    address = (tag % jnp.uint32(slots.visited.shape[0])).astype(jnp.int32)
    is_new = jnp.take_along_axis(slots.visited, address, 0, mode="promise_in_bounds") != tag
    # The stop rule, bit by bit; rating 0 has no other meaning.
    is_done = ((before & ~slots.start[:, None]) == 0).all(axis=0)
    rating = jnp.where(is_done, jnp.uint32(0), jnp.minimum(rating, jnp.uint32(_MAX_RATING)) + 1)
    return jnp.where(is_valid & is_new, (rating << 16) | ranks | m.astype(jnp.uint32), _ALL)


class _Untried(NamedTuple):
    """The actions of each situation that were not tried yet: the rest of the current word, and
    which later words hold any.
    """

    # uint32 [K, B] each, bit i % 32 of group i // 32: word i of the bitmap holds some
    groups: tuple[Array, ...]
    word: Array  # uint32 [K, B], what is left of the current word
    place: Array  # int32 [K, B], the number of the current word


def _groups(bitmap: Array) -> tuple[Array, ...]:
    """Returns which words of the bitmap, uint32 [A / 32, K, B], are not 0: `_Untried.groups`."""
    filled = jnp.concatenate(
        [bitmap != 0, jnp.zeros((-bitmap.shape[0] % WORD, *bitmap.shape[1:]), bool)]
    )
    return tuple(pack_columns(filled))


def _take_one(bitmap: Array, untried: _Untried) -> tuple[_Untried, Array]:
    """Returns what is left without the lowest untried action of every situation, and that action,
    int32 [K, B], -1 where there is none.

    A pass takes one bit of the current word, and fetches the next word that holds any when the
    current one is empty.
    """
    # The first group that holds any word, and the first word in it.
    groups = untried.groups
    group, number = groups[-1], jnp.full(untried.place.shape, len(groups) - 1, jnp.int32)
    for i in range(len(groups) - 2, -1, -1):
        group, number = (
            jnp.where(groups[i] != 0, groups[i], group),
            jnp.where(groups[i] != 0, i, number),
        )
    first = lowest_bit(group)
    next_place = jnp.maximum(number * WORD + bit_index(first), 0)

    # Fetch that word where the current one is empty, and strike it off its group.
    is_empty = (untried.word == 0) & (group != 0)
    fetched = jnp.take_along_axis(bitmap, next_place[None], 0, mode="promise_in_bounds")[0]
    word = jnp.where(is_empty, fetched, untried.word)
    place = jnp.where(is_empty, next_place, untried.place)
    groups = tuple(jnp.where(is_empty & (number == i), g ^ first, g) for i, g in enumerate(groups))

    # Take its lowest bit.
    bit = lowest_bit(word)
    untried = _Untried(groups, word ^ bit, place)
    return untried, jnp.where(word != 0, place * WORD + bit_index(bit), -1)


def _p_step(domain: _Domain, situations: Array, action: Array) -> Array:
    """Returns the situation before each action: uint32 [W, K, B], int32 [K, B] -> uint32 [W, K,
    B].
    """
    keeps, needs = (
        m.at[:, action].get(mode="promise_in_bounds") for m in (domain.keeps, domain.needs)
    )
    return (situations & keeps) | needs


def _a_step(
    domain: _Domain,
    feature_digits: Array,
    start_tables: tuple[Array, ...],
    before: Array,
) -> Array:
    """Returns the rating of each situation by the sign's weights, uint32 [K, B].

    Args:
      domain: the weights of the tables' columns.
      feature_digits: uint32 [DIGITS, W, B], the weights of the features themselves.
      start_tables: uint32 [F, S, B] each.
      before: uint32 [W, K, B], the situations.
    """
    rating = weighted_count(list(before), feature_digits)
    for table, digits in zip(start_tables, domain.table_digits):
        rating = rating + weighted_count(union_of_rows(before, table), digits)
    return rating


def _pick(candidates: _Candidates, *, beam: int) -> _Picked:
    """Returns the K candidates of least key; each one picked removes all that contain it."""
    before = candidates.before
    num_words, size, num_slots = before.shape

    def pick_best(key: Array, _: None) -> tuple[Array, tuple[Array, ...]]:
        # The key tells where its candidate lies; _ALL tells a place outside.
        low = key.min(axis=0)
        rank, turn = (low >> 8) & jnp.uint32(0xFF), low & jnp.uint32(0xFF)
        number = jnp.minimum((turn * jnp.uint32(beam) + rank).astype(jnp.int32), size - 1)
        index = jnp.broadcast_to(number[None, None], (num_words, 1, num_slots))
        best = jnp.take_along_axis(before, index, 1, mode="promise_in_bounds")
        # It contains itself, so it is removed too.
        contains = ((best & ~before) == 0).all(axis=0)
        return jnp.where(contains, _ALL, key), (number, low, best[:, 0])

    number, key, situations = lax.scan(pick_best, candidates.key, None, length=beam)[1]
    return _Picked(number, key, situations.swapaxes(0, 1))


def _remember(visited: Array, situations: Array, alive: Array) -> Array:
    """Returns the memory, uint32 [memory, B], with the hashes of the situations kept now, uint32
    [W, K, B]; a later situation overwrites an earlier one at the same address.

    They are written one after the other: a scatter would not be compiled here (`ground.marks`).
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
