"""Many tasks in one jitted search: tasks that share matrices ride together, a ladder of beams takes what is left unsolved.

The bulk of a batch does not wait for its few hard tasks: the first rung is narrow, the next ones try only what it left. What
the whole ladder leaves goes to the exact search, which alone can prove that there is no plan.
"""

import functools
import hashlib
import math
import os
import time
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import jax
import numpy as np

from sign_model.heuristics import DEFAULTS, HeuristicSign
from sign_model.kernel import regress, regress_domains
from sign_model.packed import WORD, SignWeights, landmark_columns, make_tables, make_weights
from sign_model.planner import plan
from sign_model.rating import kind_of
from sign_model.regression import RegressionSpace, regression_space
from sign_model.result import PlanResult, PlanStatus
from sign_model.task import PlanningTask
from sign_model.validate import replay_batch

MIN_LANES = 8
"""A batch of one is pathological on a CPU: it is padded to 8, which takes no longer."""

MAX_DOMAINS = 32
"""How many domains of one bucket ride in one call."""


@dataclass(frozen=True)
class Rung:
    """One try of a batch: situations kept a step, actions tried a situation, the longest plan, tasks side by side."""

    beam: int
    branch: int
    steps: int
    lanes: int


def default_ladder(num_features: int) -> tuple[Rung, ...]:
    """Returns the rungs for a domain of that many features: a narrow one for the bulk, then wider ones for longer plans."""
    side = math.isqrt(num_features)
    branch = min(64, side + 2)
    return (
        Rung(beam=6, branch=branch, steps=3 * side, lanes=128),
        Rung(beam=24, branch=branch, steps=4 * side, lanes=32),
        Rung(beam=96, branch=branch, steps=5 * side, lanes=32),
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
      tasks: those with the same features and actions ride side by side; domains of one bucket of shapes share one jitted call.
      heuristic: one sign or several (tried in turn on every rung); the unlearned `DEFAULTS` where None.
      ladder: the rungs; by the size of the domain where None.
      max_expansions: of the exact search for what the ladder leaves.
      num_threads: batches searched at once; the number of cores where None.
    """
    signs = DEFAULTS if heuristic is None else (heuristic,) if isinstance(heuristic, HeuristicSign) else tuple(heuristic)
    if not signs:
        raise ValueError("plan_batch needs at least one heuristic sign: give None for the unlearned ones")
    members: dict[bytes, list[int]] = defaultdict(list)
    identities: dict[int, bytes] = {}
    for number, task in enumerate(tasks):
        members[_identity(task, identities)].append(number)
    groups = [PackedBatch([tasks[i] for i in numbers], signs) for numbers in members.values()]
    buckets: dict[tuple, list[PackedBatch]] = defaultdict(list)
    for group in groups:
        buckets[group.shapes].append(group)
    with ThreadPoolExecutor(num_threads or _num_cores()) as pool:
        for alike in buckets.values():
            _climb(pool, alike, signs, ladder if ladder is not None else default_ladder(len(alike[0].space.features)))
    results: dict[int, PlanResult] = {}
    for group, numbers in zip(groups, members.values()):
        results.update(zip(numbers, group.results(max_expansions)))
    return [results[i] for i in range(len(tasks))]


def _identity(task: PlanningTask, known: dict[int, bytes]) -> bytes:
    """A digest of what tasks must share to ride together; arrays seen before (the same object) are not read again."""
    if id(task.conditions) not in known:
        digest = hashlib.sha256(repr((task.features, task.actions)).encode())
        for matrix in (task.conditions, task.adds, task.deletes):
            digest.update(np.packbits(matrix).tobytes())
        known[id(task.conditions)] = digest.digest()
    return known[id(task.conditions)]


def pack_batch(tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> "PackedBatch":
    """Returns tasks of one domain packed for the kernel; ValueError where they don't share their features and actions."""
    identities: dict[int, bytes] = {}
    if len({_identity(task, identities) for task in tasks}) != 1:
        raise ValueError("the tasks must share their features and actions: ground them with the same objects")
    return PackedBatch(tasks, signs)


class PackedBatch:
    """Tasks of one domain, packed; `plans` fills while the ladder is climbed."""

    def __init__(self, tasks: Sequence[PlanningTask], signs: tuple[HeuristicSign, ...]) -> None:
        began = time.perf_counter()
        self.tasks, base = tasks, tasks[0]
        self.starts, self.goals = np.array([task.start for task in tasks]), np.array([task.goal for task in tasks])
        self.space: RegressionSpace = regression_space(base, self.starts, self.goals)
        self.possible = self.space.is_consistent(self.space.situations(self.goals))
        self.plans: list[np.ndarray | None] = [None] * len(tasks)
        self.goal_kinds = {kind_of(base.features[f]) for f in np.flatnonzero(self.goals.any(axis=0))}
        self.columns = landmark_columns(self.space, signs, self.goal_kinds)
        self.tables = make_tables(self.space, self.columns)
        self.weights = [self.weights_of(sign) for sign in signs]
        self.shapes = tuple(np.shape(leaf) for leaf in jax.tree.leaves((self.tables, self.weights)))
        self.seconds = {"parse": 0.0, "build": time.perf_counter() - began, "search": 0.0, "validate": 0.0}

    def weights_of(self, sign: HeuristicSign) -> SignWeights:
        """The weights of a sign as the kernel reads them; it must count no landmarks but those of the batch's own signs."""
        schemas = [self.tasks[0].actions[a][0] for a in self.space.kept_actions]
        return make_weights(sign, self.space, self.columns, schemas, self.goal_kinds)

    def open_tasks(self) -> np.ndarray:
        """The tasks that may have a plan and have none yet; alike ones lie together, as all lanes wait for the last."""
        still = np.array([i for i, found in enumerate(self.plans) if found is None and self.possible[i]], np.int64)
        unmet = (self.goals[still] & ~self.starts[still]).sum(axis=1)
        return still[np.argsort(unmet, kind="stable")]

    def lanes(self, situations: np.ndarray) -> np.ndarray:
        """bool [N, F of the task] -> [F of the tables, N]."""
        out = np.zeros((self.tables.needs.shape[0] * WORD, len(situations)), bool)
        out[: len(self.space.features)] = self.space.situations(situations).T
        return out

    def results(self, max_expansions: int) -> list[PlanResult]:
        """Replays all plans; what has none goes to the exact search."""
        began = time.perf_counter()
        solved = [i for i, found in enumerate(self.plans) if found is not None]
        replay_batch(self.tasks[0], self.starts[solved], self.goals[solved], [p for p in self.plans if p is not None])
        self.seconds["validate"] = time.perf_counter() - began
        share = {stage: spent / len(self.tasks) for stage, spent in self.seconds.items()}
        names, out = np.array(self.tasks[0].action_names, object), []
        for task, found, is_possible in zip(self.tasks, self.plans, self.possible):
            if found is not None:
                out.append(PlanResult(PlanStatus.SOLVED, tuple(names[found].tolist()), len(found), share))
            elif not is_possible:
                out.append(PlanResult(PlanStatus.UNSOLVABLE, (), 0, share))
            else:
                out.append(plan(task, max_expansions=max_expansions))
        return out


def _climb(
    pool: ThreadPoolExecutor, groups: list[PackedBatch], signs: tuple[HeuristicSign, ...], rungs: Sequence[Rung]
) -> None:
    """Climbs the ladder with all groups of one bucket; notes the plans found."""
    for rung in rungs:
        for number, sign in enumerate(signs):
            open_ = [group.open_tasks() for group in groups]
            most = max(len(tasks) for tasks in open_)
            if not most:
                return
            size = min(rung.lanes, max(MIN_LANES, 1 << (most - 1).bit_length()))
            jobs = [(g, tasks[i : i + size]) for g, tasks in zip(groups, open_) for i in range(0, len(tasks), size)]
            at_once = 1 if len(groups) == 1 else min(MAX_DOMAINS, 1 << (len(jobs) - 1).bit_length())
            slices = [jobs[i : i + at_once] for i in range(0, len(jobs), at_once)]
            began = time.perf_counter()
            for _ in pool.map(
                functools.partial(_search, rung=rung, sign=sign, number=number, size=size, domains=at_once), slices
            ):
                pass
            for group in groups:
                group.seconds["search"] += (time.perf_counter() - began) / len(groups)


def _search(
    jobs: list[tuple[PackedBatch, np.ndarray]], *, rung: Rung, sign: HeuristicSign, number: int, size: int, domains: int
) -> None:
    """One jitted search over the jobs, each the tasks of one domain; short ones are filled up by repetition."""
    options = {"beam": rung.beam, "branch": rung.branch, "steps": rung.steps}
    options |= {"uses_landmarks": any(sign.landmarks.values()), "uses_plan": any(sign.plan.values())}
    padded = [jobs[i % len(jobs)] for i in range(domains)]
    inputs = []
    for group, tasks in padded:
        lanes = np.resize(tasks, size)
        inputs.append((group.tables, group.weights[number], group.lanes(group.starts[lanes]), group.lanes(group.goals[lanes])))
    if domains == 1:
        found = [np.asarray(part)[None] for part in regress(*inputs[0], **options)]
    else:
        found = [
            np.asarray(part) for part in regress_domains(*jax.tree.map(lambda *leaves: np.stack(leaves), *inputs), **options)
        ]
    for (group, tasks), solved, length, actions in zip(jobs, *found):
        plans = np.append(group.space.kept_actions, -1)[actions.T]  # -1, no action, stays -1
        for task, is_solved, steps, found_plan in zip(tasks.tolist(), solved.tolist(), length.tolist(), plans):
            if is_solved:
                group.plans[task] = found_plan[:steps]


def _num_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
