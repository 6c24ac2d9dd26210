"""Tasks of one domain packed for the batched search, and the answers recorded for them."""

import time
from collections.abc import Callable, Mapping, Sequence

import jax
import numpy as np

from sign_model.bits import stacked
from sign_model.foundation.words import pack_rows
from sign_model.map_algorithm.a_step import kind_of
from sign_model.map_algorithm.heuristics import HeuristicSign
from sign_model.map_algorithm.least_length import least_cost
from sign_model.map_algorithm.mutex import MAX_PAIR_WORDS
from sign_model.map_algorithm.regression import RegressionSpace, regression_space
from sign_model.map_algorithm.shorten import drop_detours
from sign_model.map_batch.grouping import share_matrices
from sign_model.map_batch.tables import (
    SignWeights,
    landmark_columns,
    make_tables,
    make_weights,
)
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import replay_batch
from sign_model.result import PlanResult, PlanStatus


def pack_batch(tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> "PackedBatch":
    """Returns tasks of one domain packed for the jitted search.

    Raises:
      ValueError: the tasks do not share their features and actions.
    """
    if not share_matrices(tasks):
        raise ValueError(
            "the tasks must share their features and actions: ground them with the same objects"
        )
    return PackedBatch(tasks, signs)


class PackedBatch:
    """N tasks of one domain, packed; `lengths` and `plans` are filled while the ladder is climbed.

    tasks: the tasks; starts, goals: bool [N, F of the task].
    space: the regression space of all of them; possible: bool [N], False where the mutexes alone
      prove that there is no plan.
    lengths: int [N], -1 while there is no plan. plans: int [N, L], actions of the task in the order
      of execution, -1 after the last.
    columns, tables, weights: of the domain and of each sign, as the jitted search reads them.
    words: starts and goals, uint32 [N, W] each.
    shapes: equal for domains of one bucket. seconds: time by stage.
    """

    def __init__(self, tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> None:
        began = time.perf_counter()
        self.tasks, base = tasks, tasks[0]

        # The regression space, and what it decides without a search.
        self.starts, self.goals = (
            stacked([task.start for task in tasks]),
            stacked([task.goal for task in tasks]),
        )
        self.space: RegressionSpace = regression_space(base, self.starts, self.goals)
        self.possible = self.space.is_consistent(self.space.situations(self.goals))
        self.lengths, self.plans = np.full(len(tasks), -1), np.zeros((len(tasks), 0), np.int64)

        # The tables of the jitted search, padded to their bucket.
        self.goal_kinds = {
            kind_of(base.features[f]) for f in np.flatnonzero(self.goals.any(axis=0))
        }
        self.columns = landmark_columns(self.space, signs, self.goal_kinds)
        self.tables = make_tables(self.space, self.columns)
        self.words = tuple(
            pack_rows(self.space.situations(m), self.tables.needs.shape[0])
            for m in (self.starts, self.goals)
        )
        self.weights = [self.weights_of(sign) for sign in signs]
        self.shapes = tuple(np.shape(leaf) for leaf in jax.tree.leaves((self.tables, self.weights)))
        self.seconds = {
            "parse": 0.0,
            "build": time.perf_counter() - began,
            "search": 0.0,
            "validate": 0.0,
        }

    def weights_of(self, sign: HeuristicSign) -> SignWeights:
        """Returns the weights of a sign as the jitted search reads them; it must count no landmarks
        other than those that the signs of this batch count.
        """
        schemas = [self.tasks[0].actions[a][0] for a in self.space.kept_actions]
        return make_weights(sign, self.space, self.columns, schemas, self.goal_kinds)

    def unsolved_tasks(self) -> np.ndarray:
        """Returns the numbers of the tasks that may have a plan and have none yet, int [n]."""
        return np.flatnonzero((self.lengths < 0) & self.possible)

    def queue(self, tasks: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.int32]:
        """Returns (start, goal, count) of some tasks as the jitted search reads them: uint32 [size,
        W] each, padded, and int32 [].
        """
        padding = ((0, size - len(tasks)), (0, 0))
        start, goal = (np.pad(words[tasks], padding) for words in self.words)
        return start, goal, np.int32(len(tasks))

    def task_bytes(self, sign: HeuristicSign) -> int:
        """Returns how many bytes the tables made from one start take."""
        num_words = self.tables.column_own.shape[1] if any(sign.landmarks.values()) else 0
        if any(sign.plan.values()):
            num_words += self.tables.explains.shape[1]
        return 4 * num_words * self.tables.explains.shape[0]

    def record(
        self, tasks: np.ndarray, lengths: np.ndarray, plans: np.ndarray, detours: np.ndarray
    ) -> None:
        """Records what a search found for some tasks; detours are removed from the plans.

        Args:
          tasks: int [n], numbers.
          lengths: int [n], -1 for no plan.
          plans: int [n, L], actions of the space, -1 after the last.
          detours: bool [n], whether the plan has one.
        """
        # Widen the table to the longest plan; action -1 of the space stays -1.
        steps = plans.shape[1]
        if steps > self.plans.shape[1]:
            self.plans = np.pad(
                self.plans, ((0, 0), (0, steps - self.plans.shape[1])), constant_values=-1
            )
        self.plans[tasks, :steps] = np.append(self.space.kept_actions, -1)[plans]
        self.lengths[tasks] = lengths

        # Shorten the plans that have detours.
        for task in tasks[detours].tolist():
            shorter = drop_detours(
                self.tasks[task], self.plans[task, : self.lengths[task]].tolist()
            )
            self.plans[task] = np.pad(
                shorter, (0, self.plans.shape[1] - len(shorter)), constant_values=-1
            )
            self.lengths[task] = len(shorter)

    def least_length(self, number: int) -> int:
        """Returns how many steps every plan of one task has at least; 0 where nothing is known."""
        conditions = self.space.conditions
        if sum(conditions.shape) * conditions.shape[1] // 64 > MAX_PAIR_WORDS:
            return 0  # what never holds together is hardly known, and the bound takes long
        start, goal = (self.space.situations(rows[number]) for rows in (self.starts, self.goals))
        return least_cost(self.space, start, goal, np.ones(len(conditions), np.int64))

    def results(
        self,
        alone: Callable[[PlanningTask], PlanResult],
        known: Mapping[int, PlanResult] | None = None,
    ) -> list[PlanResult]:
        """Returns the result of each task, in order.

        All plans are replayed. A task without a plan is planned alone, unless it is proven to have
        none.

        Args:
          alone: plans one task.
          known: results of some tasks by number, planned alone already. Where it is given, every
            plan that is not proven shortest is compared with that of planning alone, and the
            shorter one kept.
        """
        # Replay, and share the time among the tasks.
        began = time.perf_counter()
        solved = self.lengths >= 0
        replay_batch(self.tasks[0], self.starts[solved], self.goals[solved], self.plans[solved])
        self.seconds["validate"] = time.perf_counter() - began
        share = {stage: spent / len(self.tasks) for stage, spent in self.seconds.items()}

        # The names of all actions in one list, cut into plans.
        names = np.array(self.tasks[0].action_names, object)[self.plans[self.plans >= 0]].tolist()
        out, end = [], 0
        for number, (task, length, is_possible) in enumerate(
            zip(self.tasks, self.lengths.tolist(), self.possible.tolist())
        ):
            if length >= 0:
                begin, end = end, end + length
                cost = task.cost_of(self.plans[number, :length]) if task.has_costs else None
                mine = PlanResult(PlanStatus.SOLVED, tuple(names[begin:end]), length, share, cost)
                if known is not None and self.least_length(number) < length:
                    other = known[number] if number in known else alone(task)
                    if other.is_solved and len(other.actions) <= length:
                        mine = other
                out.append(mine)
            elif not is_possible:
                out.append(PlanResult(PlanStatus.UNSOLVABLE, (), 0, share))
            else:
                out.append(known[number] if known and number in known else alone(task))
        return out
