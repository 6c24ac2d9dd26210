"""The smart relocation task on the symbolic level: areas, obstacles between them, and which of
those "I" can destroy (PY16 §2).

The same scene in two forms: PDDL, which any planner can read, and signs. An area is a place within
which the agent can move freely; an obstacle closes the way between two of them. If overlapping
obstacles close one way, it becomes a chain of areas with one obstacle between each two. To approach
an obstacle is to leave the middle of an area for its border: nothing can be destroyed from afar.
"""

import dataclasses
from collections.abc import Collection, Mapping

from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import PlanningTask
from sign_model.signs.from_tasks import world_model_of
from sign_model.signs.matrix import Component
from sign_model.signs.sign import Sign, sequence, with_elementary
from sign_model.signs.world_model import WorldModel, from_signs
from sign_model.space.fuzzy_table import FuzzyTable
from sign_model.space.spatial_signs import spatial_signs

AGENT = "i"
DESTROY = "action destroy"
"""The sign of the schema `destroy`; with a kind of obstacle it forms an ability of "I"."""

DOMAIN = """(define (domain smart-relocation)
  (:requirements :strips :typing)
  (:types agent area obstacle kind - object)
  (:constants i - agent)
  (:predicates
    (at ?a - agent ?p - area)
    (way ?p ?q - area)
    (blocked-by ?p ?q - area ?o - obstacle)
    (borders ?o - obstacle ?p - area)
    (beside ?a - agent ?o - obstacle ?p - area)
    (of-kind ?o - obstacle ?k - kind)
    (can-destroy ?a - agent ?k - kind)
    (destroyed ?o - obstacle))
  (:action relocate
    :parameters (?a - agent ?p ?q - area)
    :precondition (and (at ?a ?p) (way ?p ?q))
    :effect (and (at ?a ?q) (not (at ?a ?p))))
  (:action pass
    :parameters (?a - agent ?p ?q - area ?o - obstacle)
    :precondition (and (at ?a ?p) (blocked-by ?p ?q ?o) (destroyed ?o))
    :effect (and (at ?a ?q) (not (at ?a ?p))))
  (:action approach
    :parameters (?a - agent ?o - obstacle ?p - area)
    :precondition (and (at ?a ?p) (borders ?o ?p))
    :effect (and (beside ?a ?o ?p) (not (at ?a ?p))))
  (:action destroy
    :parameters (?a - agent ?o - obstacle ?p - area ?k - kind)
    :precondition (and (beside ?a ?o ?p) (of-kind ?o ?k) (can-destroy ?a ?k))
    :effect (and (destroyed ?o) (at ?a ?p) (not (beside ?a ?o ?p)))))
"""


