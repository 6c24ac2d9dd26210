"""Modules of a package that are loaded when they are first named."""

import importlib
import pkgutil
import sys
from collections.abc import Callable


def named_when_asked(package: str) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Returns the functions `__getattr__` and `__dir__` of a package that names its modules, each
    loaded when it is first asked for, so that `import package` alone is enough.

    Args:
      package: its `__name__`.
    """

    def modules() -> set[str]:
        return {found.name for found in pkgutil.iter_modules(sys.modules[package].__path__)}

    def get(name: str) -> object:
        # Names that begin with "_" are asked for by Python itself, often: no look at the disk.
        if name.startswith("_") or name not in modules():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return importlib.import_module(f"{package}.{name}")

    def known() -> list[str]:
        held = vars(sys.modules[package])
        own = held.get("__all__", ())
        return sorted({*(name for name in held if name.startswith("__")), *own, *modules()})

    return get, known
