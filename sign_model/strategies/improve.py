"""Improves a plan part by part: each part becomes a task of its own, and the regression of MAP
looks for a shorter way.

A part is a run of the plan, or steps that share an object, moved together as far as the order of
the plan allows: so two trips of one truck meet although others travel between them. Parts grow from
pass to pass. The effort is counted in expansions and in the size of the tasks, never in seconds, so
the result is the same on every machine unless the clock ends it.
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sign_model.clock import NO_LIMIT, Clock, OutOfTime
from sign_model.map_algorithm.a_step import make_rating
from sign_model.map_algorithm.heuristics import LANDMARKS, RELAXED_PLAN, HeuristicSign
from sign_model.map_algorithm.map_planner import regress
from sign_model.map_algorithm.shorten import shorten
from sign_model.pddl.planning_task import PlanningTask
from sign_model.strategies.windows import Rearranging, Window

SIZES = (8, 14, 22, 32)
"""How many steps of a plan are replaced at once, pass by pass."""

UNLEARNED_SIGNS, UNLEARNED_BEAM = (RELAXED_PLAN, LANDMARKS), 32
"""By which signs a shorter way is looked for, and how many situations a step keeps."""

_EXPANSION = 100
"""What an expansion takes, in units of effort."""

_STEPS_LEFT = HeuristicSign("steps left", plan={"*": 1})

Parts = tuple[list[int], list[int], list[int]]


class Improved(NamedTuple):
    """A plan, and how many situations were expanded to improve it."""

    plan: list[int]
    expansions: int


@dataclass
class Patience:
    """When to stop: after `least`, once two thirds of all attempts to improve were in vain.

    All are counted in expansions; what else an attempt takes counts as so many expansions.

    least: expansions, those that found the plan included.
    begun: how many had been spent when the attempts began.
    spent: so far.
    gained: when the plan last became shorter.
    """

    least: int
    begun: int
    spent: int
    gained: int

    @property
    def is_over(self) -> bool:
        """Whether nothing more is to be hoped for."""
        in_vain = self.spent - self.gained
        return self.spent >= self.least and 3 * in_vain >= 2 * (self.spent - self.begun)


def improve(
    task: PlanningTask,
    mutex: np.ndarray,
    plan: list[int],
    *,
    effort: int,
    signs: Sequence[HeuristicSign] = UNLEARNED_SIGNS,
    beam: int = UNLEARNED_BEAM,
    patience: Patience | None = None,
    max_expansions: int = 1 << 40,
    clock: Clock = NO_LIMIT,
) -> Improved:
    """Returns a plan that is at most as long as `plan`, and valid if that was.

    Args:
      task: that the plan solves.
      mutex: bool [F, F], features of the task that never hold together.
      plan: action numbers in the order of execution.
      effort: the most effort, in units of about a microsecond.
      signs: by which a shorter way is looked for, one after another.
      beam: how many situations a step of that keeps.
      patience: when to stop before the effort is spent; it goes on counting.
      max_expansions: the most situations expanded.
      clock: once its limit has passed, the plan stays as it is then.
    """
    improving = _Improving(task, mutex, plan, effort, max_expansions, clock)
    improving.signs, improving.beam, improving.patience = signs, beam, patience
    with contextlib.suppress(OutOfTime):
        improving.run()
    return Improved(improving.plan, improving.expansions)


class _Improving:
    def __init__(
        self,
        task: PlanningTask,
        mutex: np.ndarray,
        plan: list[int],
        effort: int,
        max_expansions: int,
        clock: Clock,
    ) -> None:
        self.task, self.plan, self.effort, self.clock = task, plan, effort, clock
        self.max_expansions, self.expansions = max_expansions, 0
        self.signs: Sequence[HeuristicSign] = UNLEARNED_SIGNS
        self.beam = UNLEARNED_BEAM
        self.patience: Patience | None = None
        self.rearranging = Rearranging(task, mutex)
        self.tried: set[tuple] = set()

    def run(self) -> None:
        """Goes through all sizes of parts until none brings anything, or the effort is spent."""
        length = -1
        while length != len(self.plan) and not self.is_over:
            length = len(self.plan)
            for size in SIZES:
                for is_wide in (False, True):
                    self._pass(size, is_wide)

    @property
    def is_over(self) -> bool:
        is_vain = self.patience is not None and self.patience.is_over
        return self.effort <= 0 or self.expansions >= self.max_expansions or is_vain

    def _pass(self, size: int, is_wide: bool) -> None:
        """Tries the parts of one size; begins again with the places of a part that was improved."""
        for object_ in self._objects():
            at = 0
            while not self.is_over:
                self.clock.check()
                places = self._places(object_)
                chosen = places[at : at + size]
                if len(chosen) < 2:
                    break
                parts = self.rearranging.gathered(self.plan, chosen)
                self.effort -= 20 * (chosen[-1] - chosen[0])
                if len(parts[1]) <= 3 * size // 2 and self._try(parts, is_wide):
                    continue
                if at + size >= len(places):
                    break
                at += max(1, size // 2)
        at = 0
        while at < len(self.plan) and not self.is_over:
            self.clock.check()
            part = self.plan[at : at + size]
            if self._try((self.plan[:at], part, self.plan[at + size :]), is_wide):
                at = max(0, at - size // 2)
            else:
                at += size // 3

    def _objects(self) -> list[str]:
        """Returns the objects of the plan's actions, those of the fewest steps first."""
        count: dict[str, int] = {}
        for action in self.plan:
            for name in self.task.actions[action][1:]:
                count[name] = count.get(name, 0) + 1
        return sorted((name for name in count if count[name] > 1), key=lambda n: (count[n], n))

    def _places(self, name: str) -> list[int]:
        return [i for i, a in enumerate(self.plan) if name in self.task.actions[a][1:]]

    def _try(self, parts: Parts, is_wide: bool) -> bool:
        """Replaces a part by a shorter one if there is one, and returns whether there was."""
        before, part, after = parts
        key = (is_wide, tuple(part), hash(tuple(sorted(before))))
        if len(part) < 3 or key in self.tried:
            return False
        self.tried.add(key)
        window = self.rearranging.window(before, part, after, is_wide=is_wide)
        actions, features = window.space.conditions.shape
        taken = 3000 + 2 * actions + actions * features // 100
        self.effort -= taken
        if self.patience is not None:
            self.patience.spent += taken // (4 * _EXPANSION)
        shorter = self._shorter(window)
        if shorter is None:
            return False
        self.plan = shorten(self.task, before + shorter + after, self.clock)
        return True

    def _shorter(self, window: Window) -> list[int] | None:
        """Returns fewer actions that do what the part does; None if none were found."""
        space, start, goal, best = window.space, window.start, window.goal, None
        schemas = [self.task.actions[a][0] for a in space.kept_actions]
        length, tables = len(window.part), {}
        left = make_rating(_STEPS_LEFT, space, start, goal, schemas, self.clock, tables)
        if left(goal[None])[0] >= length:
            return None
        for sign in self.signs:
            found = regress(
                space,
                start,
                goal,
                make_rating(sign, space, start, goal, schemas, self.clock, tables),
                beam=self.beam,
                max_expansions=self.max_expansions - self.expansions,
                within=(length - 1, left),
                clock=self.clock,
            )
            self.expansions += found.expansions
            self.effort -= _EXPANSION * found.expansions
            if self.patience is not None:
                self.patience.spent += found.expansions
            if found.plan is not None and len(found.plan) < length:
                best, length = found.plan, len(found.plan)
        if self.patience is not None and best is not None:
            self.patience.gained = self.patience.spent
        return None if best is None else [int(space.kept_actions[a]) for a in best]
