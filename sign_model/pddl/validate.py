"""Replays a plan forward, step by step, from the lifted task: the independent judge of every
planner here.

It reads the PDDL records and sets of atoms only. No matrix, mutex or pruning of the planners
enters, so that a slip in them cannot hide.
"""

from collections.abc import Sequence

import numpy as np

from sign_model.bits import pack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.lifted import Atom, Domain, Problem, Schema
from sign_model.pddl.planning_task import PlanningTask

_CHECKED_EVERY = 1 << 12


def validate(task: PlanningTask, actions: Sequence[str], *, clock: Clock = NO_LIMIT) -> list[str]:
    """Returns what is wrong with a plan, one sentence each; empty when it leads from the start to
    the goal.

    Args:
      task: the task; one made from arrays is replayed on its matrices, as it has no lifted form.
      actions: the plan in the order of execution, `(pick-up a)` each; case doesn't matter.
      clock: asked on long plans; OutOfTime where its limit has passed.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> sign_model.validate(task, ["(push)", "(walk)"])
      []
      >>> sign_model.validate(task, ["(walk)"])
      ['step 1 (walk): (open) does not hold']
    """
    plan = [tuple(action.strip().strip("()").lower().split()) for action in actions]
    if task.domain is None or task.problem is None:
        return _replay_arrays(task, plan, clock)
    return _replay(task.domain, task.problem, plan, clock)


def _replay(domain: Domain, problem: Problem, plan: list[Atom], clock: Clock) -> list[str]:
    schemas = {schema.name: schema for schema in domain.schemas}
    state = set(problem.start)
    for number, step in enumerate(plan, 1):
        if not number % _CHECKED_EVERY:
            clock.check()
        step_name = f"step {number} ({' '.join(step)})"
        if not step or step[0] not in schemas:
            return [f"{step_name}: there is no such action"]
        schema = schemas[step[0]]
        problems = _wrong_arguments(domain, problem, schema, step[1:])
        if problems:
            return [f"{step_name}: {problem_}" for problem_ in problems]
        env = dict(zip((role for role, _ in schema.roles), step[1:]))
        missing = sorted(_filled(schema.conditions, env) - state)
        present = sorted(_filled(schema.negative_conditions, env) & state)
        wrong = [f"{step_name}: ({' '.join(atom)}) does not hold" for atom in missing]
        wrong += [f"{step_name}: ({' '.join(atom)}) holds but must not" for atom in present]
        if wrong:
            return wrong
        state -= _filled(schema.deletes, env)
        state |= _filled(schema.adds, env)
    unmet = [
        f"the goal ({' '.join(atom)}) is not reached" for atom in problem.goal if atom not in state
    ]
    return unmet + [
        f"the goal (not ({' '.join(atom)})) is not reached"
        for atom in problem.negative_goal
        if atom in state
    ]


def _filled(atoms: tuple[Atom, ...], env: dict[str, str]) -> set[Atom]:
    return {(atom[0], *(env.get(x, x) for x in atom[1:])) for atom in atoms}


def _wrong_arguments(
    domain: Domain, problem: Problem, schema: Schema, arguments: Atom
) -> list[str]:
    if len(arguments) != len(schema.roles):
        return [f"{len(arguments)} argument(s), the action takes {len(schema.roles)}"]
    wrong = [f"there is no object '{name}'" for name in arguments if name not in problem.objects]
    if wrong:
        return wrong
    wrong = [
        f"'{name}' is no {'/'.join(kinds)}"
        for name, (_, kinds) in zip(arguments, schema.roles)
        if not domain.is_a(problem.objects[name], kinds)
    ]
    env = dict(zip((role for role, _ in schema.roles), arguments))
    for one, other, wanted in schema.equalities:
        if (env.get(one, one) == env.get(other, other)) != wanted:
            wrong.append(f"{one} and {other} must {'' if wanted else 'not '}be equal")
    return wrong


def _replay_arrays(task: PlanningTask, plan: list[Atom], clock: Clock) -> list[str]:
    number_of = {action: i for i, action in enumerate(task.actions)}
    state = task.start.copy()
    for number, step in enumerate(plan, 1):
        if not number % _CHECKED_EVERY:
            clock.check()
        action = number_of.get(step)
        if action is None:
            return [f"step {number} ({' '.join(step)}): there is no such action"]
        missing = [task.features[f] for f in (task.conditions[action] & ~state).nonzero()[0]]
        if missing:
            return [
                f"step {number} ({' '.join(step)}): ({' '.join(atom)}) does not hold"
                for atom in missing
            ]
        state = (state & ~task.deletes[action]) | task.adds[action]
    return [
        f"the goal ({' '.join(task.features[f])}) is not reached"
        for f in (task.goal & ~state).nonzero()[0]
    ]


def replay_batch(
    task: PlanningTask, starts: np.ndarray, goals: np.ndarray, plans: np.ndarray
) -> None:
    """Replays many plans of one domain side by side on its own unpruned matrices; AssertionError
    names the first that fails.

    Args:
      task: whose matrices all share.
      starts, goals: bool [N, F].
      plans: int [N, L], action numbers in the order of execution, -1 after the last.
    """
    # Word by word, [W, A + 1] and [W, N]: the last action, which -1 names, does nothing.
    none = np.zeros((1, task.num_features), bool)
    conditions, adds, deletes = (
        np.ascontiguousarray(pack(np.concatenate([rows, none])).T)
        for rows in (task.conditions, task.adds, task.deletes)
    )
    states = np.ascontiguousarray(pack(starts).T)
    for i, actions in enumerate(np.ascontiguousarray(plans.T)):
        if (actions < 0).all():
            break
        for word, (needs, gives, takes) in enumerate(zip(conditions, adds, deletes)):
            before = states[word]
            stuck = np.flatnonzero(needs[actions] & ~before)
            if len(stuck):
                raise AssertionError(
                    f"plan {stuck[0]}: {task.action_names[plans[stuck[0], i]]} cannot go at step"
                    f" {i + 1}"
                )
            states[word] = (before & ~takes[actions]) | gives[actions]
    missed = np.flatnonzero((pack(goals).T & ~states).any(axis=0))
    if len(missed):
        raise AssertionError(f"plan {missed[0]} does not reach its goal")
