"""Smart relocation tasks in batch, on JAX: find the way, or what blocks it, what to remove, and the
way then.

PY16: A. I. Panov, K. S. Yakovlev, "Psychologically inspired planning method for smart relocation
  task", Procedia Computer
Science 88, 2016. A cell is (row, col), row 0 on top; `free` is True where the agent fits; lengths
are in cell sides.
"""

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


def __getattr__(name: str) -> object:
    """Loads `srt_jax.envs` and `srt_jax.dataset` when they are first asked for."""
    if name in ("envs", "dataset"):
        import importlib

        return importlib.import_module(f"srt_jax.{name}")
    raise AttributeError(f"module 'srt_jax' has no attribute {name!r}")
