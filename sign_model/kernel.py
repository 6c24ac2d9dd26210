"""The MAP iteration over a batch of tasks, jitted: M-, P- and A-step on packed situations, all tasks in lockstep.

The batch is the MINOR axis: situations are uint32 [W, K, B] (words, beam, tasks), so that every operation is one contiguous
vector operation over tasks that do the same thing. No sort, no top-k: the best K of all candidates leave by K passes of a
masked minimum, and each pass also drops every candidate that equals or contains the one that left, compared bit by bit.

What was expanded in earlier steps is remembered by a hash, so that a task left unsolved here is NOT proven unsolvable: proofs
are the exact search's business (`map_planner`).
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.packed import MAX_WEIGHT, WORD, SignWeights, Tables
from sign_model.start_tables import landmark_table, pack_rows, relaxed_plan_table

_ALL = np.uint32(0xFFFFFFFF)
_BITS = np.arange(WORD, dtype=np.uint32)
_DIGITS = MAX_WEIGHT.bit_length()
_MEMORY = 512
_MAX_RATING = (1 << 16) - 2
_UNROLL = 4  # of the two selection loops: all of them unrolled compile for half a minute and run no faster


def _digits(weights: jax.Array) -> list[jax.Array]:
    """int32 [n, ...] -> for each binary digit the words uint32 [n / 32, ...] of those weights that have it."""
    return [pack_rows(((weights >> d) & 1).astype(bool)) for d in range(_DIGITS)]


def _weighted_count(words: list[jax.Array], digits: list[jax.Array]) -> jax.Array:
    """The sum of the weights of all 1-bits: words [C, B] each, digits [W, B] each -> int32 [C, B]."""
    total = jnp.zeros(words[0].shape, jnp.uint32)
    for d, digit in enumerate(digits):
        count = jnp.zeros(words[0].shape, jnp.uint32)
        for w, word in enumerate(words):
            count = count + lax.population_count(word & digit[w][None])
        total = total + (count << d)
    return total.astype(jnp.int32)


def _needed(situations: jax.Array, table: jax.Array) -> list[jax.Array]:
    """OR of the table rows of each situation's features: [W, C, B], [F, S, B] -> S words [C, B]."""
    num_words, num_columns, num_tasks = situations.shape[0], table.shape[1], situations.shape[2]
    rows = table.reshape(num_words, WORD, num_columns, num_tasks)

    def one_word(needed, word_and_rows):
        word, of_word = word_and_rows
        for bit in range(WORD):  # written out: a reduction over the bits runs at half the speed
            held = (word & jnp.uint32(1 << bit)) != 0
            needed = tuple(n | jnp.where(held, of_word[bit, s][None], jnp.uint32(0)) for s, n in enumerate(needed))
        return needed, None

    nothing = (jnp.zeros(situations.shape[1:], jnp.uint32),) * num_columns
    unroll = num_words if num_words <= _UNROLL else 1
    return list(lax.scan(one_word, nothing, (situations, rows), unroll=unroll)[0])


def _lowest(word: jax.Array) -> jax.Array:
    """The lowest 1-bit of each word alone, 0 of 0."""
    return word & (jnp.uint32(0) - word)


def _position(bit: jax.Array) -> jax.Array:
    """The place of a single 1-bit, -1 of 0."""
    return jnp.int32(WORD - 1) - lax.clz(bit).astype(jnp.int32)


def _hash(situations: jax.Array) -> jax.Array:
    h = jnp.full(situations.shape[1:], 0x811C9DC5, jnp.uint32)
    for word in situations:
        h = (h ^ word) * jnp.uint32(0x9E3779B1)
        h = h ^ (h >> 15)
    h = h * jnp.uint32(0x85EBCA6B)
    return h ^ (h >> 13)


