"""The symbolic level: a world model of signs, planning over it, and experience (Panov & Yakovlev
2016, here PY16).

Names are loaded when first used, so that planning one task from the command line does not wait for
JAX.
"""

import importlib
from typing import TYPE_CHECKING

from sign_model.foundation.submodules import named_when_asked

if TYPE_CHECKING:
    from sign_model.clock import OutOfTime
    from sign_model.description import describe, to_dot
    from sign_model.experience.learn import learn
    from sign_model.experience.memory import Memory, load_memory, save_memory
    from sign_model.experience.skill import Skill
    from sign_model.map_algorithm.heuristics import HeuristicSign, load_signs, save_signs
    from sign_model.map_batch.ladder import plan_batch
    from sign_model.pddl.grounding import load
    from sign_model.pddl.planning_task import PlanningTask
    from sign_model.pddl.syntax import PddlError
    from sign_model.pddl.validate import validate
    from sign_model.plan_task import plan
    from sign_model.result import PlanResult, PlanStatus
    from sign_model.signs.from_tasks import world_model_of
    from sign_model.strategies.rule import PlanningRule, load_rule, save_rule
    from sign_model.views.network_svg import draw_networks
    from sign_model.views.trace import Trace, trace
    from sign_model.views.trace_svg import animate_trace

__all__ = [
    "HeuristicSign",
    "Memory",
    "OutOfTime",
    "PddlError",
    "PlanResult",
    "PlanStatus",
    "PlanningRule",
    "PlanningTask",
    "Skill",
    "Trace",
    "animate_trace",
    "describe",
    "draw_networks",
    "learn",
    "load",
    "load_memory",
    "load_rule",
    "load_signs",
    "plan",
    "plan_batch",
    "save_memory",
    "save_rule",
    "save_signs",
    "to_dot",
    "trace",
    "validate",
    "world_model_of",
]

_MODULES = {
    "map_batch.ladder": ("plan_batch",),
    "clock": ("OutOfTime",),
    "description": ("describe", "to_dot"),
    "pddl.grounding": ("load",),
    "map_algorithm.heuristics": ("HeuristicSign", "load_signs", "save_signs"),
    "experience.learn": ("learn",),
    "experience.memory": ("Memory", "load_memory", "save_memory"),
    "experience.skill": ("Skill",),
    "plan_task": ("plan",),
    "result": ("PlanResult", "PlanStatus"),
    "pddl.syntax": ("PddlError",),
    "pddl.planning_task": ("PlanningTask",),
    "pddl.validate": ("validate",),
    "signs.from_tasks": ("world_model_of",),
    "views.network_svg": ("draw_networks",),
    "views.trace": ("Trace", "trace"),
    "views.trace_svg": ("animate_trace",),
    "strategies.rule": ("PlanningRule", "load_rule", "save_rule"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


_module_named, __dir__ = named_when_asked(__name__)


def __getattr__(name: str) -> object:
    """Returns a public name from the module it lives in, or a module of the package."""
    if name not in _HOME:
        return _module_named(name)
    value = getattr(importlib.import_module(f"sign_model.{_HOME[name]}"), name)
    globals()[name] = value
    return value
