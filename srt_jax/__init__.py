"""Smart relocation tasks in batch, on JAX: find the way, or what blocks it, what to remove, and the
way then.

PY16: A. I. Panov, K. S. Yakovlev, "Psychologically inspired planning method for smart relocation
task", Procedia Computer Science 88, 2016. A cell is (row, col), row 0 on top; `free` is True where
the agent fits; lengths are in cell sides.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sign_model.foundation.uncompiled.first_answers import uncompiled
    from srt_jax import coalition, data, dataset, draw, envs, formats, instances  # noqa: F401
    from srt_jax.answers.facts import Explanation, explanation
    from srt_jax.answers.story import scene_model, scene_pddl, scene_problem, story
    from srt_jax.answers.table import table
    from srt_jax.answers.wording import explain, why, why_not
    from srt_jax.check import check
    from srt_jax.connecting.connect import connect
    from srt_jax.geometry.frame import Frame
    from srt_jax.geometry.raster import rasterize
    from srt_jax.geometry.world import Obstacle, World
    from srt_jax.gradients.perturbed import perturbed
    from srt_jax.many_tasks import solve_many
    from srt_jax.moves import octile_distance
    from srt_jax.paths.approach import approach
    from srt_jax.paths.contour import contour
    from srt_jax.paths.corridor import path_within
    from srt_jax.paths.cost_to_come import cost_to_come, path_cost
    from srt_jax.paths.critical import critical_cells
    from srt_jax.paths.path import trace_path
    from srt_jax.paths.reach import reach
    from srt_jax.paths.seed import seed_cell
    from srt_jax.paths.shortest import shortest_path
    from srt_jax.removal_gradient import least_removal
    from srt_jax.robots.inflate import inflate
    from srt_jax.robots.path_file import write_path
    from srt_jax.robots.polyline import polyline
    from srt_jax.solver import solve
    from srt_jax.task import make_task, stack, unstack
    from srt_jax.tolls.field import toll_to_come
    from srt_jax.total_gradient import least_total
    from srt_jax.tradeoffs import tradeoffs
    from srt_jax.types import Approach, Path, Solution, Status, Task

__version__ = "0.1.0"

__all__ = [
    "Approach",
    "Explanation",
    "Frame",
    "Obstacle",
    "Path",
    "Solution",
    "Status",
    "Task",
    "World",
    "approach",
    "check",
    "connect",
    "contour",
    "cost_to_come",
    "critical_cells",
    "explain",
    "explanation",
    "inflate",
    "least_removal",
    "least_total",
    "make_task",
    "octile_distance",
    "path_cost",
    "path_within",
    "perturbed",
    "polyline",
    "rasterize",
    "reach",
    "scene_model",
    "scene_pddl",
    "scene_problem",
    "seed_cell",
    "shortest_path",
    "solve",
    "solve_many",
    "stack",
    "story",
    "table",
    "toll_to_come",
    "trace_path",
    "tradeoffs",
    "uncompiled",
    "unstack",
    "why",
    "why_not",
    "write_path",
]

# Names are loaded when first used, so that a command which needs no JAX does not wait for it.
_MODULES = {
    "answers.facts": ("Explanation", "explanation"),
    "answers.story": ("scene_model", "scene_pddl", "scene_problem", "story"),
    "answers.table": ("table",),
    "answers.wording": ("explain", "why", "why_not"),
    "check": ("check",),
    "geometry.frame": ("Frame",),
    "geometry.raster": ("rasterize",),
    "geometry.world": ("Obstacle", "World"),
    "gradients.perturbed": ("perturbed",),
    "connecting.connect": ("connect",),
    "many_tasks": ("solve_many",),
    "moves": ("octile_distance",),
    "paths.approach": ("approach",),
    "paths.contour": ("contour",),
    "paths.corridor": ("path_within",),
    "paths.critical": ("critical_cells",),
    "paths.cost_to_come": ("cost_to_come", "path_cost"),
    "paths.path": ("trace_path",),
    "paths.reach": ("reach",),
    "paths.seed": ("seed_cell",),
    "paths.shortest": ("shortest_path",),
    "removal_gradient": ("least_removal",),
    "robots.inflate": ("inflate",),
    "robots.path_file": ("write_path",),
    "robots.polyline": ("polyline",),
    "solver": ("solve",),
    "task": ("make_task", "stack", "unstack"),
    "tolls.field": ("toll_to_come",),
    "total_gradient": ("least_total",),
    "tradeoffs": ("tradeoffs",),
    "types": ("Approach", "Path", "Solution", "Status", "Task"),
}
_HOME = {name: f"srt_jax.{module}" for module, names in _MODULES.items() for name in names}
_HOME["uncompiled"] = "sign_model.foundation.uncompiled.first_answers"


def __getattr__(name: str) -> object:
    """Returns a public name from the module it lives in, or a module of the package."""
    if name.startswith("_"):
        raise AttributeError(f"module 'srt_jax' has no attribute {name!r}")
    if name in _HOME:
        value = getattr(importlib.import_module(_HOME[name]), name)
        globals()[name] = value
        return value
    try:
        return importlib.import_module(f"srt_jax.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"srt_jax.{name}":
            raise
    raise AttributeError(f"module 'srt_jax' has no attribute {name!r}")


_SUBMODULES = ("coalition", "data", "dataset", "draw", "envs", "formats", "instances")
"""Packages for users; like the names above they are loaded when first used."""


def __dir__() -> list[str]:
    own = (name for name in globals() if name.startswith("__"))
    return sorted({*own, *__all__, *_SUBMODULES})


class _Package(ModuleType):
    """This package, in which `check` and `tradeoffs` are both modules and the public functions in
    them.
    """

    def __setattr__(self, name: str, value: object) -> None:
        """Importing a module binds it here under its name: a public function of that name stays."""
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
