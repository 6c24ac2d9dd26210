"""What a folder of units is to hold, in a file there: who comes with something else is refused."""

import contextlib
import json
import os
import pathlib
from typing import Any

from srt_jax.formats.shared.whole_files import FileError, atomic_write, read_bytes


def settle(folder: pathlib.Path, file: str, description: dict[str, Any], what: str) -> None:
    """Writes the description, or refuses the folder where it has another one.

    Args:
      file: its name in the folder. what: the folder holds, for the message, such as "data set".

    Raises:
      ValueError: another description is there, or one that cannot be read.
    """
    path = folder / file
    if not path.exists():
        _write_first(path, description)
    there = read_manifest(path, what)
    for draft in folder.glob(f".{file}.*.part"):  # of who was killed, or came second
        with contextlib.suppress(OSError):
            draft.unlink()
    for name in description:
        if there.get(name) != json.loads(json.dumps(description[name])):
            raise ValueError(
                f"{folder}: holds a {what} of {name} {_short(there.get(name))}, not"
                f" {_short(description[name])}: name another folder, or request the same"
            )


def read_manifest(path: pathlib.Path, what: str) -> dict[str, Any]:
    """Returns the description in a file; ValueError where it is missing or damaged."""
    try:
        description = json.loads(read_bytes(path, f"{what}'s description", most=1 << 26))
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{path}: is damaged, line {error.lineno}: write the {what} again"
        ) from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: is damaged: write the {what} again") from error
    if not isinstance(description, dict):
        raise ValueError(f"{path}: is no description of a {what}: write the {what} again")
    return description


def _write_first(path: pathlib.Path, description: dict[str, Any]) -> None:
    """Writes the file whole unless another process was quicker; then that one's stays."""
    draft = path.with_name(f".{path.name}.{os.urandom(6).hex()}.part")
    text = json.dumps(description, indent=1)
    try:
        draft.write_text(text, encoding="utf-8")
        os.link(draft, path)
    except (FileExistsError, FileNotFoundError):
        if not path.exists():
            _write_whole(path, text)
    except OSError:  # no hard links there
        _write_whole(path, text)
    finally:
        with contextlib.suppress(OSError):
            draft.unlink()


def _write_whole(path: pathlib.Path, text: str) -> None:
    try:
        with atomic_write(path) as file:
            file.write(text)
    except FileError:
        if not path.exists():
            raise


def _short(value: Any, most: int = 120) -> str:
    text = repr(value)
    return text if len(text) <= most else f"{text[:most]}..."
