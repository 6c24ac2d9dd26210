"""Figure 3 of the paper: what it takes to find that no path exists, and what blocks.

Goals on fragments of cities, 500 x 500 cells, are cut off in the paper's five ways (PY16 §4): start
and goal more than 400 cells apart, on opposite sides. The stages of the paper's loop are timed on
each: jump point search (JPS), which says that there is no path; A*, which explores all the free
space; the obstacle step, seed and contour. Three makes of them, on the same maps:

  reference   plain Python, srt_jax/reference/: to be read and to judge the others, not to be fast
  C++         the same algorithms natively, compiled on the spot (left out where there is no g++)
  kernels     the batched kernels, all maps of a blockage in one call: `reach` for JPS,
              `cost_to_come` for A*, `seed_cell` and `contour` for the obstacle step

examples:
  python -m experiments.figure3
  python -m experiments.figure3 --quick --out figure3
  python -m experiments.figure3 --windows 4 --osm munich.osm.pbf --seed 3
"""

import itertools
import pathlib
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from experiments.figures.city_fragments import (
    Fragment,
    extracts,
    free_cells,
    helsinki_windows,
    street_maps,
)
from experiments.figures.column_style import style
from experiments.figures.loop_figures import CAPTION, MAPS_CAPTION, figure3, figure_of_maps
from experiments.figures.loop_stages import Case, Log, cut_off, measure, measured_kernels
from experiments.figures.loop_tables import (
    checks,
    checks_table,
    counts_table,
    empty_table,
    times_table,
    unblocked_table,
)
from experiments.figures.outcome import Outcome, options, run
from srt_jax.instances.paper_blockers import BLOCKAGES, block
from srt_jax.reference.astar import astar
from srt_jax.reference.jump_point_search import jps


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment; exit code 1 where a check does not hold."""
    given = _parser().parse_args(arguments)
    outcome = Outcome("figure3", given, sys.argv[1:] if arguments is None else arguments, "scipy")
    with style():  # at once, so that a missing matplotlib does not cost the measurements
        # City fragments, cut off in five ways.
        cases = list(cut_off(_fragments(given, outcome.progress), given.seed, outcome.progress))
        if not cases:
            raise ValueError(
                "no fragment has room for start and goal: try more --windows, a larger --size or"
                " another --seed"
            )
        # What it takes to find that there is no path, by each method; the paper's empty map apart.
        rows = [measure(case, outcome.progress) for case in cases]
        kernels = measured_kernels(cases, rows, 3 if given.quick else 7, outcome.progress)
        outcome.progress(f"the empty map of {given.size} x {given.size}")
        empty = _empty_map(given.size)
        found = checks(rows, empty, given.size)
        # Keep the numbers, and make the tables, the figure and the pictures.
        outcome.keep(cases=rows, kernels=kernels, empty=empty, checks=found)
        tables = (
            times_table(rows, kernels),
            counts_table(rows),
            unblocked_table(rows),
            empty_table(empty, given.size),
        )
        for table in (*tables, checks_table(found)):
            outcome.add(table)
        outcome.figure(figure3(rows, kernels), "figure3", CAPTION)
        if not given.no_pictures:
            _pictures(outcome, cases[: len(BLOCKAGES)])
    outcome.save()
    return 0 if all(holds for _, _, holds in found) else 1


def _parser() -> ArgumentParser:
    parser = options("figure3", __doc__ or "")
    parser.add_argument(
        "--windows", type=int, metavar="N", help="windows of Helsinki (default: 8; quick: 1)"
    )
    parser.add_argument(
        "--size", type=int, default=500, help="cells a side (default: the paper's 500)"
    )
    parser.add_argument(
        "--osm",
        type=pathlib.Path,
        nargs="*",
        default=[],
        metavar="FILE",
        help="OpenStreetMap extracts too",
    )
    parser.add_argument(
        "--no-pictures", action="store_true", help="do not draw a map for each blockage"
    )
    parser.add_argument(
        "--no-street",
        action="store_true",
        help="leave MovingAI's street maps out, where they are there",
    )
    return parser


def _fragments(given: Namespace, log: Log) -> Iterator[Fragment]:
    """Returns the shipped city's windows, the street maps where they are there, and the extracts
    that the user names.
    """
    windows = given.windows if given.windows is not None else 1 if given.quick else 8
    streets = [] if given.no_street or given.quick else street_maps(given.size)
    shipped = helsinki_windows(windows, given.size, seed=given.seed)
    return itertools.chain(shipped, streets, extracts(given.osm, given.size, log))


def _empty_map(size: int) -> list[dict[str, Any]]:
    """Returns the counts that depend on no city: what the reference expands on an empty map, by
    blockage.
    """
    labels = np.full((size, size), -1, np.int32)
    found = []
    for blockage in BLOCKAGES:
        is_ring = blockage.startswith("bagel")
        start = (size // 2 if is_ring else size // 4, size // 10)
        goal = (size // 2 if is_ring else size * 9 // 10, size * 4 // 5)
        free = free_cells(block(labels, start, goal, blockage)[0])
        counts = [search(free, start, goal).num_expansions for search in (astar, jps)]
        found.append(
            {
                "blockage": blockage,
                "A*": counts[0],
                "JPS": counts[1],
                "explored": counts[0] / size**2,
            }
        )
    return found


def _pictures(outcome: Outcome, cases: list[Case]) -> None:
    """The five blockages of one fragment: a figure, and a page for each."""
    from srt_jax import solve_many
    from srt_jax.draw import draw

    outcome.progress("solving and drawing one map per blockage")
    solutions = solve_many([case.task for case in cases])
    outcome.figure(figure_of_maps(cases, solutions), "figure3-maps", MAPS_CAPTION)
    for case, solution in zip(cases, solutions):
        draw(
            case.task,
            solution,
            outcome.out / f"{case.blockage}.png",
            title=f"{case.blockage.capitalize()}, {case.fragment}",
        )


if __name__ == "__main__":
    run(main)
