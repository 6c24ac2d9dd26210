"""Many tasks in one jitted search: tasks that share matrices ride together, a ladder of beams takes what is left unsolved.

The bulk of a batch does not wait for its few hard tasks: the first rung is narrow, the next one tries only what it left. What
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
from sign_model.packed import SignWeights, landmark_columns, make_tables, make_weights, pack_words
from sign_model.planner import plan
from sign_model.rating import kind_of
from sign_model.regression import RegressionSpace, regression_space
from sign_model.result import PlanResult, PlanStatus
from sign_model.task import PlanningTask
from sign_model.validate import replay_batch

QUEUES = (16, 256, 2048)
"""How many tasks one call takes: few sizes, so that few programs are compiled. The rest of a queue is padding."""

MAX_DOMAINS = 32
"""How many domains of one bucket ride in one call."""

_MAX_TABLE_BYTES = 1 << 25
"""The most that the tables of one queue may take."""


@dataclass(frozen=True)
class Rung:
    """One try of a batch: situations kept a step, actions tried a situation, the longest plan, tasks side by side."""

    beam: int
    branch: int
    steps: int
    lanes: int


def default_ladder(num_features: int) -> tuple[Rung, ...]:
    """Returns the rungs for a domain of that many features: a narrow one for the bulk, then a wide one for longer plans."""
    side = math.isqrt(num_features)
    branch = min(64, side + 2)
    return (
        Rung(beam=min(32, max(6, 3 * side // 4)), branch=branch, steps=4 * side, lanes=64),
        Rung(beam=64, branch=branch, steps=6 * side, lanes=16),
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
    num_threads = num_threads or _num_cores()
    with ThreadPoolExecutor(num_threads) as pool:
        for alike in buckets.values():
            rungs = ladder if ladder is not None else default_ladder(len(alike[0].space.features))
            _climb(pool, num_threads, alike, signs, rungs)
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
        self.starts, self.goals = np.stack([task.start for task in tasks]), np.stack([task.goal for task in tasks])
        self.space: RegressionSpace = regression_space(base, self.starts, self.goals)
        self.possible = self.space.is_consistent(self.space.situations(self.goals))
        self.plans: list[np.ndarray | None] = [None] * len(tasks)
        self.goal_kinds = {kind_of(base.features[f]) for f in np.flatnonzero(self.goals.any(axis=0))}
        self.columns = landmark_columns(self.space, signs, self.goal_kinds)
        self.tables = make_tables(self.space, self.columns)
        self.words = tuple(pack_words(self.space.situations(m), self.tables.needs.shape[0]) for m in (self.starts, self.goals))
        self.weights = [self.weights_of(sign) for sign in signs]
        self.shapes = tuple(np.shape(leaf) for leaf in jax.tree.leaves((self.tables, self.weights)))
        self.seconds = {"parse": 0.0, "build": time.perf_counter() - began, "search": 0.0, "validate": 0.0}

    def weights_of(self, sign: HeuristicSign) -> SignWeights:
        """The weights of a sign as the kernel reads them; it must count no landmarks but those of the batch's own signs."""
        schemas = [self.tasks[0].actions[a][0] for a in self.space.kept_actions]
        return make_weights(sign, self.space, self.columns, schemas, self.goal_kinds)

    def open_tasks(self) -> np.ndarray:
        """The tasks that may have a plan and have none yet."""
        return np.array([i for i, found in enumerate(self.plans) if found is None and self.possible[i]], np.int64)

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
    pool: ThreadPoolExecutor,
    num_threads: int,
    groups: list[PackedBatch],
    signs: tuple[HeuristicSign, ...],
    rungs: Sequence[Rung],
) -> None:
    """Climbs the ladder with all groups of one bucket; notes the plans found."""
    for rung in rungs:
        for number, sign in enumerate(signs):
            began = time.perf_counter()
            open_ = [group.open_tasks() for group in groups]
            if not any(map(len, open_)):
                return
            size = _queue_size(max(map(len, open_)), num_threads if len(groups) == 1 else 1, groups[0].task_bytes(sign))
            jobs = [(group, part) for group, tasks in zip(groups, open_) for part in _parts(tasks, size, num_threads)]
            at_once = 1 if len(groups) == 1 else min(MAX_DOMAINS, 1 << (len(jobs) - 1).bit_length())
            slices = [jobs[i : i + at_once] for i in range(0, len(jobs), at_once)]
            search = functools.partial(_search, rung=rung, sign=sign, number=number, size=size, domains=at_once)
            for _ in pool.map(search, slices):
                pass
            for group in groups:
                group.seconds["search"] += (time.perf_counter() - began) / len(groups)


def _queue_size(num_tasks: int, num_threads: int, task_bytes: int) -> int:
    """The least size that takes a thread's share of the tasks, bounded by what their tables take."""
    share = -(-num_tasks // num_threads)
    size = next((size for size in QUEUES if size >= share), QUEUES[-1])
    while size > QUEUES[0] and size * task_bytes > _MAX_TABLE_BYTES:
        size = QUEUES[QUEUES.index(size) - 1]
    return size


def _parts(tasks: np.ndarray, size: int, num_threads: int) -> list[np.ndarray]:
    """The tasks in parts of at most `size`, as many for each thread."""
    if not len(tasks):
        return []
    rounds = -(-len(tasks) // (size * num_threads))
    return [part for part in np.array_split(tasks, rounds * num_threads) if len(part)]


def _search(
    jobs: list[tuple[PackedBatch, np.ndarray]], *, rung: Rung, sign: HeuristicSign, number: int, size: int, domains: int
) -> None:
    """One jitted search over the jobs, each the tasks of one domain; where there are fewer, the first stands in unread."""
    options = {"beam": rung.beam, "branch": rung.branch, "steps": rung.steps, "lanes": min(rung.lanes, size)}
    options |= {"uses_landmarks": any(sign.landmarks.values()), "uses_plan": any(sign.plan.values())}
    inputs = [(group.tables, group.weights[number], *group.queue(tasks, size)) for group, tasks in jobs]
    if domains == 1:
        found = [np.asarray(part)[None] for part in regress(*inputs[0], **options)]
    else:
        nothing = (*inputs[0][:-1], np.int32(0))
        inputs += [nothing] * (domains - len(inputs))
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *inputs)
        found = [np.asarray(part) for part in regress_domains(*stacked, **options)]
    for (group, tasks), lengths, plans in zip(jobs, *found):
        actions = np.append(group.space.kept_actions, -1)[plans[: len(tasks)]]  # -1, no action, stays -1
        for task, length, plan_found in zip(tasks.tolist(), lengths.tolist(), actions):
            if length >= 0:
                group.plans[task] = plan_found[:length]


def _num_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
