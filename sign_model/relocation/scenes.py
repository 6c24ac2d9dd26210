"""Scenes of solved smart relocation tasks, and their plans as trees: "reach the goal area" and what
it comes down to.

The abstract act `reach` is the plan of a coarser domain with the same areas. Whether it is realised
as it is or specified, its conditions the start and its effects the goal of a sub-plan, is decided
by the metacognitive rule (`plan_specification`; PY16 §3.1): an act is an operation where path
planning alone can carry it out, that is, where nothing is known to block.
"""

from collections.abc import Mapping, Sequence

from sign_model.map_algorithm.plan_specification import Step, specified
from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import PlanningTask
from sign_model.relocation.domain import AGENT, Scene, scene_task
from sign_model.relocation.working_memory import BREAKABLE, FIRM, area
from sign_model.result import PlanResult, PlanStatus
from sign_model.signs.world_model import WorldModel

OPERATIONS = ("relocate", "pass", "approach", "destroy")
"""The actions of the relocation domain that the sub-symbolic level carries out as they are."""

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
    """Returns areas one behind the other with a breakable obstacle between each two; one open
    way where there is none.
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
    firm: Sequence[str] = (),
    *,
    seen_as: Mapping[str, Sequence[str]] | None = None,
) -> Scene:
    """Returns two areas and obstacles between them, each taken to be all that blocks."""
    blocked = tuple((area(0), area(1), obstacle) for obstacle in (*breakable, *firm))
    kinds = dict.fromkeys(breakable, BREAKABLE) | dict.fromkeys(firm, FIRM)
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
    where one is there already.

    Args:
      scene: what was known.
      plan: what was carried out, actions of the scene's task; replayed first, so that a wrong one
        is left out.
      rule: realise or specify; by default `plan_specification.metacognition()`.
    """
    if scene.start == scene.goal:
        return ()
    act = f"(reach {AGENT} {scene.start} {scene.goal})"
    is_open = (scene.start, scene.goal) in scene.ways
    return specified(
        reach_task(scene),
        [act],
        [scene_task(scene)],
        plan_batch=lambda tasks: [PlanResult(PlanStatus.SOLVED, tuple(plan)) for _ in tasks],
        operations=(*OPERATIONS, "reach") if is_open else OPERATIONS,
        rule=rule,
    )
