"""Many tasks in one jitted search: tasks that share matrices ride together, a ladder of beams takes
what is left unsolved.

The bulk of a batch does not wait for its few hard tasks: the first rung is narrow, the next one
tries only what it left. What the whole ladder leaves goes to the exact search, which alone can
prove that there is no plan.
"""

import functools
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import jax
import numpy as np

from sign_model.ground.cores import num_cores
from sign_model.map_algorithm.heuristics import DEFAULTS, HeuristicSign
from sign_model.map_batch.grouping import groups_of
from sign_model.map_batch.iteration import MAX_BEAM, regress, regress_domains
from sign_model.map_batch.packed_tasks import PackedBatch
from sign_model.pddl.planning_task import PlanningTask
from sign_model.result import PlanResult

QUEUES = (16, 256, 2048)
"""How many tasks one call takes: few sizes, so that few programs are compiled. The rest of a queue
is padding.
"""

DOMAINS = (8, 32)
"""How many domains of one bucket ride in one call."""

_MAX_TABLE_BYTES = 1 << 25
"""The most that the tables of one queue may take."""


@dataclass(frozen=True)
class Rung:
    """One try of a batch: situations kept a step, actions tried a situation, the longest plan,
    tasks side by side.
    """

    beam: int
    branch: int
    steps: int
    lanes: int

    def __post_init__(self) -> None:
        for name, most in (
            ("beam", MAX_BEAM),
            ("branch", MAX_BEAM),
            ("steps", 1 << 20),
            ("lanes", 1 << 20),
        ):
            if not 1 <= getattr(self, name) <= most:
                raise ValueError(
                    f"a rung's {name} must lie between 1 and {most}, got {getattr(self, name)}"
                )
        if self.lanes & (self.lanes - 1):
            raise ValueError(
                "a rung's lanes must be a power of two, as queues are cut into them, got"
                f" {self.lanes}"
            )


def default_ladder(num_features: int) -> tuple[Rung, ...]:
    """Returns the rungs for a domain of that many features: a narrow one for the bulk, then each
    four times as wide.

    Measured on blocks of 8 to 15: twice the beam halves the speed and takes a third of what is left
    above the optimum. Small domains of other kinds (tiles, sokoban) got plans half as long from 16
    situations as from 6, and there they cost little.
    """
    side = math.isqrt(num_features)
    narrow, branch = 16 if num_features <= 64 else max(6, 5 * side // 8), min(64, side + 2)
    return tuple(
        Rung(beam=min(MAX_BEAM, narrow * width), branch=branch, steps=longest * side, lanes=lanes)
        for width, longest, lanes in (
            (1, 4, 128 if num_features <= 128 else 64),
            (4, 6, 32),
            (16, 12, 16),
        )
    )


def plan_batch(
    tasks: Sequence[PlanningTask],
    *,
    heuristic: HeuristicSign | Sequence[HeuristicSign] | None = None,
    ladder: Sequence[Rung] | None = None,
    max_expansions: int = 200_000,
    num_threads: int | None = None,
) -> list[PlanResult]:
    """Returns one result per task, in order; every plan was replayed forward. An empty batch gives
    an empty list.

    Args:
      tasks: those with the same features and actions ride side by side; domains of one bucket of
        shapes share one jitted call.
      heuristic: one sign or several (tried in turn on every rung); the unlearned `DEFAULTS` where
        None.
      ladder: the rungs; by the size of the domain where None.
      max_expansions: of the exact search for what the ladder leaves.
      num_threads: batches searched at once; the number of cores, at most SRT_JAX_CORES
        (environment), where None.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> [result.actions for result in sign_model.plan_batch([task, task])]
      [('(push)', '(walk)'), ('(push)', '(walk)')]
    """
    signs = (
        DEFAULTS
        if heuristic is None
        else (heuristic,)
        if isinstance(heuristic, HeuristicSign)
        else tuple(heuristic)
    )
    if not signs:
        raise ValueError(
            "plan_batch needs at least one heuristic sign: give None for the unlearned ones"
        )
    members = groups_of(tasks)
    groups = [PackedBatch([tasks[i] for i in numbers], signs) for numbers in members]
    buckets: dict[tuple, list[PackedBatch]] = defaultdict(list)
    for group in groups:
        buckets[group.shapes].append(group)
    num_threads = num_threads or num_cores()
    with ThreadPoolExecutor(num_threads) as outer, ThreadPoolExecutor(num_threads) as inner:

        def climb(alike: list[PackedBatch]) -> None:
            rungs = (
                ladder if ladder is not None else default_ladder(alike[0].tables.explains.shape[0])
            )
            _climb(inner, num_threads, alike, signs, rungs)

        for _ in outer.map(climb, buckets.values()):
            pass
    results: dict[int, PlanResult] = {}
    for group, numbers in zip(groups, members):
        results.update(zip(numbers, group.results(max_expansions)))
    return [results[i] for i in range(len(tasks))]


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
            size = _queue_size(
                max(map(len, open_)),
                num_threads if len(groups) == 1 else 1,
                groups[0].task_bytes(sign),
            )
            jobs = [
                (group, part)
                for group, tasks in zip(groups, open_)
                for part in _parts(tasks, size, num_threads)
            ]
            at_once = 1 if len(groups) == 1 else DOMAINS[len(jobs) > DOMAINS[0]]
            slices = [jobs[i : i + at_once] for i in range(0, len(jobs), at_once)]
            search = functools.partial(
                _search, rung=rung, sign=sign, number=number, size=size, domains=at_once
            )
            for found in pool.map(search, slices):
                for group, *plans in found:
                    group.note(*plans)
            for group in groups:
                group.seconds["search"] += (time.perf_counter() - began) / len(groups)


def _queue_size(num_tasks: int, num_threads: int, task_bytes: int) -> int:
    """The least size that takes a thread's share of the tasks, bounded by what their tables
    take.
    """
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
    jobs: list[tuple[PackedBatch, np.ndarray]],
    *,
    rung: Rung,
    sign: HeuristicSign,
    number: int,
    size: int,
    domains: int,
) -> list[tuple]:
    """One jitted search over the jobs, each the tasks of one domain; where there are fewer, the
    first stands in unread.

    -> (group, its tasks, lengths, plans, whether they have detours) of each job.
    """
    options = {
        "beam": rung.beam,
        "branch": rung.branch,
        "steps": rung.steps,
        "lanes": min(rung.lanes, size),
    }
    options |= {
        "uses_landmarks": any(sign.landmarks.values()),
        "uses_plan": any(sign.plan.values()),
    }
    inputs = [
        (group.tables, group.weights[number], *group.queue(tasks, size)) for group, tasks in jobs
    ]
    if domains == 1:
        found = [np.asarray(part)[None] for part in regress(*inputs[0], **options)]
    else:
        nothing = (*inputs[0][:-1], np.int32(0))
        inputs += [nothing] * (domains - len(inputs))
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *inputs)
        found = [np.asarray(part) for part in regress_domains(*stacked, **options)]
    return [
        (group, tasks, *(part[i, : len(tasks)] for part in found))
        for i, (group, tasks) in enumerate(jobs)
    ]
