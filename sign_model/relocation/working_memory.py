"""Working memory for smart relocation: a few slots for areas and obstacles, with prediction
matrices that are grounded once (PY16 §3.1).

An agent attends to little at one moment: the obstacles on one contour, or the few that must be
destroyed. So all scenes of one form share their actions, and differ in what holds: which slots are
filled, of what kind the obstacles are, where the goal is. The actions are those of the planning
domain (`domain.DOMAIN`), grounded over the slots. Here the facts that no action changes
(`blocked-by`, `of-kind`, ...) stay among the conditions, so that a situation can say which of them
hold. What "I" can destroy is read from the personal meanings of the sign `i`.
"""

import dataclasses
import functools
from collections.abc import Collection

import numpy as np

from sign_model.map_algorithm.regression import RegressionSpace, regression_space
from sign_model.pddl.grounding import ground
from sign_model.pddl.lifted import Atom, Schema
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.reader import parse
from sign_model.relocation.domain import AGENT, DOMAIN, Scene, abilities_of, problem_text, with_self
from sign_model.signs.from_tasks import act_name, fact_name, world_model_of
from sign_model.signs.matrix import ColumnKind
from sign_model.signs.world_model import WorldModel

BREAKABLE, INDESTRUCTIBLE = "breakable", "indestructible"
"""The kinds of obstacles that the grid level distinguishes."""


@dataclasses.dataclass(frozen=True, eq=False)
class WorkingMemory:
    """A form of scenes: everything that may hold in working memory, and the actions over it.

    num_slots: the most obstacles it holds.
    model: the signs.
    task: the scene in which everything holds that may hold.
    space: the matrices that MAP regresses on; their conditions include what no action changes.
    """

    num_slots: int
    model: WorldModel
    task: PlanningTask
    space: RegressionSpace

    def situation(self, *atoms: Atom) -> np.ndarray:
        """Returns the atoms as a situation over the features of `space`, bool [F]; atoms that are
        no feature of it are left out.
        """
        return np.array([feature in atoms for feature in self.space.features], bool)

    def about(self, name: str, *, except_for: str) -> np.ndarray:
        """Returns the features that name an obstacle and that no action changes, bool [F], except
        those of one predicate.
        """
        changes = (self.space.adds | self.space.deletes).any(axis=0)
        is_about = [name in feature and feature[0] != except_for for feature in self.space.features]
        return np.array(is_about, bool) & ~changes

    def task_of(self, start: Collection[Atom], goal: Collection[Atom]) -> PlanningTask:
        """Returns the planning task from one situation to another; my abilities hold even if
        `start` does not name them.
        """
        situation = self.task.situation(
            [*start, *(self.space.features[number] for number in np.flatnonzero(self.abilities))]
        )
        return dataclasses.replace(
            self.task,
            start=situation,
            goal=self.task.situation(list(goal)),
            problem=None,
            domain=None,
        )

    @functools.cached_property
    def abilities(self) -> np.ndarray:
        """What "I" can destroy, as features that hold in every situation, bool [F]."""
        return self.situation(
            *(("can-destroy", AGENT, kind) for kind in sorted(abilities_of(self.model)))
        )

    @property
    def actions(self) -> tuple[Atom, ...]:
        """The actions of `space`, (schema, argument, ...) each."""
        return tuple(self.task.actions[number] for number in self.space.kept_actions)


def area(number: int | str) -> str:
    """Returns the name of an area."""
    return f"area-{number}"


def slot(number: int | str) -> str:
    """Returns the name of an obstacle in working memory."""
    return f"obstacle-{number}"


@functools.cache
def contour_memory(num_slots: int, abilities: Collection[str] = (BREAKABLE,)) -> WorkingMemory:
    """Returns the working memory of one contour: area 0, where I am, area 1, which holds the goal,
    and obstacles between the two.

    Each obstacle is assumed to be all that blocks: what lies behind it is not known yet.

    Args:
      num_slots: the most obstacles.
      abilities: the kinds that "I" can destroy.
    """
    return _working_memory(
        [(area(0), area(1))],
        [(area(0), area(1), slot(number)) for number in range(num_slots)],
        abilities,
    )


