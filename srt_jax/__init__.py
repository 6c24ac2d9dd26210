"""Smart relocation tasks in batch, on JAX: find the way, or what blocks it, what to remove, and the
way then.

PY16: A. I. Panov, K. S. Yakovlev, "Psychologically inspired planning method for smart relocation
  task", Procedia Computer
Science 88, 2016. A cell is (row, col), row 0 on top; `free` is True where the agent fits; lengths
are in cell sides.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from srt_jax.answers.facts import explanation
    from srt_jax.answers.story import scene_pddl, story
    from srt_jax.answers.wording import explain, why, why_not
    from srt_jax.check import check
    from srt_jax.geometry.raster import rasterize
    from srt_jax.geometry.world import Obstacle, World
    from srt_jax.gradients.perturbed import perturbed
    from srt_jax.many_tasks import solve_many
    from srt_jax.moves import octile_distance
    from srt_jax.paths.contour import contour
    from srt_jax.paths.corridor import path_within
    from srt_jax.paths.distance import cost_to_come, path_cost
    from srt_jax.paths.path import trace_path
    from srt_jax.paths.reach import reach
    from srt_jax.paths.seed import seed_cell
    from srt_jax.removal_gradient import least_removal
    from srt_jax.solver import solve
    from srt_jax.task import make_task, stack, unstack
    from srt_jax.types import Path, Solution, Status, Task

__version__ = "0.1.0"

__all__ = [
    "Obstacle",
    "Path",
    "Solution",
    "Status",
    "Task",
    "World",
    "check",
    "contour",
    "cost_to_come",
    "explain",
    "explanation",
    "least_removal",
    "make_task",
    "octile_distance",
    "path_cost",
    "path_within",
    "perturbed",
    "rasterize",
    "reach",
    "scene_pddl",
    "seed_cell",
    "solve",
    "solve_many",
    "stack",
    "story",
    "trace_path",
    "unstack",
    "why",
    "why_not",
]

# Names are loaded when first used, so that a command which needs no JAX does not wait for it.
_MODULES = {
    "check": ("check",),
    "contour": ("contour",),
    "corridor": ("path_within",),
    "distance": ("cost_to_come", "path_cost"),
    "explain": ("explain", "why", "why_not"),
    "explanation": ("explanation",),
    "least": ("least_removal",),
    "many": ("solve_many",),
    "moves": ("octile_distance",),
    "path": ("trace_path",),
    "raster": ("rasterize",),
    "reach": ("reach",),
    "seed": ("seed_cell",),
    "soft": ("perturbed",),
    "solver": ("solve",),
    "story": ("scene_pddl", "story"),
    "task": ("make_task", "stack", "unstack"),
    "types": ("Path", "Solution", "Status", "Task"),
    "world": ("Obstacle", "World"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    """Returns a public name from the module it lives in, or a module of the package."""
    if name.startswith("_"):
        raise AttributeError(f"module 'srt_jax' has no attribute {name!r}")
    if name in _HOME:
        value = getattr(importlib.import_module(f"srt_jax.{_HOME[name]}"), name)
        globals()[name] = value
        return value
    try:
        return importlib.import_module(f"srt_jax.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"srt_jax.{name}":
            raise
    raise AttributeError(f"module 'srt_jax' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _Package(ModuleType):
    """A package some of whose functions bear the name of the module they live in, such as
    `contour`.
    """

    def __setattr__(self, name: str, value: object) -> None:
        """Importing a module binds it here under its name: where a public function has that
        name, the function stays.
        """
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
