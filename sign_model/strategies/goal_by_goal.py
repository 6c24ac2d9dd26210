"""Plans one goal after another: a situation in which one goal more holds is where the next search
begins.

Where goals hardly disturb each other, that replaces one long search by many short ones; which goal
comes next is decided by what it costs from there. What was reached is kept only if all goals can
still be reached when nothing is deleted, and a later goal may break an earlier one on its way, but
not in the end. No proof comes of it.
"""

import numpy as np

from sign_model.clock import NO_LIMIT, Clock
from sign_model.strategies.forwards import Forwards, Scripts


class GoalByGoal:
    """A search goal by goal that can be continued.

    Args:
      scripts: of the task.
      start, goal: bool [F].
      deletes, adds: bool [A, F].
      patience: how many situations may be rated for one goal before another is tried.
      clock: asked before each rating.

    Attributes:
      plan: actions in the order of execution, once all goals hold.
      expansions: situations rated.
      is_exhausted: whether every goal that is left was tried in vain.
    """

    def __init__(
        self,
        scripts: Scripts,
        adds: np.ndarray,
        deletes: np.ndarray,
        start: np.ndarray,
        goal: np.ndarray,
        *,
        patience: int,
        clock: Clock = NO_LIMIT,
    ) -> None:
        self.scripts, self.adds, self.deletes, self.clock = scripts, adds, deletes, clock
        self.goals, self.patience = np.flatnonzero(goal), patience
        self.state, self.taken = start, []
        self.expansions, self.is_exhausted = 0, False
        self.plan: list[int] | None = None
        self.waiting: list[int] | None = None
        self.search: Forwards | None = None

    def advance(self, max_expansions: int) -> None:
        """Continues until there is a plan, nothing is left, or `max_expansions` have been made in
        all.
        """
        while self.plan is None and not self.is_exhausted and self.expansions < max_expansions:
            if self.search is None and not self._begin():
                return
            search = self.search
            assert search is not None
            known = search.expansions
            search.advance(min(self.patience, known + max_expansions - self.expansions))
            self.expansions += search.expansions - known
            if search.plan is not None:
                self._take(search.plan)
            elif search.is_exhausted or search.expansions >= self.patience:
                self.search = None

    def _begin(self) -> bool:
        """Begins to look for the next goal; False where all hold, or none is left to try."""
        is_met = self.state[self.goals]
        if is_met.all():
            self.plan = self.taken
            return False
        if self.waiting is None:  # the cheapest first
            cost = self.scripts.relaxed.from_states(self.state[None])[self.goals, 0]
            order = np.argsort(cost, kind="stable")
            self.waiting = [int(g) for g in self.goals[order] if not self.state[g]]
        if not self.waiting:
            self.is_exhausted = True
            return False
        wanted = np.zeros(len(self.state), bool)
        wanted[self.goals[is_met]] = True
        wanted[self.waiting.pop(0)] = True
        self.search = Forwards(self.scripts, self.state, wanted, is_bold=True, clock=self.clock)
        return True

    def _take(self, plan: list[int]) -> None:
        """Goes to where a plan leads, unless the goals can no longer be reached from there."""
        state = self.state
        for action in plan:
            state = (state & ~self.deletes[action]) | self.adds[action]
        self.search = None
        cost = self.scripts.relaxed.from_states(state[None])[self.goals, 0]
        if (cost < self.scripts.relaxed.far).all():
            self.state, self.taken, self.waiting = state, self.taken + plan, None
