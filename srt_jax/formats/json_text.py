"""JSON read strictly: whole, in UTF-8, every number finite, no member twice, no member that is
not known.
"""

import json
from typing import Any, NoReturn

from srt_jax.formats.files import PathLike, read_bytes


def read_json(path: PathLike, kind: str) -> Any:
    """Returns the document in a JSON file.

    Args:
      kind: what it should hold, for the message, such as "world".

    Raises:
      ValueError: the file is missing, or no JSON as above; the message says where.
    """
    content = read_bytes(path, kind)
    try:
        return json.loads(
            content, parse_constant=_refuse_constant, object_pairs_hook=_without_repeats
        )
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{path}:{error.lineno}: no whole JSON file: {error.msg} at column {error.colno}"
        ) from error
    except (UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: no JSON text in UTF-8, or nested too deeply") from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def fields_of(where: str, value: object, *required: str, **defaults: object) -> dict[str, Any]:
    """Returns the members of a JSON object in the order asked for; ValueError for one that is
    missing or not known.
    """
    if not isinstance(value, dict):
        raise ValueError(
            f"{where} must be an object with {', '.join(required)}, got {type(value).__name__}"
        )
    names = (*required, *defaults)
    for name in required:
        if name not in value:
            raise ValueError(f"{where} lacks {name!r}: it has {', '.join(names)}")
    for name in value:
        if name not in names:
            raise ValueError(
                f"{where} has the unknown member {name!r}: known are {', '.join(names)}"
            )
    return {name: value.get(name, defaults.get(name)) for name in names}


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no coordinate: numbers must be finite")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the member {max(names, key=names.count)!r} stands twice in one object")
    return members