@dataclasses.dataclass(frozen=True)
class Scene:
    """What is known of a smart relocation task on the symbolic level. Names are lower-case words,
    all different.

    start, goal: areas.
    ways: pairs of areas with nothing between them, in both directions.
    blocked: (area, area, obstacle): that obstacle alone closes the way between the two areas, in
      both directions.
    kinds: the kind of each obstacle.
    abilities: the kinds that "I" can destroy.
    seen_as: for areas and obstacles, the spatial signs that say where the agent sees them, such as
      ("afar", "ahead-left").
    """

    start: str
    goal: str
    ways: tuple[tuple[str, str], ...] = ()
    blocked: tuple[tuple[str, str, str], ...] = ()
    kinds: Mapping[str, str] = dataclasses.field(default_factory=dict)
    abilities: Collection[str] = ()
    seen_as: Mapping[str, Collection[str]] = dataclasses.field(default_factory=dict)

    @property
    def areas(self) -> tuple[str, ...]:
        """Every area named, in order of first mention."""
        mentioned = [area for pair in self.ways for area in pair] + [
            area for *pair, _ in self.blocked for area in pair
        ]
        return tuple(dict.fromkeys([self.start, self.goal, *mentioned]))

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Every obstacle that closes a way, in order of first mention."""
        return tuple(dict.fromkeys(obstacle for *_, obstacle in self.blocked))


def problem_text(scene: Scene, name: str = "scene") -> str:
    """Returns the scene as a PDDL problem of `DOMAIN`.

    Args:
      scene: what is known.
      name: of the problem.

    Raises:
      ValueError: an obstacle has no kind, a name is used for two things or is not one word, or
        `seen_as` names something that is not in the scene.
    """
    _check(scene)

    # The facts that hold at the start: where I am, how areas and obstacles lie, kinds, abilities.
    kinds = tuple(dict.fromkeys([*scene.kinds.values(), *scene.abilities]))
    facts = [("at", AGENT, scene.start)]
    facts += [("way", *pair) for way in scene.ways for pair in (way, way[::-1])]
    for one, other, obstacle in scene.blocked:
        facts += [("blocked-by", one, other, obstacle), ("blocked-by", other, one, obstacle)]
        facts += [("borders", obstacle, one), ("borders", obstacle, other)]
    facts += [("of-kind", obstacle, scene.kinds[obstacle]) for obstacle in scene.obstacles]
    facts += [("can-destroy", AGENT, kind) for kind in scene.abilities]

    # The text; a section without objects is left out.
    objects = "".join(
        f" {' '.join(names)} - {sort}"
        for sort, names in (("area", scene.areas), ("obstacle", scene.obstacles), ("kind", kinds))
        if names
    )
    lines = "\n    ".join(f"({' '.join(fact)})" for fact in dict.fromkeys(facts))
    return (
        f"(define (problem {name})\n  (:domain smart-relocation)\n  (:objects{objects})\n"
        f"  (:init\n    {lines})\n  (:goal (at {AGENT} {scene.goal})))\n"
    )


def scene_task(scene: Scene) -> PlanningTask:
    """Returns the scene as a planning task; raises the errors of `problem_text`."""
    return load(DOMAIN, problem_text(scene))


def scene_signs(scene: Scene, *, table: FuzzyTable | None = None) -> WorldModel:
    """Returns the scene as signs: those of its planning task, extended by "I" and by where things
    are seen.

    Args:
      scene: what is known.
      table: leads the spatial signs down to degrees and metres; where None they are elementary.

    The personal meaning of the sign `i` is what I can do: one matrix for each kind of obstacle that
    I can destroy. The image of an area or obstacle is where it is seen: a set of spatial signs.
    """
    model = with_self(world_model_of(scene_task(scene)), scene.abilities)
    places = sorted({name for names in scene.seen_as.values() for name in names})
    grounded = {} if table is None else {sign.name: sign for sign in spatial_signs(table)}
    signs = [grounded.get(name, Sign(name)) for name in places if name not in model.names]
    model = model.with_signs(with_elementary(signs))
    for name, seen in scene.seen_as.items():
        model = model.grown(name, Component.IMAGE, sequence(set(seen)))
    return model


def with_self(model: WorldModel, abilities: Collection[str]) -> WorldModel:
    """Returns the model in which the sign `i` has one more personal meaning for each kind that "I"
    can destroy.
    """
    new_meanings = tuple(sequence({DESTROY, kind}) for kind in abilities)
    signs = (
        dataclasses.replace(sign, meaning=sign.meaning + new_meanings)
        if sign.name == AGENT
        else sign
        for sign in model.signs()
    )
    return from_signs(signs)


def abilities_of(model: WorldModel) -> frozenset[str]:
    """Returns the kinds of obstacles that "I" can destroy, as the personal meanings of the sign `i`
    say.
    """
    meanings = (matrix.features for matrix in model.sign(AGENT).meaning)
    return frozenset(
        kind for features in meanings if DESTROY in features for kind in features - {DESTROY}
    )


def _check(scene: Scene) -> None:
    """Raises ValueError where a scene breaks the rules of `problem_text`."""
    # Every obstacle has a kind.
    missing = [obstacle for obstacle in scene.obstacles if obstacle not in scene.kinds]
    if missing:
        raise ValueError(
            f"obstacle {missing[0]!r} has no kind: give it one in kinds, which decides who can"
            " destroy it"
        )

    # Every name stands for one thing, and is one word of PDDL.
    groups = (
        scene.areas,
        scene.obstacles,
        dict.fromkeys([*scene.kinds.values(), *scene.abilities]),
        (AGENT,),
    )
    names = [name for group in groups for name in group]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(
            f"{twice!r} names two things of the scene: give areas, obstacles and kinds different"
            " names"
        )
    broken = next(
        (name for name in names if name.split() != [name.lower()] or set(name) & set("();?")), None
    )
    if broken is not None:
        raise ValueError(
            f"{broken!r} is no PDDL name: use one lower-case word without parentheses, ';' and '?'"
        )

    # Only things of the scene are seen.
    unknown = next(
        (name for name in scene.seen_as if name not in (*scene.areas, *scene.obstacles)), None
    )
    if unknown is not None:
        raise ValueError(
            f"{unknown!r} is seen but is no area or obstacle of the scene: take it out of seen_as"
        )
