"""Frozen records of arrays: pytrees that type checkers can read, for both packages.

`chex.dataclass` makes a class a pytree with `replace` and `items`, but no type checker sees through
it. `record` is that decorator, declared as one that makes
dataclasses; `Record` declares, for type checkers only, the methods that chex adds.
"""

from collections.abc import ItemsView
from typing import TYPE_CHECKING, Any, Self, dataclass_transform

import chex

Array = Any
"""A `jax.Array` inside jit, a NumPy array on the host. No checker can tell what the two share, so
dtype and shape stand in the docstrings.
"""


@dataclass_transform(frozen_default=True)
def record(cls: type) -> type:
    """Returns the class as a frozen record, a pytree: `chex.dataclass(frozen=True)`."""
    return chex.dataclass(frozen=True)(cls)


class Record:
    """Base class of records whose `replace` or `items` is called; empty at run time."""

    if TYPE_CHECKING:

        def replace(self, **changes: Any) -> Self:
            """Returns the record with some fields changed."""
            ...

        def items(self) -> ItemsView[str, Any]:
            """Returns the names of the fields with their values."""
            ...
