"""Lifted task -> `PlanningTask`: roles filled by joins over static facts, negation compiled away,
the reachable kept.

Atoms are integer rows of object numbers while the roles are filled: a static condition is a table,
joined to the table of partial bindings, so that bindings that break a static condition never exist.
"""

import pathlib
import time
from collections import defaultdict

import numpy as np

from sign_model.pddl.lifted import Atom, Domain, Problem, Schema
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.reader import parse


def load(domain: str | pathlib.Path, problem: str | pathlib.Path) -> PlanningTask:
    """Returns the grounded task of a PDDL domain and problem, given as paths or text; PddlError
    names file and line.

    A goal that nothing can bring about stays in the task as a feature without achiever: the task is
    then unsolvable, not wrong.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> task.actions
      (('push',), ('walk',))
    """
    began = time.perf_counter()
    lifted = parse(domain, problem)
    parsed = time.perf_counter()
    task = ground(*lifted)
    task.seconds.update(parse=parsed - began, ground=time.perf_counter() - parsed)
    return task


def ground(domain: Domain, problem: Problem) -> PlanningTask:
    """Returns the grounded task of a lifted one."""
    fluents = {atom[0] for schema in domain.schemas for atom in schema.adds + schema.deletes}
    actions = [
        action
        for schema in domain.schemas
        for action in _ground_schema(schema, domain, problem, fluents)
    ]
    negated = {atom for action in actions for atom in action.negative} | {
        a for a in problem.negative_goal if a[0] in fluents
    }
    for action in actions:
        action.complete(negated)
    start = {atom for atom in problem.start if atom[0] in fluents} | {
        _complement(a) for a in negated if a not in problem.start
    }
    goal = {atom for atom in problem.goal if atom[0] in fluents or atom not in problem.start}
    goal |= {_complement(a) for a in problem.negative_goal if a[0] in fluents or a in problem.start}
    actions, reached = _reachable(actions, start)
    return _as_matrices(domain, problem, actions, reached | goal, start, goal)


def _complement(atom: Atom) -> Atom:
    return ("not", *atom)


class _Ground:
    """A ground action while the task is built: sets of atoms."""

    def __init__(self, schema: Schema, env: dict[str, str], cost: int, fluents: set[str]) -> None:
        def filled(atoms: tuple[Atom, ...]) -> set[Atom]:
            return {(atom[0], *(env.get(x, x) for x in atom[1:])) for atom in atoms}

        self.name = (schema.name, *(env[role] for role, _ in schema.roles))
        self.conditions = {atom for atom in filled(schema.conditions) if atom[0] in fluents}
        self.negative = {atom for atom in filled(schema.negative_conditions) if atom[0] in fluents}
        self.adds = filled(schema.adds)
        self.deletes = filled(schema.deletes) - self.adds
        self.cost = cost

    def complete(self, negated: set[Atom]) -> None:
        """Negative conditions become conditions on complements, which effects keep in step."""
        if negated:
            self.conditions |= {_complement(atom) for atom in self.negative}
            complements_added = {_complement(atom) for atom in self.deletes & negated}
            self.deletes |= {_complement(atom) for atom in self.adds & negated}
            self.adds |= complements_added


def _ground_schema(
    schema: Schema, domain: Domain, problem: Problem, fluents: set[str]
) -> list[_Ground]:
    roles = [role for role, _ in schema.roles]
    actions = []
    for binding in _bindings(schema, domain, problem, fluents):
        env = dict(zip(roles, binding))
        actions.append(_Ground(schema, env, _cost(schema, env, problem), fluents))
    return actions


def _cost(schema: Schema, env: dict[str, str], problem: Problem) -> int:
    if not problem.counts_costs:
        return 1
    terms = schema.costs or ()
    return sum(
        t if isinstance(t, int) else problem.values.get((t[0], *(env.get(x, x) for x in t[1:])), 0)
        for t in terms
    )


def _bindings(
    schema: Schema, domain: Domain, problem: Problem, fluents: set[str]
) -> list[tuple[str, ...]]:
    """All ways to fill the roles that types, equalities and static conditions permit, in the order
    of the objects.
    """
    names = list(problem.objects)
    number = {name: i for i, name in enumerate(names)}
    fits = {
        role: np.array([domain.is_a(given, kinds) for given in problem.objects.values()], bool)
        for role, kinds in schema.roles
    }
    static = [atom for atom in schema.conditions if atom[0] not in fluents]
    bound: list[str] = []
    table = _equal(np.zeros((1, 0), np.int32), bound, schema, number)
    for atom in sorted(static, key=lambda a: -len(set(a[1:]))):
        table, bound = _join(table, bound, *_rows_of(atom, problem, number))
        table = _typed(table, bound, fits)
    for role, _ in schema.roles:
        if role not in bound:
            choices = np.flatnonzero(fits[role]).astype(np.int32)
            table = np.column_stack(
                [np.repeat(table, len(choices), axis=0), np.tile(choices, len(table))]
            ).astype(np.int32)
            bound = [*bound, role]
        table = _equal(table, bound, schema, number)
    table = (
        table[:, [bound.index(role) for role, _ in schema.roles]] if schema.roles else table[:, :0]
    )
    table = table[np.lexsort(table.T[::-1])] if schema.roles else table
    forbidden = [atom for atom in schema.negative_conditions if atom[0] not in fluents]
    roles = [role for role, _ in schema.roles]
    bindings = [tuple(names[i] for i in row) for row in table]
    if forbidden:
        bindings = [b for b in bindings if not _holds_any(forbidden, dict(zip(roles, b)), problem)]
    return bindings


