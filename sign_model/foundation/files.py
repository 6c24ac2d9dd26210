"""Whole files: read only where they are regular and not too large, written whole or not at all."""

import contextlib
import errno
import itertools
import os
import pathlib
import stat
import threading
from collections.abc import Iterator
from typing import IO, Any, BinaryIO

PathLike = str | os.PathLike[str]

MOST_BYTES = 1 << 30
"""Of a file that is read into memory; more is refused before any memory is taken."""

_PART = 1 << 26
"""Bytes read at once."""

_REMEDIES = {
    errno.ENOENT: "name a file in a folder that exists",
    errno.ENOTDIR: "name a file in a folder that exists",
    errno.EISDIR: "it is a folder: name a file in it",
    errno.ENOSPC: "make room on the disk, or name a file on another one",
    errno.EDQUOT: "make room on the disk, or name a file on another one",
    errno.EFBIG: "the file grows larger than it may: raise the limit, or write less at once",
    errno.ENAMETOOLONG: "give a shorter name",
    errno.EACCES: "name a file in a folder in which you may write",
    errno.EPERM: "name a file in a folder in which you may write",
    errno.EROFS: "name a file in a folder in which you may write",
}

_drafts: set[str] = set()
"""The files that are being written now; `remove_open_drafts` clears them when the process has to
end at once.
"""
_lock = threading.RLock()  # re-entrant: a signal handler may run while this thread holds it
_numbers = itertools.count()


class FileError(OSError, ValueError):
    """A file that cannot be read or written; the message is one sentence that names the file,
    the reason and a remedy.
    """

    def __str__(self) -> str:
        return str(self.args[0])


class MissingFileError(FileError, FileNotFoundError):
    """A file that is not there."""


@contextlib.contextmanager
def atomic_write(path: PathLike, mode: str = "w") -> Iterator[IO[Any]]:
    """Opens a file that takes its name only once it is whole: on an error or interrupt nothing is
    left, an older file stays.

    Text is UTF-8 with lines that end in LF; what UTF-8 cannot express (half a surrogate pair) is
    written as \\udc80.

    Args:
      mode: "w" for text, "wb" for bytes.

    Raises:
      FileError: the folder does not exist or cannot be written to, or the disk is full.

    Example:
      with atomic_write("answers.json") as file:
          json.dump(answers, file)
    """
    encoding, errors, newline = (
        (None, None, None) if "b" in mode else ("utf-8", "backslashreplace", "\n")
    )
    with (
        draft_of(path) as draft,
        open(draft, mode, encoding=encoding, errors=errors, newline=newline) as file,
    ):
        yield file


@contextlib.contextmanager
def draft_of(path: PathLike) -> Iterator[pathlib.Path]:
    """Yields the name of a draft beside `path` for a library that opens files by name; renamed when
    all went well.

    Raises:
      FileError: as `written`.
    """
    draft = None
    try:
        target = _settled(path)
        draft = _draft_beside(target)
        keep_draft(draft)
        yield draft
        os.replace(draft, target)
    except FileError:
        raise
    except OSError as error:
        kind = MissingFileError if isinstance(error, FileNotFoundError) else FileError
        raise kind(f"{path}: cannot be written: {_reason(error)}") from error
    finally:
        if draft is not None:
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)
            forget_draft(draft)


def keep_draft(path: PathLike) -> None:
    """Notes a file that `remove_open_drafts` is to remove, such as a claim."""
    with _lock:
        _drafts.add(str(path))


def forget_draft(path: PathLike) -> None:
    """Takes back what `keep_draft` noted."""
    with _lock:
        _drafts.discard(str(path))


def remove_open_drafts() -> None:
    """Removes what is being written now, for a process that is about to end without unwinding
    its stack.
    """
    for draft in list(_drafts):
        with contextlib.suppress(OSError):
            os.unlink(draft)


