"""The arrays of an `.npz` file, read within limits.

What a header declares is compared with the bytes that are there, and with a limit, before memory is
taken.
"""

import io
import math
import sys
import zipfile
from collections.abc import Iterable
from typing import IO

import numpy as np

from srt_jax.formats.shared.whole_files import PathLike, plain_reason

MOST_BYTES = 1 << 31
"""Of all arrays of a file, unpacked. A few kilobytes can declare, and even unpack to, any
number.
"""

_METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
"""How NumPy packs; anything else was packed by another program."""


def read_arrays(
    path: PathLike, content: bytes, names: Iterable[str] | None = None, *, most: int = MOST_BYTES
) -> dict[str, np.ndarray]:
    """Returns the arrays in the bytes of an `.npz` file by name, in this machine's byte order and C
    order.

    Args:
      path: for messages. names: the arrays wanted; all by default.
      most: bytes of these arrays, unpacked.

    Raises:
      ValueError: damaged, cut off, objects instead of numbers, or larger than `most`; MemoryError:
        there is not enough memory.
    """
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            wanted = list(members) if names is None else list(names)
            chosen = {name: members[name] for name in wanted}
            total = sum(info.file_size for info in chosen.values())
            if total > most:
                raise _Refused(
                    f"its arrays take {total} bytes unpacked, and at most {most} are read: write"
                    " fewer or smaller tasks a file"
                )
            for name, info in chosen.items():
                arrays[name] = _array(archive, info)
    except _Refused as error:
        raise ValueError(f"{path}: {error}") from error
    except MemoryError:
        raise
    # the zip reader and NumPy raise whatever their code runs into on damaged bytes
    except Exception as error:
        raise ValueError(
            f"{path}: no whole .npz file of plain arrays: it is cut off, damaged, or of another"
            f" kind ({plain_reason(error)})"
        ) from error
    return arrays


class _Refused(ValueError):
    """What is no damage and has a message of its own."""


def _array(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    name = info.filename
    if info.compress_type not in _METHODS or not name.endswith(".npy"):
        raise ValueError(f"the member {name[:40]!r} is no array that NumPy wrote")
    with archive.open(info) as file:
        shape, dtype, head = read_header(file)
        size = math.prod(shape) * dtype.itemsize
        if dtype.hasobject:
            raise ValueError(f"the array {name[:40]!r} holds objects, which could run code")
        if min(shape, default=0) < 0 or head + size != info.file_size:
            raise _Refused(
                f"the array {name.removesuffix('.npy')[:40]!r} declares shape {list(shape)} and"
                f" {size} bytes, but {info.file_size - head} are there: it is cut off or damaged"
            )
        file.seek(0)
        array = np.lib.format.read_array(file, allow_pickle=False)
        file.read(1)  # the end, where the checksum is compared
    array = np.asarray(array, array.dtype.newbyteorder("="), order="C")
    if array.dtype.kind == "U" and array.size and array.view(np.uint32).max() > sys.maxunicode:
        raise ValueError(f"the array {name[:40]!r} holds numbers that stand for no character")
    return array


def read_header(file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype, int]:
    """Returns shape, dtype and the length of the header in bytes, of the `.npy` file that begins
    here.
    """
    version = np.lib.format.read_magic(file)
    try:
        read = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }.get(version)
        if read is None:
            raise ValueError(f"an array of format version {version} is not read")
        shape, _, dtype = read(file)
    except (MemoryError, RecursionError) as error:  # of the parser, on brackets without end
        raise ValueError("the header of an array is damaged") from error
    return shape, dtype, file.tell()
