"""The paper's loop in both readings beside the least removal: how often it stops short, and how
much more it destroys.

    python -m experiments.campaigns.modes [--count 200] [--size 96] [--seed 0] [--kinds half quarter
    bagel-10 rooms fences rings mixed]

Every answer is replayed by `check` (route, plan, proof), and two claims are tested with SciPy: the
seed of every cut-off task lies beside a piece of blocked cells that alone parts start and goal, and
start and goal of every unsolvable task are apart on a map with nothing but the obstacles of the
proof. Exit code 1 if anything is wrong.
"""

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from srt_jax import Solution, Status, Task, check, solve_many
from srt_jax.instances.generate import generate

MODES = ("least", "paper", "literal")
KINDS = ("half", "quarter", "bagel-10", "rooms", "fences", "rings", "mixed")
CORNERS = np.ones((3, 3), int)


def are_apart(free: np.ndarray, start: tuple[int, ...], goal: tuple[int, ...]) -> bool:
    """Returns whether no path joins two cells; moves along rows and columns reach all, for no
    corner is cut.
    """
    regions, _ = ndimage.label(free)  # type: ignore[misc]
    return not (free[start] and free[goal] and regions[start] == regions[goal])


def seed_is_beside_what_parts(task: Task, solution: Solution) -> bool:
    """Returns whether a piece of blocked cells that touches the seed parts start and goal by
    itself.
    """
    ends = [tuple(np.asarray(end).tolist()) for end in (task.start, task.goal)]
    pieces, _ = ndimage.label((task.labels != -1).any(axis=0), structure=CORNERS)  # type: ignore[misc]
    row, col = np.asarray(solution.seed).tolist()
    beside = pieces[max(0, row - 1) : row + 2, max(0, col - 1) : col + 2]
    return any(
        are_apart(np.asarray(pieces != piece), ends[0], ends[1])
        for piece in set(beside.ravel().tolist()) - {0}
    )


def proof_parts(task: Task, solution: Solution) -> bool:
    """Returns whether the indestructible obstacles of the proof alone separate start and goal."""
    ends = [tuple(np.asarray(end).tolist()) for end in (task.start, task.goal)]
    ids = solution.separating[solution.separating >= 0]
    alone = np.asarray(~np.isin(task.labels, ids).any(axis=0))
    return not task.destroyable[ids].any() and are_apart(alone, ends[0], ends[1])


def row_of(
    kind: str, tasks: Sequence[Task], answers: dict[str, list[Solution]]
) -> tuple[list[str], list[str]]:
    """Returns a row of the table, and what is wrong."""
    wrong = []
    for mode, solutions in answers.items():
        for number, (task, solution) in enumerate(zip(tasks, solutions)):
            wrong += [f"{kind} {number}, {mode}: {problem}" for problem in check(task, solution)]
    of = {
        mode: np.array([int(solution.status) for solution in solutions])
        for mode, solutions in answers.items()
    }
    cut_off = [number for number, solution in enumerate(answers["least"]) if solution.seed[0] >= 0]
    beside = [
        seed_is_beside_what_parts(tasks[number], answers["paper"][number]) for number in cut_off
    ]
    proven = np.flatnonzero(np.isin(of["least"], (Status.UNSOLVABLE, Status.GOAL_BLOCKED)))
    parted = [proof_parts(tasks[number], answers["least"][number]) for number in proven.tolist()]
    wrong += [f"{kind}: a seed lies beside nothing that parts"] * beside.count(False)
    wrong += [f"{kind}: a proof does not part"] * parted.count(False)
    solvable = np.flatnonzero(of["least"] == Status.SOLVED)
    short = int((of["literal"][solvable] == Status.STOPPED_SHORT).sum())
    cells = [
        kind,
        str(len(tasks)),
        f"{beside.count(True)}/{len(cut_off)}",
        f"{parted.count(True)}/{len(proven)}",
    ]
    cells += [str(len(solvable)), f"{short} ({100 * short / max(1, len(solvable)):.0f} %)"]
    for mode in ("paper", "literal"):
        both = solvable[of[mode][solvable] == Status.SOLVED]
        cells += [str(len(both)), *_more(answers["least"], answers[mode], both)]
    return cells, wrong


def _more(least: list[Solution], other: list[Solution], which: np.ndarray) -> tuple[str, str]:
    """Returns how much more the other mode destroys, in number and in cost, on tasks that both
    solve.
    """
    sums = [
        [
            float(sum(np.float64(getattr(answers[number], field)) for number in which.tolist()))
            for answers in (least, other)
        ]
        for field in ("num_destroyed", "removal_cost")
    ]
    number, cost = (f"{100 * (there / here - 1):+.1f} %" if here else "-" for here, there in sums)
    return number, cost


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS))
    options = parser.parse_args()
    # The head of the table.
    head = [
        "kind",
        "tasks",
        "seed beside what parts",
        "proofs that part",
        "solvable",
        "literal stops short",
    ]
    head += [
        f"{mode}: {outcome}"
        for mode in ("paper", "literal")
        for outcome in ("solved", "more obstacles", "more cost")
    ]
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    # A row for each kind: its tasks solved in every mode, the answers judged.
    wrong = []
    for kind in options.kinds:
        tasks = [
            task
            for _, task, _ in generate(
                kind, count=options.count, size=options.size, seed=options.seed
            )
        ]
        answers = {mode: solve_many(tasks, mode=mode, max_destroyed=16) for mode in MODES}
        cells, found = row_of(kind, tasks, answers)
        print("| " + " | ".join(cells) + " |", flush=True)
        wrong += found
    print(f"{len(wrong)} things wrong")
    print(*wrong[:20], sep="\n", file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
