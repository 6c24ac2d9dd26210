"""Lifted task -> `PlanningTask`: the ground actions that can ever go, negation compiled away, as
boolean matrices.

Which ground actions those are is found in `reachable`. What must not hold becomes a feature of its
own, ("not", ...), which the effects keep in step. Their number and the size of the matrices are
bounded; where the matrices would be too large, only what some chain of actions can need for the
goal is kept, and no plan is lost by that.
"""

import pathlib
import time
from collections.abc import Iterable

import numpy as np

from sign_model.clock import NO_LIMIT, Clock, OutOfTime
from sign_model.pddl.lifted import Domain, Problem
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.reachable import Binding, Fact, Reachability, Script, Template, TooManyActions
from sign_model.pddl.reader import parse
from sign_model.pddl.sections import MAX_COST
from sign_model.pddl.syntax import PddlError

MAX_ACTIONS = 500_000
"""The most ground actions a task may have."""

MAX_CELLS = 1 << 28
"""The most cells of one matrix, actions times features, one byte each: a task has three."""

_CHECKED_EVERY = 1 << 10


def load(
    domain: str | pathlib.Path, problem: str | pathlib.Path, *, max_seconds: float | None = None
) -> PlanningTask:
    """Returns the grounded task of a PDDL domain and problem, given as paths or text; PddlError
    names file and line.

    A goal that nothing can bring about stays in the task as a feature without achiever: the task is
    then unsolvable, not wrong.

    Args:
      domain, problem: paths, or PDDL text.
      max_seconds: the most time for reading and grounding; unbounded where None.

    Raises:
      PddlError: text that cannot be read, or a task with more than `MAX_ACTIONS` ground actions or
        `MAX_CELLS` cells a matrix.
      OutOfTime: the time limit was reached.

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
    began, clock = time.perf_counter(), Clock(max_seconds)
    parsed = None
    try:
        lifted = parse(domain, problem, clock=clock)
        parsed = time.perf_counter()
        task = ground(*lifted, clock=clock)
    except OutOfTime as error:
        now = time.perf_counter()
        error.seconds = {"parse": (parsed or now) - began, "build": now - (parsed or now)}
        raise
    task.seconds.update(parse=parsed - began, ground=time.perf_counter() - parsed)
    return task


def ground(domain: Domain, problem: Problem, *, clock: Clock = NO_LIMIT) -> PlanningTask:
    """Returns the grounded task of a lifted one; errors as `load`."""
    fluents = {atom[0] for schema in domain.schemas for atom in schema.adds + schema.deletes}
    names = list(problem.objects)
    number = {name: i for i, name in enumerate(names)}
    scripts = [Script(schema, domain, problem, number, fluents) for schema in domain.schemas]

    def facts(atoms: Iterable[tuple[str, ...]]) -> list[Fact]:
        return [(atom[0], *[number[name] for name in atom[1:]]) for atom in atoms]

    start = set(facts(problem.start))
    try:
        reached = Reachability(scripts, start, fluents, MAX_ACTIONS, clock)
    except TooManyActions as error:
        raise PddlError(str(error), file=problem.file) from None

    actions = [
        (script, binding)
        for script, found in zip(scripts, reached.bindings)
        for binding in sorted(found)
    ]
    negated = {
        t.fill(binding) for script, binding in actions if script.negative for t in script.negative
    }
    negated |= {fact for fact in facts(problem.negative_goal) if fact[0] in fluents}
    goal = {fact for fact in facts(problem.goal) if fact[0] in fluents or fact not in start}
    goal |= {_complement(f) for f in facts(problem.negative_goal) if f[0] in fluents or f in start}
    at_start = {fact for fact in start if fact[0] in fluents} | {
        _complement(f) for f in negated if f not in start
    }
    rules = _Rules(actions, fluents, negated, clock)
    features = reached.facts | at_start | goal
    features |= {fact for adds in rules.adds for fact in adds if fact[0] == "not"}
    kept = _bounded(rules, features, goal, problem)
    return _as_matrices(domain, problem, rules, kept, features, at_start, goal, names)


def _complement(fact: Fact) -> Fact:
    return ("not", *fact)


class _Rules:
    """Conditions, adds and deletes of the ground actions as sets of facts, negative conditions
    as complements.
    """

    def __init__(
        self,
        actions: list[tuple[Script, Binding]],
        fluents: set[str],
        negated: set[Fact],
        clock: Clock,
    ) -> None:
        self.actions = actions
        self.conditions: list[set[Fact]] = []
        self.adds: list[set[Fact]] = []
        self.deletes: list[set[Fact]] = []

        def filled(templates: Iterable[Template], binding: Binding) -> set[Fact]:
            return {template.fill(binding) for template in templates}

        for i, (script, binding) in enumerate(actions):
            if not i % _CHECKED_EVERY:
                clock.check()
            conditions = filled((t for t in script.conditions if t.predicate in fluents), binding)
            adds = filled(script.adds, binding)
            deletes = filled(script.deletes, binding) - adds
            if negated:
                conditions |= {_complement(fact) for fact in filled(script.negative, binding)}
                shown = {_complement(fact) for fact in deletes & negated}
                deletes |= {_complement(fact) for fact in adds & negated}
                adds |= shown
            self.conditions.append(conditions)
            self.adds.append(adds)
            self.deletes.append(deletes)


def _bounded(rules: _Rules, features: set[Fact], goal: set[Fact], problem: Problem) -> list[int]:
    """The numbers of the actions to keep, all of them where they fit; takes what is not needed
    out of `features`.
    """
    if len(rules.actions) * len(features) <= MAX_CELLS:
        return list(range(len(rules.actions)))
    achievers: dict[Fact, list[int]] = {}
    for i, adds in enumerate(rules.adds):
        for fact in adds:
            achievers.setdefault(fact, []).append(i)
    needed, waiting, kept = set(goal), list(goal), set()
    while waiting:
        for i in achievers.get(waiting.pop(), ()):
            if i not in kept:
                kept.add(i)
                fresh = rules.conditions[i] - needed
                needed |= fresh
                waiting += fresh
    features &= needed
    if len(kept) * len(features) > MAX_CELLS:
        message = (
            f"{len(kept):,} ground actions with {len(features):,} features, more than {MAX_CELLS:,}"
            " cells of a matrix"
        )
        raise PddlError(
            f"{message}: name fewer objects, or give the actions more conditions that never change",
            file=problem.file,
        )
    return sorted(kept)


def _as_matrices(
    domain: Domain,
    problem: Problem,
    rules: _Rules,
    kept: list[int],
    facts: set[Fact],
    start: set[Fact],
    goal: set[Fact],
    names: list[str],
) -> PlanningTask:
    def named_parts(fact: Fact) -> tuple[str, ...]:
        return tuple([part if isinstance(part, str) else names[part] for part in fact])

    named = sorted((named_parts(fact), fact) for fact in facts)
    index = {fact: i for i, (_, fact) in enumerate(named)}

    def matrix(sets: list[set[Fact]]) -> np.ndarray:
        bits = np.zeros((len(sets), len(named)), bool)
        for row, of_row in enumerate(sets):
            bits[row, [index[fact] for fact in of_row if fact in index]] = True
        return bits

    actions = [rules.actions[i] for i in kept]
    return PlanningTask(
        features=tuple(name for name, _ in named),
        actions=tuple(
            (script.schema.name, *[names[i] for i in binding]) for script, binding in actions
        ),
        conditions=matrix([rules.conditions[i] for i in kept]),
        adds=matrix([rules.adds[i] for i in kept]),
        deletes=matrix([rules.deletes[i] for i in kept]),
        costs=np.array(
            [_cost(script, binding, problem, names) for script, binding in actions], np.int64
        ),
        start=matrix([start])[0],
        goal=matrix([goal])[0],
        domain=domain,
        problem=problem,
    )


def _cost(script: Script, binding: Binding, problem: Problem, names: list[str]) -> int:
    """The cost of a ground action; a function that has no number in (:init ...) is an error, not
    0.
    """
    if not problem.counts_costs:
        return 1
    filled = dict(zip((role for role, _ in script.schema.roles), (names[i] for i in binding)))
    total = 0
    for term in script.schema.costs or ():
        if isinstance(term, int):
            total += term
            continue
        function = (term[0], *[filled.get(x, x) for x in term[1:]])
        value = problem.values.get(function)
        if value is None:
            action = " ".join((script.schema.name, *filled.values()))
            message = (
                f"({' '.join(function)}) has no number, and ({action}) needs it as its cost: give"
                " it in (:init ...)"
            )
            raise PddlError(message, file=problem.file, line=problem.start_line)
        total += value
    if total > MAX_COST:
        action = " ".join((script.schema.name, *filled.values()))
        message = (
            f"({action}) costs {total:,}, more than {MAX_COST:,}: divide all costs by the same"
            " number"
        )
        raise PddlError(message, file=problem.file, line=problem.start_line)
    return total
