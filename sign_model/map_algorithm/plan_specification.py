"""Plan specification: the acts of a plan are refined into sub-plans of a finer task, or realised as
they are (PY16 §3.1).

"Initial situation of the sub-plans is the set of features belonging to conditions of corresponding
action and final situation is the set of features belonging to effects." Both are extended by what
the rest of the plan relies on, so that sub-plans that are found separately fit together. The first
is also extended by the details: what holds at the start of the finer task and has no name on the
coarse level. A metacognitive rule decides between realise and specify. The rule is itself a pair of
signs, so it can be described, drawn and extended by experience.
"""

import dataclasses
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

import numpy as np

from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.signs.recognition import recognise
from sign_model.signs.sign import Sign, sequence, with_elementary
from sign_model.signs.world_model import WorldModel, from_signs

REALISE, SPECIFY = "realise", "specify"
IS_OPERATION, IS_ABSTRACT, HAS_FINER_LEVEL = (
    "act is an operation",
    "act is abstract",
    "a finer level is known",
)

PlanBatch = Callable[[list[PlanningTask]], Sequence[Any]]
"""Plans many tasks at once; each result has `actions`, which are validated here."""


@dataclasses.dataclass(frozen=True)
class Step:
    """One act of a plan.

    action: `(change-room hall lab)`.
    decision: REALISE or SPECIFY.
    steps: its sub-plan; None if the act is realised as it is, or no sub-plan was found.
    """

    action: str
    decision: str
    steps: tuple["Step", ...] | None = None

    def leaves(self) -> Iterator["Step"]:
        """Yields the steps to be executed, in order."""
        if self.steps is None:
            yield self
        for step in self.steps or ():
            yield from step.leaves()


def metacognition() -> WorldModel:
    """Returns the rule as signs: specify what is abstract while a finer level is known, realise
    what is an operation.

    `WorldModel.grown` adds a matrix to the image of either sign, and so changes the rule.
    """
    rule = (
        Sign(SPECIFY, image=(sequence({IS_ABSTRACT, HAS_FINER_LEVEL}),)),
        Sign(REALISE, image=(sequence(IS_OPERATION),)),
    )
    elementary = (Sign(IS_OPERATION), Sign(IS_ABSTRACT), Sign(HAS_FINER_LEVEL))
    return from_signs(with_elementary((*rule, *elementary)))


def decide(rule: WorldModel, acts: Sequence[Collection[str]]) -> tuple[str, ...]:
    """Returns for each act SPECIFY if that sign is recognised and REALISE is not, else REALISE; ()
    without acts.

    Args:
      rule: of `metacognition`, perhaps extended.
      acts: the features of each act, as names of signs of the rule.
    """
    if not acts:
        return ()
    found = np.asarray(
        recognise(rule.matrices, np.stack([rule.features(act) for act in acts])[:, None]).recognised
    )
    specifies = found[:, rule.index(SPECIFY)] & ~found[:, rule.index(REALISE)]
    return tuple(SPECIFY if specify else REALISE for specify in specifies)


def sub_tasks(
    task: PlanningTask, actions: Sequence[str], finer: PlanningTask
) -> list[PlanningTask]:
    """Returns for each act the task of specifying it: from what it needs to what it brings about,
    with the actions of `finer`.

    Args:
      task: the coarse task.
      actions: a valid plan of it.
      finer: a task whose features include those of the coarse one by name.

    Raises:
      ValueError: the plan is not valid, or a feature it relies on does not exist in the finer task.
    """
    wrong = validate(task, actions)
    if wrong:
        raise ValueError(f"only a valid plan can be specified: {wrong[0]}")
    numbers = [task.action_names.index(_normalised(action)) for action in actions]

    # What must hold between the acts, and the details that the coarse task has no names for.
    situations = _situations(task, numbers)
    coarse = set(task.features)
    details = finer.start & np.array([atom not in coarse for atom in finer.features], bool)
    starts = [_translated(task, finer, situation) | details for situation in situations[:-1]]
    goals = [
        _translated(task, finer, later | task.adds[number])
        for later, number in zip(situations[1:], numbers)
    ]
    return [_from_to(finer, start, goal) for start, goal in zip(starts, goals)]


