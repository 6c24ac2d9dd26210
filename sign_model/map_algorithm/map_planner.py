"""The MAP iteration for one task, on the host: goal regression with a beam that widens until there
is a plan or a proof.

    S := goal
    repeat  M-step  actions whose causal matrices fit: they explain a part of S and break nothing
                    of it
            P-step  the situation before each: (S & ~adds) | conditions
                    forget it if it, or a part of it, was reached before by a plan at most as long
            A-step  rate the rest by a heuristic sign, keep the best
    until S is included in the start, or nothing is left

(PY16 §3.1; regression as in its reference [17].) The A-step comes after the P-step because the
situation to which an action leads is rated. The whole beam goes through a step together, in matrix
operations. If nothing was cut off and nothing is left, there is no plan. That is a proof, because
situations are compared bit by bit, never by a hash.

Deterministic: ties go to the situation that came first, hence to the lowest action of the first
situation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sign_model.bits import any_row, as_bytes, pack, popcount
from sign_model.clock import NO_LIMIT, Clock, OutOfTime
from sign_model.map_algorithm.a_step import Rating, make_rating
from sign_model.map_algorithm.heuristics import HeuristicSign
from sign_model.map_algorithm.landmarks import landmark_table, relaxed_plan_table
from sign_model.map_algorithm.regression import RegressionSpace, regression_space
from sign_model.pddl.planning_task import PlanningTask

BEAMS = (32, 128, 512, 2048, 1 << 30)
"""Situations kept in each step, rung by rung; the last rung keeps all, so the search is
complete."""

_PAIRS_COMPARED = 1 << 22
"""The most words that the test for included situations may compare in a step; beyond it only equal
situations are recognised.
"""


_PAIRS_AT_ONCE = 1 << 16
"""How many pairs of a situation and an action, or of two situations, are tested at once: so many
words stay in the cache of a core.
"""

_STEPS_BETWEEN_CHECKS = 64
"""How many such parts are tested between two checks of the clock."""

_FEW_PAIRS = 1 << 12
"""For so few pairs it is not worth asking which word separates most of them."""


@dataclass(frozen=True)
class Regression:
    """The result of a regression.

    plan: actions of the space in the order of execution; None without a plan.
    expansions: situations expanded.
    is_proof: whether it is proven that there is no plan.
    is_shortest: whether nothing was cut off, so no plan is shorter.
    """

    plan: list[int] | None
    expansions: int
    is_proof: bool
    is_shortest: bool = False


def plan_map(
    task: PlanningTask,
    signs: Sequence[HeuristicSign],
    *,
    max_expansions: int,
    beams: Sequence[int] = BEAMS,
    clock: Clock = NO_LIMIT,
) -> Regression:
    """Returns the shortest plan that the heuristic signs find on the first rung on which one of
    them finds any.

    The actions of the plan are numbered as in the task. Without a plan, `is_proof` distinguishes a
    proof from an exhausted budget.

    Args:
      task: to be solved.
      signs: the heuristics, at least one; all are tried on every rung but the last, which needs
        only one.
      max_expansions: the most situations expanded in all.
      beams: situations kept in each step, rung by rung.
      clock: asked in every phase; once its limit has passed the search ends without a proof.
    """
    # The tables. A goal that mutexes exclude needs no search.
    try:
        rungs = Rungs(task, signs, clock)
    except OutOfTime:
        return Regression(None, 0, False)
    if rungs.is_excluded:
        return Regression(None, 0, True)

    # Each rung tries every sign, and stops at the first rung with a plan. Ends: the last rung keeps
    # all situations, so it finds a plan or a proof, or exhausts the budget.
    expansions = 0
    for beam in beams:
        found = rungs.tried(beam, max_expansions - expansions)
        expansions += found.expansions
        if found.is_proof or found.plan is not None:
            return replace(found, expansions=expansions)
        if expansions >= max_expansions or clock.is_over():
            break
    return Regression(None, expansions, False)


class Rungs:
    """The regressions of one task, from rung to rung.

    Args:
      task: to be solved.
      signs: the heuristics, at least one.
      clock: asked in every phase; OutOfTime once its limit has passed while this is made.

    Attributes:
      space: the features and actions that matter.
      is_excluded: whether the goal can never hold by the mutexes alone: a proof.
    """

    def __init__(
        self, task: PlanningTask, signs: Sequence[HeuristicSign], clock: Clock = NO_LIMIT
    ) -> None:
        self.clock, self.space = clock, regression_space(task, clock=clock)
        self.start, self.goal = (self.space.situations(rows) for rows in (task.start, task.goal))
        self.is_excluded = not self.space.is_consistent(self.goal[None])[0]
        self.ratings: list[Rating] = []
        self.tables: dict[str, np.ndarray] = {}
        if not self.is_excluded:
            schemas = [task.actions[a][0] for a in self.space.kept_actions]
            ends = self.start, self.goal
            self.ratings = [
                make_rating(sign, self.space, *ends, schemas, clock, self.tables) for sign in signs
            ]

    def estimate(self, *, by_all: bool = False) -> int:
        """Returns how long a plan may be at least, by the landmarks and the relaxed plan of the
        goal, or by those of them that the signs read: an estimate, not a bound.

        Args:
          by_all: whether both are made where they are missing.
        """
        if by_all and not self.is_excluded:
            for name, table_of in (("landmarks", landmark_table), ("plan", relaxed_plan_table)):
                if name not in self.tables:
                    self.tables[name] = table_of(self.space, self.start, self.clock)
        counts = (
            popcount(any_row(table, np.zeros(len(goal), np.int64), goal, 1))[0]
            for goal in (np.flatnonzero(self.goal),)
            for table in self.tables.values()
        )
        return int(max(counts, default=0))

    def tried(
        self,
        beam: int,
        max_expansions: int,
        patience: int | None = None,
        max_rated: int | None = None,
    ) -> Regression:
        """Returns the shortest plan of one rung, its actions numbered as in the task; options as in
        `regress`.
        """
        best, expansions = None, 0
        for rating in self.ratings if beam < 1 << 30 else self.ratings[:1]:
            found = regress(
                self.space,
                self.start,
                self.goal,
                rating,
                beam=beam,
                max_expansions=max_expansions - expansions,
                patience=patience,
                max_rated=max_rated,
                clock=self.clock,
            )
            expansions += found.expansions
            if found.is_proof:
                return Regression(None, expansions, True)
            if found.plan is not None and (best is None or len(found.plan) < len(best.plan or ())):
                best = found
        if best is None or best.plan is None:
            return Regression(None, expansions, False)
        plan = [int(self.space.kept_actions[a]) for a in best.plan]
        return Regression(plan, expansions, False, best.is_shortest)


def regress(
    space: RegressionSpace,
    start: np.ndarray,
    goal: np.ndarray,
    rating: Rating,
    *,
    beam: int,
    max_expansions: int,
    within: tuple[int, Rating] | None = None,
    patience: int | None = None,
    max_rated: int | None = None,
    clock: Clock = NO_LIMIT,
) -> Regression:
    """Returns the result of a regression with one beam; a goal included in the start needs no
    action.

    Args:
      space: the features and actions.
      start, goal: bool [F], over the features of the space.
      rating: the A-step.
      beam: situations kept in each step.
      max_expansions: the most situations expanded.
      within: (the longest plan looked for, an estimate of the steps that are left before a
        situation); situations that would exceed it are cut off. Plans of any length where None.
      patience: in how many steps that cut something off, or in half of all steps so far if that is
        more, no situation may be rated better than all before; then the search gives up. Without
        end where None.
      max_rated: the most situations rated; any number where None.
      clock: asked before and during every step; its end ends the search without a proof.
    """
    if not (goal & ~start).any():
        return Regression([], 0, False, True)

    # The beam, the memory of what was kept, and the trail (parents, actions) of each step.
    scripts = pack(space.adds), pack(space.bad)
    situations, expansions, was_cut = goal[None], 0, False
    best, since_best, num_rated = 1 << 40, 0, 0
    memory = _Memory(pack(goal[None]))
    trail: list[tuple[np.ndarray, np.ndarray]] = []

    # Ends: every step keeps only new situations, of which there are finitely many.
    try:
        while len(situations) and expansions + len(situations) <= max_expansions:
            if within is not None and len(trail) >= within[0]:
                return Regression(None, expansions, False)
            # M-step and P-step; forget what is known.
            clock.check()
            expansions += len(situations)
            parents, actions = _m_step(situations, *scripts, clock)
            before = (situations[parents] & ~space.adds[actions]) | space.conditions[actions]
            clock.check()
            fresh = memory.forget_known(before)
            parents, actions, before = parents[fresh], actions[fresh], before[fresh]

            num_rated += len(before)
            if max_rated is not None and num_rated > max_rated:
                return Regression(None, expansions, False)

            # Stop at the first situation that is included in the start.
            done = ~(before & ~start).any(axis=1)
            if done.any():
                first = int(done.argmax())
                plan = _unwind(trail, int(parents[first]), int(actions[first]))
                return Regression(plan, expansions, False, not was_cut)

            # A-step: keep the best, and none that would make the plan too long.
            if within is not None and len(before):
                is_near = within[1](before) < within[0] - len(trail)
                was_cut = was_cut or not is_near.all()
                parents, actions, before = parents[is_near], actions[is_near], before[is_near]
            if len(before) > beam:
                was_cut = True
                rated = rating(before)
                since_best = 0 if rated.min() < best else since_best + 1
                best = min(best, int(rated.min()))
                if patience is not None and since_best > max(patience, len(trail) // 2):
                    return Regression(None, expansions, False)
                kept = np.argsort(rated, kind="stable")[:beam]
                parents, actions, before = parents[kept], actions[kept], before[kept]
            memory.learn(before)
            trail.append((parents, actions))
            situations = before
    except OutOfTime:
        return Regression(None, expansions, False)
    return Regression(None, expansions, not was_cut and not len(situations))


def fitting_actions(space: RegressionSpace, situation: np.ndarray) -> np.ndarray:
    """Returns the M-step of one situation, bool [F]: the actions that explain a part of it and
    break nothing of it, int [n].
    """
    return _m_step(situation[None], pack(space.adds), pack(space.bad), NO_LIMIT)[1]


def _m_step(
    situations: np.ndarray, adds: np.ndarray, bad: np.ndarray, clock: Clock
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the numbers (situation, action), int [n] each, of all pairs that fit, ordered by
    situation, then action; tests them in parts of bounded size.

    Args:
      situations: bool [N, F].
      adds, bad: uint64 [A, words], packed.
      clock: asked before each part.
    """
    words = pack(situations)
    step = max(1, _PAIRS_AT_ONCE // max(1, len(adds)))
    adds, bad = np.ascontiguousarray(adds.T), np.ascontiguousarray(bad.T)
    parts = []
    for part, begin in enumerate(range(0, max(1, len(words)), step)):
        if part % _STEPS_BETWEEN_CHECKS == 0:
            clock.check()
        number, action = _fitting(words[begin : begin + step], adds, bad)
        parts.append((number + begin, action))
    return np.concatenate([n for n, _ in parts]), np.concatenate([a for _, a in parts])


def _fitting(words: np.ndarray, adds: np.ndarray, bad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the same for one part, of situations as uint64 [N, words]; adds and bad are uint64
    [words, A].
    """
    explains = words[:, 0, None] & adds[0]
    breaks = words[:, 0, None] & bad[0]
    room = np.empty_like(explains)
    for w in range(1, words.shape[1]):
        column = words[:, w, None]
        explains |= np.bitwise_and(column, adds[w], out=room)
        breaks |= np.bitwise_and(column, bad[w], out=room)
    place = np.flatnonzero((explains != 0) & (breaks == 0))
    return np.divmod(place, max(1, adds.shape[1]))


def _unwind(trail: list[tuple[np.ndarray, np.ndarray]], parent: int, action: int) -> list[int]:
    """Returns the plan in the order of execution: the action chosen last is executed first.

    Args:
      trail: (parents, actions) of each step before the last.
      parent, action: of the last step.
    """
    plan = [action]
    for parents, actions in reversed(trail):
        plan.append(int(actions[parent]))
        parent = int(parents[parent])
    return plan


class _Memory:
    """The situations kept so far, uint64 [N, words]. A later situation that contains one of them is
    forgotten: it requires more and its plan is at least as long.
    """

    def __init__(self, words: np.ndarray) -> None:
        self.words = words
        self.keys = set(as_bytes(words))

    def forget_known(self, situations: np.ndarray) -> np.ndarray:
        """Returns the numbers of the situations, bool [N, F], that are new, each once, in order;
        none contains a known one or a smaller new one, as far as `_PAIRS_COMPARED` allows.
        """
        # Not equal to a known one or an earlier new one.
        words = pack(situations)
        keys = as_bytes(words)
        first: dict[bytes, int] = {}
        for i, key in enumerate(keys):
            if key not in self.keys:
                first.setdefault(key, i)
        fresh = np.fromiter(first.values(), np.int64, len(first))

        # Not larger than a known one or another new one.
        for known in (self.words, words[fresh]):
            if len(fresh) * len(known) * words.shape[1] <= _PAIRS_COMPARED and len(fresh):
                fresh = fresh[~_contains_another(words[fresh], known)]
        return fresh

    def learn(self, situations: np.ndarray) -> None:
        """Adds situations, bool [N, F]."""
        words = pack(situations)
        self.words = np.concatenate([self.words, words])
        self.keys.update(as_bytes(words))


def _contains_another(words: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Returns bool [N]: whether each situation strictly contains one of the others, all of them as
    words, uint64 [N, words] and [M, words].
    """
    contains = np.zeros(len(words), bool)
    size, lacks = len(others), np.ascontiguousarray(~words.T)
    columns = np.ascontiguousarray(others.T)
    order = _most_separating(lacks, columns)
    step = max(1, _PAIRS_AT_ONCE // max(1, size))
    for begin in range(0, len(words), step):
        # Few pairs pass the test of the first word, so the others are compared for these alone.
        here = lacks[:, begin : begin + step]
        place = np.flatnonzero((here[order[0], :, None] & columns[order[0]]) == 0)
        number, other = np.divmod(place, size)
        for w in order[1:]:
            is_left = (here[w, number] & columns[w, other]) == 0
            number, other = number[is_left], other[is_left]
        is_larger = (words[number + begin] != others[other]).any(axis=1)
        contains[number[is_larger] + begin] = True
    return contains


def _most_separating(lacks: np.ndarray, columns: np.ndarray) -> list[int]:
    """Returns the numbers of the words, those first that separate most of a few pairs; what each
    situation lacks, and the others, are uint64 [words, N] and [words, M].
    """
    order = list(range(len(lacks)))
    if len(order) == 1 or lacks.shape[1] * columns.shape[1] <= _FEW_PAIRS:
        return order
    some, more = (part[:, :: 1 + part.shape[1] // 32] for part in (lacks, columns))
    separated = np.count_nonzero(some[:, :, None] & more[:, None], axis=(1, 2))
    return sorted(order, key=lambda w: -int(separated[w]))
