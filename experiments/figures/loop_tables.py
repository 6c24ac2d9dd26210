"""Figure 3 in tables: stage times beside the paper's, what was explored, the price of a blocked
goal, and what has to hold.
"""

from typing import Any

import numpy as np

from experiments.figures.loop_stages import MAKES, STAGES
from experiments.figures.outcome import Table, time_text
from srt_jax.bench.machine import spread
from srt_jax.instances.paper_blockers import BLOCKAGES

Rows = list[dict[str, Any]]

PAPER_MS = {"JPS": (30, 77), "A*": (279, 650), "obstacle": (5, 8)}
"""PY16 §4: from the least to the greatest of the five blockages, on the machine of 2016."""
PAPER_EXPLORED = {"half": 50, "quarter": 75, "bagel-100": 96, "bagel-50": 99, "bagel-10": 99.9}
"""PY16 §4: per cent of the free cells that A* visits."""
PAPER_SIZE = 500
EMPTY_EXPANSIONS = {
    "half": (125_000, 1),
    "quarter": (187_500, 1),
    "bagel-100": (240_000, 5),
    "bagel-50": (247_500, 5),
    "bagel-10": (249_900, 5),
}
"""Of the authors' planner on an empty map of 500 x 500: A* and JPS."""


def spreads(rows: Rows, kernels: dict[str, Any], make: str, stage: str) -> list[dict[str, float]]:
    """Returns the times of one make and stage, a spread for each blockage."""
    if make == "kernels":
        return [spread(kernels[blockage][stage]) for blockage in BLOCKAGES]
    return [
        spread([row[make][stage] for row in of_blockage(rows, blockage) if make in row])
        for blockage in BLOCKAGES
    ]


def of_blockage(rows: Rows, blockage: str) -> Rows:
    return [row for row in rows if row["blockage"] == blockage]


def times_table(rows: Rows, kernels: dict[str, Any]) -> Table:
    """Returns milliseconds of every stage, by blockage and make, with the paper's ranges last."""
    by_stage = {
        (make, stage): spreads(rows, kernels, make, stage) for make in MAKES for stage in STAGES
    }
    lines = []
    for place, blockage in enumerate(BLOCKAGES):
        for make in MAKES:
            found = [by_stage[make, stage][place] for stage in STAGES]
            if not all(one["count"] for one in found):
                continue  # no compiler for the C++
            total = sum(one["median"] for one in found)
            shares = " / ".join(f"{one['median'] / total:.0%}" for one in found)
            lines.append([blockage, make, *map(time_text, found), f"{1e3 * total:.1f}", shares])
    ranges = (f"{low}-{high}" for low, high in (PAPER_MS[stage] for stage in STAGES))
    lines.append(["all five", "PY16, 2016", *ranges, "602 on average", "10% / 87% / 3%"])
    count = len(rows) // len(BLOCKAGES)
    return Table(
        f"Figure 3: milliseconds a map, medians (quartiles) over {count}"
        f" fragment{'s' if count > 1 else ''} of cities",
        ("blockage", "make", "JPS", "A* exploring all", "seed + contour", "sum", "shares"),
        lines,
        "reference: plain Python. kernels: reach, cost_to_come, seed_cell + contour, all fragments"
        " in one call, over repeats; their sum counts cost_to_come, which the answer does not need."
        " PY16: as its text has them, ranges over the five blockages.",
    )


def counts_table(rows: Rows) -> Table:
    """Returns what A* explored on the fragments, beside the paper's shares."""
    lines = []
    for blockage in BLOCKAGES:
        chosen = of_blockage(rows, blockage)
        expansions = [
            np.mean([row["expansions"][stage] for row in chosen]) for stage in ("A*", "JPS")
        ]
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
        (
            "blockage",
            "explored",
            "PY16",
            "A* expansions",
            "JPS expansions",
            "contour cells",
            "all agree",
        ),
        lines,
        "explored: of the cells that can be reached with no blocker. all agree: every check of a"
        " fragment, below, holds.",
    )


def unblocked_table(rows: Rows) -> Table:
    """Returns how much a blocked goal costs beside JPS on the same map with no blocker."""
    lines = []
    for make in ("reference", "C++"):
        chosen = [row for row in rows if make in row]
        if chosen:
            blocked = spread([sum(row[make][stage] for stage in STAGES) for row in chosen])
            unblocked = spread([row[make]["unblocked JPS"] for row in chosen])
            lines.append(
                [
                    make,
                    time_text(blocked),
                    time_text(unblocked),
                    f"{blocked['median'] / unblocked['median']:.0f}x",
                ]
            )
    lines.append(["PY16, 2016", "602 on average", "6.3 on average", "'two orders of magnitude'"])
    return Table(
        "Against JPS on the same map with no blocker: milliseconds, medians (quartiles) over all",
        ("make", "the three stages", "unblocked JPS", "ratio"),
        lines,
    )


def empty_table(found: Rows, size: int) -> Table:
    """Returns the expansions on the empty map, beside those of the authors' planner."""
    lines = []
    for row in found:
        counts = (row["A*"], row["JPS"], *EMPTY_EXPANSIONS[row["blockage"]])
        lines.append(
            [
                row["blockage"],
                *(f"{n:,}" for n in counts),
                f"{row['explored']:.2%}",
                f"{PAPER_EXPLORED[row['blockage']]:g}%",
            ]
        )
    return Table(
        f"Expansions on the empty map of {size} x {size}, beside those of the authors' planner on"
        f" {PAPER_SIZE} x {PAPER_SIZE}",
        ("blockage", "A*", "JPS", "authors' A*", "authors' JPS", "explored", "PY16"),
        lines,
    )


def checks(rows: Rows, empty: Rows, size: int) -> list[tuple[str, str, bool]]:
    """Returns what has to hold, what was found, and whether it does; the empty map's counts for the
    paper's size alone.
    """
    found = [
        _tally(check, [row["checks"][name] for row in rows if name in row["checks"]])
        for name, check in _CHECKS.items()
    ]
    if size == PAPER_SIZE:
        off = max(abs(100 * row["explored"] - PAPER_EXPLORED[row["blockage"]]) for row in empty)
        found.append(
            (
                "empty map: explored within 1 point of PY16's 50, 75, 96, 99, 99.9 %",
                f"off by {off:.2f} at most",
                off <= 1,
            )
        )
        is_theirs = [(row["A*"], row["JPS"]) == EMPTY_EXPANSIONS[row["blockage"]] for row in empty]
        found.append(
            _tally("empty map: A* and JPS expand what the authors' planner expands", is_theirs)
        )
    return [one for one in found if one[1]]


def checks_table(found: list[tuple[str, str, bool]]) -> Table:
    lines = [[check, what, "yes" if holds else "NO"] for check, what, holds in found]
    return Table("Checks", ("what has to hold", "found", "holds"), lines)


_CHECKS = {
    "no path": "JPS and A* find no path to the blocked goal",
    "lengths": "with no blocker the lengths of JPS and A* are equal",
    "C++": "C++ explores the same cells, finds the same seed, contour and length",
    "kernels": "the kernels reach the same cells, find the same seed, contour and length",
}


def _tally(check: str, holding: list[bool]) -> tuple[str, str, bool]:
    """Nothing found where there is nothing to check."""
    return check, f"{sum(holding)} of {len(holding)}" if holding else "", all(holding)
