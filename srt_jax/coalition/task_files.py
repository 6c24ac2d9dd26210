"""Tasks of coalitions in files: a batch as one `.npz` of plain arrays, a single task as `.json`."""

import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from sign_model.foundation.files import require_regular
from srt_jax.coalition.task import (
    NOWHERE,
    CoalitionTask,
    NamedCoalition,
    make_coalition,
    unstack_coalitions,
)
from srt_jax.formats.containers.arrays import read_arrays
from srt_jax.formats.containers.json_text import fields_of, may_have_member, read_json
from srt_jax.formats.shared.whole_files import PathLike, atomic_write, read_bytes
from srt_jax.types import FREE, OUTSIDE

_FIELDS = {
    "labels": (np.int32, "BLHW"),
    "removal_cost": (np.float32, "BM"),
    "able": (np.bool_, "BAM"),
    "start": (np.int32, "BA2"),
    "goal": (np.int32, "BA2"),
    "size": (np.int32, "B2"),
}


def holds_coalitions(path: PathLike) -> bool:
    """Returns whether a file holds tasks of coalitions: an `.npz` with the array `able`, a `.json`
    with the member `agents`. Files that cannot be read do not.
    """
    ending = pathlib.Path(path).suffix.lower()
    try:
        if ending == ".npz":
            require_regular(path)
            # opened here: `np.load` leaves a file open that it cannot read
            with open(path, "rb") as opened, np.load(opened, allow_pickle=False) as arrays:
                return "able" in arrays.files
        if ending == ".json":
            # a large world is parsed once, by its own reader
            if not may_have_member(read_bytes(path, "task"), "agents"):
                return False
            document = read_json(path, "task")
            return isinstance(document, dict) and "agents" in document
    except Exception:  # whoever reads it as something else says what is wrong
        return False
    return False


def read_coalitions(path: PathLike) -> list[NamedCoalition]:
    """Returns the tasks in an `.npz` or `.json` file, each with its name.

    Raises:
      ValueError: the file is missing or breaks a rule; the message says where.

    Examples:
      >>> import numpy as np
      >>> import tempfile
      >>> from srt_jax.coalition import make_coalition, read_coalitions
      >>> from srt_jax.coalition import stack_coalitions, write_coalitions
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> with tempfile.TemporaryDirectory() as folder:
      ...     write_coalitions(f"{folder}/two.npz", stack_coalitions([task, task]), names="ab")
      ...     [one.name for one in read_coalitions(f"{folder}/two.npz")]
      ['a', 'b']
    """
    if pathlib.Path(path).suffix.lower() == ".npz":
        return _of_arrays(str(path), read_arrays(path, read_bytes(path, "batch of coalitions")))
    return [NamedCoalition(pathlib.Path(path).stem, _of_json(path))]


def write_coalitions(
    path: PathLike,
    tasks: CoalitionTask,
    *,
    names: Sequence[str] | None = None,
    optimum: Sequence[float] | None = None,
) -> None:
    """Writes a batch (`stack_coalitions` makes one) as `.npz`: its arrays under their names, and
    `names` (one text a task) and `optimum` (float32 [B], NaN where unknown) where given.

    Raises:
      ValueError: another ending, or arrays that `read_coalitions` would refuse.

    Examples:
      >>> import numpy as np
      >>> import os
      >>> import tempfile
      >>> from srt_jax.coalition import make_coalition, stack_coalitions, write_coalitions
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> with tempfile.TemporaryDirectory() as folder:
      ...     write_coalitions(f"{folder}/one.npz", stack_coalitions([task]))
      ...     os.listdir(folder)
      ['one.npz']
    """
    if pathlib.Path(path).suffix.lower() != ".npz":
        raise ValueError(f"{path}: a batch of coalitions is an .npz file: end the name in .npz")
    arrays: dict[str, Any] = {name: np.asarray(getattr(tasks, name)) for name in _FIELDS}
    if names is not None:
        arrays["names"] = np.array([str(name) for name in names], np.str_)
    if optimum is not None:
        arrays["optimum"] = np.asarray(optimum, np.float32)
    _of_arrays(str(path), arrays)
    with atomic_write(path, "wb") as file:
        np.savez_compressed(file, **arrays)


def _of_arrays(path: str, arrays: dict[str, np.ndarray]) -> list[NamedCoalition]:
    """The tasks of a batch, checked."""
    known = (*_FIELDS, "names", "optimum")
    for name in (*_FIELDS, *arrays):
        if name not in arrays or name not in known:
            fault = "is missing" if name in known else "is unknown"
            raise ValueError(
                f"{path}: the array {name!r} {fault}: a batch of coalitions holds"
                f" {', '.join(_FIELDS)}, and may hold names, optimum"
            )
    sizes: dict[str, int] = {"2": 2}
    number = arrays["labels"].shape[0] if arrays["labels"].ndim else 0
    names = arrays.get("names", np.array([str(i) for i in range(number)], np.str_))
    forms = _FIELDS | {"names": (np.str_, "B")}
    if "optimum" in arrays:
        forms |= {"optimum": (np.float32, "B")}
    for name, (dtype, axes) in forms.items():
        array = names if name == "names" else arrays[name]
        shape = dict(zip(axes, array.shape))
        if not np.issubdtype(array.dtype, dtype):
            raise ValueError(f"{path}: {name} must be {np.dtype(dtype).name}, got {array.dtype}")
        if (
            array.ndim != len(axes)
            or 0 in array.shape
            or any(sizes.setdefault(axis, length) != length for axis, length in shape.items())
        ):
            raise ValueError(
                f"{path}: {name} must have shape [{', '.join(axes)}], none 0 and sizes equal in all"
                f" arrays, got {list(array.shape)}"
            )
    _check_ranges(path, arrays)
    batch = CoalitionTask(**{name: arrays[name] for name in _FIELDS})
    return [NamedCoalition(str(n), t) for n, t in zip(names, unstack_coalitions(batch))]


