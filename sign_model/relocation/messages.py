"""A coalition on the symbolic level: several agents, their abilities, and messages between them
(PY16 §2, and its [18]).

The same scene in two forms: plain typed STRIPS, which any planner can check, and signs. Each agent
has a chain of areas of its own, from its start to its last place; between two areas lies an
obstacle that has to be gone, and the agent passes once it knows that it is. Whoever is asked for an
obstacle, stands beside it and is able to destroys it and knows so; messages carry requests and
knowledge from one agent to another.

In the world model of one agent the sign "i" means what I can do, the sign "they" what the others
can; a message is a sign whose image names who speaks, to whom, and about what.
"""

import dataclasses
from collections.abc import Mapping

from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import PlanningTask
from sign_model.relocation.domain import DESTROY
from sign_model.signs.from_tasks import world_model_of
from sign_model.signs.sign import Sign, sequence
from sign_model.signs.world_model import WorldModel, from_signs

I, THEY = "i", "they"  # noqa: E741

COALITION_DOMAIN = """(define (domain coalition-relocation)
  (:requirements :strips :typing)
  (:types agent area obstacle - object)
  (:predicates
    (at ?a - agent ?p - area)
    (blocked-by ?p ?q - area ?o - obstacle)
    (way ?p ?q - area)
    (borders ?o - obstacle ?p - area)
    (beside ?a - agent ?o - obstacle ?p - area)
    (can-destroy ?a - agent ?o - obstacle)
    (wants ?a - agent ?o - obstacle)
    (asked ?a - agent ?o - obstacle)
    (knows ?a - agent ?o - obstacle))
  (:action relocate
    :parameters (?a - agent ?p ?q - area)
    :precondition (and (at ?a ?p) (way ?p ?q))
    :effect (and (at ?a ?q) (not (at ?a ?p))))
  (:action pass
    :parameters (?a - agent ?p ?q - area ?o - obstacle)
    :precondition (and (at ?a ?p) (blocked-by ?p ?q ?o) (knows ?a ?o))
    :effect (and (at ?a ?q) (not (at ?a ?p))))
  (:action approach
    :parameters (?a - agent ?o - obstacle ?p - area)
    :precondition (and (at ?a ?p) (borders ?o ?p))
    :effect (and (beside ?a ?o ?p) (not (at ?a ?p))))
  (:action destroy
    :parameters (?a - agent ?o - obstacle ?p - area)
    :precondition (and (beside ?a ?o ?p) (can-destroy ?a ?o) (asked ?a ?o))
    :effect (and (knows ?a ?o) (at ?a ?p) (not (beside ?a ?o ?p))))
  (:action ask
    :parameters (?a ?b - agent ?o - obstacle)
    :precondition (and (wants ?a ?o) (can-destroy ?b ?o))
    :effect (asked ?b ?o))
  (:action tell
    :parameters (?b ?a - agent ?o - obstacle)
    :precondition (and (knows ?b ?o) (wants ?a ?o))
    :effect (knows ?a ?o)))
"""


@dataclasses.dataclass(frozen=True)
class CoalitionScene:
    """What is known of a coalition's task on the symbolic level. Names are lower-case words.

    chains: for each agent the obstacles on its way, in order: between the areas `area_name(agent,
      j)` and the next lies chains[agent][j], None where the way is open.
    beside: for each agent the obstacles that it can come beside, each with the number of the area.
    abilities: for each agent the obstacles that it is able to destroy.
    goals: the agents that have to reach the end of their chain.
    """

    chains: Mapping[str, tuple[str | None, ...]]
    beside: Mapping[str, tuple[tuple[str, int], ...]]
    abilities: Mapping[str, tuple[str, ...]]
    goals: tuple[str, ...]

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Every obstacle, in order of first mention."""
        ways = [obstacle for chain in self.chains.values() for obstacle in chain if obstacle]
        ends = [obstacle for pairs in self.beside.values() for obstacle, _ in pairs]
        return tuple(dict.fromkeys([*ways, *ends]))

    def wants(self, agent: str) -> tuple[str, ...]:
        """The obstacles that an agent needs gone."""
        return tuple(dict.fromkeys(obstacle for obstacle in self.chains[agent] if obstacle))


def area_name(agent: str, number: int) -> str:
    """Returns the name of an area on an agent's way."""
    return f"{agent}-area-{number}"


