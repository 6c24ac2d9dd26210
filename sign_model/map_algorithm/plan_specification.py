"""Plan specification: the acts of a plan unfold into sub-plans of a finer task, or are realised as
they are (PY16 §3.1).

"Initial situation of the sub-plans is the set of features belonging to conditions of corresponding
action and final situation is the set of features belonging to effects." To both are added what the
rest of the plan still relies on, so that sub-plans found apart fit together, and to the first the
details: what holds in the finer task's start and has no name above. Realise or specify is decided
by a metacognitive rule which is itself a pair of signs, hence can be described, drawn and grown.
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
"""Plans many tasks at once; each result has `actions`, whose validity is checked here."""


@dataclasses.dataclass(frozen=True)
class Step:
    """One act of a plan. steps: its sub-plan; None where the act is realised as it is, or where
    no sub-plan was found.
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
    """Returns SPECIFY for each act at which that sign alone is recognised, else REALISE; () where
    there is no act.

    Args:
      rule: as of `metacognition`.
      acts: the features of each act, names of signs of the rule.
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
    """Returns the task of specifying each act: from what it needs to what it brings about, on the
    actions of `finer`.

    Args:
      task: the coarse task.
      actions: a valid plan of it.
      finer: a task whose features include those of the coarse one by name.

    Raises:
      ValueError: the plan is not valid, or a feature it relies on is none of the finer task.
    """
    wrong = validate(task, actions)
    if wrong:
        raise ValueError(f"only a valid plan can be specified: {wrong[0]}")
    numbers = [task.action_names.index(_written(action)) for action in actions]
    situations = _situations(task, numbers)
    coarse = set(task.features)
    details = finer.start & np.array([atom not in coarse for atom in finer.features], bool)
    starts = [_translated(task, finer, situation) | details for situation in situations[:-1]]
    goals = [
        _translated(task, finer, later | task.adds[number])
        for later, number in zip(situations[1:], numbers)
    ]
    return [_from_to(finer, start, goal) for start, goal in zip(starts, goals)]


def specified(
    task: PlanningTask,
    actions: Sequence[str],
    levels: Sequence[PlanningTask],
    *,
    plan_batch: PlanBatch,
    operations: Collection[str] = (),
    rule: WorldModel | None = None,
) -> tuple[Step, ...]:
    """Returns the plan as a tree, unfolded level by level as far as the rule wants it; () for a
    plan of no act.

    All acts of one level are planned in one batched call. Where what one sub-plan does to the
    details spoils another, they are planned one after the other instead, each from the situation in
    which it will really start. Levels below are entered while the plan as a whole can be replayed
    on the level reached; an act that is realised stands for itself there.

    Args:
      task, actions: the coarse task and a valid plan of it.
      levels: ever finer tasks; the acts of a plan unfold into actions of the next.
      plan_batch: the planner.
      operations: schemas that can be executed as they are.
      rule: decides for each act; by default `metacognition()`.

    Raises:
      ValueError: as of `sub_tasks`.
    """
    rule = rule or metacognition()
    acts = tuple(map(_written, actions))
    traits = [{IS_OPERATION if _schema(act) in operations else IS_ABSTRACT} for act in acts]
    decisions = decide(rule, [trait | {HAS_FINER_LEVEL} for trait in traits] if levels else traits)
    if SPECIFY not in decisions:
        return tuple(Step(act, decision) for act, decision in zip(acts, decisions))
    finer, tasks = levels[0], sub_tasks(task, acts, levels[0])
    parts = _unfolded(finer, tasks, acts, decisions, plan_batch)
    whole, joined = _from_to(finer, finer.start, tasks[-1].goal), _joined(parts)
    inner = iter(
        tuple(Step(act, REALISE) for act in joined)
        if validate(whole, joined)
        else specified(
            whole, joined, levels[1:], plan_batch=plan_batch, operations=operations, rule=rule
        )
    )
    unfolded = [None if part is None else tuple(next(inner) for _ in part) for part in parts]
    return tuple(
        Step(act, decision, steps if decision == SPECIFY else None)
        for act, decision, steps in zip(acts, decisions, unfolded)
    )


def _unfolded(
    finer: PlanningTask,
    tasks: list[PlanningTask],
    acts: Sequence[str],
    decisions: Sequence[str],
    plan_batch: PlanBatch,
) -> list[tuple[str, ...] | None]:
    """Returns for each act its sub-plan, None where there is none, and the act itself where it
    is realised.
    """
    chosen = [number for number, decision in enumerate(decisions) if decision == SPECIFY]
    parts: list[tuple[str, ...] | None] = [(act,) for act in acts]
    for number, plan in zip(chosen, _planned([tasks[number] for number in chosen], plan_batch)):
        parts[number] = plan
    is_whole = len(chosen) == len(acts) and None not in parts
    if is_whole and validate(_from_to(finer, finer.start, tasks[-1].goal), _joined(parts)):
        return _planned_in_turn(finer, tasks, plan_batch)
    return parts


def _joined(parts: Sequence[tuple[str, ...] | None]) -> tuple[str, ...]:
    return tuple(act for part in parts for act in part or ())


def _planned(tasks: list[PlanningTask], plan_batch: PlanBatch) -> list[tuple[str, ...] | None]:
    """Returns a valid plan for each task, None where the planner has none."""
    plans = [tuple(result.actions or ()) for result in plan_batch(tasks)]
    return [None if validate(task, plan) else plan for task, plan in zip(tasks, plans)]


def _planned_in_turn(
    finer: PlanningTask, tasks: list[PlanningTask], plan_batch: PlanBatch
) -> list[tuple[str, ...] | None]:
    """Returns sub-plans each of which starts where the one before ends; None from the first that
    has none.
    """
    situation, plans = finer.start, []
    for task in tasks:
        plan = _planned([_from_to(finer, situation, task.goal)], plan_batch)[0]
        if plan is None:
            return plans + [None] * (len(tasks) - len(plans))
        for action in plan:
            number = finer.action_names.index(_written(action))
            situation = (situation & ~finer.deletes[number]) | finer.adds[number]
        plans.append(plan)
    return plans


def _situations(task: PlanningTask, numbers: list[int]) -> list[np.ndarray]:
    """Returns what the plan relies on before each act and at its end: the situations of the
    P-step, bool [F] each.
    """
    situations = [task.goal]
    for number in reversed(numbers):
        situations.insert(0, (situations[0] & ~task.adds[number]) | task.conditions[number])
    return situations


def _translated(task: PlanningTask, finer: PlanningTask, situation: np.ndarray) -> np.ndarray:
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
        wanted = tuple(atom for atom, is_wanted in zip(finer.features, goal) if is_wanted)
        problem = dataclasses.replace(
            problem,
            start=(problem.start - features) | holds,
            goal=tuple(atom for atom in wanted if atom[0] != "not"),
            negative_goal=tuple(atom[1:] for atom in wanted if atom[0] == "not"),
        )
    return dataclasses.replace(finer, start=start, goal=goal, problem=problem, seconds={})


def _schema(action: str) -> str:
    return _written(action)[1:-1].split(" ")[0]


def _written(action: str) -> str:
    return f"({' '.join(action.strip().strip('()').lower().split())})"
