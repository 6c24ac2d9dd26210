"""Costs, bounds and statuses of a million small tasks against an exact oracle.

    python -m experiments.campaigns.costs [--count 1000000] [--seed 0] [--at-once 2048]

Tasks of at most 32 x 32 cells and 10 obstacles, in pieces, overlapping, in layers; costs over ten
orders of magnitude, near ties, sums of one another, from the least float32 to the greatest; several
limits on obstacles and branches, and the paper's loop. The oracle tries every set of obstacles,
with sums of 320 bits; it is C++ of its own (g++ is needed). One task in fifty is replayed by
`check` too. Any that is wrong is printed with what brings it back: `--seed S --only NUMBER`. Exit
code 1 if any is.
"""

import argparse
import sys
import time
from typing import Any, NamedTuple

import jax
import numpy as np

from experiments.campaigns.inputs.cost_tasks import MOST_OBSTACLES, random_task
from experiments.campaigns.judges.cost_oracle import Truth, judge
from experiments.campaigns.judges.tally import progress
from srt_jax import Solution, Status, Task, check, make_task, solve, stack

REPLAYED = 50
"""One task in so many goes through `check`."""


class Limits(NamedTuple):
    mode: str
    max_destroyed: int
    max_branches: int


LIMITS = (
    Limits("least", MOST_OBSTACLES, 256),
    Limits("least", 2, 256),
    Limits("least", MOST_OBSTACLES, 1),
    Limits("least", 1, 9),
    Limits("paper", MOST_OBSTACLES, 1),
    Limits("literal", 3, 1),
)
"""The batches have these in turn."""


def make_tasks(first: int, count: int, seed: int) -> Task:
    """Returns the tasks from number `first` on, as one batch."""
    return batch_of(
        [
            random_task(np.random.default_rng([seed, number]))
            for number in range(first, first + count)
        ]
    )


def batch_of(tasks: list[Task]) -> Task:
    """Returns the tasks padded to one shape: few programs are compiled."""
    largest = make_task(
        np.full((3, 32, 32), -1), (0, 0), (0, 0), removal_cost=np.ones(MOST_OBSTACLES, np.float32)
    )
    padded = stack([*tasks, largest])
    return jax.tree.map(lambda array: array[:-1], padded)


def problems_of(
    batch: Task, solutions: Solution, truth: Truth, limits: Limits
) -> list[tuple[int, str]]:
    """Returns what is wrong, each with the task's place in the batch."""
    status, kind = solutions.status, truth.status
    is_solved = (status == Status.SOLVED) | (status == Status.PATH_EXISTS)
    is_spent, is_short = status == Status.BUDGET_SPENT, status == Status.STOPPED_SHORT
    is_cut = kind == Status.SOLVED
    may_stop = is_cut & (is_spent | (is_short & (limits.mode == "literal")))
    own = is_cut & is_solved
    bound, cost = solutions.removal_bound, solutions.removal_cost
    is_least_mode = limits.mode == "least"
    # Each branch settles one obstacle more: so many look into all.
    is_complete = (
        is_cut & is_least_mode & (2.0 ** (batch.destroyable.sum(axis=1) + 1) <= limits.max_branches)
    )
    num = solutions.num_destroyed
    has_size = (truth.sizes >> np.minimum(num, 31).astype(np.uint32) & 1) != 0
    wrong = {
        "the status is not the truth": (status != kind) & ~may_stop,
        "the bound is above the least cost": is_cut & ~(bound <= truth.least),
        "the bound is below 0 or no number": ~(bound >= 0),
        "the bound is not 0 though a path exists": (kind == Status.PATH_EXISTS) & (bound != 0),
        "the bound is not inf though there is no way": np.isin(kind, (2, 3, 4)) & (bound != np.inf),
        "what is destroyed does not open the way": own & ~truth.opens,
        "the cost is not that of what is destroyed": own & (cost != truth.cost),
        "the cost is not 0 though a path exists": (status == Status.PATH_EXISTS) & (cost != 0),
        "the cost is below the bound": is_solved & ~(cost >= bound),
        "something needless is destroyed": own & is_least_mode & ~truth.is_thin,
        "the set is not the least though every branch was looked into": own
        & is_complete
        & ~truth.is_least,
        "cost and bound differ though every branch was looked into": own
        & is_complete
        & (cost != bound),
        "more is said to be needed than the limit without need": is_spent
        & is_least_mode
        & ~(num > limits.max_destroyed),
        "no least set has the number of obstacles that is said to be needed": is_spent
        & is_complete
        & ~has_size,
    }
    return [(int(place), what) for what, mask in wrong.items() for place in np.flatnonzero(mask)]


def solve_and_judge(batch: Task, limits: Limits) -> tuple[Task, Solution, Truth]:
    """Returns the batch, the answers to it, and the truth on both."""
    options: dict[str, Any] = limits._asdict()
    solutions = jax.tree.map(np.asarray, solve(batch, **options))
    chosen = (solutions.destroyed[:, :, None] == np.arange(batch.destroyable.shape[1])).any(axis=1)
    return batch, solutions, judge(batch, chosen)


def run(first: int, count: int, limits: Limits, seed: int) -> tuple[int, dict[str, int]]:
    """Prints what is wrong in one batch; returns how many tasks are, and counts of what they were
    like.
    """
    batch, solutions, truth = solve_and_judge(make_tasks(first, count, seed), limits)
    problems = problems_of(batch, solutions, truth, limits)
    for place in range(0, count, REPLAYED):
        one = jax.tree.map(lambda array, i=place: array[i], (batch, solutions))
        problems += [(place, problem) for problem in check(*one, mode=limits.mode)]
    for place, what in problems:
        print(
            f"task {first + place}, {limits}: {what}; --seed {seed} --only {first + place}",
            file=sys.stderr,
            flush=True,
        )
    is_cut = truth.status == Status.SOLVED
    counted = {
        "to be opened": is_cut.sum(),
        "unsolvable": np.isin(truth.status, (2, 4)).sum(),
        "proven": (is_cut & (solutions.removal_cost == solutions.removal_bound)).sum(),
        "more needed than allowed": (solutions.status == Status.BUDGET_SPENT).sum(),
    }
    return len({place for place, _ in problems}), {
        name: int(number) for name, number in counted.items()
    }


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--at-once", type=int, default=2048, help="tasks in a batch")
    parser.add_argument("--only", type=int, help="this task alone, with all limits")
    options = parser.parse_args(argv)
    # One task alone, to look at a failure.
    if options.only is not None:
        return int(sum(run(options.only, 1, limits, options.seed)[0] for limits in LIMITS) > 0)
    # All tasks, batch by batch, each batch with the next of the limits.
    begin, wrong, counts = time.process_time(), 0, dict[str, int]()
    firsts = range(0, options.count, options.at_once)
    for number, first in enumerate(progress("costs", firsts, len(firsts))):
        count = min(options.at_once, options.count - first)
        more, counted = run(first, count, LIMITS[number % len(LIMITS)], options.seed)
        wrong += more
        counts = {name: counts.get(name, 0) + counted[name] for name in counted}
    summary = ", ".join(f"{number} {name}" for name, number in counts.items())
    print(f"{summary}; {time.process_time() - begin:.0f} s of CPU")
    print(f"{options.count} tasks, {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
