"""Figure 1 of the paper end to end, and what its greedy loop costs beside the least removal.

First one world of polygons, from the sign of the goal down to the route and back: the goal is
"afar, ahead-left", the signs are grounded in a sector, the sector in a square, the square is a cell
of the grid; no path is found; what blocks becomes signs; the plan becomes approach, destroy, pass;
each leg of the route is a relocation with its permitted deviation H. Drawn as Figure 1.

Then many tasks on cities, rooms, fences, rings (and NAMO scenes, where they can be read), each
solved in every mode there is:

  least    destroys what costs least, then takes the shortest route for it
  paper    the paper's loop, read kindly: walk until blocked, destroy what can be on the contour,
           walk on
  literal  the paper's loop to the letter: it ends where what lies ahead of the seed is
           indestructible

Every answer is replayed by `check`.

examples:
  python -m experiments.figure1
  python -m experiments.figure1 --quick --out figure1
  python -m experiments.figure1 --count 200 --size 128 --seed 7
"""

import sys
import time
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from experiments.figures.column_style import style
from experiments.figures.fuzzy_goal import GOAL, Story, draw, plan_and_walk
from experiments.figures.outcome import Outcome, Table, options, run, time_text
from experiments.figures.relocation_tasks import kinds
from srt_jax import Solution, Status, Task, check, solve, solver, stack
from srt_jax.bench.machine import spread

MODES = ("least", "paper", "literal")
"""Those that `solve` does not know are left out."""