def specify_plan(
    task: PlanningTask,
    actions: Sequence[str],
    levels: Sequence[PlanningTask],
    *,
    plan_batch: PlanBatch,
    operations: Collection[str] = (),
    rule: WorldModel | None = None,
) -> tuple[Step, ...]:
    """Returns the plan as a tree, refined level by level as far as the rule decides; () for a plan
    without acts.

    All acts of one level are planned in one batched call. If the changes that one sub-plan makes to
    the details invalidate another, they are planned one after the other instead, each from the
    situation in which it really starts. The next level is entered only if the whole plan can be
    replayed on the level reached; an act that is realised is an action there too.

    Args:
      task, actions: the coarse task and a valid plan of it.
      levels: finer and finer tasks; the acts of a plan are refined into actions of the next one.
      plan_batch: the planner.
      operations: schemas that can be executed as they are.
      rule: decides for each act; by default `metacognition()`.

    Raises:
      ValueError: as of `sub_tasks`.
    """
    # Decide for each act.
    rule = rule or metacognition()
    acts = tuple(map(_normalised, actions))
    traits = [{IS_OPERATION if _schema(act) in operations else IS_ABSTRACT} for act in acts]
    decisions = decide(rule, [trait | {HAS_FINER_LEVEL} for trait in traits] if levels else traits)
    if SPECIFY not in decisions:
        return tuple(Step(act, decision) for act, decision in zip(acts, decisions))

    # Plan the sub-tasks, and refine the joined plan on the next level if it is valid.
    finer, tasks = levels[0], sub_tasks(task, acts, levels[0])
    parts = _sub_plans(finer, tasks, acts, decisions, plan_batch)
    whole, joined = _from_to(finer, finer.start, tasks[-1].goal), _joined(parts)
    inner = iter(
        tuple(Step(act, REALISE) for act in joined)
        if validate(whole, joined)
        else specify_plan(
            whole, joined, levels[1:], plan_batch=plan_batch, operations=operations, rule=rule
        )
    )

    # Cut the refined plan into the sub-plans of the acts again.
    sub_steps = [None if part is None else tuple(next(inner) for _ in part) for part in parts]
    return tuple(
        Step(act, decision, steps if decision == SPECIFY else None)
        for act, decision, steps in zip(acts, decisions, sub_steps)
    )


def _sub_plans(
    finer: PlanningTask,
    tasks: list[PlanningTask],
    acts: Sequence[str],
    decisions: Sequence[str],
    plan_batch: PlanBatch,
) -> list[tuple[str, ...] | None]:
    """Returns the sub-plan of each act, None if none was found; the act itself if it is
    realised.
    """
    chosen = [number for number, decision in enumerate(decisions) if decision == SPECIFY]
    parts: list[tuple[str, ...] | None] = [(act,) for act in acts]
    for number, plan in zip(chosen, _plan_all([tasks[number] for number in chosen], plan_batch)):
        parts[number] = plan
    is_whole = len(chosen) == len(acts) and None not in parts
    if is_whole and validate(_from_to(finer, finer.start, tasks[-1].goal), _joined(parts)):
        return _plan_in_turn(finer, tasks, plan_batch)
    return parts


def _joined(parts: Sequence[tuple[str, ...] | None]) -> tuple[str, ...]:
    """Returns all sub-plans as one plan."""
    return tuple(act for part in parts for act in part or ())


def _plan_all(tasks: list[PlanningTask], plan_batch: PlanBatch) -> list[tuple[str, ...] | None]:
    """Returns a valid plan for each task, None if the planner found none."""
    plans = [tuple(result.actions or ()) for result in plan_batch(tasks)]
    return [None if validate(task, plan) else plan for task, plan in zip(tasks, plans)]


def _plan_in_turn(
    finer: PlanningTask, tasks: list[PlanningTask], plan_batch: PlanBatch
) -> list[tuple[str, ...] | None]:
    """Returns sub-plans of which each starts where the previous one ends; None for the first task
    without a plan and for all after it.
    """
    situation, plans = finer.start, []
    for task in tasks:
        plan = _plan_all([_from_to(finer, situation, task.goal)], plan_batch)[0]
        if plan is None:
            return plans + [None] * (len(tasks) - len(plans))
        for action in plan:
            number = finer.action_names.index(_normalised(action))
            situation = (situation & ~finer.deletes[number]) | finer.adds[number]
        plans.append(plan)
    return plans


def _situations(task: PlanningTask, numbers: list[int]) -> list[np.ndarray]:
    """Returns what the rest of the plan relies on before each act and at its end: the situations of
    the P-step, bool [F] each.
    """
    situations = [task.goal]
    for number in reversed(numbers):
        situations.insert(0, (situations[0] & ~task.adds[number]) | task.conditions[number])
    return situations


def _translated(task: PlanningTask, finer: PlanningTask, situation: np.ndarray) -> np.ndarray:
    """Returns a situation of the task over the features of the finer task, by their names."""
    return finer.situation([task.features[feature] for feature in np.flatnonzero(situation)])


def _from_to(finer: PlanningTask, start: np.ndarray, goal: np.ndarray) -> PlanningTask:
    """Returns the finer task with another start and goal, in its matrices and in its lifted
    form.
    """
    problem = finer.problem
    if problem is not None:
        features = frozenset(finer.features)
        holds = {
            atom for atom, is_true in zip(finer.features, start) if is_true and atom[0] != "not"
        }
        goal_atoms = tuple(atom for atom, is_goal in zip(finer.features, goal) if is_goal)
        problem = dataclasses.replace(
            problem,
            start=(problem.start - features) | holds,
            goal=tuple(atom for atom in goal_atoms if atom[0] != "not"),
            negative_goal=tuple(atom[1:] for atom in goal_atoms if atom[0] == "not"),
        )
    return dataclasses.replace(finer, start=start, goal=goal, problem=problem, seconds={})


def _schema(action: str) -> str:
    """Returns the name of the schema of an action."""
    return _normalised(action)[1:-1].split(" ")[0]


def _normalised(action: str) -> str:
    """Returns an action in lower case, with parentheses and single blanks."""
    return f"({' '.join(action.strip().strip('()').lower().split())})"
