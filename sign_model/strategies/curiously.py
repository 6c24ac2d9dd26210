"""Plans by curiosity: what holds together for the first time is looked at first.

A situation is new in the first degree if a feature holds in it that never held before, in the
second if a feature has come to hold beside one that never held with it before, and else in the
third. Only situations are compared that have as many goals left, and as many features of one
relaxed plan behind them (Lipovetzky & Geffner 2017, who call it best-first width search).

    S := start
    repeat  A-step  take the situation of the lowest degree; of those the one with the fewest
                    goals left, then with the least of its relaxed plan ahead
            M-step  scripts whose conditions are included in S
            P-step  the situation after each: (S & ~deletes) | adds
                    forget it if it was reached before
    until the goal is included in S, or nothing is left

A relaxed plan is made only where a goal more holds than before, so most situations cost a few
operations on whole numbers. That goes far where relaxed plans mislead: puzzles, and tasks in which
a goal has to be given up for another. The plans are longer than those of other ways.

Nothing is cut off: when nothing is left, there is no plan. Deterministic: ties go to the situation
met first.
"""

import heapq

import numpy as np

from sign_model.bits import as_number, as_words, pack, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.strategies.forwards import Scripts

_MET_PER_EXPANSION = 4
"""So many situations met count as one expanded: about what they take."""

_MAX_WORDS = 1 << 24
"""The most words that remember which features held together."""

_CHECKED_EVERY = 32
"""How many situations are expanded between two looks at the clock."""


class Curiously:
    """A search by novelty that can be continued.

    Args:
      scripts: of the task.
      start, goal: bool [F].
      clock: asked again and again; OutOfTime once its limit has passed.

    Attributes:
      plan: actions in the order of execution, once one was found.
    """

    def __init__(
        self, scripts: Scripts, start: np.ndarray, goal: np.ndarray, *, clock: Clock = NO_LIMIT
    ) -> None:
        self.scripts, self.clock, self.num_features = scripts, clock, len(start)
        self.goal, self.goal_numbers = as_number(pack(goal)), np.flatnonzero(goal)

        # The situations met: how each was reached, its goals left, and of the relaxed plan that it
        # follows the features, and those of them that have held since.
        self.states: list[int] = []
        self.parents: list[int] = []
        self.actions: list[int] = []
        self.left: list[int] = []
        self.follows: list[tuple[int, int]] = []
        self.without_plan: set[int] = set()
        self.seen: set[int] = set()

        # For those compared with each other: what has held, and beside what each feature has.
        self.held: dict[tuple[int, int], int] = {}
        self.beside: dict[tuple[int, int], dict[int, int]] = {}
        self.words_left = _MAX_WORDS
        self.queue: list[tuple[int, int, int, int]] = []
        self.plan: list[int] | None = None
        self.popped = 0
        self._meet(as_number(pack(start)), -1, -1)

    @property
    def expansions(self) -> int:
        """The situations expanded, or a share of those met if that is more."""
        return max(self.popped, len(self.states) // _MET_PER_EXPANSION)

    @property
    def is_exhausted(self) -> bool:
        """Whether every situation was seen and none includes the goal: a proof."""
        return self.plan is None and not self.queue

    def advance(self, max_expansions: int) -> None:
        """Continues until there is a plan, nothing is left, or `max_expansions` have been made in
        all.
        """
        while self.plan is None and self.queue and self.expansions < max_expansions:
            if self.popped % _CHECKED_EVERY == 0:
                self.clock.check()
            *_, number = heapq.heappop(self.queue)
            self.popped += 1
            if number in self.without_plan:
                self.without_plan.discard(number)
                wanted = self._relaxed_plan(self.states[number])
                if wanted is None:  # the goal can't be reached from here
                    continue
                self.follows[number] = wanted, 0
            self._expand(number)

    def _expand(self, number: int) -> None:
        """Meets the situations after one, until one of them includes the goal."""
        state = self.states[number]
        for action in self.scripts.fitting(self._bits(state)).tolist():
            _, adds, deletes = self.scripts.rows.of(action)
            after = (state & ~deletes) | adds
            if after not in self.seen:
                self._meet(after, number, action)
                if self.plan is not None:
                    return

    def _meet(self, state: int, parent: int, action: int) -> None:
        """Remembers a new situation, and puts it into the queue."""
        number, left = len(self.states), (self.goal & ~state).bit_count()
        wanted = behind = 0
        if parent < 0 or left < self.left[parent]:
            self.without_plan.add(number)
        else:
            wanted, behind = self.follows[parent]
            behind |= wanted & state
        self.seen.add(state)
        self.states.append(state)
        self.parents.append(parent)
        self.actions.append(action)
        self.left.append(left)
        self.follows.append((wanted, behind))
        if not left:
            self.plan = self._plan_to(number)
            return
        degree = self._degree(number)
        heapq.heappush(self.queue, (degree, left, (wanted & ~behind).bit_count(), number))

    def _degree(self, number: int) -> int:
        """Returns the degree of novelty of a situation, and remembers what holds in it."""
        state, parent, key = self.states[number], self.parents[number], self._compared(number)
        known = self.held.get(key, 0)
        self.held[key] = known | state
        degree = 1 if state & ~known else 3

        # What has just come to hold; where it is compared with others than before, all of it.
        fresh = state
        if known and parent >= 0 and self._compared(parent) == key:
            fresh &= ~self.states[parent]
        rows = self.beside.setdefault(key, {})
        while fresh:
            lowest = fresh & -fresh
            fresh ^= lowest
            feature = lowest.bit_length()
            row = rows.get(feature, 0)
            if state & ~row and self.words_left > 0:
                degree = min(degree, 2)
                if not row:
                    self.words_left -= 16 + self.num_features // 64
                rows[feature] = row | state
        return degree

    def _compared(self, number: int) -> tuple[int, int]:
        """Returns the key of the situations with which one is compared."""
        return self.left[number], self.follows[number][1].bit_count()

    def _relaxed_plan(self, state: int) -> int | None:
        """Returns the features that a relaxed plan brings about; None if there is none, 0 where it
        is too dear to be counted.
        """
        relaxed, bits = self.scripts.relaxed, self._bits(state)[None]
        cost = relaxed.from_states(bits)
        if (cost[self.goal_numbers, 0] >= relaxed.far).any():
            return None if relaxed.is_exact(cost) else 0
        wanted = 0
        for action in relaxed.relaxed_plans(bits, cost, self.goal_numbers).action.tolist():
            wanted |= self.scripts.rows.of(action)[1]
        return wanted & ~state

    def _bits(self, state: int) -> np.ndarray:
        return unpack(as_words(state, self.num_features), self.num_features)

    def _plan_to(self, number: int) -> list[int]:
        actions = []
        while self.parents[number] >= 0:
            actions.append(self.actions[number])
            number = self.parents[number]
        return actions[::-1]