def _holds_any(atoms: list[Atom], env: dict[str, str], problem: Problem) -> bool:
    return any((atom[0], *(env.get(x, x) for x in atom[1:])) in problem.start for atom in atoms)


def _rows_of(atom: Atom, problem: Problem, number: dict[str, int]) -> tuple[np.ndarray, list[str]]:
    """The start's facts that match a static condition, as a table over its variables (constants and
    repetitions tested).
    """
    variables = list(dict.fromkeys(x for x in atom[1:] if x.startswith("?")))
    rows = []
    for fact in problem.start:
        if fact[0] != atom[0]:
            continue
        env: dict[str, str] = {}
        if all(
            y == (env.setdefault(x, y) if x.startswith("?") else x)
            for x, y in zip(atom[1:], fact[1:])
        ):
            rows.append([number[env[v]] for v in variables])
    return np.array(sorted(rows), np.int32).reshape(len(rows), len(variables)), variables


def _join(
    left: np.ndarray, left_names: list[str], right: np.ndarray, right_names: list[str]
) -> tuple[np.ndarray, list[str]]:
    """The natural join of two tables of bindings."""
    shared = [name for name in right_names if name in left_names]
    fresh = [name for name in right_names if name not in left_names]
    keep = [right_names.index(name) for name in fresh]
    groups: dict[tuple[int, ...], list[np.ndarray]] = defaultdict(list)
    for row in right:
        groups[tuple(row[[right_names.index(name) for name in shared]])].append(row[keep])
    at = [left_names.index(name) for name in shared]
    rows = [np.concatenate([row, more]) for row in left for more in groups.get(tuple(row[at]), ())]
    names = left_names + fresh
    return np.array(rows, np.int32).reshape(len(rows), len(names)), names


def _typed(table: np.ndarray, bound: list[str], fits: dict[str, np.ndarray]) -> np.ndarray:
    fit = np.ones(len(table), bool)
    for column, role in enumerate(bound):
        fit &= fits[role][table[:, column]]
    return table[fit]


def _equal(
    table: np.ndarray, bound: list[str], schema: Schema, number: dict[str, int]
) -> np.ndarray:
    """The bindings that keep the equalities whose roles are all bound."""
    for one, other, wanted in schema.equalities:
        sides = [
            table[:, bound.index(x)] if x in bound else number[x]
            for x in (one, other)
            if x in bound or not x.startswith("?")
        ]
        if len(sides) == 2:
            table = table[np.broadcast_to((sides[0] == sides[1]) == wanted, len(table))]
    return table


def _reachable(actions: list[_Ground], start: set[Atom]) -> tuple[list[_Ground], set[Atom]]:
    """The actions and features that can be reached when nothing is ever deleted."""
    waiting: dict[Atom, list[int]] = defaultdict(list)
    missing = [len(action.conditions) for action in actions]
    for i, action in enumerate(actions):
        for atom in action.conditions:
            waiting[atom].append(i)
    reached, new = set(start), list(start)
    ready = [i for i, count in enumerate(missing) if count == 0]
    used = set()
    while ready or new:
        while ready:
            used.add(i := ready.pop())
            fresh = actions[i].adds - reached
            reached |= fresh
            new += fresh
        while new:
            for i in waiting[new.pop()]:
                missing[i] -= 1
                if missing[i] == 0:
                    ready.append(i)
    return [action for i, action in enumerate(actions) if i in used], reached


def _as_matrices(
    domain: Domain,
    problem: Problem,
    actions: list[_Ground],
    atoms: set[Atom],
    start: set[Atom],
    goal: set[Atom],
) -> PlanningTask:
    features = tuple(sorted(atoms))
    index = {atom: i for i, atom in enumerate(features)}

    def matrix(sets: list[set[Atom]]) -> np.ndarray:
        bits = np.zeros((len(sets), len(features)), bool)
        for row, atoms_of in enumerate(sets):
            bits[row, [index[atom] for atom in atoms_of if atom in index]] = True
        return bits

    return PlanningTask(
        features=features,
        actions=tuple(action.name for action in actions),
        conditions=matrix([action.conditions for action in actions]),
        adds=matrix([action.adds for action in actions]),
        deletes=matrix([action.deletes for action in actions]),
        costs=np.array([action.cost for action in actions], np.int32),
        start=matrix([start])[0],
        goal=matrix([goal])[0],
        domain=domain,
        problem=problem,
    )
