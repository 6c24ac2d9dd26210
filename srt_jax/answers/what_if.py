"""What would follow if one obstacle were otherwise: the task is changed and solved again (host)."""

import dataclasses
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from srt_jax.solver import solve
from srt_jax.types import FREE, Solution, Status, Task


@dataclasses.dataclass(frozen=True)
class Outcome:
    """How a changed task ends. destroyed: in order; removal_cost: of all of them, rounded down to
    float32 as in `Solution`, inf without a route.
    """

    status: Status
    destroyed: tuple[int, ...]
    removal_cost: float

    def as_data(self) -> dict:
        """Returns the outcome as JSON types; what has no finite value is None."""
        cost = self.removal_cost if np.isfinite(self.removal_cost) else None
        return {"status": self.status.name, "destroyed": list(self.destroyed), "removal_cost": cost}

    def in_words(self) -> str:
        """Returns the outcome in words, without a full stop."""
        if self.status is Status.PATH_EXISTS:
            return "a path exists"
        if self.status in (Status.SOLVED, Status.BROKE_THROUGH):
            return (
                f"{' + '.join(map(str, self.destroyed))} would have to go, at cost"
                f" {self.removal_cost:g}"
            )
        return {Status.BUDGET_SPENT: "more than max_destroyed would have to go"}.get(
            self.status, "unsolvable"
        )


def if_flag(task: Task, solution: Solution, obstacle: int, *, is_destroyable: bool) -> Outcome:
    """Returns how the task ends if one obstacle can be destroyed, or cannot: the least removal
    then.
    """
    flags = np.array(task.destroyable)
    flags[obstacle] = is_destroyable
    return _solve_again(task.replace(destroyable=flags), solution)


def if_gone(task: Task, solution: Solution, obstacle: int) -> Outcome:
    """Returns the least removal among those that destroy this obstacle: it goes first, and its cost
    is part of the sum.
    """
    labels = np.array(task.labels)
    labels[labels == obstacle] = FREE
    rest = _solve_again(task.replace(labels=labels), solution)
    if not rest.status.is_solved:
        return rest
    destroyed = (obstacle, *rest.destroyed)
    return Outcome(Status.SOLVED, destroyed, _rounded_down(exact_cost(task, destroyed)))


def exact_cost(task: Task, obstacles: Iterable[int]) -> Fraction:
    """Returns the sum of the removal costs of some obstacles of one task, without rounding."""
    costs = np.asarray(task.removal_cost)
    return sum((Fraction(float(costs[i])) for i in obstacles), Fraction(0))


def _rounded_down(cost: Fraction) -> float:
    """Returns the greatest finite float32 that is no more than `cost`, as `solve` rounds its
    sums.
    """
    greatest = np.finfo(np.float32).max
    nearest = np.float32(min(cost, Fraction(float(greatest))))
    is_above = Fraction(float(nearest)) > cost
    return float(np.nextafter(nearest, np.float32(0)) if is_above else nearest)


def outcome_of(solution: Solution) -> Outcome:
    """Returns the outcome of one solution."""
    destroyed = np.asarray(solution.destroyed)
    destroyed = destroyed[destroyed >= 0]
    return Outcome(
        Status(int(solution.status)), tuple(destroyed.tolist()), float(solution.removal_cost)
    )


def _solve_again(task: Task, solution: Solution) -> Outcome:
    return outcome_of(solve(task, max_destroyed=np.shape(solution.destroyed)[-1]))