def read_bytes(path: PathLike, *, what: str = "file", most: int = MOST_BYTES) -> bytes:
    """Returns the content of a regular file; devices, pipes and folders are refused before anything
    is read from them.

    Args:
      what: the file should hold, for the message, such as "MovingAI map".
      most: bytes; a larger file is refused before memory is taken.

    Raises:
      FileError: the file is missing, no regular file, too large, or cannot be read.
    """
    require_regular(path, what=what, most=most)
    try:
        with open(path, "rb") as file:
            content = _read_at_most(file, most + 1)
    except (OSError, ValueError) as error:
        raise FileError(
            f"{path}: the {what} cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    if len(content) > most:
        raise FileError(_too_large(path, what, len(content), most))
    return content


def _read_at_most(file: BinaryIO, most: int) -> bytes:
    """Returns what is left in a file, `most` bytes of it at most.

    In parts: to read with a limit takes memory for the whole limit at once.
    """
    parts, left = [], most
    while left > 0 and (part := file.read(min(left, _PART))):
        parts.append(part)
        left -= len(part)
    return parts[0] if len(parts) == 1 else b"".join(parts)


def read_text(path: PathLike, *, what: str = "file", most: int = MOST_BYTES) -> str:
    """Returns the text of a regular UTF-8 file, without a byte order mark.

    Raises:
      FileError: as `read_bytes`. UnicodeDecodeError: the file is no UTF-8.
    """
    return read_bytes(path, what=what, most=most).decode("utf-8-sig")


def require_regular(path: PathLike, *, what: str = "file", most: int | None = None) -> None:
    """Raises FileError where `path` is missing, no regular file, or larger than `most` bytes;
    opens nothing.
    """
    try:
        found = os.stat(path)
    except FileNotFoundError as error:
        raise MissingFileError(f"{path}: no such file; a {what} was to be read from it") from error
    except (OSError, ValueError) as error:
        raise FileError(
            f"{path}: the {what} cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    if not stat.S_ISREG(found.st_mode):
        raise FileError(
            f"{path}: the {what} cannot be read: it is {_form(found.st_mode)}: name a regular file"
        )
    if most is not None and found.st_size > most:
        raise FileError(_too_large(path, what, found.st_size, most))


def _too_large(path: PathLike, what: str, size: int, most: int) -> str:
    return (
        f"{path}: the {what} has {size} bytes or more, and at most {most} are read: cut it into"
        " smaller files"
    )


def opened_for(target: PathLike | IO[bytes]) -> contextlib.AbstractContextManager[IO[bytes]]:
    """Returns a file to write bytes to: a whole one under a name (`atomic_write`), or the open file
    that was given, which stays open.
    """
    if isinstance(target, str | os.PathLike):
        return atomic_write(target, "wb")
    return contextlib.nullcontext(target)


def require_folder_of(path: PathLike, called: str | None = None) -> None:
    """Raises ValueError, before anything is made, where a file could not be written because there
    is no folder for it.

    Args:
      called: what to call it in the message, such as "--report page.html"; by default its name.
    """
    folder = pathlib.Path(path).parent
    if not os.path.isdir(folder):  # False for names that no folder can have
        raise ValueError(
            f"{called or path}: there is no folder {folder}: name a file in a folder that exists"
        )


def _form(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a socket" if stat.S_ISSOCK(mode) else "a device"


def _settled(path: PathLike) -> pathlib.Path:
    """Returns the file behind links; devices and pipes are refused, for a rename would put a
    file in their place.
    """
    try:
        target = pathlib.Path(os.path.realpath(path))
        mode = os.stat(target).st_mode if os.path.exists(target) else stat.S_IFREG
    except ValueError as error:  # a null byte, or signs that the file system cannot express
        raise FileError(f"{path!r}: is no name of a file ({error}): give another") from error
    if not stat.S_ISREG(mode):
        raise FileError(f"{path}: cannot be written: it is {_form(mode)}: name a regular file")
    return target


def _draft_beside(target: pathlib.Path) -> pathlib.Path:
    # Cut, for a name as long as the file system permits has no room for what a draft adds to it.
    stem = target.name.encode("utf-8", "surrogateescape")[:180].decode("utf-8", "ignore")
    # Numbers of processes are the same on two machines that share a folder: hence the random part.
    return target.with_name(f".{stem}.{os.getpid()}-{next(_numbers)}-{os.urandom(4).hex()}.part")


def _reason(error: OSError) -> str:
    reason = error.strerror or str(error)
    remedy = _REMEDIES.get(error.errno or 0)
    return f"{reason}; {remedy}" if remedy else reason
