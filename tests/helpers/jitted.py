"""The functions of a module, each jitted: called as they are, every step of them is compiled alone,
for every shape, which takes longer than to compile them whole.
"""

import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any

import jax


class Jitted:
    """The functions of a module or an object; the arguments named in `static` are no arrays."""

    def __init__(self, home: ModuleType | Any, **static: tuple[int, ...]) -> None:
        self._home, self._static = home, static

    @functools.cache  # noqa: B019
    def _jitted(self, name: str) -> Callable:
        return jax.jit(getattr(self._home, name), static_argnums=self._static.get(name, ()))

    def __getattr__(self, name: str) -> Callable:
        return self._jitted(name)
