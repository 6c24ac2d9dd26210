"""Solutions as plain data: what `--json` prints and results files hold."""

import json
import math
import os
from typing import Any

import numpy as np

from srt_jax.explain import explain
from srt_jax.formats.files import written
from srt_jax.types import Solution, Status, Task


def as_record(name: str, task: Task, solution: Solution) -> dict[str, Any]:
    """Returns one task's answer as JSON types; cells are [row, col], and what has no finite value is None."""
    count = int(solution.num_destroyed)
    is_solved = Status(int(solution.status)).is_solved
    blocking = np.asarray(solution.blocking)
    seed = np.asarray(solution.seed).tolist()
    return {
        "name": name,
        "status": Status(int(solution.status)).name,
        "cost": _finite(solution.cost),
        "cells": np.asarray(solution.cells)[: int(solution.num_cells)].tolist() if is_solved else [],
        "destroyed": np.asarray(solution.destroyed)[:count].tolist(),
        "destroyed_at": np.asarray(solution.destroyed_at)[:count].tolist(),
        "removal_cost": _finite(solution.removal_cost),
        "removal_bound": _finite(solution.removal_bound),
        "seed": seed if seed[0] >= 0 else None,
        "contour": np.argwhere(np.asarray(solution.contour)).tolist(),
        "blocking": blocking[blocking >= 0].tolist(),
        "explanation": explain(task, solution),
    }


def write_results(path: str | os.PathLike[str], records: list[dict[str, Any]]) -> None:
    """Writes {"tasks": records} as JSON; the file appears whole or not at all."""
    with written(path) as file:
        json.dump({"tasks": records}, file)


def _finite(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None