@functools.partial(jax.jit, static_argnames=("beam", "branch", "steps", "uses_landmarks", "uses_plan"))
def regress(
    tables: Tables,
    weights: SignWeights,
    start: jax.Array,
    goal: jax.Array,
    *,
    beam: int,
    branch: int,
    steps: int,
    uses_landmarks: bool = True,
    uses_plan: bool = False,
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Returns (solved bool [B], length int32 [B], plan int32 [steps, B]) of a batch of tasks of one domain.

    The plan holds action numbers of the tables in the order of execution, -1 where there is none; a goal included in the start
    is solved with length 0.

    Args:
      tables, weights: of the domain and of one heuristic sign.
      start, goal: bool [F, B], padding False.
      beam: situations kept a step, K. branch: actions tried for each situation. steps: the longest plan.
      uses_landmarks, uses_plan: which tables the sign reads at all.
    """
    search = _Search(tables, weights, start, beam, branch, uses_landmarks, uses_plan)
    first = search.first_state(goal, steps)
    state = lax.while_loop(lambda s: (s[0] < steps) & (~s[5] & s[2].any(axis=0)).any(), search.iterate, first)
    trail, solved, length = state[4:]
    return solved, length, _unwind(*trail, length)


@functools.partial(jax.jit, static_argnames=("beam", "branch", "steps", "uses_landmarks", "uses_plan"))
def regress_domains(
    tables: Tables, weights: SignWeights, start: jax.Array, goal: jax.Array, **options: int
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Returns what `regress` returns, for several domains of one bucket one after the other: all with a leading axis [D]."""
    return lax.map(lambda one: regress(*one, **options), (tables, weights, start, goal))


def _unwind(chosen: jax.Array, parent: jax.Array, length: jax.Array) -> jax.Array:
    """The action chosen last is the first to execute: walking back gives the plan in the order of execution."""
    lane = jnp.arange(length.shape[0])

    def back(at, row):
        number, chosen_now, parent_now = row
        on = number < length
        return jnp.where(on, parent_now[at, lane], at), jnp.where(on, chosen_now[at, lane], -1)

    steps = chosen.shape[0]
    numbers = jnp.arange(steps, dtype=jnp.int32)
    _, backwards = lax.scan(back, jnp.zeros(length.shape, jnp.int32), (numbers, chosen, parent), reverse=True)
    place = length[None] - 1 - numbers[:, None]
    return jnp.where(place >= 0, jnp.take_along_axis(backwards, jnp.maximum(place, 0), 0), -1)


class _Search:
    """The steps of one search, closed over its tables."""

    def __init__(self, tables, weights, start, beam, branch, uses_landmarks, uses_plan):
        self.t, self.K, self.M = tables, beam, branch
        self.start_words = pack_rows(start)
        self.parts = []
        if uses_landmarks:
            self.parts.append((landmark_table(tables, start), [d[:, None] for d in _digits(weights.landmarks)]))
        if uses_plan:
            self.parts.append((relaxed_plan_table(tables, start), [d[:, None] for d in _digits(weights.plan)]))
        self.feature_digits = _digits(jnp.where(start, weights.held[:, None], weights.unmet[:, None]))

    def first_state(self, goal, steps):
        num_tasks, K = goal.shape[1], self.K
        words = pack_rows(goal)
        situations = jnp.broadcast_to(words[:, None], (words.shape[0], K, num_tasks))
        alive = jnp.zeros((K, num_tasks), bool).at[0].set(True)
        solved = ((words & ~self.start_words) == 0).all(axis=0)
        trail = (jnp.full((steps, K, num_tasks), -1, jnp.int32), jnp.zeros((steps, K, num_tasks), jnp.int32))
        seen = jnp.zeros((_MEMORY, num_tasks), jnp.uint32)
        return (jnp.int32(0), situations, alive, seen, trail, solved, jnp.zeros(num_tasks, jnp.int32))

    def m_step(self, situations, is_open):
        """The actions whose scripts fit: they explain a part of the situation and break nothing. -> bitmap [A / 32, K, B]."""
        adds, bad = self.t.adds, self.t.bad
        shape = (adds.shape[0], *situations.shape[1:])
        relevant, broken = jnp.zeros(shape, jnp.uint32), jnp.zeros(shape, jnp.uint32)
        for w, word in enumerate(situations):
            relevant = relevant | (adds[:, w, None, None] & word[None])
            broken = broken | (bad[:, w, None, None] & word[None])
        fits = ((relevant != 0) & (broken == 0) & is_open[None]).reshape(-1, WORD, *situations.shape[1:])
        bitmap = jnp.zeros((fits.shape[0], *fits.shape[2:]), jnp.uint32)
        for bit in range(WORD):  # written out, as in `_needed`
            bitmap = bitmap | jnp.where(fits[:, bit], jnp.uint32(1 << bit), jnp.uint32(0))
        return bitmap

    def take_first(self, bitmap):
        """The first M actions of every situation's bitmap, int32 [M K, B], -1 where there are fewer.

        Each pass takes one bit of the word at hand, and fetches the next word that holds any when that one is empty.
        """
        num_words, K, num_tasks = bitmap.shape
        filled = jnp.concatenate([bitmap != 0, jnp.zeros((-num_words % WORD, K, num_tasks), bool)])
        groups = tuple(pack_rows(filled))  # bit i % 32 of group i // 32: word i holds something

        def take(state, _):
            groups, word, place = state
            group, number = groups[-1], jnp.full((K, num_tasks), len(groups) - 1, jnp.int32)
            for i in range(len(groups) - 2, -1, -1):
                group, number = jnp.where(groups[i] != 0, groups[i], group), jnp.where(groups[i] != 0, i, number)
            first = _lowest(group)
            next_place = jnp.maximum(number * WORD + _position(first), 0)
            fetch = (word == 0) & (group != 0)
            word = jnp.where(fetch, jnp.take_along_axis(bitmap, next_place[None], 0)[0], word)
            place = jnp.where(fetch, next_place, place)
            groups = tuple(jnp.where(fetch & (number == i), g ^ first, g) for i, g in enumerate(groups))
            bit = _lowest(word)
            return (groups, word ^ bit, place), jnp.where(word != 0, place * WORD + _position(bit), -1)

        state = (groups, jnp.zeros((K, num_tasks), jnp.uint32), jnp.zeros((K, num_tasks), jnp.int32))
        return lax.scan(take, state, None, length=self.M, unroll=min(self.M, _UNROLL))[1].reshape(self.M * K, num_tasks)

    def p_step(self, situations, actions):
        """The situation before each candidate; candidate c came from situation c % K."""
        return (jnp.tile(situations, (1, self.M, 1)) & self.t.keeps[:, actions]) | self.t.needs[:, actions]

    def a_step(self, situations):
        """The rating of each situation by the sign's weights, int32 [C, B]."""
        rating = _weighted_count(list(situations), self.feature_digits)
        for table, digits in self.parts:
            rating = rating + _weighted_count(_needed(situations, table), digits)
        return rating

    def pick(self, before, key):
        """The K candidates of least key; each that leaves takes with it all that contain it. -> numbers, keys [K, B]."""
        last = jnp.int32(before.shape[1] - 1)

        def take(key, _):
            low = key.min(axis=0)
            number = jnp.minimum((low & jnp.uint32(0xFFFF)).astype(jnp.int32), last)
            best = jnp.take_along_axis(before, jnp.broadcast_to(number[None, None], (before.shape[0], 1, number.shape[0])), 1)
            contains = ((best & ~before) == 0).all(axis=0)
            return jnp.where(contains, _ALL, key), (number, low)

        return lax.scan(take, key, None, length=self.K, unroll=min(self.K, _UNROLL))[1]

    def iterate(self, state):
        step, situations, alive, seen, trail, solved, length = state
        actions = self.take_first(self.m_step(situations, alive & ~solved[None]))
        valid, actions = actions >= 0, jnp.maximum(actions, 0)
        before = self.p_step(situations, actions)
        tag = _hash(before)
        slot = (tag % jnp.uint32(_MEMORY)).astype(jnp.int32)
        valid = valid & (jnp.take_along_axis(seen, slot, 0) != tag)  # forget what was expanded before
        done = ((before & ~self.start_words[:, None]) == 0).all(
            axis=0
        )  # the stop rule, bit by bit; rating 0 means nothing else
        rating = jnp.where(done, jnp.int32(0), jnp.minimum(self.a_step(before), _MAX_RATING) + 1)
        number = jnp.arange(before.shape[1], dtype=jnp.uint32)[:, None]
        key = jnp.where(valid, (rating.astype(jnp.uint32) << 16) | number, _ALL)
        picked, best = self.pick(before, key)

        alive = best != _ALL
        lane = jnp.arange(solved.shape[0])[None]
        situations = jnp.take_along_axis(before, jnp.broadcast_to(picked[None], situations.shape), 1)
        kept_tag = jnp.take_along_axis(tag, picked, 0)
        kept_slot = jnp.where(alive, (kept_tag % jnp.uint32(_MEMORY)).astype(jnp.int32), _MEMORY)
        seen = seen.at[kept_slot, lane].set(kept_tag, mode="drop")
        chosen, parent = trail
        chosen = chosen.at[step].set(jnp.where(alive, jnp.take_along_axis(actions, picked, 0), -1))
        parent = parent.at[step].set(picked % self.K)
        now = alive[0] & (best[0] >> 16 == 0) & ~solved  # a finished situation always leaves first
        length = jnp.where(now, step + 1, length)
        return step + 1, situations, alive, seen, (chosen, parent), solved | now, length
