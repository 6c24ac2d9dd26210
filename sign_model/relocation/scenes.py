"""Scenes of solved smart relocation tasks, and their plans as trees: "reach the goal area" with the
acts that it consists of.

The abstract act `reach` is the plan of a coarser domain with the same areas. The metacognitive rule
decides whether it is realised as it is, or specified: then its conditions are the start and its
effects the goal of a sub-plan (`plan_specification`; PY16 §3.1). An act is an operation if path
planning alone can execute it, that is, if nothing is known to block the way.
"""

from collections.abc import Mapping, Sequence

from sign_model.map_algorithm.plan_specification import Step, specify_plan
from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import PlanningTask
from sign_model.relocation.domain import AGENT, Scene, scene_task
from sign_model.relocation.working_memory import BREAKABLE, INDESTRUCTIBLE, area
from sign_model.result import PlanResult, PlanStatus
from sign_model.signs.world_model import WorldModel

OPERATIONS = ("relocate", "pass", "approach", "destroy")
"""The actions of the relocation domain that the sub-symbolic level executes as they are."""

COARSE_DOMAIN = """(define (domain reaching)
  (:requirements :strips :typing)
  (:types agent area - object)
  (:constants i - agent)
  (:predicates (at ?a - agent ?p - area))
  (:action reach
    :parameters (?a - agent ?p ?q - area)
    :precondition (at ?a ?p)
    :effect (and (at ?a ?q) (not (at ?a ?p)))))
"""


def chain_scene(
    obstacles: Sequence[str], *, seen_as: Mapping[str, Sequence[str]] | None = None
) -> Scene:
    """Returns a scene of areas in a row with a breakable obstacle between each two; without
    obstacles, two areas and an open way.

    Args:
      obstacles: their names, from the start on.
      seen_as: as in `Scene`.
    """
    blocked = tuple(
        (area(place), area(place + 1), obstacle) for place, obstacle in enumerate(obstacles)
    )
    ways = () if obstacles else ((area(0), area(1)),)
    goal = area(max(1, len(obstacles)))
    kinds = dict.fromkeys(obstacles, BREAKABLE)
    return Scene(area(0), goal, ways, blocked, kinds, (BREAKABLE,), seen_as or {})


def contour_scene(
    breakable: Sequence[str],
    indestructible: Sequence[str] = (),
    *,
    seen_as: Mapping[str, Sequence[str]] | None = None,
) -> Scene:
    """Returns a scene of two areas and obstacles between them, each assumed to be all that blocks.

    Args:
      breakable, indestructible: the names of the obstacles.
      seen_as: as in `Scene`.
    """
    obstacles = (*breakable, *indestructible)
    blocked = tuple((area(0), area(1), obstacle) for obstacle in obstacles)
    kinds = dict.fromkeys(breakable, BREAKABLE) | dict.fromkeys(indestructible, INDESTRUCTIBLE)
    return Scene(area(0), area(1), (), blocked, kinds, (BREAKABLE,), seen_as or {})


def reach_task(scene: Scene) -> PlanningTask:
    """Returns the coarse task of a scene: to reach the goal area, whatever lies between."""
    areas = dict.fromkeys((scene.start, scene.goal))
    return load(
        COARSE_DOMAIN,
        f"(define (problem reach)\n  (:domain reaching)\n  (:objects {' '.join(areas)} - area)\n"
        f"  (:init (at {AGENT} {scene.start}))\n  (:goal (at {AGENT} {scene.goal})))\n",
    )


def reached(
    scene: Scene, plan: Sequence[str], *, rule: WorldModel | None = None
) -> tuple[Step, ...]:
    """Returns the tree of "reach the goal area": realised as it is, or with the plan below it; ()
    if the agent is there already.

    Args:
      scene: what was known.
      plan: what was executed, actions of the scene's task; it is replayed first, and left out if it
        is not valid.
      rule: decides between realise and specify; by default `plan_specification.metacognition()`.
    """
    if scene.start == scene.goal:
        return ()
    act = f"(reach {AGENT} {scene.start} {scene.goal})"
    is_open = (scene.start, scene.goal) in scene.ways
    return specify_plan(
        reach_task(scene),
        [act],
        [scene_task(scene)],
        plan_batch=lambda tasks: [PlanResult(PlanStatus.SOLVED, tuple(plan)) for _ in tasks],
        operations=(*OPERATIONS, "reach") if is_open else OPERATIONS,
        rule=rule,
    )
