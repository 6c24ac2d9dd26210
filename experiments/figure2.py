"""Figure 2 of the paper: plan lengths and times of MAP beside A* and W*, on the blocks world.

The paper's two tasks first (BLOCKS-4-0 and BLOCKS-4-1 of IPC-2000), then a growing series: IPC's
tasks where its files are there (folder pddl/blocks in the directory that SRT_SHARED_DATA names),
else random ones made like them. All planners get the same PDDL:

  MAP            goal regression on prediction matrices; its time is split into parsing, grounding,
                 building the semiotic network, search and replay (the paper found the network to be
                 most of it)
  A*, W*         forward search over the same matrices, by hmax; weighted by 2, by FF
  authors' rule  MAP's A-step as the authors published it: most features shared with the start,
                 depth-first
  peers          pyperplan and Fast Downward, where installed (pip install 'srt-jax[bench]'), each
                 run a process of its own

A planner without a plan on three tasks in a row is not run again.

examples:
  python -m experiments.figure2
  python -m experiments.figure2 --quick --no-peers
  python -m experiments.figure2 --most-blocks 30 --most-seconds 120
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments.figures.blocks_figures import (
    CAPTION,
    PAPER,
    SERIES_CAPTION,
    by_blocks,
    figure2,
    figure_of_series,
)
from experiments.figures.blocks_tasks import BlocksTask, paper_tasks, series
from experiments.figures.column_style import style
from experiments.figures.outcome import Outcome, Table, options, run, time_text
from experiments.figures.planners import Answer, Planner, own_planners, peers
from srt_jax.bench.machine import spread

STAGES = ("parse", "ground", "network", "search", "validate")
_PATIENCE = 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment; exit code 1 where a length of the paper's is not met."""
    parser = options("figure2", __doc__ or "")
    parser.add_argument(
        "--most-blocks", type=int, metavar="N", help="end of the series (default: 15; quick: 6)"
    )
    parser.add_argument(
        "--budget",
        type=int,
        metavar="N",
        help="most states A* and W* expand (default: 10000; quick: 2000)",
    )
    parser.add_argument(
        "--most-seconds",
        type=float,
        metavar="S",
        help="most time for a peer's plan (default: 20; quick: 5)",
    )
    parser.add_argument("--no-peers", action="store_true", help="ours alone")
    given = parser.parse_args(arguments)
    budget = given.budget or (2000 if given.quick else 10_000)
    most_blocks = given.most_blocks or (6 if given.quick else 15)
    packages = ("pyperplan", "up-fast-downward")
    outcome = Outcome("figure2", given, sys.argv[1:] if arguments is None else arguments, *packages)
    # Our planners, and the peers that are installed.
    others = {} if given.no_peers else peers(given.most_seconds or (5.0 if given.quick else 20.0))
    for name in [name for name, planner in others.items() if planner is None]:
        outcome.progress(f"{name} is not installed and left out (pip install 'srt-jax[bench]')")
    planners = own_planners(budget) | {name: planner for name, planner in others.items() if planner}
    with style():
        # The three tasks of the paper, then a series of growing ones; tables and figures of both.
        first = {
            task.name: _row(task, planners, 3 if given.quick else 9, outcome)
            for task in paper_tasks()
        }
        rows = _series(list(series(most_blocks, seed=given.seed)), planners, outcome)
        outcome.keep(paper=first, series=rows)
        outcome.add(_paper_table(first))
        for table in (
            _split_table(rows),
            _series_table(rows, planners),
            _times_table(rows, planners),
        ):
            outcome.add(table)
        outcome.figure(figure2(first), "figure2", CAPTION)
        outcome.figure(figure_of_series(rows, list(planners)), "figure2-series", SERIES_CAPTION)
    outcome.save()
    # The lengths of the paper are met.
    is_same = all(
        first[task][name]["length"] == length
        for task, entry in PAPER.items()
        for name, (length, _) in entry.items()
    )
    return 0 if is_same else 1


def _row(
    task: BlocksTask, planners: dict[str, Planner], repeats: int, outcome: Outcome
) -> dict[str, Any]:
    """Returns each planner's length and times on one task; the median of repeats."""
    outcome.progress(f"{task.name}: {', '.join(planners)}")
    row = {}
    for name, planner in planners.items():
        answers = [planner(task)]  # the first also warms up what is loaded once
        while len(answers) <= repeats and sum(answer.seconds for answer in answers) < 10:
            answers.append(planner(task))
        row[name] = _record(answers[1:] or answers)
    return row


