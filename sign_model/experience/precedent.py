"""A precedent: one solved task, stored so that other objects may play its roles. It becomes a sign
whose image is the sequence of acts and whose personal meaning is what the plan needs and brings
about (PY16 §3.1).
"""

import dataclasses
import functools
from collections.abc import Iterator, Sequence

import numpy as np

from sign_model.experience.renaming import Atom, colours, rename
from sign_model.pddl.lifted import Domain
from sign_model.pddl.planning_task import PlanningTask
from sign_model.signs.from_tasks import act_name, fact_name
from sign_model.signs.sign import Sign, causal, sequence
from sign_model.signs.world_model import WorldModel


@dataclasses.dataclass(frozen=True)
class Precedent:
    """One solved task.

    domain: names and arities of the predicates and schemas; a precedent is only tried on tasks of
      the same domain.
    objects: (name, types) of each object.
    constants: the objects that no other object may stand for.
    start, goal: all atoms; a negative goal begins with "not", the value of a cost function ends
      with `=value`.
    plan: ground actions.
    needs: the atoms of the start that the plan relies on.
    gives: the atoms that the plan has brought about at its end.
    """

    domain: str
    objects: tuple[tuple[str, tuple[str, ...]], ...]
    constants: tuple[str, ...]
    start: frozenset[Atom]
    goal: frozenset[Atom]
    plan: tuple[Atom, ...] = ()
    needs: frozenset[Atom] = frozenset()
    gives: frozenset[Atom] = frozenset()

    @functools.cached_property
    def colours(self) -> dict[str, str]:
        """The colour of each object, equal for objects that a renaming of the whole task could
        exchange.
        """
        fixed = {
            name: (*types, f"constant {name}")
            for name, types in self.objects
            if name in self.constants
        }
        return colours({**dict(self.objects), **fixed}, {"start": self.start, "goal": self.goal})

    @functools.cached_property
    def fingerprint(self) -> tuple:
        """Equal for tasks that differ only in the names of their objects; tasks with different
        fingerprints differ in more.
        """
        return (self.domain, len(self.start), len(self.goal), *sorted(self.colours.values()))


def precedent_of(task: PlanningTask, actions: Sequence[str]) -> Precedent:
    """Returns the precedent of a solved task; `actions` must be a valid plan of it."""
    plan = tuple(_parse(action) for action in actions)
    needs, gives = _footprint(task, plan)
    return dataclasses.replace(without_plan(task), plan=plan, needs=needs, gives=gives)


def without_plan(task: PlanningTask) -> Precedent:
    """Returns a task in the form of a precedent, without a plan."""
    if task.domain is None or task.problem is None:
        # A task from arrays has no objects that could be renamed, so the rules themselves must
        # agree.
        rules = np.concatenate(
            [part.ravel() for part in (task.conditions, task.adds, task.deletes)]
        )
        return Precedent(
            domain=f"{task.features} {task.actions} {np.packbits(rules).tobytes().hex()}",
            objects=(),
            constants=(),
            start=frozenset(atom for atom, holds in zip(task.features, task.start) if holds),
            goal=frozenset(atom for atom, holds in zip(task.features, task.goal) if holds),
        )
    # The values of cost functions belong to the start.
    domain, problem = task.domain, task.problem
    costs = (
        {(*function, f"={value}") for function, value in problem.values.items()}
        if problem.counts_costs
        else set()
    )
    return Precedent(
        domain=domain_name(domain),
        objects=tuple(problem.objects.items()),
        constants=tuple(domain.constants),
        start=problem.start | costs,
        goal=frozenset(problem.goal) | {("not", *atom) for atom in problem.negative_goal},
    )


def domain_name(domain: Domain) -> str:
    """Returns what identifies a domain: its name, and its predicates and schemas with their
    numbers of roles.
    """
    parts = [f"{name}/{len(roles)}" for name, roles in domain.predicates.items()]
    parts += [f"{schema.name}({len(schema.roles)})" for schema in domain.schemas]
    return " ".join([domain.name, *parts])


def require_one_domain(tasks: Sequence[PlanningTask]) -> str:
    """Returns what identifies the domain of some tasks, at least one.

    Raises:
      ValueError: they are of several domains, or one was made from arrays and has none.
    """
    names = {None if task.domain is None else domain_name(task.domain) for task in tasks}
    if None in names:
        raise ValueError("a task made from arrays has no roles to learn from: load it from PDDL")
    if len(names) != 1:
        raise ValueError(
            f"the tasks are of {len(names) or 'no'} domains: give tasks of one domain, whose"
            " predicates and actions have the same names"
        )
    return str(names.pop())


def _footprint(
    task: PlanningTask, plan: tuple[Atom, ...]
) -> tuple[frozenset[Atom], frozenset[Atom]]:
    """Returns the atoms of the start that a valid plan relies on, and the atoms that it has brought
    about at its end.
    """
    needs: set[Atom] = set()
    gives: set[Atom] = set()
    for conditions, adds, deletes in _rules(task, plan):
        needs |= conditions - gives
        gives = (gives - deletes) | adds
    return frozenset(needs), frozenset(gives)


def _rules(
    task: PlanningTask, plan: tuple[Atom, ...]
) -> Iterator[tuple[set[Atom], set[Atom], set[Atom]]]:
    """Yields (conditions, adds, deletes) of each action of a plan, static conditions among them."""
    # A task from arrays: the rules are rows of its matrices.
    if task.domain is None:
        number_of = {action: number for number, action in enumerate(task.actions)}
        for action in plan:
            rule = (part[number_of[action]] for part in (task.conditions, task.adds, task.deletes))
            conditions, adds, deletes = (
                {task.features[feature] for feature in np.flatnonzero(bits)} for bits in rule
            )
            yield conditions, adds, deletes
        return

    # Else they are the schemas with their roles replaced by the arguments.
    schemas = {schema.name: schema for schema in task.domain.schemas}
    for name, *arguments in plan:
        schema = schemas[name]
        object_of = dict(zip((role for role, _ in schema.roles), arguments))
        conditions, adds, deletes = (
            {rename(atom, object_of) for atom in atoms}
            for atoms in (schema.conditions, schema.adds, schema.deletes)
        )
        yield conditions, adds, deletes


def precedent_sign(precedent: Precedent, name: str) -> Sign:
    """Returns the precedent as a sign called `name`: its image is the sequence of acts, its
    personal meaning a causal matrix of what the plan needs and brings about.
    """
    plan = sequence(*(act_name(action) for action in precedent.plan))
    return Sign(
        name,
        image=(plan,),
        meaning=(causal(map(fact_name, precedent.needs), map(fact_name, precedent.gives)),),
    )


def with_precedent(model: WorldModel, precedent: Precedent, name: str) -> WorldModel:
    """Returns the world model of a task extended by a precedent: a sign called `name`, and
    elementary signs for the static facts that it needs.

    In a flow of acts, recognition then reports when the plan is being followed, and `expectation`
    (`signs.recognition`) which act comes next.
    """
    sign = precedent_sign(precedent, name)
    features = frozenset().union(*(matrix.features for _, matrix in sign))
    return model.with_signs((*map(Sign, sorted(features - set(model.names))), sign))


def _parse(action: str) -> Atom:
    """Returns an action, `(stack a b)`, as a tuple of words."""
    return tuple(action.strip().strip("()").lower().split())
