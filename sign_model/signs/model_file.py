"""World models as JSON files: names and lists only, nothing executable.

    {"format": "sign_model world model, version 1",
     "signs": [{"name": "face", "image": [[["condition", ["nose"]], ["condition", ["mouth"]]]],
               "meaning": []}, {"name": "mouth"}, {"name": "nose"}]}

A sign has up to three components; a component is a list of matrices, a matrix a list of columns,
and a column a pair of its kind and its features.
"""

import json
import pathlib

from sign_model.foundation.files import atomic_write, read_text
from sign_model.signs.matrix import ColumnKind
from sign_model.signs.sign import Column, PredictionMatrix, Sign
from sign_model.signs.world_model import WorldModel, from_signs

_FORMAT = "sign_model world model, version 1"
_COMPONENTS = ("image", "significance", "meaning")
_KINDS = {kind.name.lower(): kind for kind in ColumnKind if kind != ColumnKind.ABSENT}


def save_model(model: WorldModel, path: str | pathlib.Path) -> None:
    """Writes the signs of a model; `load_model` reads them back without loss."""
    signs = [
        {"name": sign.name, **{part: _to_plain(getattr(sign, part)) for part in _COMPONENTS}}
        for sign in model.signs()
    ]
    text = json.dumps({"format": _FORMAT, "signs": signs}, indent=1)
    with atomic_write(path) as file:
        file.write(text + "\n")


def load_model(path: str | pathlib.Path) -> WorldModel:
    """Returns the world model of a file.

    Raises:
      ValueError: the file is not JSON or not of this format, a sign does not have the form above,
        or the signs do not form a world model; the message names the file, the sign and the rule.
    """
    # The file is JSON, and says that it is a world model.
    try:
        payload = json.loads(read_text(path, what="world model"))
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: not JSON ({error}): give a file written by save_model") from None
    if (
        not isinstance(payload, dict)
        or payload.get("format") != _FORMAT
        or not isinstance(payload.get("signs"), list)
    ):
        raise ValueError(
            f"{path}: not a world model: its format must be {_FORMAT!r}; give a file written by"
            " save_model"
        )

    # Its signs, and the rules between them.
    signs = [
        _from_plain(entry, f"{path}: sign {number}")
        for number, entry in enumerate(payload["signs"], 1)
    ]
    try:
        return from_signs(signs)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _to_plain(matrices: tuple[PredictionMatrix, ...]) -> list[list]:
    """Returns one component as plain data."""
    return [
        [[column.kind.name.lower(), sorted(column.features)] for column in matrix.columns]
        for matrix in matrices
    ]


def _from_plain(entry: object, where: str) -> Sign:
    """Returns one sign of the file.

    Args:
      entry: any JSON value.
      where: the file and the sign, for error messages.

    Raises:
      ValueError: the value is not a sign.
    """
    if (
        not isinstance(entry, dict)
        or not isinstance(entry.get("name"), str)
        or set(entry) - {"name", *_COMPONENTS}
    ):
        raise ValueError(
            f"{where}: must have a name, and nothing but {', '.join(_COMPONENTS)}; see"
            " sign_model.signs.model_file"
        )
    where = f"{where} ({entry['name']})"
    try:
        return Sign(
            entry["name"], *(tuple(map(_matrix, entry.get(part, []))) for part in _COMPONENTS)
        )
    except TypeError:
        raise ValueError(
            f"{where}: each component must be a list of matrices, each a list of columns"
        ) from None
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _matrix(columns: list) -> PredictionMatrix:
    """Returns one matrix of the file."""
    return PredictionMatrix(tuple(map(_column, columns)))


def _column(column: object) -> Column:
    """Returns one column of the file, any JSON value; ValueError if it is not a column."""
    kind, names = column if isinstance(column, list) and len(column) == 2 else ("", column)
    if (
        kind not in _KINDS
        or not isinstance(names, list)
        or not all(isinstance(name, str) for name in names)
    ):
        raise ValueError(
            f"a column must be a kind ({', '.join(_KINDS)}) and a list of names, got {column!r}"
        )
    return Column(frozenset(names), _KINDS[kind])
