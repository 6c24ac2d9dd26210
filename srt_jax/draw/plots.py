"""The plots that people make of many answers: boxes by kind, bound against cost, time against size.

They are as wide as a column of a paper and take what `srt_jax.table` returns.
"""

import io
import os
from collections.abc import Callable, Mapping, Sequence
from typing import IO, Any

import numpy as np

from srt_jax.draw.parts.column import COLOURS, COLUMN_WIDTH, MARKS, style
from srt_jax.draw.picture import Picture, is_axes, page

_ENOUGH = 5
"""Answers from which on a box says more than points."""

Place = str | os.PathLike | IO[bytes] | None


def boxes_by_kind(
    answers: Any,
    column: str = "length",
    path: Place = None,
    *,
    kinds: Sequence[str] | None = None,
    axes: Any = None,
) -> Picture | None:
    """Draws a box for each kind of task, and for each mode where there are several: quartiles, the
    median, whiskers to 1.5 quartile ranges, and what lies beyond as points; of fewer than five
    answers each one as a point.

    Args:
      answers: from `srt_jax.table`, also as a pandas or polars frame, or its rows as dicts.
      column: the number shown; rows where it is null are left out.
      path: .png, .svg or .pdf, or a file open for bytes; None returns the picture. Matplotlib axes
        are taken as `axes`.
      kinds: one for each row; by default what stands before the last "-" of its name, as
        `srt-jax generate` names tasks.
      axes: matplotlib axes to draw on instead.

    Raises:
      ImportError: matplotlib is missing. ValueError: no such column, or no number in it.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import boxes_by_kind
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> tasks = [srt_jax.make_task(free, (2, 0), (row, 6)) for row in range(5)]
      >>> answers = srt_jax.table(tasks, srt_jax.solve_many(tasks), names=["wall-0"] * 5)
      >>> boxes_by_kind(answers, "length").png[:4]
      b'\x89PNG'
    """
    rows = _rows(answers, column)
    names = [kind_of(row["name"]) for row in rows] if kinds is None else list(kinds)
    if len(names) != len(rows):
        raise ValueError(f"there are {len(rows)} answers and {len(names)} kinds: give one for each")
    modes = _modes(rows)
    known = list(dict.fromkeys(kind for row, kind in zip(rows, names) if row[column] is not None))

    def paint(axes: Any) -> None:
        wide, boxes = 0.8 / len(modes), []
        for number, mode in enumerate(modes):
            groups = [
                [
                    row[column]
                    for row, kind in zip(rows, names)
                    if kind == each and row.get("mode") == mode and row[column] is not None
                ]
                for each in known
            ]
            at = np.arange(len(known)) + (number - (len(modes) - 1) / 2) * wide
            drawn = axes.boxplot(
                groups,
                positions=at,
                widths=0.8 * wide,
                patch_artist=True,
                manage_ticks=False,
                medianprops={"color": "black"},
                flierprops={"marker": ".", "markersize": 3, "markeredgecolor": "0.4"},
            )
            for box in drawn["boxes"]:
                box.set(facecolor=COLOURS[number % len(COLOURS)], alpha=0.75, linewidth=0.6)
            boxes.append(drawn["boxes"][0])
            few = [(x, y) for x, group in zip(at, groups) if len(group) < _ENOUGH for y in group]
            axes.plot(
                *(zip(*few) if few else ((), ())),
                MARKS[number % len(MARKS)],
                color=COLOURS[number % len(COLOURS)],
                markeredgecolor="white",
                markeredgewidth=0.4,
                zorder=3,
            )
        is_crowded = sum(map(len, known)) > 34
        axes.set_xticks(
            range(len(known)),
            known,
            rotation=30 if is_crowded else 0,
            rotation_mode="anchor",
            ha="right" if is_crowded else "center",
            va="center" if is_crowded else "top",
        )
        axes.set_ylabel(_LABELS.get(column, column))
        if len(modes) > 1:
            axes.legend(boxes, modes, frameon=False)

    return _drawn(paint, path, axes)


def bound_against_cost(answers: Any, path: Place = None, *, axes: Any = None) -> Picture | None:
    """Draws the proven lower bound on the removal cost against the cost of the answer: points on
    the diagonal are proven least, points below it have a gap.

    Args:
      answers, path, axes: as for `boxes_by_kind`.

    Raises:
      ImportError: matplotlib is missing. ValueError: no task is solved.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import bound_against_cost
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> tasks = [srt_jax.make_task(free, (2, 0), (row, 6)) for row in range(5)]
      >>> answers = srt_jax.table(tasks, srt_jax.solve_many(tasks))
      >>> bound_against_cost(answers).png[:4]
      b'\x89PNG'
    """
    rows = _rows(answers, "removal_cost", "removal_bound")

    def paint(axes: Any) -> None:
        most = max(row["removal_cost"] for row in rows if row["removal_cost"] is not None)
        most = 1.05 * max(most, 1.0)
        axes.plot([0, most], [0, most], color="0.6", zorder=1)
        _scatter(axes, rows, "removal_cost", "removal_bound")
        proven = [row["removal_cost"] == row["removal_bound"] for row in rows if row["is_solved"]]
        axes.set_title(f"{sum(proven)} of {len(proven)} answers proven least")
        axes.set_xlabel("removal cost")
        axes.set_ylabel("proven lower bound")

    return _drawn(paint, path, axes)


