"""Solutions as plain data: what `--json` prints and results files hold, JSON or Parquet."""

import json
import pathlib
from typing import Any

import numpy as np

from sign_model.foundation.files import require_folder_of
from sign_model.foundation.legible import finite_or_none
from srt_jax.answers.wording import explain
from srt_jax.formats.containers.json_text import read_json
from srt_jax.formats.shared.whole_files import PathLike, atomic_write, read_bytes, require_module
from srt_jax.geometry.frame import Frame
from srt_jax.paths.approach import approach as approach_of
from srt_jax.symbols.scene_of_task import planned_steps
from srt_jax.types import Approach, Solution, Status, Task

_STEP = ("action", "obstacle", "index")
"""What a step of a plan holds: a column of Parquet has one type, so there it is a record."""


def as_record(
    name: str,
    task: Task,
    solution: Solution,
    *,
    cell_side: float | None = None,
    frame: Frame | None = None,
    approach: Approach | None = None,
) -> dict[str, Any]:
    """Returns one task's answer as JSON types; cells are [row, col], and what has no finite value
    is None.

    `cost` is in cell sides; `cell_side` is the side in metres, where the map has any; with its
    `frame` the explanation names places in metres too. `approach` {cells, cost, gap} is the way as
    near as one gets, None where the task is solved or no cell is free.
    `plan` is a list of [action, obstacle or None, index into `cells` at which the step ends].
    """
    is_solved = Status(int(solution.status)).is_solved
    count = int(solution.num_destroyed) if is_solved else 0
    blocking, separating = np.asarray(solution.blocking), np.asarray(solution.separating)
    plan = ((step.act.name.lower(), step.obstacle, step.end) for step in planned_steps(solution))
    seed = np.asarray(solution.seed).tolist()
    near = None
    if not is_solved:
        near = approach_of(task) if approach is None else approach
    return {
        "name": name,
        "status": Status(int(solution.status)).name,
        "cost": finite_or_none(solution.cost),
        "cells": (
            np.asarray(solution.cells)[: int(solution.num_cells)].tolist() if is_solved else []
        ),
        "destroyed": np.asarray(solution.destroyed)[:count].tolist(),
        "destroyed_at": np.asarray(solution.destroyed_at)[:count].tolist(),
        "removal_cost": finite_or_none(solution.removal_cost),
        "removal_bound": finite_or_none(solution.removal_bound),
        "total": finite_or_none(solution.total),
        "total_bound": finite_or_none(solution.total_bound),
        "seed": seed if seed[0] >= 0 else None,
        "contour": np.argwhere(np.asarray(solution.contour)).tolist(),
        "blocking": blocking[blocking >= 0].tolist(),
        "plan": [[act, obstacle if obstacle >= 0 else None, end] for act, obstacle, end in plan],
        "separating": separating[separating >= 0].tolist(),
        "approach": None if near is None or not int(near.num_cells) else _approach(near),
        "cell_side": cell_side,
        "explanation": explain(task, solution, cell_side=cell_side, frame=frame, approach=near),
    }


def _approach(near: Approach) -> dict[str, Any]:
    cells = np.asarray(near.cells)[: int(near.num_cells)].tolist()
    return {"cells": cells, "cost": float(near.cost), "gap": float(near.gap)}


def write_results(path: PathLike, records: list[dict[str, Any]]) -> None:
    """Writes records as `as_record` makes them: {"tasks": records} as JSON, or a row a task where
    the name ends in .parquet.

    The file appears whole or not at all. Parquet needs pyarrow.

    Raises:
      ValueError: another ending, or no such folder.
    """
    if _is_parquet(path):
        arrow = require_module("pyarrow", extra="parquet", what="writing Parquet")
        table = arrow_table(arrow, records)
        parquet = require_module("pyarrow.parquet", extra="parquet", what="writing Parquet")
        with atomic_write(path, "wb") as file:
            parquet.write_table(table, file)
    else:
        with atomic_write(path) as file:
            json.dump({"tasks": records}, file)


def arrow_table(arrow: Any, records: list[dict[str, Any]]) -> Any:
    """Returns records as an Arrow table; `arrow` is the module pyarrow."""
    # Half a surrogate pair, which a name may hold, is no text to Arrow: it is written as its
    # number.
    names = [record["name"].encode("utf-8", "backslashreplace").decode() for record in records]
    rows = [
        record | {"name": name, "plan": [dict(zip(_STEP, step)) for step in record["plan"]]}
        for name, record in zip(names, records)
    ]
    return arrow.Table.from_pylist(rows, schema=_schema(arrow))


def read_results(path: PathLike) -> list[dict[str, Any]]:
    """Returns the records in a file of results, equal to those that were written.

    Raises:
      ValueError: the file is missing, cut off, or holds something else.
    """
    if not _is_parquet(path):
        document = read_json(path, "file of results")
        if not isinstance(document, dict) or not isinstance(document.get("tasks"), list):
            raise ValueError(f"{path}: no results: a JSON object with a list 'tasks'")
        return document["tasks"]
    arrow = require_module("pyarrow", extra="parquet", what="reading Parquet")
    parquet = require_module("pyarrow.parquet", extra="parquet", what="reading Parquet")
    content = read_bytes(path, "file of results")
    try:
        table = parquet.read_table(arrow.BufferReader(content))
        rows = table.select(_schema(arrow).names).to_pylist()
    except (arrow.ArrowException, OSError, KeyError) as error:
        raise ValueError(
            f"{path}: no whole Parquet file of results: {' '.join(str(error).split())}"
        ) from error
    return [
        row | {"plan": [[step[name] for name in _STEP] for step in row["plan"]]} for row in rows
    ]


def require_name(path: PathLike) -> None:
    """Raises ValueError, before anything is solved, where results could not be written to
    `path`.
    """
    _is_parquet(path)
    require_folder_of(path)


def _is_parquet(path: PathLike) -> bool:
    ending = pathlib.Path(path).suffix.lower()
    if ending not in (".json", ".parquet"):
        raise ValueError(f"{path}: results are written as .json or .parquet, not {ending!r}")
    return ending == ".parquet"


def _schema(arrow: Any) -> Any:
    """Returns the columns of a table of results, named as in `as_record`."""
    cell, ids, text, number = (
        arrow.list_(arrow.int32(), 2),
        arrow.list_(arrow.int32()),
        arrow.string(),
        arrow.float64(),
    )
    cells = arrow.list_(cell)
    columns = {
        "name": text,
        "status": text,
        "cost": number,
        "cells": cells,
        "destroyed": ids,
        "destroyed_at": ids,
    }
    columns |= {
        "removal_cost": number,
        "removal_bound": number,
        "total": number,
        "total_bound": number,
        "seed": cell,
        "contour": cells,
        "blocking": ids,
    }
    step = arrow.struct(dict(zip(_STEP, (text, arrow.int32(), arrow.int32()))))
    columns |= {"plan": arrow.list_(step), "separating": ids}
    near = arrow.struct({"cells": cells, "cost": number, "gap": number})
    return arrow.schema(columns | {"approach": near, "cell_side": number, "explanation": text})
