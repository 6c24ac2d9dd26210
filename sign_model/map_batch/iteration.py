"""The MAP iteration over a queue of tasks, jitted: M-, P- and A-step on packed situations, all
lanes in lockstep.

The batch is the MINOR axis: situations are uint32 [W, K, B] (words, beam, lanes), so that every
operation is one contiguous vector operation over tasks that do the same thing. No sort, no top-k:
the best K of all candidates leave by K passes of a masked minimum, and each pass also drops every
candidate that equals or contains the one that left, compared bit by bit. A step goes through its
candidates pass by pass, one action for every situation of every lane, and ends when all are
through: what it works on stays in the fastest cache.

What was kept in earlier steps is remembered by a hash, so that a task left unsolved here is NOT
proven unsolvable: proofs are the exact search's business (`map_planner`). No lane reads another: an
answer does not depend on the tasks beside it.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.loops import repeat
from sign_model.ground.marks import compiled_whole, jitted_wide
from sign_model.ground.sizes import next_power_of_two
from sign_model.ground.words import WORD, pack_columns
from sign_model.map_batch.counts import digits_of, hash_of, lowest, needed, position, weighted_count
from sign_model.map_batch.detours import have_detours
from sign_model.map_batch.lanes import Answers, Lanes, Queue, empty, turn_over
from sign_model.map_batch.start_tables import landmark_table, relaxed_plan_table

MAX_BEAM = 256
_ALL = np.uint32(0xFFFFFFFF)
_MAX_RATING = (1 << 16) - 3
_OPTIONS = ("beam", "branch", "steps", "lanes", "uses_landmarks", "uses_plan")
# of the M-step: few enough to compile fast, many enough to keep its sums in registers
_BITS_A_PASS = 8


def _regress(
    tables,
    weights,
    start,
    goal,
    count,
    *,
    beam,
    branch,
    steps,
    lanes,
    uses_landmarks=True,
    uses_plan=False,
):
    """Returns (length int32 [Q], plan int32 [Q, steps], has_detour bool [Q]) of a queue of tasks of
    one domain.

    Length -1: no plan was found. The plan holds action numbers of the tables in the order of
    execution, -1 after the last; a goal included in the start is solved with length 0.

    Args:
      tables, weights: of the domain and of one heuristic sign.
      start, goal: uint32 [Q, W], features packed into words.
      count: int32, how many of them are tasks; the rest is padding.
      beam: situations kept a step, K, up to 256. branch: actions tried for each situation, up to
        256.
      steps: the longest plan. lanes: tasks side by side.
      uses_landmarks, uses_plan: which tables the sign reads at all.
    """
    make = functools.partial(
        _parts, tables, lanes=lanes, uses_landmarks=uses_landmarks, uses_plan=uses_plan
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

    def search(queue, domain):
        first = empty(
            queue,
            num_lanes=lanes,
            beam=beam,
            steps=steps,
            memory=32 * next_power_of_two(beam),
        )
        iterate = functools.partial(_iterate, queue, domain, branch)
        return lax.while_loop(
            lambda s: (s[0].task >= 0).any() | s[0].finished.any(), iterate, first
        )[1]

    answers = compiled_whole(search)(queue, domain)
    length, plan = answers.length[:-1], answers.plan[:-1]
    detour = have_detours(
        tables.keeps, tables.needs, tables.deletes, start, goal, plan, lanes=lanes
    )
    return length, plan, detour & (length > 0)


regress = jitted_wide(_regress, static_argnames=_OPTIONS)


def _regress_domains(tables, weights, start, goal, count, **options):
    """Returns what `regress` returns, for several domains of one bucket one after the other: all
    with a leading axis [D].
    """
    return lax.map(lambda one: _regress(*one, **options), (tables, weights, start, goal, count))


regress_domains = jitted_wide(_regress_domains, static_argnames=_OPTIONS)


def _parts(tables, start, count, *, lanes, uses_landmarks, uses_plan):
    """The tables made from each start, uint32 [Q, F, S] each; as many tasks at once as there are
    lanes.
    """
    makers = [
        maker
        for maker, used in ((landmark_table, uses_landmarks), (relaxed_plan_table, uses_plan))
        if used
    ]
    if not makers:
        return ()
    size, num_words = start.shape
    places = jnp.arange(WORD, dtype=jnp.uint32)

    def chunk(at, done):
        words = lax.dynamic_slice_in_dim(start, at * lanes, lanes).T
        bits = (
            ((words[:, None] >> places[None, :, None]) & 1)
            .astype(bool)
            .reshape(num_words * WORD, lanes)
        )
        rows = (jnp.moveaxis(make(tables, bits), -1, 0) for make in makers)
        return tuple(
            lax.dynamic_update_slice_in_dim(whole, new, at * lanes, 0)
            for whole, new in zip(done, rows)
        )

    shapes = [
        jax.eval_shape(make, tables, jnp.zeros((num_words * WORD, lanes), bool)) for make in makers
    ]
    first = tuple(jnp.zeros((size, *shape.shape[:-1]), jnp.uint32) for shape in shapes)
    return lax.fori_loop(np.int32(0), (count + lanes - 1) // lanes, chunk, first)


class _Domain(NamedTuple):
    """What all lanes read alike."""

    explains: jax.Array  # uint32 [F, A / 32]
    breaks: jax.Array  # uint32 [F, A / 32]
    keeps: jax.Array  # uint32 [W, A]
    needs: jax.Array  # uint32 [W, A]
    held: jax.Array  # uint32 [DIGITS, W, 1]
    unmet: jax.Array  # uint32 [DIGITS, W, 1]
    parts: tuple[jax.Array, ...]  # uint32 [DIGITS, S, 1] each


class _Candidates(NamedTuple):
    """The situations before the actions tried in a step; candidate m K + k came from situation k in
    pass m.
    """

    before: jax.Array  # uint32 [W, M K, B]
    action: jax.Array  # int32 [M K, B]
    # uint32 [M K, B], rating << 16 | k << 8 | m: ties go to the children of the best situation
    key: jax.Array


def _iterate(
    queue: Queue, domain: _Domain, branch: int, state: tuple[Lanes, Answers]
) -> tuple[Lanes, Answers]:
    """One step of all lanes, after those that are finished were emptied and filled again."""
    lanes, answers = turn_over(queue, *state)
    candidates = _expand(domain, branch, lanes)
    number, key, situations = _pick(candidates, beam=lanes.alive.shape[0])
    alive = key != _ALL
    action = jnp.take_along_axis(candidates.action, number, 0, mode="promise_in_bounds")
    entry = jnp.where(alive, (action << 8) | ((key >> 8) & jnp.uint32(0xFF)).astype(jnp.int32), 0)
    row = jnp.remainder(lanes.clock, jnp.int32(lanes.trail.shape[0]))
    is_busy, age = lanes.task >= 0, lanes.age + 1
    # a situation included in the start always leaves first
    solved = is_busy & alive[0] & (key[0] >> 16 == 0)
    return lanes._replace(
        clock=lanes.clock + 1,
        age=age,
        solved=solved,
        finished=is_busy & (solved | ~alive.any(axis=0) | (age >= lanes.trail.shape[0])),
        situations=situations,
        alive=alive & is_busy[None],
        seen=_remembered(lanes.seen, situations, alive),
        trail=lax.dynamic_update_slice_in_dim(lanes.trail, entry[None], row, 0),
    ), answers


def _m_step(domain: _Domain, situations: jax.Array, alive: jax.Array) -> jax.Array:
    """The actions whose scripts fit: they explain a part of the situation and break nothing. ->
    bitmap [A / 32, K, B].
    """
    num_words, num_passes = situations.shape[0], WORD // _BITS_A_PASS
    shifts = jnp.arange(num_passes, dtype=jnp.uint32) * _BITS_A_PASS
    parts = (situations[:, None] >> shifts[None, :, None, None]).reshape(-1, *situations.shape[1:])
    rows = (
        m.reshape(num_words * num_passes, _BITS_A_PASS, -1)
        for m in (domain.explains, domain.breaks)
    )

    def one_part(found, given):
        part, explains, breaks = given
        explained, broken = found
        for bit in range(_BITS_A_PASS):
            held = ((part & jnp.uint32(1 << bit)) != 0)[None]
            explained = explained | jnp.where(held, explains[bit][:, None, None], jnp.uint32(0))
            broken = broken | jnp.where(held, breaks[bit][:, None, None], jnp.uint32(0))
        return (explained, broken), None

    nothing = jnp.zeros((domain.explains.shape[1], *situations.shape[1:]), jnp.uint32)
    explained, broken = lax.scan(one_part, (nothing, nothing), (parts, *rows))[0]
    return jnp.where(alive[None], explained & ~broken, jnp.uint32(0))


def _expand(domain: _Domain, branch: int, lanes: Lanes) -> _Candidates:
    """Every fitting action of every situation, the first `branch` of each, in turn: P-step, A-step,
    and what is forgotten.
    """
    num_words, beam, num_lanes = lanes.situations.shape
    bitmap = _m_step(domain, lanes.situations, lanes.alive)
    feature_digits = (domain.held & lanes.start[None]) | (domain.unmet & ~lanes.start[None])
    ranks = jnp.arange(beam, dtype=jnp.uint32)[:, None] << 8

    def one_pass(state):
        m, left, done = state
        left, action = _take_one(bitmap, left)
        is_valid, action = action >= 0, jnp.maximum(action, 0)
        before = _p_step(domain, lanes.situations, action)
        rating = _a_step(domain, feature_digits, lanes.parts, before)
        tag = hash_of(before)
        slot = (tag % jnp.uint32(lanes.seen.shape[0])).astype(jnp.int32)
        # forget what was kept before
        is_new = jnp.take_along_axis(lanes.seen, slot, 0, mode="promise_in_bounds") != tag
        # the stop rule, bit by bit; rating 0 means nothing else
        is_done = ((before & ~lanes.start[:, None]) == 0).all(axis=0)
        rating = jnp.where(is_done, jnp.uint32(0), jnp.minimum(rating, jnp.uint32(_MAX_RATING)) + 1)
        key = jnp.where(is_valid & is_new, (rating << 16) | ranks | m.astype(jnp.uint32), _ALL)
        new, at = _Candidates(before, action, key), m * beam
        return (
            m + 1,
            left,
            _Candidates(
                lax.dynamic_update_slice_in_dim(done.before, new.before, at, 1),
                lax.dynamic_update_slice_in_dim(done.action, new.action, at, 0),
                lax.dynamic_update_slice_in_dim(done.key, new.key, at, 0),
            ),
        )

    size = branch * beam
    first = _Candidates(
        jnp.zeros((num_words, size, num_lanes), jnp.uint32),
        jnp.zeros((size, num_lanes), jnp.int32),
        jnp.full((size, num_lanes), _ALL, jnp.uint32),
    )
    groups = _groups(bitmap)
    nothing = jnp.zeros((beam, num_lanes), jnp.uint32)
    left = _Left(groups, nothing, nothing.astype(jnp.int32))

    def goes_on(state):
        m, left, _ = state
        return (m < branch) & (left.word | functools.reduce(jnp.bitwise_or, left.groups)).any()

    return lax.while_loop(goes_on, one_pass, (jnp.int32(0), left, first))[2]


class _Left(NamedTuple):
    """The actions of each situation that were not tried: groups of words that hold some, and the
    word at hand.
    """

    # uint32 [K, B] each, bit i % 32 of group i // 32: word i holds some
    groups: tuple[jax.Array, ...]
    word: jax.Array  # uint32 [K, B]
    place: jax.Array  # int32 [K, B], the number of the word at hand


def _groups(bitmap: jax.Array) -> tuple[jax.Array, ...]:
    filled = jnp.concatenate(
        [bitmap != 0, jnp.zeros((-bitmap.shape[0] % WORD, *bitmap.shape[1:]), bool)]
    )
    return tuple(pack_columns(filled))


def _take_one(bitmap: jax.Array, left: _Left) -> tuple[_Left, jax.Array]:
    """The lowest action left of every situation, int32 [K, B], -1 where there is none.

    A pass takes one bit of the word at hand, and fetches the next word that holds any when that one
    is empty.
    """
    groups = left.groups
    group, number = groups[-1], jnp.full(left.place.shape, len(groups) - 1, jnp.int32)
    for i in range(len(groups) - 2, -1, -1):
        group, number = (
            jnp.where(groups[i] != 0, groups[i], group),
            jnp.where(groups[i] != 0, i, number),
        )
    first = lowest(group)
    next_place = jnp.maximum(number * WORD + position(first), 0)
    fetch = (left.word == 0) & (group != 0)
    fetched = jnp.take_along_axis(bitmap, next_place[None], 0, mode="promise_in_bounds")[0]
    word, place = jnp.where(fetch, fetched, left.word), jnp.where(fetch, next_place, left.place)
    groups = tuple(jnp.where(fetch & (number == i), g ^ first, g) for i, g in enumerate(groups))
    bit = lowest(word)
    return _Left(groups, word ^ bit, place), jnp.where(word != 0, place * WORD + position(bit), -1)


def _p_step(domain: _Domain, situations: jax.Array, action: jax.Array) -> jax.Array:
    """The situation before each action: [W, K, B], [K, B] -> [W, K, B]."""
    keeps, needs = (
        m.at[:, action].get(mode="promise_in_bounds") for m in (domain.keeps, domain.needs)
    )
    return (situations & keeps) | needs


def _a_step(
    domain: _Domain, feature_digits: jax.Array, parts: tuple[jax.Array, ...], before: jax.Array
) -> jax.Array:
    """The rating of each situation by the sign's weights, uint32 [K, B]."""
    rating = weighted_count(list(before), feature_digits)
    for table, digits in zip(parts, domain.parts):
        rating = rating + weighted_count(needed(before, table), digits)
    return rating


