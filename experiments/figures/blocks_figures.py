"""Figure 2 as the paper has it, plan length and runtime on its two tasks, and the same over the
series of larger tasks.
"""

from typing import Any

import numpy as np

from experiments.figures.column_style import (
    COLOURS,
    MARKS,
    column_figure,
    grouped_bars,
    plain_ticks,
)
from srt_jax.bench.machine import spread

Rows = list[dict[str, Any]]

PAPER = {
    "BLOCKS-4-0": {"MAP": (6, 0.22), "A*": (6, 0.0077), "W*": (6, 0.0068)},
    "BLOCKS-4-1": {"MAP": (10, 0.31), "A*": (10, 0.0068), "W*": (10, 0.0060)},
}
"""Length and seconds in Figure 2, on the machine of 2016."""

CAPTION = (
    "Plan length (left) and runtime (right) of the behaviour planners on the paper's two tasks"
    " (PY16, Figure 2); diamonds are the paper's numbers."
)
SERIES_CAPTION = (
    "The same planners, and peers (FD: Fast Downward; dashed), over the growing series: medians of"
    " what was solved, by number of blocks. Lengths are over the optimum, or over the shortest plan"
    " found where that is not known."
)
_NAMES = ("MAP", "A*", "W*")
_OURS = (*_NAMES, "authors' rule")


def by_blocks(rows: Rows) -> dict[int, Rows]:
    """Returns the tasks of each number of blocks."""
    return {
        blocks: [row for row in rows if row["blocks"] == blocks]
        for blocks in sorted({row["blocks"] for row in rows})
    }


def figure2(first: dict[str, Any]) -> Any:
    """Returns bars of lengths and runtimes by task, MAP, A* and W* beside each other; {task:
    {planner: record}}.
    """
    figure, (lengths, times) = column_figure(1, 2, height=2.0)
    for axes, key in ((lengths, "length"), (times, "seconds")):
        found = {name: [row[name][key] for row in first.values()] for name in _NAMES}
        series = {
            name: [spread([one or 0]) if key == "length" else one for one in row]
            for name, row in found.items()
        }
        grouped_bars(axes, [task.removeprefix("BLOCKS-") for task in first], series)
        _add_papers(axes, list(first), 0 if key == "length" else 1)
        axes.set_xlabel("task BLOCKS-")
    lengths.set_ylabel("plan length, steps")
    times.set_ylabel("runtime, s")
    ours = [row[name]["seconds"]["median"] for row in first.values() for name in _NAMES]
    theirs = [PAPER[task][name][1] for task in first for name in _NAMES]
    plain_ticks(times, [*ours, *theirs, 1.0])
    handles = sorted(
        lengths.get_legend_handles_labels()[0], key=lambda handle: handle.get_label() == "PY16"
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def _add_papers(axes: Any, tasks: list[str], place: int) -> None:
    for number, name in enumerate(_NAMES):
        places = [group + (number - 1) * 0.8 / 3 for group in range(len(tasks))]
        theirs = [PAPER[task][name][place] for task in tasks]
        label = "PY16" if number == 0 else None
        look = {
            "color": "white",
            "markeredgecolor": "black",
            "markeredgewidth": 0.7,
        }
        axes.plot(places, theirs, "D", label=label, **look)


def figure_of_series(rows: Rows, planners: list[str]) -> Any:
    """Returns curves of lengths and runtimes by the number of blocks."""
    figure, (ratios, times) = column_figure(2, 1, height=4.4, sharex=True, height_ratios=(1, 1.25))
    groups = by_blocks(rows)
    for number, name in enumerate(planners):
        points = _points(groups, name)
        if points:
            blocks, ratio, seconds = zip(*points)
            x = np.array(blocks) + 0.08 * (number - (len(planners) - 1) / 2)
            ratios.plot(x, ratio, **_look(number, name))
            times.plot(x, seconds, **_look(number, name))
    for axes, label in ((ratios, "plan length / optimum"), (times, "runtime, s")):
        plain_ticks(axes, axes.dataLim.intervaly)
        axes.set_ylabel(label)
    ratios.set_ylim(0.85, 1.25 * max(2.0, ratios.dataLim.y1))
    ticks = [tick for tick in (1, 2, 5, 10, 20, 50, 100, 200) if tick <= ratios.get_ylim()[1]]
    ratios.set_yticks(ticks, [str(tick) for tick in ticks])
    ratios.set_yticks([], minor=True)
    times.set_xlabel("blocks (planners side by side)")
    times.set_xticks(list(groups), list(groups))
    figure.legend(
        *ratios.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False
    )
    return figure


def _points(groups: dict[int, Rows], name: str) -> list[tuple[int, float, float]]:
    """Returns blocks, length over the least, and seconds: medians of the tasks that the planner
    solved.
    """
    points = []
    for blocks, group in groups.items():
        solved = [row for row in group if row["answers"].get(name, {}).get("length") is not None]
        if solved:
            ratio = float(
                np.median([row["answers"][name]["length"] / _least(row) for row in solved])
            )
            points.append(
                (
                    blocks,
                    ratio,
                    float(np.median([row["answers"][name]["seconds"]["median"] for row in solved])),
                )
            )
    return points


def _look(number: int, name: str) -> dict[str, Any]:
    """Ours filled and solid, peers hollow and dashed: distinct without colours too."""
    colour, is_ours = COLOURS[number % len(COLOURS)], name in _OURS
    return {
        "label": name,
        "color": colour,
        "marker": MARKS[number % len(MARKS)],
        "markerfacecolor": colour if is_ours else "white",
        "markeredgewidth": 0.8,
        "linestyle": "-" if is_ours else (0, (4, 1.5)),
        "zorder": 3 if name == "MAP" else 2,
    }


def _least(row: dict[str, Any]) -> int:
    """The optimum where it is known, else the shortest plan that any planner found."""
    lengths = [
        record["length"] for record in row["answers"].values() if record["length"] is not None
    ]
    return row["optimum"] or min(lengths)
