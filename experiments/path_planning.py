"""Figure 3 of the paper: what it takes to find that no path exists, and what blocks.

Goals on fragments of cities, 500 x 500 cells, are cut off in the paper's five ways (PY16 §4): start and goal more than 400
cells apart, on opposite sides. The stages of the paper's loop are timed on each: jump point search (JPS), which says that there
is no path; A*, which explores all the free space; the obstacle step, seed and contour. Three makes of them, on the same maps:

  reference   plain Python, srt_jax/reference/: to be read and to judge the others, not to be fast
  C++         the same algorithms natively, compiled on the spot (left out where there is no g++)
  kernels     the batched kernels, all maps of a blockage in one call: `reach` for JPS, `cost_to_come` for A*,
              `seed_cell` and `contour` for the obstacle step

examples:
  python -m experiments.path_planning
  python -m experiments.path_planning --quick --out figure3
  python -m experiments.path_planning --windows 4 --osm munich.osm.pbf --seed 3
"""

import itertools
import pathlib
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from experiments._figures import column_figure, grouped_bars, style
from experiments._fragments import extracts, free_cells, helsinki_windows, street_maps
from experiments._loop_stages import MAKES, STAGES, Case, cut_off, measured, measured_kernels
from experiments._outcome import Outcome, Table, options, run, timed
from srt_jax.bench.machine import spread
from srt_jax.blockage import BLOCKAGES, block
from srt_jax.reference.astar import astar
from srt_jax.reference.jps import jps

PAPER_MS = {"JPS": (30, 77), "A*": (279, 650), "obstacle": (5, 8)}
"""From the least to the greatest of the five blockages, on the machine of 2016."""
PAPER_EXPLORED = {"half": 50, "quarter": 75, "bagel-100": 96, "bagel-50": 99, "bagel-10": 99.9}
PAPER_SHARE = {"JPS": 10, "A*": 87, "obstacle": 3}
EMPTY_EXPANSIONS = {
    "half": (125_000, 1),
    "quarter": (187_500, 1),
    "bagel-100": (240_000, 5),
    "bagel-50": (247_500, 5),
    "bagel-10": (249_900, 5),
}
"""Of the authors' planner on an empty map of 500 x 500: A* and JPS."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment; exit code 1 where two ways to the same answer differ."""
    parser = options("path_planning", __doc__ or "")
    parser.add_argument("--windows", type=int, metavar="N", help="windows of Helsinki (default: 8; quick: 1)")
    parser.add_argument("--size", type=int, default=500, help="cells a side (default: the paper's 500)")
    parser.add_argument("--osm", type=pathlib.Path, nargs="*", default=[], metavar="FILE", help="OpenStreetMap extracts too")
    parser.add_argument("--no-pictures", action="store_true", help="do not draw a map for each blockage")
    parser.add_argument("--no-street", action="store_true", help="leave MovingAI's street maps out, where they are there")
    given = parser.parse_args(arguments)
    outcome = Outcome("path_planning", given, sys.argv[1:] if arguments is None else arguments, "scipy")
    windows = given.windows if given.windows is not None else 1 if given.quick else 8
    streets = [] if given.no_street or given.quick else street_maps(given.size)
    fragments = itertools.chain(
        helsinki_windows(windows, given.size, seed=given.seed), streets, extracts(given.osm, given.size)
    )
    with style():  # at once, so that a missing matplotlib does not cost the measurements
        cases = list(cut_off(fragments, given.seed, outcome.progress))
        if not cases:
            raise ValueError("no fragment has room for start and goal: try more --windows, a larger --size or another --seed")
        rows = [measured(case, outcome.progress) for case in cases]
        kernels = measured_kernels(cases, rows, 3 if given.quick else 7, outcome.progress)
        _report(outcome, rows, kernels)
        is_right = _empty_map(outcome, given.size) and all(row["agrees"] for row in rows)
        outcome.figure(_figure3(rows, kernels), "figure3", _CAPTION)
    if not given.no_pictures:
        _pictures(outcome, cases)
    outcome.save()
    return 0 if is_right else 1