def _pick(candidates: _Candidates, *, beam: int) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The K candidates of least key; each that leaves takes with it all that contain it.

    -> numbers int32 [K, B], keys uint32 [K, B], situations uint32 [W, K, B].
    """
    before = candidates.before
    num_words, size, num_lanes = before.shape

    def take(key, _):
        low = key.min(axis=0)
        rank, turn = (low >> 8) & jnp.uint32(0xFF), low & jnp.uint32(0xFF)
        number = jnp.minimum((turn * jnp.uint32(beam) + rank).astype(jnp.int32), size - 1)
        index = jnp.broadcast_to(number[None, None], (num_words, 1, num_lanes))
        best = jnp.take_along_axis(before, index, 1, mode="promise_in_bounds")
        contains = ((best & ~before) == 0).all(axis=0)
        return jnp.where(contains, _ALL, key), (number, low, best[:, 0])

    number, key, situations = lax.scan(take, candidates.key, None, length=beam)[1]
    return number, key, situations.swapaxes(0, 1)


def _remembered(seen: jax.Array, situations: jax.Array, alive: jax.Array) -> jax.Array:
    """The memory with what was kept now, one situation after the other: a scatter would not be
    compiled here.
    """
    beam, num_lanes = alive.shape
    tag = hash_of(situations)
    slot = (tag % jnp.uint32(seen.shape[0])).astype(jnp.int32)
    tag = jnp.where(alive, tag, jnp.take_along_axis(seen, slot, 0, mode="promise_in_bounds"))

    def put(i, seen):
        place = (i // num_lanes, i % num_lanes)
        one = lax.dynamic_slice(tag, place, (1, 1))
        return lax.dynamic_update_slice(
            seen, one, (lax.dynamic_slice(slot, place, (1, 1))[0, 0], place[1])
        )

    return repeat(beam * num_lanes, put, seen)
