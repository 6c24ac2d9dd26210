"""Figures for a column of a paper: bars with quartiles, and plain logarithmic ticks."""

import math
from collections.abc import Iterable
from typing import Any

from srt_jax.draw.parts.column import COLOURS, COLUMN_WIDTH, MARKS, column_figure, style

__all__ = [
    "COLOURS",
    "COLUMN_WIDTH",
    "MARKS",
    "column_figure",
    "grouped_bars",
    "plain_ticks",
    "style",
]


def grouped_bars(
    axes: Any, groups: list[str], series: dict[str, list[dict[str, float]]], *, unit: float = 1.0
) -> None:
    """Draws a bar for each series in each group: medians, with the quartiles as whiskers; nothing
    where there is no value.
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
