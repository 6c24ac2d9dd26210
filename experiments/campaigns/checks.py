"""Answers made wrong in every field, thousands of them: `check` has to notice each, and to pass the
right ones.

    python -m experiments.campaigns.checks [--count 5000] [--seed 0]

The tasks are those of `campaigns.costs`. Prints how many wrong answers there were of each field,
and every one that passes. Exit code 1 if any wrong answer passes, or any right one does not.
"""

import argparse
import sys
import time
from collections import Counter

import jax
import numpy as np

from experiments.campaigns.costs import LIMITS, make_tasks
from experiments.campaigns.inputs.spoilt_answers import spoilt
from experiments.campaigns.judges.tally import progress
from srt_jax import check, solve

AT_ONCE = 64
PER_TASK = 20
"""Wrong answers made of one right one, of some 80."""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=5000, help="wrong answers")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(argv)
    begin, first, rng = time.process_time(), 0, np.random.default_rng(options.seed)
    seen, wrong = Counter[str](), 0
    limits = LIMITS[0]
    for _ in progress(
        "wrong answers", iter(lambda: seen.total() < options.count, False), options.count
    ):
        # Right answers first: the check must pass them.
        batch = make_tasks(first, AT_ONCE, options.seed)
        solutions = jax.tree.map(np.asarray, solve(batch, **limits._asdict()))
        for place in range(AT_ONCE):
            task, solution = jax.tree.map(lambda array, i=place: array[i], (batch, solutions))
            for problem in check(task, solution, mode=limits.mode):
                wrong += 1
                print(
                    f"task {first + place}: the right answer: {problem}",
                    file=sys.stderr,
                    flush=True,
                )
            # Each is spoilt in many ways: the check must notice every one.
            for what, fields, changed in spoilt(rng, task, solution, PER_TASK):
                if seen.total() == options.count:
                    break
                seen[" + ".join(fields)] += 1
                if not check(task, changed, mode=limits.mode):
                    wrong += 1
                    print(f"task {first + place}: passes with {what}", file=sys.stderr, flush=True)
        first += AT_ONCE
    print(", ".join(f"{number} {name}" for name, number in sorted(seen.items())))
    print(
        f"{seen.total()} wrong answers to {first} tasks, {wrong} wrong;"
        f" {time.process_time() - begin:.0f} s of CPU"
    )
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
