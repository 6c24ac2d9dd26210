"""MAP over working memory, inside any jitted loop: a batch of situations of one form, planned
together (PY16 §3.1).

    S := goal situation
    repeat  M-step  actions that explain a part of S, break nothing of it, and whose unchanging
                    conditions hold
            P-step  the situation before each: (S & ~adds) | conditions
            A-step  rate each by how far its features are from the start if nothing were ever
                    deleted; keep the best few that contain no situation expanded before
    until S is included in the start: then the plan is replayed forward; or nothing is left

The matrices are constants (`working_memory`); situations are words with the batch as the last axis.
It ends after `max_steps`. There is nothing but elementwise operations, reductions and reads and
writes of whole rows, so it can be compiled as a single function.

Shapes: B tasks, F features, W words of features, A actions, K situations in the beam, T steps, D
binary digits of a rating.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import repeat
from sign_model.foundation.records import Array
from sign_model.foundation.words import num_words, pack_columns, pack_rows
from sign_model.relocation.working_memory import WorkingMemory

_NEVER = np.int32(2**31 - 1)
# Selections in a step beyond the beam, to make up for those that contain a situation expanded
# before.
_SPARE = 5


class MapPlans(NamedTuple):
    """Plans of a batch.

    actions: int32 [T, B], rows of `WorkingMemory.space`, in the order of execution, -1 after the
      last.
    num_actions: int32 [B], 0 without a plan.
    is_solved: bool [B]; the plan was replayed.
    is_proof: bool [B], no plan exists. Neither solved nor proof: the search was cut short.
    """

    actions: Array
    num_actions: Array
    is_solved: Array
    is_proof: Array


class _Search(NamedTuple):
    """The carry of the search loop."""

    step: Array  # int32 [], steps taken
    situations: Array  # uint32 [W, K, B], the beam
    is_alive: Array  # bool [K, B], which situations of the beam are in use
    known: Array  # uint32 [W, T + 1, K, B], all situations expanded so far
    chosen: Array  # int32 [T, K, B], the trail: the action that led to each situation, and
    parent: Array  # int32 [T, K, B], the situation of the step before from which it led there
    length: Array  # int32 [B], of the plan; _NEVER while there is none
    was_cut: Array  # bool [B], whether a candidate was left out for lack of room


def plan_situations(
    memory: WorkingMemory, start: Array, goal: Array, *, max_steps: int, beam: int = 3
) -> MapPlans:
    """Returns a plan for each pair of situations; deterministic, and independent of the batch
    around a pair.

    Ties go to the situation that came first, then to the lowest action.

    Args:
      memory: the working memory, fixed while tracing.
      start, goal: bool [F, B], features of `memory.space`.
      max_steps: T, the longest plan.
      beam: situations kept in each step, K.
    """
    # Search. Ends: after max_steps.
    rules = _Rules(memory)
    given = rules.given(start)
    search = _first(rules.pack(goal), given, max_steps, beam)
    end = lax.while_loop(
        lambda search: (search.step < max_steps) & search.is_alive.any(),
        lambda search: _iterate(search, rules, given),
        search,
    )

    # Read the plans from the trail, and replay them.
    is_solved = end.length < _NEVER
    length = jnp.where(is_solved, end.length, 0)
    actions = _unwind(end.chosen, end.parent, length)
    is_solved &= _is_replayed(rules, given, actions, rules.pack(goal))

    # Nothing is left and nothing was left out: then there is no plan.
    is_proof = (end.length == _NEVER) & ~end.was_cut & ~end.is_alive.any(axis=0)
    return MapPlans(
        jnp.where(is_solved[None], actions, -1),
        jnp.where(is_solved, length, 0),
        is_solved,
        is_proof,
    )


class _Given(NamedTuple):
    """What is known of a start."""

    holds: Array  # uint32 [W, B], what holds, of the features that actions change
    possible: Array  # uint32 [W, B], what can become true if nothing is ever deleted
    # uint32 [D, W, B], the round of that spread in which it becomes true, in binary digits
    levels: Array
    usable: Array  # bool [A, B], the actions whose unchanging conditions hold


class _Spread(NamedTuple):
    """The carry of the spread from a start: what can become true, round by round."""

    level: Array  # int32 [], the round to come
    reached: Array  # uint32 [W, B]
    is_changed: Array  # bool [], whether the last round brought a new feature
    levels: Array  # uint32 [D, W, B]


class _Rules:
    """The matrices as words, uint32 [W, A, 1] each. Features that actions change are packed apart
    from those that never change.
    """

    def __init__(self, memory: WorkingMemory) -> None:
        # Which features change at all, and the matrices over each of the two sets.
        space = memory.space
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
        """Returns what is known of a start, bool [F, B]."""
        usable = ((self.needs_static & ~pack_columns(start[self.static])[:, None]) == 0).all(axis=0)
        holds = self.pack(start)
        places = jnp.arange(len(self.changing).bit_length(), dtype=jnp.int32)

        def spread(state: _Spread) -> _Spread:
            # Every usable action whose conditions are reached adds what it adds.
            can = usable & ((self.needs & ~state.reached[:, None]) == 0).all(axis=0)
            gives = lax.reduce(
                jnp.where(can[None], self.adds, jnp.uint32(0)), jnp.uint32(0), lax.bitwise_or, (1,)
            )
            # Note the round of what is new, in binary digits.
            fresh, is_digit = gives & ~state.reached, (state.level >> places) & 1 == 1
            levels = state.levels | jnp.where(is_digit[:, None, None], fresh[None], jnp.uint32(0))
            return _Spread(state.level + 1, state.reached | fresh, (fresh != 0).any(), levels)

        first = _Spread(
            jnp.int32(1),
            holds,
            jnp.bool_(True),
            jnp.zeros((len(places), *holds.shape), jnp.uint32),
        )
        # Ends: every round but the last brings a new feature, so there are no more rounds than
        # features.
        end = lax.while_loop(lambda state: state.is_changed, spread, first)
        return _Given(holds, end.reached, end.levels, usable)

    def pack(self, situation: Array) -> Array:
        """Returns the features that actions change: bool [F, B] -> uint32 [W, B]."""
        return pack_columns(situation[self.changing])

    def row(self, matrix: np.ndarray, action: Array) -> Array:
        """Returns the row of each action, int32 [B] -> uint32 [W, B]."""
        return jnp.asarray(matrix[:, :, 0])[:, action.clip(0)]


def _first(goal: Array, given: _Given, max_steps: int, beam: int) -> _Search:
    """Returns the search before its first step: the beam holds the goal, uint32 [W, B], alone."""
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


class _Picks(NamedTuple):
    """The carry of the selection in a step."""

    situations: Array  # uint32 [W, K, B], those kept so far
    candidates: Array  # int32 [K, B], their numbers among the candidates, -1 where there is none
    count: Array  # int32 [B], how many are kept
    key: Array  # int32 [A K, B], of the candidates that are left; _NEVER once one is removed


def _iterate(search: _Search, rules: _Rules, given: _Given) -> _Search:
    """Returns the search after one step: M- and P-step, A-step, and the best K."""
    W, K, B = search.situations.shape
    before, fits = _candidates(search, rules, given)

    key = _keys(before, fits, given.levels)

    # Keep the best K.
    nothing = _Picks(
        jnp.zeros((W, K, B), jnp.uint32),
        jnp.full((K, B), -1, jnp.int32),
        jnp.zeros(B, jnp.int32),
        key,
    )

    def pick(_: Array, picks: _Picks) -> _Picks:
        return _pick(picks, before, search.known)

    picks = repeat(K + _SPARE, pick, nothing)

    # Stop where the best one is included in the start; the rest is the beam of the next step.
    is_kept = picks.candidates >= 0
    is_done = is_kept[0] & ((picks.situations[:, 0] & ~given.holds) == 0).all(axis=0)
    step = search.step
    return _Search(
        step=step + 1,
        situations=picks.situations,
        is_alive=is_kept & ~is_done[None],
        known=_with_row(
            search.known,
            jnp.where(is_kept[None], picks.situations, jnp.uint32(0xFFFFFFFF))[:, None],
            step + 1,
            1,
        ),
        chosen=_with_row(
            search.chosen, jnp.where(is_kept, picks.candidates // K, -1)[None], step, 0
        ),
        parent=_with_row(
            search.parent, jnp.where(is_kept, picks.candidates % K, -1)[None], step, 0
        ),
        length=jnp.where(is_done, step + 1, search.length),
        was_cut=search.was_cut | ((picks.key < _NEVER).any(axis=0) & ~is_done),
    )


def _candidates(search: _Search, rules: _Rules, given: _Given) -> tuple[Array, Array]:
    """Returns the situation before each action from each situation of the beam, uint32 [W, A K, B],
    and which of them are candidates, bool [A, K, B]; number a K + k comes from situation k by
    action a.
    """
    A, (W, K, B) = rules.num_actions, search.situations.shape
    now = search.situations[:, None]  # [W, 1, K, B]; rules [W, A, 1, 1]
    adds, bad, needs = (words[..., None] for words in (rules.adds, rules.bad, rules.needs))
    # P-step: the situation before each action.
    before = (now & ~adds) | needs
    # M-step: the action explains a part, breaks nothing and is usable,
    fits = (
        ((now & adds) != 0).any(axis=0)
        & ((now & bad) == 0).all(axis=0)
        & given.usable[:, None]
        & search.is_alive[None]
    )
    # and the situation before it can be reached from the start if nothing is ever deleted.
    fits &= ((before & ~given.possible[:, None, None]) == 0).all(axis=0)
    return before.reshape(W, A * K, B), fits


def _keys(before: Array, fits: Array, levels: Array) -> Array:
    """Returns the key of each candidate, int32 [A K, B]: its rating, then its number; _NEVER for
    those that do not fit.

    The rating of a situation (A-step) is the sum of the levels of its features: the rounds in which
    they become true if nothing is ever deleted.

    Args:
      before: uint32 [W, A K, B].
      fits: bool [A, K, B].
      levels: uint32 [D, W, B], in binary digits.
    """
    _, size, B = before.shape
    rating = jnp.zeros((size, B), jnp.int32)
    for place, digit in enumerate(levels):
        rating += (
            lax.population_count(before & digit[:, None])
            .astype(jnp.int32)
            .sum(axis=0, dtype=jnp.int32)
            << place
        )
    number = jnp.arange(size, dtype=jnp.int32)[:, None]
    return jnp.where(fits.reshape(size, B), rating * size + number, _NEVER)


def _pick(picks: _Picks, before: Array, known: Array) -> _Picks:
    """Returns the selection after the candidate of least key was taken, with all that contain it.
    It is kept if it contains no known situation and there is room.

    Args:
      picks: the selection so far.
      before: uint32 [W, A K, B], the candidates.
      known: uint32 [W, T + 1, K, B], the situations expanded so far.
    """
    # The best candidate, uint32 [W, B], and whether it contains a known situation.
    K = picks.candidates.shape[0]
    least = picks.key.min(axis=0)
    is_it = (picks.key == least[None]) & (picks.key < _NEVER)
    one = jnp.where(is_it[None], before, jnp.uint32(0)).sum(axis=1, dtype=jnp.uint32)
    is_new = is_it.any(axis=0) & ~((known & ~one[:, None, None]) == 0).all(axis=0).any(axis=(0, 1))

    # Keep it in the first free place.
    is_kept = is_new & (picks.count < K)
    here = (jnp.arange(K, dtype=jnp.int32)[:, None] == picks.count[None]) & is_kept[None]
    contains = ((one[:, None] & ~before) == 0).all(axis=0)
    situations = jnp.where(here[None], one[:, None], picks.situations)
    number = jnp.arange(picks.key.shape[0], dtype=jnp.int32)[:, None]
    candidates = jnp.where(
        here, jnp.where(is_it, number, 0).sum(axis=0, dtype=jnp.int32)[None], picks.candidates
    )

    # Remove it, and all that contain it. What finds no room stays: so the search knows that it was
    # cut off.
    is_out = (is_it | contains) & (is_kept | ~is_new)[None]
    return _Picks(
        situations,
        candidates,
        picks.count + is_kept.astype(jnp.int32),
        jnp.where(is_out, _NEVER, picks.key),
    )


def _with_row(array: Array, row: Array, place: Array, axis: int) -> Array:
    """Returns the array with `row` written at index `place` of an axis."""
    return lax.dynamic_update_slice_in_dim(array, row, place, axis)


class _Unwinding(NamedTuple):
    """The carry of the walk back along the trail."""

    at: Array  # int32 [B], the situation of the beam to follow
    actions: Array  # int32 [T, B], written so far


def _unwind(chosen: Array, parent: Array, length: Array) -> Array:
    """Returns the actions in the order of execution, int32 [T, B]: the action chosen last is
    executed first.

    Args:
      chosen, parent: int32 [T, K, B], the trail.
      length: int32 [B], of each plan, 0 without one.
    """
    T, K, _ = chosen.shape
    beam = jnp.arange(K, dtype=jnp.int32)[:, None]

    def back(number: Array, state: _Unwinding) -> _Unwinding:
        # The entry of the trail to read, as a mask: each task has its own step and place.
        step = length - 1 - number
        is_on = step >= 0
        is_row = (jnp.arange(T, dtype=jnp.int32)[:, None, None] == step[None, None]) & (
            beam == state.at[None]
        )[None]
        action, up = (
            jnp.where(is_row, trail, 0).sum(axis=(0, 1), dtype=jnp.int32)
            for trail in (chosen, parent)
        )
        # Write the action and follow its parent.
        actions = _with_row(state.actions, jnp.where(is_on, action, -1)[None], number, 0)
        return _Unwinding(jnp.where(is_on, up, state.at), actions)

    nothing = jnp.full((T, length.shape[0]), -1, jnp.int32)
    return lax.fori_loop(
        np.int32(0), length.max().clip(0, T), back, _Unwinding(jnp.zeros_like(length), nothing)
    ).actions


class _Replay(NamedTuple):
    """The carry of a replay."""

    situation: Array  # uint32 [W, B]
    is_right: Array  # bool [B], whether every action so far was possible


def _is_replayed(rules: _Rules, given: _Given, actions: Array, goal: Array) -> Array:
    """Returns whether each plan, executed from the start, is possible and ends in the goal: bool
    [B].

    Args:
      rules, given: the matrices and the start.
      actions: int32 [T, B], -1 after the last.
      goal: uint32 [W, B].
    """
    which = jnp.arange(rules.num_actions, dtype=jnp.int32)[:, None]

    def act(number: Array, state: _Replay) -> _Replay:
        # -1 is no action: the situation stays as it is.
        situation, is_right = state
        action = lax.dynamic_index_in_dim(actions, number, keepdims=False)
        is_on = action >= 0
        can = (given.usable & (which == action[None])).any(axis=0) & (
            (rules.row(rules.needs, action) & ~situation) == 0
        ).all(axis=0)
        after = (situation & ~rules.row(rules.deletes, action)) | rules.row(rules.adds, action)
        return _Replay(jnp.where(is_on[None], after, situation), is_right & (can | ~is_on))

    num_steps = (actions >= 0).any(axis=1).sum(dtype=jnp.int32)
    end, is_right = lax.fori_loop(
        np.int32(0), num_steps, act, _Replay(given.holds, jnp.ones(actions.shape[1], bool))
    )
    return is_right & ((goal & ~end) == 0).all(axis=0)
