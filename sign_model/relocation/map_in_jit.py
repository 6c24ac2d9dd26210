"""MAP over working memory, inside any jitted loop: a batch of situations of one form, planned
together (PY16 §3.1).

    S := goal situation
    repeat  M-step  actions that explain a part of S, break nothing of it, and whose unchanging
            conditions hold P-step  the situation before each: (S & ~adds) | conditions A-step  rate
            each by how far off its features are, were nothing ever deleted; keep the best few that
            contain none
                    expanded before
    until S is included in the start: then the plan, replayed forward; or nothing is left

The matrices are constants (`working_memory`), situations are words with the batch as the minor
axis. It ends after `max_steps`. Nothing but elementwise operations, reductions and reads and writes
of whole rows: it can be compiled as a single function.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.loops import repeat
from sign_model.ground.records import Array
from sign_model.ground.words import num_words, pack_columns, pack_rows
from sign_model.relocation.working_memory import Attention

_NEVER = np.int32(2**31 - 1)
_SPARE = 5  # picks a step beyond the beam, for those that contain a situation expanded before


class MapPlans(NamedTuple):
    """Plans of a batch.

    actions: int32 [T, B], rows of `Attention.space`, in the order of execution, -1 after the last.
    num_actions: int32 [B], 0 without a plan.
    is_solved: bool [B]; the plan was replayed. is_proof: bool [B], no plan exists. Neither: the
      search was cut short.
    """

    actions: Array
    num_actions: Array
    is_solved: Array
    is_proof: Array


class _Search(NamedTuple):
    """step; situations uint32 [W, K, B] and which are alive, bool [K, B]; all expanded so far,
    uint32 [W, T, K, B]; the trail of chosen actions and their parents, int32 [T, K, B]; plan length
    int32 [B], _NEVER while open; was_cut bool [B]."""

    step: Array
    situations: Array
    is_alive: Array
    known: Array
    chosen: Array
    parent: Array
    length: Array
    was_cut: Array


def plan_situations(
    attention: Attention, start: Array, goal: Array, *, max_steps: int, beam: int = 3
) -> MapPlans:
    """Returns a plan for each pair of situations; deterministic, and independent of the batch
    around a pair.

    Ties go to the situation that came first, then to the lowest action.

    Args:
      attention: the working memory, fixed while tracing.
      start, goal: bool [F, B], features of `working_memory.space`.
      max_steps: T, the longest plan.
      beam: situations kept a step.
    """
    rules = _Rules(attention)
    given = rules.given(start)
    search = _first(rules.pack(goal), given, max_steps, beam)
    # Ends: after max_steps.
    end = lax.while_loop(
        lambda search: (search.step < max_steps) & search.is_alive.any(),
        lambda search: _iterate(search, rules, given),
        search,
    )
    is_solved = end.length < _NEVER
    length = jnp.where(is_solved, end.length, 0)
    actions = _unwound(end.chosen, end.parent, length)
    is_solved &= _is_replayed(rules, given, actions, rules.pack(goal))
    is_proof = (end.length == _NEVER) & ~end.was_cut & ~end.is_alive.any(axis=0)
    return MapPlans(
        jnp.where(is_solved[None], actions, -1),
        jnp.where(is_solved, length, 0),
        is_solved,
        is_proof,
    )


class _Given(NamedTuple):
    """A start.

    holds: uint32 [W, B], what holds of what actions change.
    possible: uint32 [W, B], what can come to hold if nothing is ever deleted.
    levels: uint32 [D, W, B], after how many rounds of that it does, in binary digits.
    usable: bool [A, B], the actions whose unchanging conditions hold.
    """

    holds: Array
    possible: Array
    levels: Array
    usable: Array


class _Rules:
    """The matrices as words: what actions change apart from what they never do. uint32 [W, A, 1]
    each.
    """

    def __init__(self, attention: Attention) -> None:
        space = attention.space
        changes = (space.adds | space.deletes).any(axis=0)
        self.changing, self.static = (
            np.flatnonzero(which).astype(np.int32) for which in (changes, ~changes)
        )

        def words(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
            packed = pack_rows(rows[:, places], max(1, num_words(len(places))))
            return np.ascontiguousarray(packed.T)[:, :, None]

        self.adds, self.deletes, self.bad = (
            words(m, self.changing) for m in (space.adds, space.deletes, space.bad)
        )
        self.needs, self.needs_static = (
            words(space.conditions, places) for places in (self.changing, self.static)
        )
        self.num_actions = len(space.adds)

    def given(self, start: Array) -> _Given:
        """bool [F, B]: a start."""
        usable = ((self.needs_static & ~pack_columns(start[self.static])[:, None]) == 0).all(axis=0)
        holds = self.pack(start)
        places = jnp.arange(len(self.changing).bit_length(), dtype=jnp.int32)

        def spread(state: tuple) -> tuple:
            level, reached, _, levels = state
            can = usable & ((self.needs & ~reached[:, None]) == 0).all(axis=0)
            gives = lax.reduce(
                jnp.where(can[None], self.adds, jnp.uint32(0)), jnp.uint32(0), lax.bitwise_or, (1,)
            )
            fresh, is_digit = gives & ~reached, (level >> places) & 1 == 1
            levels |= jnp.where(is_digit[:, None, None], fresh[None], jnp.uint32(0))
            return level + 1, reached | fresh, (fresh != 0).any(), levels

        first = (
            jnp.int32(1),
            holds,
            jnp.bool_(True),
            jnp.zeros((len(places), *holds.shape), jnp.uint32),
        )
        # Ends: every round but the last brings a new feature, so there are no more rounds than
        # features.
        _, possible, _, levels = lax.while_loop(lambda state: state[2], spread, first)
        return _Given(holds, possible, levels, usable)

    def pack(self, situation: Array) -> Array:
        """bool [F, B] -> uint32 [W, B]: the features that actions change."""
        return pack_columns(situation[self.changing])

    def row(self, matrix: np.ndarray, action: Array) -> Array:
        """The row of each action, uint32 [W, B]."""
        return jnp.asarray(matrix[:, :, 0])[:, action.clip(0)]


def _first(goal: Array, given: _Given, max_steps: int, beam: int) -> _Search:
    W, B = goal.shape
    is_done = ((goal & ~given.holds) == 0).all(axis=0)
    is_possible = ((goal & ~given.possible) == 0).all(axis=0)
    situations = jnp.broadcast_to(goal[:, None], (W, beam, B))
    is_alive = (jnp.arange(beam, dtype=jnp.int32)[:, None] == 0) & (is_possible & ~is_done)[None]
    # Unused places of the memory have every bit: only a situation with every bit contains one.
    known = jnp.full((W, max_steps + 1, beam, B), 0xFFFFFFFF, jnp.uint32)
    known = known.at[:, 0].set(jnp.where(is_alive[None], situations, jnp.uint32(0xFFFFFFFF)))
    trail = jnp.full((max_steps, beam, B), -1, jnp.int32)
    length = jnp.where(is_done, jnp.int32(0), jnp.int32(_NEVER))
    return _Search(
        jnp.int32(0), situations, is_alive, known, trail, trail, length, jnp.zeros(B, bool)
    )


def _iterate(search: _Search, rules: _Rules, given: _Given) -> _Search:
    A, (W, K, B) = rules.num_actions, search.situations.shape
    now = search.situations[:, None]  # [W, 1, K, B]; rules [W, A, 1, 1]
    adds, bad, needs = (words[..., None] for words in (rules.adds, rules.bad, rules.needs))
    before = (now & ~adds) | needs
    fits = (
        ((now & adds) != 0).any(axis=0)
        & ((now & bad) == 0).all(axis=0)
        & given.usable[:, None]
        & search.is_alive[None]
    )
    fits &= ((before & ~given.possible[:, None, None]) == 0).all(axis=0)
    before = before.reshape(W, A * K, B)
    rating = jnp.zeros((A * K, B), jnp.int32)
    for place, digit in enumerate(given.levels):
        rating += (
            lax.population_count(before & digit[:, None])
            .astype(jnp.int32)
            .sum(axis=0, dtype=jnp.int32)
            << place
        )
    number = jnp.arange(A * K, dtype=jnp.int32)[:, None]
    key = jnp.where(fits.reshape(A * K, B), rating * (A * K) + number, _NEVER)
    kept = (
        jnp.zeros((W, K, B), jnp.uint32),
        jnp.full((K, B), -1, jnp.int32),
        jnp.zeros(B, jnp.int32),
        key,
    )

    def pick(_: Array, kept: tuple) -> tuple:
        return _pick(kept, before, search.known)

    situations, places, _, key = repeat(K + _SPARE, pick, kept)
    is_kept = places >= 0
    is_done = is_kept[0] & ((situations[:, 0] & ~given.holds) == 0).all(axis=0)
    step = search.step
    return _Search(
        step=step + 1,
        situations=situations,
        is_alive=is_kept & ~is_done[None],
        known=_with_row(
            search.known,
            jnp.where(is_kept[None], situations, jnp.uint32(0xFFFFFFFF))[:, None],
            step + 1,
            1,
        ),
        chosen=_with_row(search.chosen, jnp.where(is_kept, places // K, -1)[None], step, 0),
        parent=_with_row(search.parent, jnp.where(is_kept, places % K, -1)[None], step, 0),
        length=jnp.where(is_done, step + 1, search.length),
        was_cut=search.was_cut | ((key < _NEVER).any(axis=0) & ~is_done),
    )


def _pick(kept: tuple, before: Array, known: Array) -> tuple:
    """Takes the candidate of least key, and all that contain it; it is kept where it contains no
    known one and finds room.
    """
    situations, places, num_kept, key = kept
    K = places.shape[0]
    least = key.min(axis=0)
    is_it = (key == least[None]) & (key < _NEVER)
    one = jnp.where(is_it[None], before, jnp.uint32(0)).sum(axis=1, dtype=jnp.uint32)
    is_new = is_it.any(axis=0) & ~((known & ~one[:, None, None]) == 0).all(axis=0).any(axis=(0, 1))
    goes = is_new & (num_kept < K)
    here = (jnp.arange(K, dtype=jnp.int32)[:, None] == num_kept[None]) & goes[None]
    contains = ((one[:, None] & ~before) == 0).all(axis=0)
    situations = jnp.where(here[None], one[:, None], situations)
    number = jnp.arange(key.shape[0], dtype=jnp.int32)[:, None]
    places = jnp.where(here, jnp.where(is_it, number, 0).sum(axis=0, dtype=jnp.int32)[None], places)
    # what finds no room stays, so that it is seen to have been cut off
    is_out = (is_it | contains) & (goes | ~is_new)[None]
    return situations, places, num_kept + goes.astype(jnp.int32), jnp.where(is_out, _NEVER, key)


def _with_row(array: Array, row: Array, place: Array, axis: int) -> Array:
    return lax.dynamic_update_slice_in_dim(array, row, place, axis)


def _unwound(chosen: Array, parent: Array, length: Array) -> Array:
    """Returns the actions in the order of execution, int32 [T, B]: the one chosen last goes
    first.
    """
    T, K, _ = chosen.shape
    beam = jnp.arange(K, dtype=jnp.int32)[:, None]

    def back(number: Array, state: tuple) -> tuple:
        at, actions = state
        step = length - 1 - number  # of the search, for each task
        is_on = step >= 0
        is_row = (jnp.arange(T, dtype=jnp.int32)[:, None, None] == step[None, None]) & (
            beam == at[None]
        )[None]
        action, up = (
            jnp.where(is_row, trail, 0).sum(axis=(0, 1), dtype=jnp.int32)
            for trail in (chosen, parent)
        )
        actions = _with_row(actions, jnp.where(is_on, action, -1)[None], number, 0)
        return jnp.where(is_on, up, at), actions

    nothing = jnp.full((T, length.shape[0]), -1, jnp.int32)
    return lax.fori_loop(
        np.int32(0), length.max().clip(0, T), back, (jnp.zeros_like(length), nothing)
    )[1]


def _is_replayed(rules: _Rules, given: _Given, actions: Array, goal: Array) -> Array:
    """Returns whether each plan, carried out from the start, is possible and ends in the goal: bool
    [B].
    """
    which = jnp.arange(rules.num_actions, dtype=jnp.int32)[:, None]

    def act(number: Array, state: tuple) -> tuple:
        situation, is_right = state
        action = lax.dynamic_index_in_dim(actions, number, keepdims=False)
        is_on = action >= 0
        can = (given.usable & (which == action[None])).any(axis=0) & (
            (rules.row(rules.needs, action) & ~situation) == 0
        ).all(axis=0)
        after = (situation & ~rules.row(rules.deletes, action)) | rules.row(rules.adds, action)
        return jnp.where(is_on[None], after, situation), is_right & (can | ~is_on)

    num_steps = (actions >= 0).any(axis=1).sum(dtype=jnp.int32)
    end, is_right = lax.fori_loop(
        np.int32(0), num_steps, act, (given.holds, jnp.ones(actions.shape[1], bool))
    )
    return is_right & ((goal & ~end) == 0).all(axis=0)