def _spreads(rows: list[dict[str, Any]], kernels: dict[str, Any], make: str, stage: str) -> list[dict[str, float]]:
    """The times of one make and stage, a spread for each blockage."""
    if make == "kernels":
        return [spread(kernels[blockage][stage]) for blockage in BLOCKAGES]
    return [spread([row[make][stage] for row in rows if row["blockage"] == blockage and make in row]) for blockage in BLOCKAGES]


def _report(outcome: Outcome, rows: list[dict[str, Any]], kernels: dict[str, Any]) -> None:
    outcome.keep(cases=rows, kernels=kernels)
    by_stage = {(make, stage): _spreads(rows, kernels, make, stage) for make in MAKES for stage in STAGES}
    lines = []
    for place, blockage in enumerate(BLOCKAGES):
        for make in MAKES:
            spreads = [by_stage[make, stage][place] for stage in STAGES]
            if not all(one["count"] for one in spreads):
                continue  # no compiler for the C++
            total = sum(one["median"] for one in spreads)
            shares = " / ".join(f"{one['median'] / total:.0%}" for one in spreads)
            lines.append([blockage, make, *map(timed, spreads), f"{1e3 * total:.1f}", shares])
    low, high = zip(*(PAPER_MS[stage] for stage in STAGES))
    lines.append(["all five", "PY16, 2016", *(f"{a}-{b}" for a, b in zip(low, high)), "602 on average", "10% / 87% / 3%"])
    outcome.add(
        Table(
            f"Figure 3: milliseconds a map, medians (quartiles) over {len(rows) // len(BLOCKAGES)} fragments of cities",
            ("blockage", "make", "JPS", "A* exploring all", "seed + contour", "sum", "shares"),
            lines,
            "reference: plain Python. kernels: reach, cost_to_come, seed_cell + contour, all fragments in one call, over "
            "repeats; their sum counts cost_to_come, which the answer does not need.",
        )
    )
    outcome.add(_counts(rows))
    outcome.add(_unblocked(rows))


def _counts(rows: list[dict[str, Any]]) -> Table:
    lines = []
    for blockage in BLOCKAGES:
        chosen = [row for row in rows if row["blockage"] == blockage]
        expansions = [np.mean([row["expansions"][stage] for row in chosen]) for stage in ("A*", "JPS")]
        lines.append(
            [
                blockage,
                f"{np.mean([row['explored'] for row in chosen]):.1%}",
                f"{PAPER_EXPLORED[blockage]:g}%",
                *(f"{count:,.0f}" for count in expansions),
                f"{np.mean([row['contour'] for row in chosen]):.0f}",
                f"{sum(row['agrees'] for row in chosen)} of {len(chosen)}",
            ]
        )
    return Table(
        "Explored before the search gives up: means over the fragments",
        ("blockage", "explored", "PY16", "A* expansions", "JPS expansions", "contour cells", "all agree"),
        lines,
        "explored: of the cells that can be reached with no blocker. all agree: JPS and A* find no path; without the blocker "
        "their lengths are equal; C++ and kernels reach the same cells, find the same seed, contour and length.",
    )


def _unblocked(rows: list[dict[str, Any]]) -> Table:
    lines = []
    for make in ("reference", "C++"):
        chosen = [row for row in rows if make in row]
        blocked = spread([sum(row[make][stage] for stage in STAGES) for row in chosen])
        unblocked = spread([row[make]["unblocked JPS"] for row in chosen])
        lines.append([make, timed(blocked), timed(unblocked), f"{blocked['median'] / unblocked['median']:.0f}x"])
    lines.append(["PY16, 2016", "602 on average", "6.3 on average", "96x"])
    return Table(
        "Against JPS on the same map with no blocker: milliseconds, medians (quartiles) over all",
        ("make", "the three stages", "unblocked JPS", "ratio"),
        [line for line in lines if line[1] != "-"],
    )


