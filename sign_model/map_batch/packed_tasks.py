"""Tasks of one domain packed for the batched search, and their answers as it finds them."""

import time
from collections.abc import Sequence

import jax
import numpy as np

from sign_model.ground.words import pack_rows
from sign_model.map_algorithm.heuristics import HeuristicSign
from sign_model.map_algorithm.rating import kind_of
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
from sign_model.plan_task import plan
from sign_model.result import PlanResult, PlanStatus


def pack_batch(tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> "PackedBatch":
    """Returns tasks of one domain packed for the kernel; ValueError where they don't share their
    features and actions.
    """
    if not share_matrices(tasks):
        raise ValueError(
            "the tasks must share their features and actions: ground them with the same objects"
        )
    return PackedBatch(tasks, signs)


class PackedBatch:
    """Tasks of one domain, packed; `plans` fills while the ladder is climbed."""

    def __init__(self, tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> None:
        began = time.perf_counter()
        self.tasks, base = tasks, tasks[0]
        self.starts, self.goals = (
            np.stack([task.start for task in tasks]),
            np.stack([task.goal for task in tasks]),
        )
        self.space: RegressionSpace = regression_space(base, self.starts, self.goals)
        self.possible = self.space.is_consistent(self.space.situations(self.goals))
        self.lengths, self.plans = np.full(len(tasks), -1), np.zeros((len(tasks), 0), np.int64)
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
        """The weights of a sign as the kernel reads them; it must count no landmarks but those of
        the batch's own signs.
        """
        schemas = [self.tasks[0].actions[a][0] for a in self.space.kept_actions]
        return make_weights(sign, self.space, self.columns, schemas, self.goal_kinds)

    def open_tasks(self) -> np.ndarray:
        """The tasks that may have a plan and have none yet."""
        return np.flatnonzero((self.lengths < 0) & self.possible)

    def queue(self, tasks: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.int32]:
        """(start, goal, count) as the kernel reads them: uint32 [size, W] each, padded."""
        padding = ((0, size - len(tasks)), (0, 0))
        start, goal = (np.pad(words[tasks], padding) for words in self.words)
        return start, goal, np.int32(len(tasks))

    def task_bytes(self, sign: HeuristicSign) -> int:
        """How much the tables made from one start take."""
        num_words = self.tables.column_own.shape[1] if any(sign.landmarks.values()) else 0
        if any(sign.plan.values()):
            num_words += self.tables.explains.shape[1]
        return 4 * num_words * self.tables.explains.shape[0]

    def note(
        self, tasks: np.ndarray, lengths: np.ndarray, plans: np.ndarray, detours: np.ndarray
    ) -> None:
        """Notes what a search found of some tasks (numbers [n]); detours are left out.

        lengths: int [n], -1 for no plan. plans: int [n, L], actions of the space, -1 after the
          last. detours: bool [n].
        """
        steps = plans.shape[1]
        if steps > self.plans.shape[1]:
            self.plans = np.pad(
                self.plans, ((0, 0), (0, steps - self.plans.shape[1])), constant_values=-1
            )
        self.plans[tasks, :steps] = np.append(self.space.kept_actions, -1)[plans]
        self.lengths[tasks] = lengths
        for task in tasks[detours].tolist():
            shorter = drop_detours(
                self.tasks[task], self.plans[task, : self.lengths[task]].tolist()
            )
            self.plans[task] = np.pad(
                shorter, (0, self.plans.shape[1] - len(shorter)), constant_values=-1
            )
            self.lengths[task] = len(shorter)

    def results(self, max_expansions: int) -> list[PlanResult]:
        """Replays all plans; what has none goes to the exact search."""
        began = time.perf_counter()
        solved = self.lengths >= 0
        replay_batch(self.tasks[0], self.starts[solved], self.goals[solved], self.plans[solved])
        self.seconds["validate"] = time.perf_counter() - began
        share = {stage: spent / len(self.tasks) for stage, spent in self.seconds.items()}
        names = np.array(self.tasks[0].action_names, object)[self.plans[self.plans >= 0]].tolist()
        out, end = [], 0
        for task, length, is_possible in zip(
            self.tasks, self.lengths.tolist(), self.possible.tolist()
        ):
            if length >= 0:
                begin, end = end, end + length
                out.append(PlanResult(PlanStatus.SOLVED, tuple(names[begin:end]), length, share))
            elif not is_possible:
                out.append(PlanResult(PlanStatus.UNSOLVABLE, (), 0, share))
            else:
                out.append(plan(task, max_expansions=max_expansions))
        return out
