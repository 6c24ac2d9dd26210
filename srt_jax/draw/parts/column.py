"""Figures for a column of a paper: 3.4 inches wide, letters of 7 points, colours that colour-blind
people can tell apart.
"""

from typing import Any

from srt_jax.formats.shared.whole_files import require_module

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
    return require_module("matplotlib", extra="draw", what="a figure").rc_context(_STYLE)


def column_figure(
    rows: int = 1, cols: int = 1, *, height: float = 2.2, **options: Any
) -> tuple[Any, Any]:
    """Returns a figure as wide as a column, and its axes; to be called within `style`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(COLUMN_WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, cols, **options)
