"""Many tasks in one jitted search: tasks that share their matrices are searched together, on a
ladder of ever wider beams.

The bulk of a batch does not wait for its few hard tasks: the first rung is narrow, and the next one
tries only the tasks that are still unsolved. What the whole ladder leaves unsolved goes to the
exact search, which alone can prove that there is no plan.
"""

import functools
import math
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import jax
import numpy as np

from sign_model.foundation.core_count import num_cores
from sign_model.foundation.legible import counted
from sign_model.map_algorithm.heuristics import DEFAULTS, HeuristicSign
from sign_model.map_batch.grouping import groups_of
from sign_model.map_batch.iteration import MAX_BEAM, regress, regress_domains
from sign_model.map_batch.packed_tasks import PackedBatch
from sign_model.pddl.planning_task import PlanningTask
from sign_model.plan_task import Memory, plan
from sign_model.result import PlanResult

QUEUES = (16, 256, 2048)
"""Sizes of a queue, the tasks of one call: few of them, so that few programs are compiled. What the
tasks do not fill is padding.
"""

DOMAINS = (8, 32)
"""How many domains of one bucket share a call: the first number, or the second if there are more
queues than that.
"""

TOGETHER = 64
"""A group of fewer tasks is planned one by one even where a sign is given: that is sooner done than
compiled, and better.
"""

_COMPARED = 256
"""A group of fewer tasks is planned one by one rather than searched side by side and compared:
compiling takes as long.
"""

_PROBED = 8
"""So many tasks of a group, planned alone, tell whether its plans can be proven shortest."""

_MAX_TABLE_BYTES = 1 << 25
"""The most memory that the tables of one queue may take."""


