"""The MAP iteration carried out forwards: from the start towards the goal, as PY16 §3.1 words it.

    S := start
    repeat  A-step  take the situations of best rating
            M-step  scripts whose conditions are included in S; those of its relaxed plan first
            P-step  the situation after each: (S & ~deletes) | adds
                    forget it if it was reached before
            rate all of them together by the length of their relaxed plans
    until the goal is included in S, or nothing is left

A rating is also a proposal: the relaxed plan itself, a script of scripts, is carried out as far as
its conditions allow, and where it ends is one more situation (Vidal 2004 calls it a lookahead). So
where deletes hardly matter a few ratings lead to the goal. Two queues take turns, one of the
scripts of the relaxed plans and one of all scripts; the first is favoured while it makes progress
(Richter & Westphal 2010).

Nothing is cut off: when both queues are empty, there is no plan. Deterministic: ties go to the
situation met first.
"""

import heapq
from collections.abc import Callable

import numpy as np

from sign_model.bits import NumberedRows, as_bytes, as_number, as_words, pack, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.forward_search.relaxed_costs import RelaxedCosts
from sign_model.strategies.landmarks_left import LandmarksLeft

_AT_ONCE = 32
"""How many situations are rated together; half of them where they are deferred."""

_PREPARED = 32
"""So many situations after one are prepared together, though each waits for its turn."""

_MOST_KEYS = 1 << 18
"""For so many situations it is remembered by what they are known: many are met again and again."""

_BOOST = 1000
"""How many turns the queue of the relaxed plans gains by progress."""

Canonical = Callable[[np.ndarray], np.ndarray]
"""Situations bool [N, F] -> the same, each exchanged for the one that stands for all its like."""


class Scripts:
    """The actions of one task, prepared once for all forward searches.

    Args:
      conditions, adds, deletes: bool [A, F].
      clock: asked in every phase.
    """

    def __init__(
        self,
        conditions: np.ndarray,
        adds: np.ndarray,
        deletes: np.ndarray,
        clock: Clock = NO_LIMIT,
    ) -> None:
        self.relaxed = RelaxedCosts(conditions, adds, np.ones(len(adds), np.int64), clock=clock)
        self.rows, self.num_features = NumberedRows(conditions, adds, deletes), adds.shape[1]
        self.gives, self.keeps = pack(adds), ~pack(deletes)

    def fitting(self, state: np.ndarray) -> np.ndarray:
        """Returns the M-step: the actions whose conditions are included in a situation, bool
        [F].
        """
        met = np.bincount(
            self.relaxed.needed_by.of(np.flatnonzero(state)), minlength=self.relaxed.num_actions
        )
        return np.flatnonzero(met == self.relaxed.needs.count)

    def carried_out(self, words: np.ndarray, actions: list[int]) -> tuple[np.ndarray, list[int]]:
        """Returns (the situation after, the actions that could go in the order in which they went).

        Ends: an action goes once.

        Args:
          words: the situation before, uint64 [W].
          actions: gone through again and again while one of them can go.
        """
        state, taken = as_number(words), []
        while True:
            left = []
            for action in actions:
                conditions, adds, deletes = self.rows.of(action)
                if conditions & ~state:
                    left.append(action)
                else:
                    state = (state & ~deletes) | adds
                    taken.append(action)
            if len(left) in (0, len(actions)):
                return as_words(state, self.num_features), taken
            actions = left