@functools.cache
def chain_memory(num_slots: int, abilities: Collection[str] = (BREAKABLE,)) -> WorkingMemory:
    """Returns the working memory of a chain: area after area, with one obstacle between each two.

    Args:
      num_slots: the most obstacles.
      abilities: the kinds that "I" can destroy.
    """
    pairs = [(area(number), area(number + 1)) for number in range(num_slots)]
    return _working_memory(
        pairs, [(*pair, slot(number)) for number, pair in enumerate(pairs)], abilities
    )


def _working_memory(
    ways: list[tuple[str, str]], blocked: list[tuple[str, str, str]], abilities: Collection[str]
) -> WorkingMemory:
    """Returns the working memory of the areas and obstacles that these ways and blocked ways
    name."""
    # The planning task and its signs; the rules are read back from the signs.
    kinds = {obstacle: BREAKABLE for *_, obstacle in blocked}
    scene = Scene(ways[0][0], ways[-1][1], tuple(ways), tuple(blocked), kinds, tuple(abilities))
    task = _everything(scene, (BREAKABLE, INDESTRUCTIBLE))
    model = with_self(world_model_of(task), abilities)
    task = _from_signs(task, model)
    # The matrices of the regression: a goal may be in any area.
    goals = np.stack([task.situation([("at", AGENT, name)]) for name in scene.areas])
    return WorkingMemory(len(blocked), model, task, regression_space(task, goals=goals))


def _everything(scene: Scene, kinds: Collection[str]) -> PlanningTask:
    """Returns the ground task of a scene in which any obstacle may be of any kind; facts that never
    change are features too.
    """
    # Ground the problem in which every obstacle is of every kind and I can destroy them all.
    domain, problem = parse(DOMAIN, problem_text(scene))
    facts = {("of-kind", obstacle, kind) for obstacle in scene.obstacles for kind in kinds}
    facts |= {("can-destroy", AGENT, kind) for kind in kinds}
    objects = problem.objects | dict.fromkeys(kinds, ("kind",))
    problem = dataclasses.replace(problem, objects=objects, start=problem.start | facts)
    task = ground(domain, problem)

    # Grounding leaves out conditions that never change: add them as features and conditions.
    fluents = {atom[0] for schema in domain.schemas for atom in schema.adds + schema.deletes}
    schemas = {schema.name: schema for schema in domain.schemas}
    statics = [_static_conditions(schemas[action[0]], action, fluents) for action in task.actions]
    features = tuple(sorted(set(task.features).union(*statics)))
    place = np.array([features.index(atom) for atom in task.features])

    def widen(rows: np.ndarray) -> np.ndarray:
        wider = np.zeros((*rows.shape[:-1], len(features)), bool)
        wider[..., place] = rows
        return wider

    conditions = widen(task.conditions) | np.array(
        [[atom in static for atom in features] for static in statics], bool
    )
    start = widen(task.start) | np.array([atom in problem.start for atom in features], bool)
    rest = {"adds": widen(task.adds), "deletes": widen(task.deletes), "goal": widen(task.goal)}
    return dataclasses.replace(
        task, features=features, conditions=conditions, start=start, problem=problem, **rest
    )


def _static_conditions(schema: Schema, action: Atom, fluents: Collection[str]) -> set[Atom]:
    """Returns the conditions of a ground action that no action changes."""
    filled = {role: thing for (role, _), thing in zip(schema.roles, action[1:], strict=True)}
    return {
        (atom[0], *(filled.get(x, x) for x in atom[1:]))
        for atom in schema.conditions
        if atom[0] not in fluents
    }


def _from_signs(task: PlanningTask, model: WorldModel) -> PlanningTask:
    """Returns the task with its rules (FC, FA, FD) read from the personal meanings of its acts."""
    of_name = {sign.name: sign for sign in model.signs()}
    number = {fact_name(atom): place for place, atom in enumerate(task.features)}
    kinds = {
        "conditions": ColumnKind.CONDITION,
        "adds": ColumnKind.ADDS,
        "deletes": ColumnKind.DELETES,
    }
    rules = {part: np.zeros_like(task.conditions) for part in kinds}
    for row, action in enumerate(task.actions):
        (meaning,) = of_name[act_name(action)].meaning
        for part, kind in kinds.items():
            rules[part][row, [number[name] for name in meaning.named(kind)]] = True
    return dataclasses.replace(task, **rules)
