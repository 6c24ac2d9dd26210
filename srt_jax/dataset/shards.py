"""Shards on disk: one `.npz` each with a fixed time stamp, so equal arrays are equal bytes; or
ArrayRecord, a record a task.
"""

import importlib
import io
import pathlib
import zipfile
from collections.abc import Callable, Iterable
from typing import IO, Any

import numpy as np

from sign_model.foundation.extras import install_command
from srt_jax.formats.containers.arrays import read_arrays, read_header
from srt_jax.formats.shared.whole_files import atomic_write, draft_of, read_bytes, require_regular
from srt_jax.types import FREE

FIELDS = (
    *(
        "index",
        "labels",
        "destroyable",
        "removal_cost",
        "start",
        "goal",
        "size",
        "status",
        "length",
        "removal_bound",
    ),
    *("least_removal", "first_blocker", "cost_to_go", "correction", "focal", "least_cost"),
)
"""The arrays of a shard, [tasks, ...]; `least_cost` is what the least removal costs."""

SHORTEST_FIELDS = ("breaks", "total", "total_bound")
"""What a shard of mode "shortest" holds besides."""

SUFFIXES = {"npz": "npz", "arrayrecord": "arrayrecord"}
_MOST_BYTES = 1 << 36
"""Of a shard, unpacked: its size is what the data set's own description says, and much larger
than a batch may be.
"""
_LEVEL = 1  # deflate: maps of floats shrink little more at higher ones, and ten times slower


def write_npz(path: pathlib.Path, arrays: dict[str, np.ndarray]) -> None:
    """Writes a shard, whole or not at all."""
    with atomic_write(path, "wb") as file:
        _pack(file, arrays)


def _pack(file: IO[bytes], arrays: dict[str, np.ndarray]) -> None:
    """Deflates the arrays into a file piece by piece, for a copy would take much memory."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name in (*FIELDS, *(name for name in SHORTEST_FIELDS if name in arrays)):
            array = np.ascontiguousarray(arrays[name])
            is_large = 1.05 * array.nbytes > zipfile.ZIP64_LIMIT  # in case it does not shrink
            # dated 1980, whenever it is written
            with archive.open(f"{name}.npy", "w", force_zip64=is_large) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


def read_npz(path: pathlib.Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Returns the requested arrays; ValueError where the file is damaged."""
    return _unpack(str(path), read_bytes(path, "shard of a data set", most=_MOST_BYTES), names)


def _unpack(path: str, content: bytes, names: Iterable[str]) -> dict[str, np.ndarray]:
    try:
        return read_arrays(path, content, names, most=_MOST_BYTES)
    except ValueError as error:
        raise ValueError(
            f"{path}: the shard is damaged: delete it and run the same srt-jax dataset command"
            " again"
        ) from error


def shape_npz(path: pathlib.Path) -> tuple[int, int]:
    """Returns the layers and obstacles (L, M) of a shard; reads only the heads of its arrays."""
    require_regular(path, what="shard of a data set")
    try:
        with zipfile.ZipFile(path) as archive:
            return _head(archive, "labels")[1], _head(archive, "destroyable")[1]
    # the zip reader and NumPy raise whatever their code runs into on damaged bytes
    except Exception as error:
        raise ValueError(
            f"{path}: the shard is damaged: delete it and run the same srt-jax dataset command"
            " again"
        ) from error


def _head(archive: zipfile.ZipFile, name: str) -> tuple[int, ...]:
    with archive.open(f"{name}.npy") as file:
        return read_header(file)[0]


def write_records(path: pathlib.Path, arrays: dict[str, np.ndarray]) -> None:
    """Writes a shard of records: the arrays of one task each, packed as an `.npz` of one."""
    with draft_of(path) as draft:
        writer = _array_record().ArrayRecordWriter(str(draft), "group_size:1")
        for index in range(len(arrays["index"])):
            record = io.BytesIO()
            _pack(record, {name: array[index : index + 1] for name, array in arrays.items()})
            writer.write(record.getvalue())
        writer.close()


def read_records(path: pathlib.Path, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Returns the requested arrays of a shard of records."""
    reader = _array_record().ArrayRecordReader(str(path))
    records = [_unpack(str(path), record, names) for record in reader.read_all()]
    reader.close()
    return {name: np.concatenate([record[name] for record in records]) for name in names}


def shape_records(path: pathlib.Path) -> tuple[int, int]:
    """Returns the layers and obstacles (L, M) of a shard of records; all its tasks have the
    same.
    """
    reader = _array_record().ArrayRecordReader(str(path))
    first = _unpack(str(path), reader.read([0])[0], ("labels", "destroyable"))
    reader.close()
    return first["labels"].shape[1], first["destroyable"].shape[1]


def require(format: str) -> None:
    """Raises ImportError with the install command where the format's package is missing."""
    if format == "arrayrecord":
        _array_record()


def _array_record() -> Any:
    try:
        return importlib.import_module("array_record.python.array_record_module")
    except ImportError as error:
        raise ImportError(
            "ArrayRecord is not installed:"
            f" {install_command('arrayrecord', 'array_record')}, or use --format npz"
        ) from error


def widen(name: str, array: np.ndarray, widths: dict[str, int]) -> np.ndarray:
    """Returns an array padded to the layers (L) and obstacles (M) of the whole data set, as `stack`
    pads.
    """
    fill = {"labels": FREE, "removal_cost": 1, "destroyable": False, "least_removal": False}
    if name not in fill:
        return array
    missing = widths["L" if name == "labels" else "M"] - array.shape[1]
    return np.pad(
        array, [(0, 0), (0, missing)] + [(0, 0)] * (array.ndim - 2), constant_values=fill[name]
    )


WRITERS: dict[str, Callable[[pathlib.Path, dict[str, np.ndarray]], None]] = {
    "npz": write_npz,
    "arrayrecord": write_records,
}
READERS = {"npz": read_npz, "arrayrecord": read_records}
SHAPES = {"npz": shape_npz, "arrayrecord": shape_records}
