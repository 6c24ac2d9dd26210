"""The front of route lengths against removal costs: what there is to choose from."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from srt_jax.types import Solution, Status


class Tradeoff(NamedTuple):
    """One point of the front.

    Attributes:
      length: of the route, in cell sides.
      removal_cost: of what is destroyed for it.
      destroyed: ids, in order.
      tolls: the least and the greatest of the tolls tried at which it is the best.
      is_proven: whether that is proven at one of these tolls.
      solution: the answer at the least of these tolls.
    """

    length: float
    removal_cost: float
    destroyed: tuple[int, ...]
    tolls: tuple[float, float]
    is_proven: bool
    solution: Solution


def front_of(answers: Iterable[tuple[float, Solution]]) -> list[Tradeoff]:
    """Returns the points of the front from (toll, solution) pairs, in the order of their tolls: the
    shortest route first; empty where none has a route.
    """
    points: list[Tradeoff] = []
    for toll, solution in sorted(answers, key=lambda answer: answer[0]):
        if not Status(int(solution.status)).is_solved:
            continue
        ids = np.asarray(solution.destroyed)[: int(solution.num_destroyed)].tolist()
        point = Tradeoff(
            length=float(solution.cost),
            removal_cost=float(solution.removal_cost),
            destroyed=tuple(ids),
            tolls=(toll, toll),
            is_proven=bool(solution.total == solution.total_bound),
            solution=solution,
        )
        same = [i for i, other in enumerate(points) if other[:2] == point[:2]]
        if same:
            first = points[same[0]]
            is_proven = first.is_proven or point.is_proven
            points[same[0]] = first._replace(tolls=(first.tolls[0], toll), is_proven=is_proven)
        else:
            points.append(point)
    return sorted(
        (point for point in points if not any(_is_better(other, point) for other in points)),
        key=lambda point: point.length,
    )


def _is_better(one: Tradeoff, other: Tradeoff) -> bool:
    """Whether one point is no worse in both and better in one."""
    return (
        one[:2] != other[:2]
        and one.length <= other.length
        and one.removal_cost <= other.removal_cost
    )
