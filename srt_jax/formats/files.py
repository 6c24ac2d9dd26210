"""Files read whole or refused in one sentence, and written whole or not at all."""

import contextlib
import importlib
import os
import pathlib
from collections.abc import Iterator
from typing import IO, Any

PathLike = str | os.PathLike[str]


def read_bytes(path: PathLike, kind: str) -> bytes:
    """Returns the content of a file; ValueError where it cannot be read.

    Args:
      kind: what it should hold, for the message, such as "MovingAI map".
    """
    try:
        return pathlib.Path(path).read_bytes()
    except FileNotFoundError as error:
        raise ValueError(f"{path}: no such file; a {kind} was to be read from it") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"{path}: the {kind} cannot be read: {reason}") from error


def read_lines(path: PathLike, kind: str) -> list[str]:
    """Returns the lines of a text file without their ends (LF or CRLF); bytes that are no UTF-8
    stand as U+FFFD.
    """
    text = read_bytes(path, kind).decode("utf-8-sig", errors="replace")
    return [line.removesuffix("\r") for line in text.removesuffix("\n").split("\n")]


@contextlib.contextmanager
def written(path: PathLike, mode: str = "w") -> Iterator[IO[Any]]:
    """Opens a file that takes its name only once it is whole: on an error nothing is left, and an
    older file stays.

    Raises:
      ValueError: the folder does not exist or cannot be written to.
    """
    target = pathlib.Path(path)
    draft = target.with_name(f".{target.name}.{os.getpid()}.part")
    encoding, newline = (None, None) if "b" in mode else ("utf-8", "\n")
    try:
        with open(draft, mode, encoding=encoding, newline=newline) as file:
            yield file
        os.replace(draft, target)
    except OSError as error:
        raise ValueError(
            f"{path}: cannot be written: {error.strerror}; name a file in a folder that exists"
        ) from error
    finally:
        draft.unlink(missing_ok=True)


def make_folder(path: pathlib.Path) -> None:
    """Makes the folder and those above it, where they are missing; ValueError where that cannot
    be.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(f"{path}: cannot be made a folder: {error.strerror}") from error


def needed(module: str, *, extra: str, what: str) -> Any:
    """Returns a module that is not part of the core; ImportError with the command that installs it
    where it is absent.

    Args:
      extra: of this package, which brings it. what: asks for it, such as "reading OpenStreetMap".
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = {"PIL": "pillow", "yaml": "pyyaml"}.get(
            module.split(".")[0], module.split(".")[0]
        )
        raise ImportError(f"{what} needs {package}: pip install 'srt-jax[{extra}]'") from error