def _record(answers: list[Answer]) -> dict[str, Any]:
    lengths = {answer.length for answer in answers}
    if len(lengths) > 1:
        raise AssertionError(
            f"lengths {lengths} of one task by one planner: they should be the same"
        )
    parts = {
        stage: float(np.median([answer.parts[stage] for answer in answers]))
        for stage in answers[0].parts
    }
    return {
        "length": answers[0].length,
        "seconds": spread([answer.seconds for answer in answers]),
        "parts": parts,
        "expansions": answers[0].expansions,
    }


def _series(
    tasks: list[BlocksTask], planners: dict[str, Planner], outcome: Outcome
) -> list[dict[str, Any]]:
    """Returns {task, blocks, optimum, answers {planner: record}} of each task; a planner that gave
    up has no record.
    """
    failed, rows = dict.fromkeys(planners, 0), []
    for task in tasks:
        answers = {}
        for name, planner in planners.items():
            if failed[name] < _PATIENCE:
                answers[name] = _record([planner(task)])
                failed[name] = 0 if answers[name]["length"] is not None else failed[name] + 1
        lengths = ", ".join(
            f"{name} {record['length'] or 'none'}" for name, record in answers.items()
        )
        outcome.progress(f"{task.name}: {lengths}")
        rows.append(
            {
                "task": task.name,
                "blocks": task.num_blocks,
                "optimum": task.optimum,
                "answers": answers,
            }
        )
    return rows


def _paper_table(first: dict[str, Any]) -> Table:
    lines = []
    for task, row in first.items():
        for name, record in row.items():
            length, seconds = PAPER[task].get(name, (None, None))
            theirs = [str(length or ""), f"{1e3 * seconds:.3g}" if seconds else ""]
            parts = record["parts"]
            split = " / ".join(f"{1e3 * parts[stage]:.2f}" for stage in STAGES) if parts else ""
            lines.append(
                [
                    task,
                    name,
                    str(record["length"]),
                    theirs[0],
                    time_text(record["seconds"]),
                    theirs[1],
                    split,
                ]
            )
    return Table(
        "Figure 2: plan length and milliseconds on the paper's two tasks, medians (quartiles)",
        ("task", "planner", "length", "PY16", "ms", "PY16", "ms: " + " / ".join(STAGES)),
        lines,
        "ours: from the PDDL text to the replayed plan, in one process; peers: with the start of"
        " their process. PY16: the numbers its authors published for its Figure 2. Its text has"
        " none and names no task: that they are these two is inferred from the lengths.",
    )


def _split_table(rows: list[dict[str, Any]]) -> Table:
    lines = []
    for blocks, group in by_blocks(rows).items():
        parts = [row["answers"]["MAP"]["parts"] for row in group if "MAP" in row["answers"]]
        medians = [1e3 * float(np.median([part[stage] for part in parts])) for stage in STAGES]
        total = sum(medians)
        lines.append(
            [
                str(blocks),
                *(f"{ms:.1f}" for ms in medians),
                f"{medians[2] / total:.0%}",
                f"{medians[3] / total:.0%}",
            ]
        )
    return Table(
        "MAP's time by stage: milliseconds, medians over the tasks of a size",
        ("blocks", *STAGES, "network's share", "search's share"),
        lines,
        "network: the semiotic network of signs. The paper: MAP is slower 'due to large overhead on"
        " the initial process of semiotic network generation'.",
    )


def _series_table(rows: list[dict[str, Any]], planners: dict[str, Planner]) -> Table:
    lines = []
    for row in rows:
        lengths = [
            _result_text(row["answers"].get(name), lambda record: str(record["length"]))
            for name in planners
        ]
        lines.append([row["task"], str(row["optimum"] or ""), *lengths])
    return Table(
        "Plan lengths over the growing series",
        ("task", "optimum", *planners),
        lines,
        "-: no plan within the budget. Blank: not asked any more.",
    )


def _times_table(rows: list[dict[str, Any]], planners: dict[str, Planner]) -> Table:
    lines = []
    for blocks, group in by_blocks(rows).items():
        line = [str(blocks)]
        for name in planners:
            records = [row["answers"][name] for row in group if name in row["answers"]]
            solved = [record for record in records if record["length"] is not None]
            seconds = time_text(spread([record["seconds"]["median"] for record in solved]), unit=1)
            line.append(f"{len(solved)}/{len(records)} {seconds}" if records else "")
        lines.append(line)
    return Table(
        "Solved, and seconds where solved: medians (quartiles) over the tasks of a size",
        ("blocks", *planners),
        lines,
    )


def _result_text(record: dict[str, Any] | None, tell: Any) -> str:
    return "" if record is None else "-" if record["length"] is None else tell(record)


if __name__ == "__main__":
    run(main)