class Forwards:
    """A forward search of one task that can be continued.

    Args:
      scripts: of the task.
      start, goal: bool [F].
      is_bold: whether relaxed plans are carried out as far as they go.
      is_deferred: whether a situation waits under the rating of the one before it, and is rated
        only when its turn comes: fewer ratings, longer plans.
      landmarks: of the goal, as a second rating with queues of its own; None for none.
      canonical: of situations that differ only by objects alike; None if none are.
      at_once: how many situations are rated together, half of them where they are deferred: the
        fewer, the sooner there is a plan, and the longer it is.
      clock: asked before each rating; OutOfTime once its limit has passed.

    Attributes:
      plan: actions in the order of execution, once one was found.
      expansions: situations rated.
    """

    def __init__(
        self,
        scripts: Scripts,
        start: np.ndarray,
        goal: np.ndarray,
        *,
        is_bold: bool = False,
        is_deferred: bool = False,
        landmarks: LandmarksLeft | None = None,
        canonical: Canonical | None = None,
        at_once: int = _AT_ONCE,
        clock: Clock = NO_LIMIT,
    ) -> None:
        self.at_once = at_once
        self.clock, self.canonical, self.num_features = clock, canonical, len(start)
        self.is_bold, self.is_deferred, self.landmarks = is_bold, is_deferred, landmarks
        self.goal, self.goal_words = np.flatnonzero(goal), pack(goal)
        self.scripts, self.relaxed = scripts, scripts.relaxed

        # The situations met, and for those in the queues the first scripts of their relaxed plans.
        self.words: list[np.ndarray] = []
        self.parents: list[int] = []
        self.steps: list[tuple[int, ...]] = []
        self.first: dict[int, np.ndarray] = {}
        self.fitting: dict[int, np.ndarray] = {}
        self.seen: set[bytes] = set()
        self.reached: list[np.ndarray] = []
        ratings = 1 if landmarks is None else 2
        self.queues: list[list[tuple[int, int, int]]] = [[] for _ in range(2 * ratings)]
        self.turns = [0] * (2 * ratings)
        self.best, self.expansions = [1 << 40] * ratings, 0
        self.plan: list[int] | None = None
        self.key_of: dict[bytes, bytes] = {}
        self.prepared: dict[tuple[int, int], tuple[np.ndarray, list[bytes]]] = {}
        first = pack(start)[None]
        self.waiting = self._met(first, [-1], [()], self._keys(first))

    @property
    def is_exhausted(self) -> bool:
        """Whether every situation was seen and none includes the goal: a proof."""
        return self.plan is None and not self.waiting and not any(self.queues)

    def advance(self, max_expansions: int) -> None:
        """Continues until there is a plan, nothing is left, or `max_expansions` have been made in
        all.
        """
        while self.plan is None and self.expansions < max_expansions and not self.is_exhausted:
            if not self.waiting:
                self.waiting = self._children()
                continue
            count = min(self.at_once, max_expansions - self.expansions)
            now, self.waiting = self.waiting[:count], self.waiting[count:]
            self.waiting = self._rate(now) + self.waiting

    def _rate(self, numbers: list[int]) -> list[int]:
        """Rates situations, puts them into the queues, and returns where their best relaxed plans
        lead.
        """
        self.clock.check()
        self.expansions += len(numbers)
        states = unpack(np.array([self.words[n] for n in numbers]), self.num_features)
        cost = self.relaxed.from_states(states)
        can_reach = np.all(cost[self.goal] < self.relaxed.far, axis=0)
        plans = self.relaxed.relaxed_plans(states[can_reach], cost[:, can_reach], self.goal)
        if not self.relaxed.is_exact(cost):  # too dear to count is not unreachable: last of all
            for number, is_counted in zip(numbers, can_reach.tolist()):
                if not is_counted:
                    heapq.heappush(self.queues[1], (1 << 40, number, 0))

        # Their relaxed plans, each in the order in which its actions become ready.
        order = np.lexsort((plans.action, plans.ready, plans.owner))
        actions, ready = plans.action[order], plans.ready[order]
        alive = [n for n, reaches in zip(numbers, can_reach.tolist()) if reaches]
        lengths = np.bincount(plans.owner, minlength=len(alive))
        ends = np.cumsum(lengths)
        of_state = {n: slice(end - k, end) for n, end, k in zip(alive, ends, lengths)}

        # The queues, two for each rating; progress favours the scripts of the relaxed plans.
        if not alive:
            return []
        for number in alive:
            part = of_state[number]
            self.first[number] = actions[part][ready[part] == 0]
        ratings = [lengths.tolist()]
        if self.landmarks is not None:
            reached = np.array([self.reached[n] for n in alive])
            ratings.append(self.landmarks.left(states[can_reach], reached).tolist())
        has_progress = False
        for i, row in enumerate(ratings):
            for number, rating in zip(alive, row):
                heapq.heappush(self.queues[2 * i], (rating, number, 0))
                heapq.heappush(self.queues[2 * i + 1], (rating, number, 0))
            if min(row) < self.best[i]:
                self.best[i], has_progress = min(row), True
        if has_progress:
            for i in range(len(ratings)):
                self.turns[2 * i] -= _BOOST
        if not self.is_bold:
            return []
        leader = alive[int(lengths.argmin())]
        return self._ahead(leader, actions[of_state[leader]].tolist())

    def _ahead(self, number: int, actions: list[int]) -> list[int]:
        """Carries out a relaxed plan as far as it goes, and returns the situation where it ends, if
        that is new.
        """
        words, taken = self.scripts.carried_out(self.words[number], actions)
        if len(taken) < 2:
            return []
        return self._met(words[None], [number], [tuple(taken)], self._keys(words[None]))

    def _children(self) -> list[int]:
        """Takes situations from the queues, and returns the new ones that follow them."""
        found: list[int] = []
        most = -(-self.at_once // 2) if self.is_deferred else self.at_once
        while len(found) < most and any(self.queues) and self.plan is None:
            turn = min((t, i) for i, t in enumerate(self.turns) if self.queues[i])[1]
            self.turns[turn] += 1
            rating, number, place = heapq.heappop(self.queues[turn])
            if turn % 2 == 0:
                actions = self.first[number]
            else:
                actions = self._fitting(number)
            if not self.is_deferred:
                after = self._after(number, actions)
                steps = [(action,) for action in actions.tolist()]
                found += self._met(after, [number] * len(actions), steps, self._keys(after))
                continue
            # One after another; the rest waits in the same place.
            if place + 1 < len(actions):
                heapq.heappush(self.queues[turn], (rating, number, place + 1))
            if not len(actions):
                continue
            key, at = (number, turn), place % _PREPARED
            if not at:
                after = self._after(number, actions[place : place + _PREPARED])
                self.prepared[key] = after, self._keys(after)
            after, keys = self.prepared[key]
            one = slice(at, at + 1)
            found += self._met(after[one], [number], [(int(actions[place]),)], keys[one])
            if place + 1 == len(actions):
                del self.prepared[key]
        return found

    def _after(self, number: int, actions: np.ndarray) -> np.ndarray:
        """Returns the situations after one by each action, uint64 [n, W]."""
        keeps, gives = self.scripts.keeps[actions], self.scripts.gives[actions]
        return (self.words[number] & keeps) | gives

    def _keys(self, words: np.ndarray) -> list[bytes]:
        """Returns what situations, uint64 [n, W], are known by: the same for those alike."""
        keys = as_bytes(words)
        if self.canonical is None:
            return keys
        if len(self.key_of) > _MOST_KEYS:
            self.key_of.clear()
        new = [i for i, key in enumerate(keys) if key not in self.key_of]
        if new:
            likes = pack(self.canonical(unpack(words[new], self.num_features)))
            self.key_of.update(zip((keys[i] for i in new), as_bytes(likes)))
        return [self.key_of[key] for key in keys]

    def _fitting(self, number: int) -> np.ndarray:
        """Returns the actions that can go in a situation."""
        if number not in self.fitting:
            self.fitting[number] = self.scripts.fitting(
                unpack(self.words[number], self.num_features)
            )
        return self.fitting[number]

    def _met(
        self,
        words: np.ndarray,
        parents: list[int],
        steps: list[tuple[int, ...]],
        keys: list[bytes],
    ) -> list[int]:
        """Remembers situations, uint64 [n, W], that are new by their keys, and returns their
        numbers; the first that includes the goal gives the plan.
        """
        done = ~np.any(self.goal_words & ~words, axis=1)
        found = []
        for i, key in enumerate(keys):
            if key in self.seen:
                continue
            self.seen.add(key)
            found.append(len(self.words))
            self.words.append(words[i])
            self.parents.append(parents[i])
            self.steps.append(steps[i])
            if self.landmarks is not None:
                past = self.reached[parents[i]] if parents[i] >= 0 else np.uint64(0)
                self.reached.append(past | words[i])
            if done[i] and self.plan is None:
                self.plan = self._plan_to(found[-1])
        return found

    def _plan_to(self, number: int) -> list[int]:
        parts = []
        while number >= 0:
            parts.append(self.steps[number])
            number = self.parents[number]
        return [action for part in reversed(parts) for action in part]
