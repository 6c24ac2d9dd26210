"""Answers as a table, one row a task: for pandas, polars, DuckDB or a spreadsheet."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sign_model.foundation.legible import finite_or_none
from srt_jax.components import regions
from srt_jax.engine.entrance import require_listed, require_listed_solution
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.task import unstack
from srt_jax.types import FREE, Solution, Status, Task


def table(
    tasks: Sequence[Task] | Task,
    solutions: Sequence[Solution] | Solution | Mapping[str, Sequence[Solution] | Solution],
    *,
    names: Sequence[str] | None = None,
    maps: Sequence[str] | None = None,
    seconds: float | Sequence[float] | None = None,
    cell_side: float | None = None,
    side_by_side: bool = False,
) -> Any:
    """Returns an Arrow table with one row for each task and mode.

    Columns: name; map; mode; status; is_solved; height, width, num_obstacles of the task; length of
    the route in cell sides and length_m in metres; num_cells of the route; num_destroyed;
    removal_cost and removal_bound; is_proven_least; total and total_bound of mode "shortest", in
    cell sides; num_blocking, obstacles on the contour;
    explored, the cells reached before anything is destroyed; seconds. What does not apply or is not
    given is null. `table(...).to_pandas()` and `polars.from_arrow(table(...))` make data frames of
    it.

    Args:
      tasks: a list of single ones, or one batch.
      solutions: as many, a list or a batch, or such for each mode, {mode: solutions}: the rows of a
        mode follow each other, and `mode` tells them apart.
      names, maps: one for each task; names are "0", "1", ... by default.
      seconds: of each task, or of all of them alike.
      cell_side: metres a cell.
      side_by_side: one row a task, and for each mode columns of its own: status_least,
        status_paper, length_least and so on.

    Raises:
      ImportError: pyarrow is missing. TypeError: something else than tasks and solutions.
      ValueError: the numbers of tasks, solutions, names, maps or seconds differ, or a list holds
        batches.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> modes = {mode: [srt_jax.solve(task, mode=mode)] for mode in ("least", "paper")}
      >>> answers = srt_jax.table([task], modes, cell_side=0.5)
      >>> answers.select(["mode", "status", "length", "length_m"]).to_pylist()[0]
      {'mode': 'least', 'status': 'SOLVED', 'length': 6.0, 'length_m': 3.0}
      >>> wide = srt_jax.table([task], modes, side_by_side=True)
      >>> wide.select(["name", "length_least", "length_paper"]).to_pylist()
      [{'name': '0', 'length_least': 6.0, 'length_paper': 6.0}]
    """
    arrow = require_module("pyarrow", extra="parquet", what="a table of answers")
    all_tasks, by_mode = _listed(tasks), _by_mode(solutions)
    by_mode = {mode: _listed(found) for mode, found in by_mode.items()}
    count = len(all_tasks)
    named = [str(number) for number in range(count)] if names is None else list(names)
    spent = [seconds] * count if seconds is None or np.ndim(seconds) == 0 else list(seconds)  # type: ignore
    given = {"names": named, "seconds": spent, "maps": [None] * count if maps is None else maps}
    given |= {
        "solutions" if mode is None else f"solutions of mode {mode}": found
        for mode, found in by_mode.items()
    }
    for what, values in given.items():
        if len(values) != count:
            raise ValueError(f"there are {count} tasks and {len(values)} {what}: give one for each")
    for number, task in enumerate(all_tasks):
        require_listed("table", task, number)
    for number, solution in itertools.chain(*map(enumerate, by_mode.values())):
        require_listed_solution("table", solution, number)
    facts = [_of_task(task) for task in all_tasks]
    rows = [
        {"name": named[i], "map": given["maps"][i], "mode": mode}
        | facts[i]
        | _of_solution(found[i], cell_side)
        | {"seconds": spent[i]}
        for mode, found in by_mode.items()
        for i in range(count)
    ]
    schema = _schema(arrow)
    if side_by_side:
        if None in by_mode:
            raise ValueError("side_by_side needs modes: give solutions as {mode: solutions}")
        rows, schema = _widened(rows, schema, list(by_mode), arrow)
    return arrow.Table.from_pylist(rows, schema=schema)


def _by_mode(solutions: Any) -> dict[Any, Any]:
    """Returns solutions by mode, None where there is but one, without a name."""
    # a record is a mapping, too: of its fields
    has_modes = isinstance(solutions, Mapping) and not isinstance(solutions, Solution)
    return dict(solutions) if has_modes else {None: solutions}


def _listed(records: Any) -> list[Any]:
    """Returns single tasks or solutions as a list, whether one, a batch or a list is given."""
    if not isinstance(records, Task | Solution):
        return list(records)
    is_one = not np.ndim(records.status if isinstance(records, Solution) else records.size[..., 0])
    return [records] if is_one else unstack(records)


def _widened(
    rows: list[dict[str, Any]], schema: Any, modes: list[Any], arrow: Any
) -> tuple[list[dict[str, Any]], Any]:
    """Returns a row a task, with columns of each mode, and their schema."""
    count = len(rows) // len(modes) if modes else 0
    wide = [
        {name: rows[i][name] for name in _OF_TASK}
        | {
            f"{name}_{mode}": rows[number * count + i][name]
            for number, mode in enumerate(modes)
            for name in schema.names
            if name not in (*_OF_TASK, "mode")
        }
        for i in range(count)
    ]
    fields = [(name, schema.field(name).type) for name in schema.names if name != "mode"]
    kinds = {name: kind for name, kind in fields if name in _OF_TASK} | {
        f"{name}_{mode}": kind for name, kind in fields if name not in _OF_TASK for mode in modes
    }
    return wide, arrow.schema(kinds)


_OF_TASK = ("name", "map", "height", "width", "num_obstacles", "explored")
"""Columns that do not depend on the mode."""


def _of_task(task: Task) -> dict[str, Any]:
    labels = np.asarray(task.labels)
    height, width = np.asarray(task.size).tolist()
    free = (labels[:, :height, :width] == FREE).all(axis=0)
    row, col = np.asarray(task.start).tolist()
    is_inside = 0 <= row < height and 0 <= col < width
    explored = 0
    if is_inside and free[row, col]:
        pieces = regions(free)
        explored = int((pieces == pieces[row, col]).sum())
    return {
        "height": height,
        "width": width,
        "num_obstacles": int((np.unique(labels) >= 0).sum()),
        "explored": explored,
    }


def _of_solution(solution: Solution, cell_side: float | None) -> dict[str, Any]:
    status = Status(int(solution.status))
    length, removal = finite_or_none(solution.cost), finite_or_none(solution.removal_cost)
    bound = finite_or_none(solution.removal_bound)
    is_weighed = float(solution.total) > 0  # 0 in every other mode, and where start is goal
    return {
        "status": status.name,
        "is_solved": status.is_solved,
        "length": length,
        "length_m": None if cell_side is None or length is None else length * cell_side,
        "num_cells": int(solution.num_cells) if status.is_solved else None,
        "num_destroyed": int(solution.num_destroyed) if status.is_solved else None,
        "removal_cost": removal,
        "removal_bound": bound,
        "is_proven_least": removal == bound if status.is_solved else None,
        "total": finite_or_none(solution.total) if is_weighed else None,
        "total_bound": finite_or_none(solution.total_bound) if is_weighed else None,
        "num_blocking": int((np.asarray(solution.blocking) >= 0).sum()),
    }


def _schema(arrow: Any) -> Any:
    text, whole, number, truth = arrow.string(), arrow.int32(), arrow.float64(), arrow.bool_()
    kinds = {
        "name": text,
        "map": text,
        "mode": text,
        "status": text,
        "is_solved": truth,
        "height": whole,
        "width": whole,
        "num_obstacles": whole,
        "length": number,
        "length_m": number,
        "num_cells": whole,
        "num_destroyed": whole,
        "removal_cost": number,
        "removal_bound": number,
        "is_proven_least": truth,
        "total": number,
        "total_bound": number,
        "num_blocking": whole,
        "explored": whole,
        "seconds": number,
    }
    return arrow.schema(kinds)
