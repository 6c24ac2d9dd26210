"""A coalition: several agents with different abilities on one map, who help each other by
destroying obstacles (PY16 [18]: Panov & Yakovlev, RiTA 2016).

Names are loaded when first used, as in `srt_jax`.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from srt_jax.check.coalition import check_coalition
    from srt_jax.coalition.explain import coalition_record, explain_coalition, help_edges
    from srt_jax.coalition.generate import helpers
    from srt_jax.coalition.reach import coalition_reach
    from srt_jax.coalition.schedule import Schedule, schedule_coalition
    from srt_jax.coalition.solve import solve_coalition
    from srt_jax.coalition.task import (
        CoalitionTask,
        make_coalition,
        stack_coalitions,
        unstack_coalitions,
    )
    from srt_jax.coalition.task_files import read_coalitions, write_coalitions
    from srt_jax.coalition.types import CoalitionReach, CoalitionSolution, Help
    from srt_jax.symbols.scene_of_coalition import (
        coalition_lines,
        coalition_messages,
        coalition_texts,
        planned_by_map,
        signs_of,
    )

__all__ = [
    "CoalitionReach",
    "CoalitionSolution",
    "CoalitionTask",
    "Help",
    "Schedule",
    "check_coalition",
    "coalition_lines",
    "coalition_messages",
    "coalition_reach",
    "coalition_record",
    "coalition_texts",
    "explain_coalition",
    "help_edges",
    "helpers",
    "make_coalition",
    "planned_by_map",
    "read_coalitions",
    "schedule_coalition",
    "signs_of",
    "solve_coalition",
    "stack_coalitions",
    "unstack_coalitions",
    "write_coalitions",
]

_MODULES = {
    "check.coalition": ("check_coalition",),
    "coalition.explain": ("coalition_record", "explain_coalition", "help_edges"),
    "coalition.task_files": ("read_coalitions", "write_coalitions"),
    "symbols.scene_of_coalition": (
        "coalition_lines",
        "coalition_messages",
        "coalition_texts",
        "planned_by_map",
        "signs_of",
    ),
    "coalition.generate": ("helpers",),
    "coalition.reach": ("coalition_reach",),
    "coalition.types": ("CoalitionReach", "CoalitionSolution", "Help"),
    "coalition.schedule": ("Schedule", "schedule_coalition"),
    "coalition.solve": ("solve_coalition",),
    "coalition.task": (
        "CoalitionTask",
        "make_coalition",
        "stack_coalitions",
        "unstack_coalitions",
    ),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    """Returns a public name from the module it lives in."""
    if name not in _HOME:
        raise AttributeError(f"module 'srt_jax.coalition' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"srt_jax.{_HOME[name]}"), name)
    globals()[name] = value
    return value
