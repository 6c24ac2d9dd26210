"""Planning tasks become signs, and signs the matrices of the search again (PY16 §3.1).

An action schema is a script: its significance holds the roles of the action instead of objects. A
ground action is that script with its roles assigned, an entry of the schema's personal meaning.

- object `a`: sign `a`, elementary.
- type `block`: sign `type block`. Significance: one matrix for each object and each subtype.
- predicate `on`: sign `predicate on`. Significance: the types of its roles, in order of position.
- fact `(on a b)`: sign `(on a b)`. Image: the predicate, then each argument in its place.
- action schema `stack`: sign `action stack`. Significance: the script, which is its roles, then
  conditions => adds, deletes. Personal meaning: one matrix for each ground action.
- role `?x` of `stack`: sign `role stack ?x`. Significance: the types that may fill it.
- atom of a script: sign `script stack (on ?x ?y)`. Image: the predicate, then each role in its
  place.
- ground action: sign `act (stack a b)`. Image: the schema, then each argument in its place.
  Personal meaning: the causal matrix (FC, FA, FD).
- start and goal: signs `situation start` and `situation goal`. Personal meaning: the facts that
  hold.

Places are columns, so an argument may occur in several. A negated atom begins with `predicate not`.
No two names are equal: PDDL names contain neither blanks nor parentheses, and the first word of a
name tells its kind. Costs are not signs and stay with the task.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sign_model.pddl.lifted import Atom, Domain, Problem, Schema
from sign_model.pddl.planning_task import PlanningTask
from sign_model.signs.matrix import ColumnKind, Component, features_of, select
from sign_model.signs.sign import PredictionMatrix, Sign, causal, sequence, with_elementary
from sign_model.signs.world_model import WorldModel, from_signs

START, GOAL = "situation start", "situation goal"


class TaskMatrices(NamedTuple):
    """The matrices of a planning task, read from a world model; fields and shapes are those of
    `PlanningTask`.
    """

    features: tuple[Atom, ...]
    actions: tuple[Atom, ...]
    conditions: np.ndarray
    adds: np.ndarray
    deletes: np.ndarray
    start: np.ndarray
    goal: np.ndarray


def world_model_of(task: PlanningTask) -> WorldModel:
    """Returns the signs of a planning task, by the list above; `task_matrices` reads the matrices
    of the task back.

    A task made from arrays has no lifted form: its signs have only images and personal meanings.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> model = sign_model.world_model_of(task)
      >>> sign_model.describe(model).splitlines()[0]
      'World model of 17 signs with 20 prediction matrices; links: 9 in W_p, 4 in W_m, 8 in W_a.'
    """
    lifted = (
        ()
        if task.domain is None or task.problem is None
        else _lifted_signs(task.domain, task.problem)
    )
    facts = tuple(Sign(fact_name(atom), image=(_image(atom),)) for atom in task.features)
    situations = (
        Sign(START, meaning=(_situation(task, task.start),)),
        Sign(GOAL, meaning=(_situation(task, task.goal),)),
    )
    schemas = _with_meanings(lifted, task.actions)
    return from_signs(with_elementary((*schemas, *facts, *_acts(task), *situations)))


def task_matrices(model: WorldModel) -> TaskMatrices:
    """Returns features, actions, (FC, FA, FD), start and goal of the world model of a task, equal
    bit for bit to those of the task.
    """
    # The signs of facts, and the owners of the causal matrices and of the two situations.
    facts = [number for number, name in enumerate(model.names) if name.startswith("(")]
    acts = [number for number, name in enumerate(model.names) if name.startswith("act ")]
    owners = [*acts, model.index(START), model.index(GOAL)]
    # Selected first: dense rows for all slots of a large task would take hundreds of megabytes.
    table = select(model.matrices, _meaning_slots(model)[owners])
    kinds = (ColumnKind.CONDITION, ColumnKind.ADDS, ColumnKind.DELETES)
    conditions, adds, deletes = (np.asarray(features_of(table, kind))[:, facts] for kind in kinds)
    return TaskMatrices(
        features=tuple(_atom(model.names[number]) for number in facts),
        actions=tuple(_atom(model.names[number].removeprefix("act ")) for number in acts),
        conditions=conditions[:-2],
        adds=adds[:-2],
        deletes=deletes[:-2],
        start=conditions[-2],
        goal=conditions[-1],
    )


def fact_name(atom: Atom) -> str:
    """Returns the name of the sign of a fact, `(on a b)`."""
    return f"({' '.join(atom)})"


def act_name(action: Atom) -> str:
    """Returns the name of the sign of a ground action, `act (stack a b)`."""
    return f"act {fact_name(action)}"


def _atom(name: str) -> Atom:
    """Returns the inverse of `fact_name`."""
    return tuple(name[1:-1].split(" "))


def _meaning_slots(model: WorldModel) -> np.ndarray:
    """Returns the slot of the first personal meaning of each sign, int [S]; N where it has none."""
    owner = np.where(
        np.asarray(model.matrices.component) == Component.MEANING, model.matrices.owner, -1
    )
    slots = np.full(model.matrices.is_sign.shape[0], len(owner))
    used = np.flatnonzero(owner >= 0)[::-1]
    slots[owner[used]] = used
    return slots


def _image(atom: Atom, schema: str | None = None) -> PredictionMatrix:
    """Returns the image of an atom: the predicate, then what fills its places; roles `?x` are those
    of `schema`.
    """
    predicate, *places = atom
    if predicate == "not" and places:
        return PredictionMatrix(
            sequence("predicate not").columns + _image(tuple(places), schema).columns
        )
    return sequence(
        f"predicate {predicate}",
        *(f"role {schema} {x}" if x.startswith("?") else x for x in places),
    )


def _situation(task: PlanningTask, holds: np.ndarray) -> PredictionMatrix:
    """Returns the matrix of a situation, bool [F]: one column with all facts that hold."""
    facts = [fact_name(task.features[feature]) for feature in np.flatnonzero(holds)]
    return sequence(facts) if facts else sequence()


def _acts(task: PlanningTask) -> Iterator[Sign]:
    """Yields the sign of each ground action."""
    names = [fact_name(atom) for atom in task.features]
    for number, action in enumerate(task.actions):
        rule = (
            [names[feature] for feature in np.flatnonzero(part[number])]
            for part in (task.conditions, task.adds, task.deletes)
        )
        yield Sign(
            act_name(action),
            image=(sequence(f"action {action[0]}", *action[1:]),),
            meaning=(causal(*rule),),
        )


def _with_meanings(lifted: tuple[Sign, ...], actions: tuple[Atom, ...]) -> Iterator[Sign]:
    """Yields the lifted signs, each schema with its ground actions as personal meanings. A schema
    without a lifted sign (of a task from arrays) becomes a sign with personal meanings only.
    """
    acts: dict[str, list[PredictionMatrix]] = {}
    for action in actions:
        acts.setdefault(f"action {action[0]}", []).append(sequence(act_name(action)))
    for sign in lifted:
        yield Sign(sign.name, sign.image, sign.significance, tuple(acts.pop(sign.name, ())))
    for name, meanings in acts.items():
        yield Sign(name, meaning=tuple(meanings))


def _lifted_signs(domain: Domain, problem: Problem) -> tuple[Sign, ...]:
    """Returns the signs of objects, types, predicates and schemas."""
    objects = tuple(Sign(name) for name in problem.objects)
    types = tuple(_type_sign(kind, domain, problem) for kind in _types(domain, problem))
    predicates = tuple(
        Sign(f"predicate {name}", significance=(sequence(*map(_type_names, roles)),))
        for name, roles in domain.predicates.items()
    )
    scripts = tuple(sign for schema in domain.schemas for sign in _schema_signs(schema))
    return (*objects, *types, *predicates, *scripts)


def _types(domain: Domain, problem: Problem) -> list[str]:
    """Returns every type that domain or problem name, each once."""
    declared = [kind for kinds in problem.objects.values() for kind in kinds]
    parents = [parent for parents in domain.types.values() for parent in parents]
    return list(dict.fromkeys(["object", *domain.types, *parents, *declared]))


def _type_sign(kind: str, domain: Domain, problem: Problem) -> Sign:
    """Returns the sign of a type, with its direct subtypes and its objects as significance."""
    subtypes = [
        f"type {name}" for name, parents in domain.types.items() if kind in parents and name != kind
    ]
    objects = [name for name, kinds in problem.objects.items() if kind in (kinds or ("object",))]
    return Sign(f"type {kind}", significance=tuple(map(sequence, (*subtypes, *objects))))


def _type_names(kinds: tuple[str, ...]) -> list[str]:
    """Returns the names of the signs of some types; `object` if there is none."""
    return [f"type {kind}" for kind in kinds or ("object",)]


def _schema_signs(schema: Schema) -> Iterator[Sign]:
    """Yields the sign of a schema, then those of its roles, then those of the atoms of its
    script."""
    # All conditions as atoms: positive, negative, and equalities.
    negated = [("not", *atom) for atom in schema.negative_conditions]
    equal = [
        ("=", one, other) if wanted else ("not", "=", one, other)
        for one, other, wanted in schema.equalities
    ]
    conditions = (*schema.conditions, *negated, *equal)

    def script_names(atoms: tuple[Atom, ...]) -> list[str]:
        return [f"script {schema.name} {fact_name(atom)}" for atom in atoms]

    # The script: the roles one after the other, then the rule.
    roles = sequence(*(f"role {schema.name} {role}" for role, _ in schema.roles))
    rule = causal(*map(script_names, (conditions, schema.adds, schema.deletes)))
    yield Sign(
        f"action {schema.name}", significance=(PredictionMatrix(roles.columns + rule.columns),)
    )

    # What the script is made of.
    for role, kinds in schema.roles:
        yield Sign(f"role {schema.name} {role}", significance=(sequence(_type_names(kinds)),))
    for atom in dict.fromkeys((*conditions, *schema.adds, *schema.deletes)):
        yield Sign(f"script {schema.name} {fact_name(atom)}", image=(_image(atom, schema.name),))
