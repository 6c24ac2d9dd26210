"""Files packed by gzip or bzip2, unpacked piece by piece and only up to a limit."""

import bz2
import gzip
import pathlib
from collections.abc import Iterator
from typing import Any

from srt_jax.formats.shared.whole_files import PathLike

MOST_RATIO = 200
"""Bytes unpacked for each byte of the file; extracts of OpenStreetMap have 10 to 30, files of
blanks a thousand and more.
"""
ALWAYS = 1 << 26
"""Bytes unpacked that are read whatever the ratio."""

_OPENERS: dict[str, Any] = {".gz": gzip.open, ".bz2": bz2.open}
_CHUNK = 1 << 20


class UnpacksTooFarError(ValueError):
    """A packed file holds far more than its size lets expect; the message names the file."""


def unpack(path: PathLike) -> Iterator[bytes]:
    """Yields the bytes of a file, a MiB at a time, unpacked where it ends in .gz or .bz2.

    Raises:
      UnpacksTooFarError: it unpacks to more than 200 times its size and 64 MiB; noticed before the
        piece beyond the limit is handed out.
      OSError, EOFError, zlib.error: the file is missing, damaged or cut off.
    """
    opener = _OPENERS.get(pathlib.PurePath(path).suffix.lower())
    most = max(ALWAYS, MOST_RATIO * pathlib.Path(path).stat().st_size)
    total = 0
    with (opener or open)(path, "rb") as file:
        while chunk := file.read(_CHUNK):
            total += len(chunk)
            if opener and total > most:
                raise UnpacksTooFarError(
                    f"{path}: it unpacks to more than {most} bytes, over {MOST_RATIO} times its"
                    " size, which no extract does: unpack it and see what it holds"
                )
            yield chunk