def time_against_size(answers: Any, path: Place = None, *, axes: Any = None) -> Picture | None:
    """Draws seconds against the cells of the map, both logarithmic.

    Args:
      answers: as for `boxes_by_kind`; made with `seconds=`.
      path, axes: as there.

    Raises:
      ImportError: matplotlib is missing. ValueError: no row has seconds.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import time_against_size
      >>> tasks = [srt_jax.make_task(np.ones((n, n), bool), (0, 0), (1, 1)) for n in (4, 8)]
      >>> answers = srt_jax.table(tasks, srt_jax.solve_many(tasks), seconds=[0.001, 0.002])
      >>> time_against_size(answers).png[:4]
      b'\x89PNG'
    """
    rows = _rows(answers, "seconds", "height", "width")
    rows = [row | {"cells": row["height"] * row["width"]} for row in rows]

    def paint(axes: Any) -> None:
        _scatter(axes, rows, "cells", "seconds")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("cells of the map")
        axes.set_ylabel("seconds")

    return _drawn(paint, path, axes)


def kind_of(name: str) -> str:
    """Returns the kind that a task's name begins with: "rooms" of "rooms-0003"."""
    kind, dash, number = name.rpartition("-")
    return kind if dash and number.isdigit() else name


_LABELS = {
    "length": "length of the route, cell sides",
    "length_m": "length of the route, metres",
    "removal_cost": "removal cost",
    "num_destroyed": "obstacles destroyed",
    "explored": "cells reached before anything is destroyed",
    "seconds": "seconds",
}


def _rows(answers: Any, *columns: str) -> list[dict[str, Any]]:
    """Returns the rows of a table; ValueError where a column is missing or holds no number."""
    rows = _as_dicts(answers)
    for column in columns:
        if any(row.get(column) is not None for row in rows):
            continue
        known = sorted({name for row in rows for name in row})
        if column not in known:
            raise ValueError(
                f"no column is called {column!r}: give what srt_jax.table returns; it has"
                f" {', '.join(known) or 'no row'}"
            )
        needs = {"seconds": ": give srt_jax.table seconds=", "length_m": ": give it cell_side="}
        raise ValueError(f"the column {column!r} holds no number{needs.get(column, '')}")
    return rows


def _as_dicts(answers: Any) -> list[dict[str, Any]]:
    """Returns the rows of a table as dicts: of pyarrow, polars, pandas, or a list of them."""
    if hasattr(answers, "to_pylist"):
        return answers.to_pylist()
    if hasattr(answers, "to_dicts"):
        return answers.to_dicts()
    if hasattr(answers, "to_dict"):  # pandas says NaN where a table says null
        rows = answers.to_dict("records")
        return [
            {name: None if value != value else value for name, value in row.items()} for row in rows
        ]
    rows = [] if isinstance(answers, str | Mapping) else list(answers)
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        raise TypeError(
            "a plot takes the table of srt_jax.table, a pandas or polars frame, or a list of its"
            f" rows as dicts, got {type(answers).__name__}"
        )
    return rows


def _modes(rows: list[dict[str, Any]]) -> list[Any]:
    return list(dict.fromkeys(row.get("mode") for row in rows))


def _scatter(axes: Any, rows: list[dict[str, Any]], across: str, up: str) -> None:
    modes = _modes(rows)
    for number, mode in enumerate(modes):
        points = [
            (row[across], row[up])
            for row in rows
            if row.get("mode") == mode and row[across] is not None and row[up] is not None
        ]
        xs, ys = zip(*points) if points else ((), ())
        axes.plot(
            xs,
            ys,
            MARKS[number % len(MARKS)],
            color=COLOURS[number % len(COLOURS)],
            alpha=0.6,
            markeredgewidth=0,
            label=str(mode),
            zorder=2,
        )
    if len(modes) > 1:
        axes.legend(frameon=False)


def _drawn(paint: Callable[[Any], None], path: Place, axes: Any) -> Picture | None:
    """Paints on axes; else on a page of its own, into a file or as a picture."""
    if axes is None and is_axes(path):
        path, axes = None, path
    if axes is not None:
        if path is not None:
            raise ValueError("a plot goes onto axes or to a path: give one of them")
        paint(axes)
        return None
    target = io.BytesIO() if path is None else path
    with style(), page(target, size=(COLUMN_WIDTH, 2.4)) as figure:
        paint(figure.add_subplot())
    return Picture(target.getvalue()) if path is None else None  # type: ignore[union-attr]
