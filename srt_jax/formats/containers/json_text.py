"""JSON read strictly: whole, in UTF-8, every number finite, no member twice, no member that is not
known.
"""

import json
import math
from typing import Any, NoReturn

from srt_jax.formats.shared.whole_files import PathLike, read_bytes

_MOST_DIGITS = 300
"""Of a whole number; longer ones exceed what a float can hold, and any that a file has a use
for.
"""


def read_json(path: PathLike, kind: str, *, takes_nan: bool = False) -> Any:
    """Returns the document in a JSON file.

    Args:
      kind: what it should hold, for the message, such as "world".
      takes_nan: NaN and Infinity, which are no JSON but are written, come back as numbers.

    Raises:
      ValueError: the file is missing, or no JSON as above; the message says where.
    """
    content = read_bytes(path, kind)
    try:
        constant = float if takes_nan else _refuse_constant
        return json.loads(
            content,
            parse_constant=constant,
            parse_int=_whole,
            object_pairs_hook=_without_repeats,
        )
    except json.JSONDecodeError as error:
        raise ValueError(
            f"{path}:{error.lineno}: no whole JSON file: {error.msg} at column {error.colno}"
        ) from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: no JSON text in UTF-8") from error
    except RecursionError as error:
        raise ValueError(
            f"{path}: nested too deeply: at most some hundred lists or objects lie inside each"
            " other"
        ) from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def may_have_member(content: bytes, name: str) -> bool:
    """Returns False where no object of a document has a member of that name, without parsing it.

    A name may also be written in escapes, or in an encoding of several bytes a letter.
    """
    is_wide = b"\0" in content[:4]
    return name.encode() in content or b"\\u" in content or is_wide


def fields_of(where: str, value: object, *required: str, **defaults: object) -> dict[str, Any]:
    """Returns the members of a JSON object in the requested order; ValueError for one that is
    missing or not known.
    """
    if not isinstance(value, dict):
        raise ValueError(
            f"{where} must be an object with {', '.join(required)}, got {type(value).__name__}"
        )
    names = (*required, *defaults)
    for name in required:
        if name not in value:
            raise ValueError(f"{where} lacks {name!r}: it needs {', '.join(required)}")
    for name in value:
        if name not in names:
            raise ValueError(
                f"{where} has the unknown member {name!r}: known are {', '.join(names)}"
            )
    return {name: value.get(name, defaults.get(name)) for name in names}


def is_version(value: object, version: int) -> bool:
    """Whether a member of an object is this number; `true`, which Python takes for 1, is not."""
    return value == version and not isinstance(value, bool)


def _whole(text: str) -> int | float:
    """Returns a whole number; inf where no float can hold it, which the readers of finite
    numbers refuse by name.
    """
    return (
        int(text)
        if len(text) <= _MOST_DIGITS
        else math.copysign(math.inf, -1 if text[0] == "-" else 1)
    )


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is no coordinate: numbers must be finite")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the member {max(names, key=names.count)!r} is given twice in one object")
    return members
