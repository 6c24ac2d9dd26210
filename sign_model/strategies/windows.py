"""Parts of a plan as tasks of their own: what they start from, what the rest needs of them, and
the actions that change nothing else.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sign_model.bits import NumberedRows, as_number, as_words, pack, unpack
from sign_model.forward_search.relaxed_costs import Lists
from sign_model.map_algorithm.regression import RegressionSpace, space_over
from sign_model.pddl.planning_task import PlanningTask


@dataclass(frozen=True)
class Window:
    """A part of a plan, and the task that it solves.

    before, part, after: actions of the whole task, executed one after another.
    space: the matrices of the part's task; its kept actions are numbers of the whole task.
    start, goal: bool [F], over the features of the space.
    """

    before: list[int]
    part: list[int]
    after: list[int]
    space: RegressionSpace
    start: np.ndarray
    goal: np.ndarray


class Rearranging:
    """What is known of the actions of one task, to rearrange its plans.

    Args:
      task: whose actions the plans consist of.
      mutex: bool [F, F], its features that never hold together.
    """

    def __init__(self, task: PlanningTask, mutex: np.ndarray) -> None:
        self.task, self.mutex = task, mutex
        self.needs, self.gives, self.takes = (
            Lists(matrix) for matrix in (task.conditions, task.adds, task.deletes)
        )
        self.taken_by = self.takes.turned(task.num_features)
        self.rows = NumberedRows(task.conditions, task.adds, task.deletes)
        self.orders: dict[tuple[int, int], bool] = {}
        self.start, self.goal = as_number(pack(task.start)), as_number(pack(task.goal))

    def must_precede(self, earlier: int, later: int) -> bool:
        """Returns whether two actions that follow each other in a plan cannot be exchanged."""
        key = (earlier, later)
        if key not in self.orders:
            conditions, adds, deletes = self.rows.of(earlier)
            other_conditions, other_adds, other_deletes = self.rows.of(later)
            self.orders[key] = bool(
                (adds & (other_conditions | other_deletes))
                | (conditions & other_deletes)
                | (deletes & other_adds)
            )
        return self.orders[key]

    def gathered(
        self, plan: Sequence[int], chosen: Sequence[int]
    ) -> tuple[list[int], list[int], list[int]]:
        """Returns a plan in three parts, executed one after another, of which the second holds the
        chosen steps and as few others as its order allows.

        Args:
          plan: action numbers.
          chosen: places in the plan, ascending, at least one.
        """
        before, after = list(plan[: chosen[0]]), list(plan[chosen[-1] + 1 :])
        wanted = set(chosen)

        # Others go before the part unless something in the part must precede them.
        middle: list[tuple[int, bool]] = []
        for place in range(chosen[0], chosen[-1] + 1):
            action, is_chosen = plan[place], place in wanted
            if is_chosen or any(self.must_precede(other, action) for other, _ in middle):
                middle.append((action, is_chosen))
            else:
                before.append(action)

        # And else after it, unless they must precede something in it.
        part: list[int] = []
        later: list[int] = []
        for action, is_chosen in reversed(middle):
            if is_chosen or any(self.must_precede(action, other) for other in part):
                part.insert(0, action)
            else:
                later.insert(0, action)
        return before, part, later + after

    def window(
        self, before: list[int], part: list[int], after: list[int], *, is_wide: bool
    ) -> Window:
        """Returns the task of a part of a plan.

        Its actions are those of the part, and all that change nothing beyond what such actions
        change: a part in which one truck carries one parcel becomes the task of that truck and that
        parcel, on all roads.

        Args:
          before, part, after: of the plan.
          is_wide: also take actions that use what lies idle before the part, such as another hand.
        """
        # The situation before the part, and what the rest of the plan needs after it.
        state, needs = self.start, self.goal
        for action in before:
            _, adds, deletes = self.rows.of(action)
            state = (state & ~deletes) | adds
        for action in reversed(after):
            conditions, adds, _ = self.rows.of(action)
            needs = (needs & ~adds) | conditions
        size = self.task.num_features
        start, goal = (unpack(as_words(number, size), size) for number in (state, needs))

        # All features that the actions don't change stay: conditions on them hold, or never will.
        task = self.task
        actions, features = self._local(part, start, is_wide)
        can_hold = start.copy()
        can_hold[features] = True
        never = np.repeat(np.arange(len(actions)), self.needs.count[actions])
        never = never[~can_hold[self.needs.of(actions)]]
        actions = np.delete(actions, never)
        conditions, adds, deletes = (
            lists.part(actions, features, task.num_features)
            for lists in (self.needs, self.gives, self.takes)
        )
        space = space_over(task.features, features, actions, conditions, adds, deletes, self.mutex)
        return Window(before, part, after, space, start[features], goal[features])

    def _local(
        self, part: Iterable[int], start: np.ndarray, is_wide: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the numbers of the actions of a part's task, and of the features that they
        change.
        """
        task, steps = self.task, np.array(sorted(set(part)))
        changes = self._changed_by(steps)
        if is_wide:
            touches = self._deletes_in(np.flatnonzero(changes)) > 0
            fits = self._deletes_in(np.flatnonzero(changes | start)) == self.takes.count
            near = np.flatnonzero(touches & fits)
            changes |= self._changed_by(near)

        # Actions whose deletes all lie there; what they add can then be deleted. Ends: the set only
        # grows.
        missing, new = self.takes.count.copy(), np.flatnonzero(changes)
        while len(new):
            gone = self._deletes_in(new)
            missing -= gone
            allowed = np.flatnonzero((missing == 0) & (gone > 0))
            more = np.zeros(task.num_features, bool)
            more[self.gives.of(allowed)] = True
            more &= ~changes
            changes |= more
            new = np.flatnonzero(more)
        is_allowed = (missing == 0) & (self.takes.count > 0)
        is_allowed[steps] = True
        return np.flatnonzero(is_allowed), np.flatnonzero(changes)

    def _changed_by(self, actions: np.ndarray) -> np.ndarray:
        """Returns bool [F]: the features that some of the actions, int [n], add or delete."""
        changed = np.zeros(self.task.num_features, bool)
        changed[self.gives.of(actions)] = True
        changed[self.takes.of(actions)] = True
        return changed

    def _deletes_in(self, features: np.ndarray) -> np.ndarray:
        """Returns how many of the features, int [n], each action deletes, int [A]."""
        return np.bincount(self.taken_by.of(features), minlength=self.task.num_actions)