MOST_DESTROYED = 16


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment; exit code 1 where an answer fails its replay, or beats the proven
    bound.
    """
    parser = options("figure1", __doc__ or "")
    parser.add_argument(
        "--count", type=int, metavar="N", help="tasks of each kind (default: 128; quick: 16)"
    )
    parser.add_argument(
        "--size", type=int, metavar="CELLS", help="cells a side (default: 96; quick: 50)"
    )
    given = parser.parse_args(arguments)
    count, size = (
        given.count or (16 if given.quick else 128),
        given.size or (50 if given.quick else 96),
    )
    outcome = Outcome("figure1", given, sys.argv[1:] if arguments is None else arguments)
    # One world from the goal's sign to the executed plan: the figure and its table.
    with style():
        outcome.progress("Figure 1: a world from its goal's sign to the executed plan")
        story = plan_and_walk()
        outcome.figure(draw(story), "figure1", _CAPTION)
    outcome.add(_story_table(story))
    # What the greedy loop costs beside the least removal, on random tasks.
    batches = _pad(kinds(count, size, seed=given.seed, log=outcome.progress))
    rows, num_wrong = _compare(batches, 1 if given.quick else 5, outcome)
    outcome.keep(goal=GOAL, plan=story.plan, modes=rows, problems=num_wrong)
    outcome.add(_comparison(rows))
    outcome.save()
    return int(num_wrong > 0 or any(row["below_bound"] for row in rows))


def _compare(
    batches: dict[str, Task], repeats: int, outcome: Outcome
) -> tuple[list[dict[str, Any]], int]:
    """Returns a row for each kind and mode, and how many answers failed their replay."""
    modes, rows, num_wrong = [mode for mode in MODES if mode in solver.MODES], [], 0
    for mode in set(MODES) - set(modes):
        outcome.progress(
            f"mode {mode} is left out: this version of solve has {', '.join(solver.MODES)}"
        )
    for kind, batch in batches.items():
        answers = {}
        for mode in modes:
            outcome.progress(f"{kind}: {len(batch.start)} tasks, mode {mode}")
            answers[mode] = _solve(batch, mode, len(batches["cities"].start), repeats=repeats)
            for place in range(len(batch.start)):
                for problem in check(_one(batch, place), _one(answers[mode][0], place)):
                    outcome.progress(f"{kind} {place}, {mode}: {problem}")
                    num_wrong += 1
        rows += _rows(kind, answers)
    return rows, num_wrong


def _pad(tasks: dict[str, list[Task]]) -> dict[str, Task]:
    """Returns a batch of each kind, padded to one shape, so that a mode is compiled once; larger
    NAMO scenes apart.
    """
    same = {
        kind: some
        for kind, some in tasks.items()
        if kind != "NAMO" or _largest(some) <= _largest(tasks["cities"])
    }
    whole, first, batches = stack([task for some in same.values() for task in some]), 0, {}
    for kind, some in same.items():
        batches[kind] = jax.tree.map(
            lambda array, first=first, some=some: array[first : first + len(some)], whole
        )
        first += len(some)
    return batches | {kind: stack(some) for kind, some in tasks.items() if kind not in same}


def _largest(tasks: list[Task]) -> int:
    return max(max(task.labels.shape[-2:]) for task in tasks)


def _one(batch: Any, place: int) -> Any:
    return jax.tree.map(lambda array: np.asarray(array)[place], batch)


def _solve(
    batch: Task, mode: str, count: int, *, repeats: int
) -> tuple[Solution, dict[str, float]]:
    """Returns the answers, and seconds a task once all is compiled; a batch of fewer than `count`
    is filled up with copies.
    """
    num_tasks = len(batch.start)
    places = np.arange(max(count, num_tasks)) % num_tasks
    filled = jax.tree.map(lambda array: array[places], batch)
    room, seconds = 32 * max(batch.labels.shape[-2:]), []
    for _ in range(repeats + 1):
        began = time.perf_counter()
        solution = jax.block_until_ready(
            solve(filled, mode=mode, max_destroyed=MOST_DESTROYED, max_cells=room)
        )
        seconds.append((time.perf_counter() - began) / len(places))
    return jax.tree.map(lambda array: np.asarray(array)[:num_tasks], solution), spread(seconds[1:])


def _rows(kind: str, answers: dict[str, tuple[Solution, dict[str, float]]]) -> list[dict[str, Any]]:
    """Returns a row per mode; lengths and counts are means over the tasks that this mode and the
    least removal both solve.
    """
    solved = (int(Status.PATH_EXISTS), int(Status.SOLVED))
    is_solved = {mode: np.isin(solution.status, solved) for mode, (solution, _) in answers.items()}
    least = answers["least"][0]
    bounds = least.removal_bound
    rows = []
    for mode, (solution, seconds) in answers.items():
        costs, by_both = solution.removal_cost, is_solved[mode] & is_solved["least"]
        rows.append(
            {
                "kind": kind,
                "mode": mode,
                "tasks": len(bounds),
                "solvable": int(np.isfinite(bounds).sum()),
                "solved": int(is_solved[mode].sum()),
                "compared": int(by_both.sum()),
                "destroyed": _mean(solution.num_destroyed[by_both]),
                "cost": _mean(costs[by_both]),
                "bound": _mean(bounds[by_both]),
                "least_cost": _mean(least.removal_cost[by_both]),
                "route": _mean(solution.cost[by_both]),
                "least_route": _mean(least.cost[by_both]),
                "at_bound": int((costs <= bounds * (1 + 1e-6))[is_solved[mode]].sum()),
                "below_bound": int((costs < bounds * (1 - 1e-6)).sum()),
                "seconds": seconds,
            }
        )
    return rows


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _number_text(value: float, form: str) -> str:
    """Returns a dash for a mean over no task."""
    return format(value, form) if value == value else "-"


def _more(value: float, than: float) -> str:
    """Returns by how much `value` exceeds another; a dash where no task was compared or nothing had
    to go.
    """
    return f"{100 * (value / than - 1):+.0f}%" if than > 0 else "-"


def _comparison(rows: list[dict[str, Any]]) -> Table:
    lines = []
    for row in rows:
        lines.append(
            [
                row["kind"],
                row["mode"],
                f"{row['solved']} of {row['solvable']}",
                _number_text(row["destroyed"], ".2f"),
                _number_text(row["cost"], ".2f"),
                _more(row["cost"], row["bound"]),
                f"{row['at_bound']} of {row['solved']}",
                _number_text(row["route"], ".1f"),
                _more(row["route"], row["least_route"]),
                time_text(row["seconds"]),
            ]
        )
    return Table(
        "The paper's greedy loop beside the least removal",
        (
            "world",
            "mode",
            "solved of solvable",
            "destroyed",
            "removal cost",
            "over the bound",
            "proven least",
            "route",
            "longer by",
            "ms a task",
        ),
        lines,
        "destroyed, cost and route: means over the tasks that the mode and the least removal solve;"
        " route in cells. bound: the proven lower bound on the removal cost. solvable: not proven"
        " unsolvable. -: nothing to compare. ms: median (quartiles) of a batch, compiling apart,"
        " all padded to the same size, layers and obstacles.",
    )


def _story_table(story: Story) -> Table:
    near, far = float(story.sector.near), float(story.sector.far)
    (x, y), side = story.square
    seen = "; ".join(
        f"{name}: {len(regions)} regions from {regions[0]}" for name, regions in story.seen.items()
    )
    lines = [
        ["goal, as a sign", GOAL],
        [
            "grounded in the sector",
            f"r {near:g} to {far:g} m, {np.degrees(float(story.sector.width)):.0f} degrees wide",
        ],
        ["the square that holds it", f"side {side:.2f} m round ({x:.1f}, {y:.1f}) m"],
        ["the grid", f"{story.grid.height} x {story.grid.width} cells of that side"],
        ["first plan", " ".join(story.first_plan)],
        [
            "the path planner",
            f"no path; contour of {int(np.asarray(story.solution.contour).sum())} cells",
        ],
        ["what blocks, as signs", seen],
        ["plan after that", " ".join(story.plan)],
    ]
    for number, (points, name, deviation, strays) in enumerate(story.legs, 1):
        lines.append(
            [
                f"L{number}, carried out",
                (
                    f"{name}: {len(points) - 1} steps, strays {strays:.1f} m, H{number}"
                    f" {deviation:g} m"
                ),
            ]
        )
    return Table("Figure 1, end to end", ("step", "what"), lines)


_CAPTION = (
    "Single-agent smart relocation task (PY16, Figure 1). The goal's sector in the agent's polar"
    " frame and the square that holds it; H1 and H2 are permitted deviations from the straight"
    " links, L1 and L2 traces of the relocation actions carried out: up to the fence, which is"
    " destroyed, and on to the goal."
)


if __name__ == "__main__":
    run(main)