@dataclass(frozen=True)
class Rung:
    """One attempt at a batch.

    beam: situations kept in each step, 1 to `MAX_BEAM`.
    branch: actions tried for each situation, 1 to `MAX_BEAM`.
    steps: the longest plan.
    lanes: batch slots, that is, tasks searched side by side; a power of two.

    Raises:
      ValueError: a number lies outside its range.
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
                "a rung's lanes must be a power of two, so that they divide a queue, got"
                f" {self.lanes}"
            )


def default_ladder(num_features: int) -> tuple[Rung, ...]:
    """Returns the rungs for a domain with that many features: a narrow beam for the bulk, then each
    four times as wide.

    Measured on tasks of 8 to 15 blocks: doubling the beam halves the speed and removes a third of
    the excess over the optimal length. Small domains of other kinds (tiles, sokoban) got plans half
    as long from 16 situations as from 6, at little cost.
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
    memory: Memory | None = None,
    max_expansions: int = 200_000,
    max_seconds: float | None = None,
    num_threads: int | None = None,
    log: Callable[[str], None] | None = None,
    together: int | None = None,
) -> list[PlanResult]:
    """Returns one result per task, in order; every plan was replayed forward. An empty batch gives
    an empty list.

    Tasks may be of any sizes and domains. Those with the same features and actions form a group.
    No plan is longer than that of `plan`, unless a sign, a ladder or `together` asks for speed:

    - by default a group is planned task by task, with the plans of `plan`. A group of some
      hundred tasks whose plans can be proven shortest is searched side by side first; what is
      proven shortest stays, every other task is planned by `plan` too, and the shorter plan kept.
    - groups of at least `together` tasks are searched side by side only, thousands of tasks a
      second once that is compiled, which takes seconds. There narrow beams give plans that may be
      some hundredths longer.

    Args:
      tasks: to be planned.
      heuristic: one sign or several (tried in turn on every rung); the unlearned `DEFAULTS` if
        None.
      ladder: the rungs, for groups of any size, all searched side by side only; chosen by the size
        of the domain if None.
      memory: as of `plan`, for tasks planned one by one.
      max_expansions: of each task planned one by one, those that the ladder leaves unsolved among
        them.
      max_seconds: of each task planned one by one; unbounded where None.
      num_threads: batches searched at once; if None the number of cores, at most SRT_JAX_CORES
        (environment).
      log: called with a line of text for each group: how many tasks, how they were planned, and
        what it cost; and if there are several, with one for all of them.
      together: from so many tasks on a group is searched side by side only. If None, `TOGETHER`
        where `heuristic` is given, and no group is where it is not.

    Raises:
      TypeError: a single task. ValueError: `heuristic` is an empty sequence, or a weight of it is
        too large.

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
    if isinstance(tasks, PlanningTask):
        raise TypeError("plan_batch takes a list of tasks, got a single one: write [task], or plan")
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

    # Which groups are searched side by side, and which of them only so.
    if together is None and heuristic is not None:
        together = TOGETHER
    options = {"max_expansions": max_expansions, "max_seconds": max_seconds}
    alone = functools.partial(plan, heuristic=heuristic, memory=memory, **options)
    results: dict[int, PlanResult] = {}
    members, began_all = groups_of(tasks), time.perf_counter()
    groups: list[_Group] = []
    for numbers in members:
        of_group, began = [tasks[i] for i in numbers], time.perf_counter()
        if ladder is not None or (together is not None and len(numbers) >= together):
            groups.append(_Group(numbers, PackedBatch(of_group, signs), None))
            continue
        if together is None and len(numbers) >= _COMPARED:
            batch = PackedBatch(of_group, signs)
            known = {i: alone(of_group[i]) for i in range(_PROBED)}
            proven = sum(batch.least_length(i) == len(r.actions) for i, r in known.items())
            if 2 * proven >= len(known):
                batch.seconds["search"] += time.perf_counter() - began
                groups.append(_Group(numbers, batch, known))
                continue
        else:
            known = {}
        for number, i in enumerate(numbers):
            results[i] = known[number] if number in known else alone(tasks[i])
        _tell(log, of_group, "one by one", time.perf_counter() - began)

    # Search those of equal shapes side by side, and the queues of each bucket side by side as well.
    buckets: dict[tuple, list[PackedBatch]] = defaultdict(list)
    for group in groups:
        buckets[group.known is not None, *group.batch.shapes].append(group.batch)
    num_threads = num_threads or num_cores()
    with ThreadPoolExecutor(num_threads) as outer, ThreadPoolExecutor(num_threads) as inner:

        def climb(is_compared: bool, alike: list[PackedBatch]) -> None:
            rungs = ladder or default_ladder(alike[0].tables.explains.shape[0])
            # what is compared had better be proven shortest
            _climb(inner, num_threads, alike, signs, rungs[1:] if is_compared else rungs)

        jobs = [(is_compared, alike) for (is_compared, *_), alike in buckets.items()]
        for _ in outer.map(climb, *zip(*jobs)) if jobs else ():
            pass

    # Replay the plans; planning alone takes the tasks that have none, or perhaps a longer one.
    for group in groups:
        began, batch = time.perf_counter(), group.batch
        exact = functools.partial(plan, max_expansions=max_expansions)
        found = batch.results(exact if group.known is None else alone, group.known)
        results.update(zip(group.numbers, found))
        spent = batch.seconds["search"] + time.perf_counter() - began
        how = "side by side, plans not compared with those of planning alone"
        if group.known is not None:
            how = "side by side, then one by one those not proven shortest"
        _tell(log, batch.tasks, f"{how}, what was compiled for it included", spent)
    if log is not None and len(members) > 1:
        spent, solved = time.perf_counter() - began_all, sum(r.is_solved for r in results.values())
        many = counted(len(members), "group")
        log(f"{counted(len(tasks), 'task')} in {many}: {solved} solved in {spent:.2f} s")
    return [results[i] for i in range(len(tasks))]


class _Group(NamedTuple):
    """Tasks that are searched side by side: their numbers; and where their plans are compared with
    those of planning alone, which of these are known.
    """

    numbers: list[int]
    batch: PackedBatch
    known: dict[int, PlanResult] | None


def _tell(
    log: Callable[[str], None] | None, tasks: Sequence[PlanningTask], how: str, seconds: float
) -> None:
    """Says what a group of tasks cost."""
    if log is not None:
        log(
            f"{counted(len(tasks), 'task')} of {counted(tasks[0].num_features, 'feature')} and"
            f" {counted(tasks[0].num_actions, 'action')}, {how}:"
            f" {seconds:.2f} s, {1000 * seconds / len(tasks):.1f} ms each"
        )


def _climb(
    pool: ThreadPoolExecutor,
    num_threads: int,
    groups: list[PackedBatch],
    signs: tuple[HeuristicSign, ...],
    rungs: Sequence[Rung],
) -> None:
    """Climbs the ladder with all groups of one bucket; each group records the plans found for it.

    Ends early when no task is left that may have a plan.
    """
    for rung in rungs:
        for number, sign in enumerate(signs):
            began = time.perf_counter()
            unsolved = [group.unsolved_tasks() for group in groups]
            if not any(map(len, unsolved)):
                return

            # Cut the unsolved tasks into queues, and the queues into calls.
            size = _queue_size(
                max(map(len, unsolved)),
                num_threads if len(groups) == 1 else 1,
                groups[0].task_bytes(sign),
            )
            jobs = [
                (group, part)
                for group, tasks in zip(groups, unsolved)
                for part in _split(tasks, size, num_threads)
            ]
            at_once = 1 if len(groups) == 1 else DOMAINS[len(jobs) > DOMAINS[0]]
            slices = [jobs[i : i + at_once] for i in range(0, len(jobs), at_once)]

            # Search them, and record the answers; the time is shared among the groups.
            search = functools.partial(
                _search, rung=rung, sign=sign, number=number, size=size, domains=at_once
            )
            for found in pool.map(search, slices):
                for group, *plans in found:
                    group.record(*plans)
            for group in groups:
                group.seconds["search"] += (time.perf_counter() - began) / len(groups)


def _queue_size(num_tasks: int, num_threads: int, task_bytes: int) -> int:
    """Returns the least of `QUEUES` that holds one thread's share of the tasks; less if their
    tables, `task_bytes` per task, would take more than `_MAX_TABLE_BYTES`.
    """
    share = -(-num_tasks // num_threads)
    size = next((size for size in QUEUES if size >= share), QUEUES[-1])
    while size > QUEUES[0] and size * task_bytes > _MAX_TABLE_BYTES:
        size = QUEUES[QUEUES.index(size) - 1]
    return size


def _split(tasks: np.ndarray, size: int, num_threads: int) -> list[np.ndarray]:
    """Returns the tasks in parts of at most `size`, the same number of parts for each thread."""
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
) -> list[tuple[PackedBatch, np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Returns what one jitted search finds for the jobs, each the tasks of one domain: (group, its
    tasks, lengths, plans, whether they have detours) for each job.

    Args:
      jobs: at most `domains` of them; an empty copy of the first fills up the rest.
      rung, sign, number: the attempt, its heuristic sign and the number of that sign.
      size: of each queue.
      domains: how many jobs the compiled program takes.
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

    # One domain goes in as it is; several are stacked along a new first axis.
    if domains == 1:
        found = [np.asarray(part)[None] for part in regress(*inputs[0], **options)]
    else:
        nothing = (*inputs[0][:-1], np.int32(0))
        inputs += [nothing] * (domains - len(inputs))
        stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *inputs)
        found = [np.asarray(part) for part in regress_domains(*stacked, **options)]
    lengths, plans, detours = found
    answers = []
    for i, (group, tasks) in enumerate(jobs):
        rows = i, slice(len(tasks))  # without the padding
        answers.append((group, tasks, lengths[rows], plans[rows], detours[rows]))
    return answers