def _empty_map(outcome: Outcome, size: int) -> bool:
    """The counts that depend on no city: on an empty map, beside those of the authors' planner; False where they differ."""
    outcome.progress(f"the empty map of {size} x {size}")
    labels = np.full((size, size), -1, np.int32)
    lines, found, is_right = [], [], True
    for blockage in BLOCKAGES:
        is_ring = blockage.startswith("bagel")
        start = (size // 2 if is_ring else size // 4, size // 10)
        goal = (size // 2 if is_ring else size * 9 // 10, size * 4 // 5)
        blocked, _ = block(labels, start, goal, blockage)
        free = free_cells(blocked)
        counts = [search(free, start, goal).num_expansions for search in (astar, jps)]
        theirs = EMPTY_EXPANSIONS[blockage]
        is_right &= size != 500 or tuple(counts) == theirs
        found.append({"blockage": blockage} | dict(zip(("A*", "JPS"), counts)))
        share = counts[0] / size**2
        lines.append([blockage, *(f"{n:,}" for n in (*counts, *theirs)), f"{share:.2%}", f"{PAPER_EXPLORED[blockage]:g}%"])
    outcome.keep(empty=found)
    outcome.add(
        Table(
            f"Expansions on the empty map of {size} x {size}, beside those of the authors' planner on 500 x 500",
            ("blockage", "A*", "JPS", "authors' A*", "authors' JPS", "explored", "PY16"),
            lines,
        )
    )
    return is_right


_CAPTION = (
    "Path planning runtimes (PY16, Figure 3) on 500 x 500 fragments of cities: medians, whiskers are quartiles. The bands are "
    "the paper's ranges over the five blockages, in the colour of their stage."
)


def _figure3(rows: list[dict[str, Any]], kernels: dict[str, Any]) -> Any:
    names = {"JPS": "JPS", "A*": "A*", "obstacle": "obstacle detection"}
    panels = {"a  reference, plain Python": "reference", "b  the same in C++": "C++", "c  batched kernels on JAX": "kernels"}
    if not any("C++" in row for row in rows):
        del panels["b  the same in C++"]
    figure, axes = column_figure(len(panels), 1, height=1.45 * len(panels) + 0.45, sharex=True, sharey=True)
    for panel, (title, make) in zip(axes, panels.items()):
        series = {names[stage]: _spreads(rows, kernels, make, stage) for stage in STAGES}
        grouped_bars(panel, [blockage.capitalize() for blockage in BLOCKAGES], series, unit=1e3)
        for bar, stage in zip(panel.containers[::2], STAGES):
            panel.axhspan(*PAPER_MS[stage], color=bar.patches[0].get_facecolor(), alpha=0.18, linewidth=0, zorder=0)
        panel.set_yscale("log")
        panel.set_ylabel("runtime, ms")
        panel.set_title(title, loc="left")
    handles, _ = axes[0].get_legend_handles_labels()
    band = axes[0].axhspan(1, 1, facecolor="0.8", linewidth=0, label="band: range in PY16")
    figure.legend(handles=[*handles, band], loc="outside lower center", ncols=2, frameon=False)
    return figure


def _pictures(outcome: Outcome, cases: list[Case]) -> None:
    """A picture for each blockage, on the first fragment."""
    from srt_jax import solve_many
    from srt_jax.draw import draw

    chosen = cases[: len(BLOCKAGES)]
    outcome.progress("solving and drawing one map per blockage")
    for case, solution in zip(chosen, solve_many([case.task for case in chosen])):
        draw(case.task, solution, outcome.out / f"{case.blockage}.png", title=f"{case.blockage.capitalize()}, {case.fragment}")


if __name__ == "__main__":
    run(main)
