"""Many tasks in one jitted search: tasks that share matrices ride together, a ladder of beams takes what is left unsolved.

The bulk of a batch does not wait for its few hard tasks: the first rung is narrow, the next ones try only what it left. What
the whole ladder leaves goes to the exact search, which alone can prove that there is no plan.
"""

import hashlib
import os
import time
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from sign_model.heuristics import DEFAULTS, HeuristicSign
from sign_model.kernel import regress
from sign_model.packed import WORD, Tables, landmark_columns, make_tables, make_weights, words_for
from sign_model.planner import plan
from sign_model.rating import kind_of
from sign_model.regression import RegressionSpace, regression_space
from sign_model.result import PlanResult, PlanStatus
from sign_model.task import PlanningTask
from sign_model.validate import replay_batch

MIN_LANES = 8
"""A batch of one is pathological on a CPU: it is padded to 8, which takes no longer."""


@dataclass(frozen=True)
class Rung:
    """One try of a batch: situations kept a step, actions tried a situation, the longest plan, tasks side by side."""

    beam: int
    branch: int
    steps: int
    lanes: int


def default_ladder(num_features: int, beams: Sequence[int] = (4, 16, 64)) -> tuple[Rung, ...]:
    """Returns the rungs for a domain of that many features: plans of up to about its size, wider beams in smaller batches."""
    steps = max(32, 8 * int(num_features**0.5))
    branch = 8 if num_features <= 100 else 16 if num_features <= 400 else 32
    return tuple(
        Rung(beam, min(64, branch * (1 + (i > 0))), steps * (1 + (i > 0)), 64 if i == 0 else 32) for i, beam in enumerate(beams)
    )


def plan_batch(
    tasks: Sequence[PlanningTask],
    *,
    heuristic: HeuristicSign | Sequence[HeuristicSign] | None = None,
    ladder: Sequence[Rung] | None = None,
    max_expansions: int = 200_000,
    num_threads: int | None = None,
) -> list[PlanResult]:
    """Returns one result per task, in order; every plan was replayed forward. An empty batch gives an empty list.

    Args:
      tasks: those with the same features and actions share one search; others follow in further ones.
      heuristic: one sign or several (tried in turn on every rung); the unlearned `DEFAULTS` where None.
      ladder: the rungs; by the size of the domain where None.
      max_expansions: of the exact search for what the ladder leaves.
      num_threads: batches searched at once; the number of cores where None.
    """
    signs = DEFAULTS if heuristic is None else (heuristic,) if isinstance(heuristic, HeuristicSign) else tuple(heuristic)
    if not signs:
        raise ValueError("plan_batch needs at least one heuristic sign: give None for the unlearned ones")
    results: dict[int, PlanResult] = {}
    groups: dict[bytes, list[int]] = defaultdict(list)
    identities: dict[int, bytes] = {}
    for number, task in enumerate(tasks):
        groups[_identity(task, identities)].append(number)
    for members in groups.values():
        found = _plan_group([tasks[i] for i in members], signs, ladder, max_expansions, num_threads)
        results.update(zip(members, found))
    return [results[i] for i in range(len(tasks))]


def _identity(task: PlanningTask, known: dict[int, bytes]) -> bytes:
    """A digest of what tasks must share to ride together; arrays seen before (the same object) are not read again."""
    if id(task.conditions) not in known:
        digest = hashlib.sha256(repr((task.features, task.actions)).encode())
        for matrix in (task.conditions, task.adds, task.deletes):
            digest.update(np.packbits(matrix).tobytes())
        known[id(task.conditions)] = digest.digest()
    return known[id(task.conditions)]


