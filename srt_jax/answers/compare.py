"""Two sets of answers to the same tasks, task by task and in sum."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from sign_model.foundation.legible import finite_or_none
from srt_jax.types import Solution, Status


class Answer(NamedTuple):
    """What is compared of an answer. length: of the route in cell sides; None, as the removal cost,
    where there is no route. destroyed: in order.
    """

    name: str
    status: str
    length: float | None
    removal_cost: float | None
    destroyed: tuple[int, ...]

    @property
    def is_solved(self) -> bool:
        """Whether there is a route."""
        return self.status in Status.__members__ and Status[self.status].is_solved


class Pair(NamedTuple):
    """The answers to one task, None where one of the two has no such task. differs: the fields of
    `Answer` in which they do.
    """

    name: str
    left: Answer | None
    right: Answer | None
    differs: tuple[str, ...]


class Sums(NamedTuple):
    """Over all tasks of both sides.

    tasks, solved: of the left and the right side. shared: tasks that both solve, over which lengths
    and removal costs are added up (left, right) and compared: (less on the left, less on the right)
    tasks.
    """

    tasks: tuple[int, int]
    solved: tuple[int, int]
    shared: int
    differing: int
    lengths: tuple[float, float]
    removal_costs: tuple[float, float]
    shorter: tuple[int, int]
    cheaper: tuple[int, int]


def answer_of(name: str, solution: Solution) -> Answer:
    """Returns what is compared of a solution."""
    status = Status(int(solution.status))
    count = int(solution.num_destroyed) if status.is_solved else 0
    destroyed = np.asarray(solution.destroyed)[:count].tolist()
    numbers = finite_or_none(solution.cost), finite_or_none(solution.removal_cost)
    return Answer(name, status.name, *numbers, tuple(destroyed))


def answer_of_record(record: dict[str, Any]) -> Answer:
    """Returns what is compared of a record of results (`results_file.as_record`).

    Raises:
      ValueError: it lacks a field.
    """
    missing = [name for name in ("name", "status", "cost", "removal_cost") if name not in record]
    if missing:
        raise ValueError(
            f"an answer has no {missing[0]!r}: compare files that srt-jax solve --results or --out"
            " wrote"
        )
    return Answer(
        record["name"],
        record["status"],
        record["cost"],
        record["removal_cost"],
        tuple(record.get("destroyed", ())),
    )


def pairs(left: Iterable[Answer], right: Iterable[Answer]) -> list[Pair]:
    """Returns the answers of both sides by the names of their tasks, in the order of the left side,
    then those that only the right side has. Of tasks of one name the first meets the first.
    """
    sides = [_by_name(left), _by_name(right)]
    return [
        Pair(key[0], *found, _differing(*found))
        for key in {**sides[0], **sides[1]}
        for found in [(sides[0].get(key), sides[1].get(key))]
    ]


def _by_name(answers: Iterable[Answer]) -> dict[tuple[str, int], Answer]:
    seen: Counter[str] = Counter()
    found = {}
    for answer in answers:
        found[answer.name, seen[answer.name]] = answer
        seen[answer.name] += 1
    return found


def _differing(left: Answer | None, right: Answer | None) -> tuple[str, ...]:
    if left is None or right is None:
        return ("task",)
    return tuple(
        name
        for name in Answer._fields[1:]
        if not _are_equal(getattr(left, name), getattr(right, name))
    )


def _are_equal(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-6)  # a length may be float32 or JSON
    return one == other


def sums(found: Sequence[Pair]) -> Sums:
    """Returns the sums over the tasks of both sides."""
    sides = [[pair.left for pair in found], [pair.right for pair in found]]
    shared = [
        (pair.left, pair.right)
        for pair in found
        if pair.left and pair.right and pair.left.is_solved and pair.right.is_solved
    ]

    def totals(name: str) -> tuple[float, float]:
        return tuple(math.fsum(getattr(pair[i], name) or 0.0 for pair in shared) for i in (0, 1))  # type: ignore

    def less(name: str) -> tuple[int, int]:
        values = [(getattr(a, name) or 0.0, getattr(b, name) or 0.0) for a, b in shared]
        apart = [(a, b) for a, b in values if not _are_equal(float(a), float(b))]
        return sum(a < b for a, b in apart), sum(b < a for a, b in apart)

    return Sums(
        tasks=_both(sum(one is not None for one in side) for side in sides),
        solved=_both(sum(one is not None and one.is_solved for one in side) for side in sides),
        shared=len(shared),
        differing=sum(bool(pair.differs) for pair in found),
        lengths=totals("length"),
        removal_costs=totals("removal_cost"),
        shorter=less("length"),
        cheaper=less("removal_cost"),
    )


def _both(numbers: Iterable[int]) -> tuple[int, int]:
    left, right = numbers
    return left, right