def _check_ranges(path: str, arrays: dict[str, np.ndarray]) -> None:
    labels, size, cost = arrays["labels"], arrays["size"], arrays["removal_cost"]
    height, width = labels.shape[2:]
    inside = (np.arange(height) < size[:, :1])[:, :, None] & (np.arange(width) < size[:, 1:])[
        :, None
    ]
    is_padding = labels == np.where(np.arange(labels.shape[1]) == 0, OUTSIDE, FREE)[:, None, None]
    is_id = (labels >= FREE) & (labels < cost.shape[1])

    def strays(cells: np.ndarray) -> np.ndarray:
        is_nowhere = (cells == NOWHERE).all(axis=2, keepdims=True)
        return ~is_nowhere & ((cells < 0) | (cells >= size[:, None]))

    broken = {
        f"size must lie between 1 x 1 and {height} x {width}, the shape of labels": (
            (size < 1) | (size > (height, width))
        ),
        "start must lie inside the map, or be (-1, -1) for padding": strays(arrays["start"]),
        "goal must lie inside the map, or be (-1, -1) for none": strays(arrays["goal"]),
        f"labels must be {FREE} (free) or an id from 0 to {cost.shape[1] - 1}": (
            inside[:, None] & ~is_id
        ),
        f"labels beyond the map's size must be {OUTSIDE} in layer 0 and {FREE} in the others": (
            ~inside[:, None] & ~is_padding
        ),
        "removal_cost must be positive and finite": ~(np.isfinite(cost) & (cost > 0)),
    }
    for rule, is_broken in broken.items():
        if is_broken.any():
            raise ValueError(f"{path}: task {np.argwhere(is_broken)[0][0]}: {rule}")


def _of_json(path: PathLike) -> CoalitionTask:
    """The task of a document: map or labels, agents, and what destroying costs."""
    members = fields_of(
        str(path),
        read_json(path, "task of a coalition"),
        "agents",
        map=None,
        labels=None,
        removal_cost=1.0,
    )
    if (members["map"] is None) == (members["labels"] is None):
        raise ValueError(
            f"{path}: give either map, a list of rows such as '..@.', or labels, obstacle ids with"
            " -1 for free cells"
        )
    cells = (
        _rows(path, members["map"])
        if members["map"] is not None
        else _labels(path, members["labels"])
    )
    agents = members["agents"]
    if not isinstance(agents, list) or not agents:
        raise ValueError(f"{path}: agents must be a list of at least one agent")
    given = [
        fields_of(f"{path}: agent {number}", agent, "start", goal=None, able=True)
        for number, agent in enumerate(agents)
    ]
    try:
        return make_coalition(
            cells,
            [_cell(one["start"], "start") for one in given],
            [None if one["goal"] is None else _cell(one["goal"], "goal") for one in given],
            able=[_able(one["able"]) for one in given],
            removal_cost=np.asarray(members["removal_cost"]),
        )
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from error


def _rows(path: PathLike, rows: object) -> np.ndarray:
    is_text = isinstance(rows, list) and rows and all(isinstance(row, str) for row in rows)
    if not is_text or not rows[0] or len({len(row) for row in rows}) != 1:  # pyright: ignore
        raise ValueError(
            f"{path}: map must be a list of texts of one length, '.' for a free cell and '@' for a"
            " blocked one"
        )
    signs = np.array([list(row) for row in rows])  # pyright: ignore
    wrong = np.argwhere((signs != ".") & (signs != "@"))
    if len(wrong):
        row, col = wrong[0].tolist()
        raise ValueError(
            f"{path}: map has {str(signs[row, col])!r} at ({row}, {col}): use '.' and '@'"
        )
    return signs == "."


def _labels(path: PathLike, labels: object) -> np.ndarray:
    try:
        array = np.asarray(labels)
    except ValueError as error:
        raise ValueError(f"{path}: labels must be rows of one length: {error}") from error
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{path}: labels must be whole numbers in rows of one length")
    return array


def _cell(cell: object, what: str) -> list:
    if not isinstance(cell, list) or len(cell) != 2 or not all(type(v) is int for v in cell):
        raise ValueError(f"{what} must be a cell [row, column], got {cell!r}")
    return cell


def _able(able: object) -> Any:
    if isinstance(able, bool) or (isinstance(able, list) and all(type(v) is int for v in able)):
        return able
    raise ValueError(f"able must be true, false or a list of obstacle ids, got {able!r}")
