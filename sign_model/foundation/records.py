"""Frozen records of arrays: pytrees that type checkers can read, for both packages.

`chex.dataclass` makes a class a pytree with `replace` and `items`, but no type checker sees through
it. `record` is that decorator, declared as one that makes
dataclasses; `Record` declares, for type checkers only, the methods that chex adds.
"""

import dataclasses
from collections.abc import ItemsView
from typing import TYPE_CHECKING, Any, Self, dataclass_transform

import chex
import numpy as np

_SHOWN = 8
"""Entries of an array up to which it is shown, not only its shape."""

Array = Any
"""A `jax.Array` inside jit, a NumPy array on the host. No checker can tell what the two share, so
dtype and shape stand in the docstrings.
"""


@dataclass_transform(frozen_default=True)
def record(cls: type) -> type:
    """Returns the class as a frozen record, a pytree: `chex.dataclass(frozen=True)`, with a short
    `repr`.
    """
    if "__repr__" not in cls.__dict__:
        cls.__repr__ = outline  # pyright: ignore[reportAttributeAccessIssue]
    return chex.dataclass(frozen=True)(cls)


def outline(one: Any) -> str:
    """Returns a record in a line: its small arrays, and dtype and shape of the others."""
    fields = (f"{f.name}={_short(getattr(one, f.name))}" for f in dataclasses.fields(one))
    return f"{type(one).__name__}({', '.join(fields)})"


def values_of(*arrays: Any) -> list[np.ndarray] | None:
    """Returns arrays as NumPy's; None where one has no values, as while tracing."""
    try:
        return [np.asarray(array) for array in arrays]
    except Exception:  # JAX has an error of its own for each way of having none
        return None


def _short(value: Any) -> str:
    if not hasattr(value, "dtype") or not hasattr(value, "shape"):
        return repr(value)
    known = values_of(value) if np.prod(value.shape) <= _SHOWN else None
    if known is not None and known[0].dtype != object:
        return repr(known[0].tolist())
    return f"{value.dtype}[{','.join(map(str, value.shape))}]"


class Record:
    """Base class of records whose `replace` or `items` is called; empty at run time."""

    if TYPE_CHECKING:

        def replace(self, **changes: Any) -> Self:
            """Returns the record with some fields changed."""
            ...

        def items(self) -> ItemsView[str, Any]:
            """Returns the names of the fields with their values."""
            ...
