"""Files read whole or refused in one sentence, and written whole or not at all."""

import importlib
import pathlib
import re
from typing import Any

from sign_model.foundation.extras import install_command
from sign_model.foundation.files import MOST_BYTES, PathLike
from sign_model.foundation.files import FileError as FileError
from sign_model.foundation.files import atomic_write as atomic_write
from sign_model.foundation.files import draft_of as draft_of
from sign_model.foundation.files import read_bytes as _read_bytes
from sign_model.foundation.files import require_regular as require_regular


def read_bytes(path: PathLike, kind: str, *, most: int = MOST_BYTES) -> bytes:
    """Returns the content of a regular file; ValueError where it cannot be read or has more than
    `most` bytes.

    Args:
      kind: what it should hold, for the message, such as "MovingAI map".
    """
    return _read_bytes(path, what=kind, most=most)


def read_lines(path: PathLike, kind: str) -> list[str]:
    """Returns the lines of a text file without their ends (LF or CRLF); bytes that are no UTF-8
    are read as U+FFFD.
    """
    text = read_bytes(path, kind).decode("utf-8-sig", errors="replace")
    return [line.removesuffix("\r") for line in text.removesuffix("\n").split("\n")]


def make_folder(path: pathlib.Path) -> None:
    """Makes the folder and those above it, where they are missing; ValueError where that cannot
    be.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(f"{path}: cannot be made a folder: {error.strerror}") from error


def plain_reason(error: BaseException) -> str:
    """Returns what a library says of a file, on one line and without addresses of objects in
    memory.
    """
    reason = re.sub(r"<[^<>]* object at 0x[0-9a-fA-F]+>", "it", " ".join(str(error).split()))
    return reason[:300] or type(error).__name__


_PACKAGES = {
    "PIL": "pillow",
    "yaml": "pyyaml",
    "svg": "svg.path",
    "unified_planning": "unified-planning",
}
"""The packages whose modules have other names."""


def require_module(module: str, *, extra: str, what: str) -> Any:
    """Returns a module that is not part of the core; ImportError with the command that installs it
    where it is absent.

    Args:
      extra: of this package, which brings it.
      what: the job that needs it, such as "reading OpenStreetMap".
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        top = module.split(".")[0]
        package = _PACKAGES.get(top, top)
        raise ImportError(f"{what} needs {package}: {install_command(extra, package)}") from error