def coalition_problem(scene: CoalitionScene, name: str = "scene") -> str:
    """Returns the scene as a PDDL problem of `COALITION_DOMAIN`.

    An agent that wants an obstacle gone and is able to destroy it is asked by itself.
    """
    agents, facts = tuple(scene.chains), []
    areas = [
        area_name(agent, number)
        for agent in agents
        for number in range(len(scene.chains[agent]) + 1)
    ]
    for agent in agents:
        facts.append(("at", agent, area_name(agent, 0)))
        for number, obstacle in enumerate(scene.chains[agent]):
            ends = area_name(agent, number), area_name(agent, number + 1)
            for pair in (ends, ends[::-1]):
                facts.append(("blocked-by", *pair, obstacle) if obstacle else ("way", *pair))
        wants = scene.wants(agent)
        facts += [("wants", agent, obstacle) for obstacle in wants]
        facts += [("asked", agent, o) for o in wants if o in scene.abilities[agent]]
        facts += [("borders", o, area_name(agent, number)) for o, number in scene.beside[agent]]
        facts += [("can-destroy", agent, o) for o in scene.abilities[agent] if o in scene.obstacles]
    ends = [("at", a, area_name(a, len(scene.chains[a]))) for a in scene.goals]
    lines = "\n    ".join(f"({' '.join(fact)})" for fact in dict.fromkeys(facts))
    objects = f"{' '.join(agents)} - agent {' '.join(areas)} - area"
    if scene.obstacles:
        objects += f" {' '.join(scene.obstacles)} - obstacle"
    goal = " ".join(f"({' '.join(end)})" for end in ends)
    return (
        f"(define (problem {name})\n  (:domain coalition-relocation)\n  (:objects {objects})\n"
        f"  (:init\n    {lines})\n  (:goal (and {goal})))\n"
    )


def coalition_task(scene: CoalitionScene) -> PlanningTask:
    """Returns the scene as a planning task."""
    return load(COALITION_DOMAIN, coalition_problem(scene))


def coalition_signs(scene: CoalitionScene, agent: str, messages: tuple = ()) -> WorldModel:
    """Returns what one agent knows as signs: those of the planning task, "i", "they" and messages.

    Args:
      scene: what all know.
      agent: who "i" is.
      messages: (act, speaker, listener, obstacle), act "ask" or "tell", in the order of the plan.
    """
    others = [other for other in scene.chains if other != agent]

    def meanings(who: str, *also: str) -> tuple:
        known = [o for o in scene.abilities[who] if o in scene.obstacles]
        return tuple(sequence({*also, DESTROY, obstacle}) for obstacle in known)

    signs = {sign.name: sign for sign in world_model_of(coalition_task(scene)).signs()}
    missing = {name for name in (DESTROY, *scene.obstacles) if name not in signs}
    signs |= {name: Sign(name) for name in sorted(missing)}
    signs[I] = Sign(I, image=(sequence({agent}),), meaning=meanings(agent))
    signs[THEY] = Sign(
        THEY,
        image=tuple(sequence({other}) for other in others),
        meaning=tuple(matrix for other in others for matrix in meanings(other, other)),
    )
    for act, speaker, listener, obstacle in messages:
        name = f"message {act} {speaker} {listener} {obstacle}"
        signs[name] = Sign(name, image=(sequence(speaker, f"action {act}", listener, obstacle),))
    return from_signs(signs.values())
