"""Files packed by gzip or bzip2, tested for how much they unpack to before a reader that unpacks
them is called.
"""

import bz2
import gzip
import pathlib
import zlib

from srt_jax.formats.files import PathLike

MOST_RATIO = 200
"""Bytes unpacked for each byte of the file; extracts of OpenStreetMap have 10 to 30, files of
blanks a thousand and more.
"""
ALWAYS = 1 << 26
"""Bytes unpacked that are read whatever the ratio."""

_OPENERS = {".gz": gzip.open, ".bz2": bz2.open}
_CHUNK = 1 << 20


def require_packing(path: PathLike) -> None:
    """Raises ValueError where a file ending in .gz or .bz2 unpacks to more than 200 times its size
    and 64 MiB.

    Nothing is kept of what is unpacked. Damaged files pass: their reader tells what is wrong with
    them.
    """
    opener = _OPENERS.get(pathlib.PurePath(path).suffix.lower())
    if opener is None:
        return
    most = max(ALWAYS, MOST_RATIO * pathlib.Path(path).stat().st_size)
    total = 0
    try:
        with opener(path, "rb") as file:
            while chunk := file.read(_CHUNK):
                total += len(chunk)
                if total > most:
                    break
    except (OSError, EOFError, ValueError, zlib.error):
        return
    if total > most:
        raise ValueError(
            f"{path}: it unpacks to more than {most} bytes, over {MOST_RATIO} times its size, which"
            " no extract does: unpack it and see what it holds"
        )
