"""Figures for a column of a paper: 3.4 inches wide, letters of 7 points, colours that
colour-blind people can tell apart.
"""

import math
from collections.abc import Iterable
from typing import Any

COLUMN_WIDTH = 3.4
"""Inches."""

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#000000", "#999999")
"""Okabe and Ito's."""

MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")

_STYLE: Any = {
    "font.size": 7,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.5,
    "svg.fonttype": "none",
    "svg.hashsalt": "srt-jax",
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def style() -> Any:
    """Returns a context in which figures are drawn and saved; the settings of the caller's
    matplotlib stay as they are.

    Raises:
      ImportError: matplotlib is missing.
    """
    try:
        import matplotlib
    except ImportError as error:
        raise ImportError("figures need matplotlib: pip install 'srt-jax[draw]'") from error
    return matplotlib.rc_context(_STYLE)


def column_figure(
    rows: int = 1, cols: int = 1, *, height: float = 2.2, **options: Any
) -> tuple[Any, Any]:
    """Returns a figure as wide as a column, and its axes; to be called within `style`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(COLUMN_WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, cols, **options)


def grouped_bars(
    axes: Any, groups: list[str], series: dict[str, list[dict[str, float]]], *, unit: float = 1.0
) -> None:
    """Draws a bar for each series in each group: medians, with the quartiles as whiskers;
    nothing where there is no value.
    """
    width = 0.8 / len(series)
    for number, (name, spreads) in enumerate(series.items()):
        places = [group + (number - (len(series) - 1) / 2) * width for group in range(len(groups))]
        medians = [spread["median"] * unit for spread in spreads]
        below = [(spread["median"] - spread["low"]) * unit for spread in spreads]
        above = [(spread["high"] - spread["median"]) * unit for spread in spreads]
        axes.bar(places, medians, width * 0.92, color=COLOURS[number % len(COLOURS)], label=name)
        axes.errorbar(
            places,
            medians,
            [below, above],
            fmt="none",
            ecolor="0.25",
            elinewidth=0.6,
            capsize=1.2,
            capthick=0.6,
        )
    axes.set_xticks(range(len(groups)), groups)


def plain_ticks(axes: Any, values: Iterable[float]) -> None:
    """Makes the y axis logarithmic, from the power of ten below all values to that above them,
    labelled 0.1, 1, 10.
    """
    there = [value for value in values if value > 0]  # NaN is not
    axes.set_yscale("log")
    axes.set_ylim(
        10.0 ** math.floor(math.log10(min(there))), 10.0 ** math.ceil(math.log10(max(there)))
    )
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