class _Group:
    """Tasks of one domain, packed."""

    def __init__(self, tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> None:
        self.starts, self.goals = (np.array([getattr(task, name) for task in tasks]) for name in ("start", "goal"))
        base = tasks[0]
        self.space: RegressionSpace = regression_space(base, self.starts, self.goals)
        self.possible = self.space.is_consistent(self.space.situations(self.goals))
        kinds = {kind_of(base.features[f]) for f in np.flatnonzero(self.goals.any(axis=0))}
        self.columns = landmark_columns(self.space, signs, kinds)
        self.tables: Tables = make_tables(self.space, self.columns)
        schemas = [base.actions[a][0] for a in self.space.kept_actions]
        self.weights = [make_weights(sign, self.space, self.columns, schemas, kinds) for sign in signs]

    def lanes(self, situations: np.ndarray) -> np.ndarray:
        """bool [N, F of the task] -> [F of the tables, N]."""
        out = np.zeros((words_for(len(self.space.features)) * WORD, len(situations)), bool)
        out[: len(self.space.features)] = self.space.situations(situations).T
        return out


def _plan_group(
    tasks: Sequence[PlanningTask],
    signs: tuple[HeuristicSign, ...],
    ladder: Sequence[Rung] | None,
    max_expansions: int,
    num_threads: int | None,
) -> list[PlanResult]:
    began = time.perf_counter()
    group = _Group(tasks, signs)
    built = time.perf_counter()
    rungs = ladder if ladder is not None else default_ladder(len(group.space.features))
    plans: list[np.ndarray | None] = [None] * len(tasks)
    open_ = np.flatnonzero(group.possible)
    with ThreadPoolExecutor(num_threads or _num_cores()) as pool:
        for rung in rungs:
            for sign, weights in zip(signs, group.weights):
                open_ = _climb(pool, group, rung, sign, weights, open_, plans)
    solved = [i for i, found in enumerate(plans) if found is not None]
    searched = time.perf_counter()
    replay_batch(tasks[0], group.starts[solved], group.goals[solved], [found for found in plans if found is not None])
    ended = time.perf_counter()
    share = 1.0 / len(tasks)
    stages = {"build": built - began, "search": searched - built, "validate": ended - searched}
    seconds = {"parse": 0.0, **{stage: spent * share for stage, spent in stages.items()}}
    return _results(tasks, plans, group.possible, max_expansions, seconds)


def _climb(pool, group: _Group, rung: Rung, sign: HeuristicSign, weights, open_: np.ndarray, plans: list) -> np.ndarray:
    """Tries the open tasks on one rung with one sign; notes the plans found and returns what is still open."""
    if not len(open_):
        return open_
    size = min(rung.lanes, max(MIN_LANES, 1 << (len(open_) - 1).bit_length()))
    chunks = [open_[i : i + size] for i in range(0, len(open_), size)]
    uses = {"uses_landmarks": any(sign.landmarks.values()), "uses_plan": any(sign.plan.values())}

    def search(chunk: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        lanes = np.resize(chunk, size)  # the last chunk is filled up by repetition: one shape, one compilation
        start, goal = group.lanes(group.starts[lanes]), group.lanes(group.goals[lanes])
        found = regress(group.tables, weights, start, goal, beam=rung.beam, branch=rung.branch, steps=rung.steps, **uses)
        return np.asarray(found[0]), np.asarray(found[1]), np.asarray(found[2])

    left = []
    for chunk, (solved, length, actions) in zip(chunks, pool.map(search, chunks)):
        for lane, number in enumerate(chunk):
            if solved[lane]:
                plans[number] = group.space.kept_actions[actions[: length[lane], lane]]
            else:
                left.append(number)
    return np.array(left, np.int64)


def _results(tasks, plans, possible, max_expansions, seconds) -> list[PlanResult]:
    names, out = tasks[0].action_names, []
    for number, task in enumerate(tasks):
        found = plans[number]
        if found is not None:
            out.append(PlanResult(PlanStatus.SOLVED, tuple([names[a] for a in found]), len(found), seconds))
        elif not possible[number]:
            out.append(PlanResult(PlanStatus.UNSOLVABLE, (), 0, seconds))
        else:
            out.append(plan(task, max_expansions=max_expansions))
    return out


def _num_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
