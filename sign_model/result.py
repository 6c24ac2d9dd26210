"""The result of planning: a status, the plan, and the effort spent."""

from dataclasses import dataclass, field

from sign_model.foundation.legible import counted
from sign_model.foundation.meanings import WithMeaning

_MOST_SHOWN = 100
"""Steps of a plan in a notebook."""


class PlanStatus(WithMeaning):
    """How planning ended. The numbers are the exit codes of `srt-jax plan`; `meaning` explains them
    in words.

    Examples:
      >>> import sign_model
      >>> sign_model.PlanStatus(1).name, sign_model.PlanStatus(1).meaning
      ('UNSOLVABLE', 'proven: no plan exists')
    """

    SOLVED = 0, "the plan leads from the start to the goal; it was replayed"
    UNSOLVABLE = 1, "proven: no plan exists"
    BUDGET_SPENT = (
        3,
        "the budget was exhausted before a plan or a proof: raise max_expansions or max_seconds",
    )


@dataclass(frozen=True)
class PlanResult:
    """The answer to a planning task.

    Attributes:
      status: how planning ended.
      actions: the plan in the order of execution, `(pick-up a)` each; empty without a plan, or if
        the goal holds at the start.
      expansions: situations (or states) expanded; 1 if the plan is that of a precedent.
      seconds: wall-clock time by stage: parse, build, search, validate.
      cost: the total cost of the actions, whichever planner found them; None without a plan, and
        where the problem has no costs.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> result = sign_model.plan(task)
      >>> result.is_solved, result.actions
      (True, ('(push)', '(walk)'))
    """

    status: PlanStatus
    actions: tuple[str, ...] = ()
    expansions: int = 0
    seconds: dict[str, float] = field(default_factory=dict)
    cost: int | None = None

    @property
    def is_solved(self) -> bool:
        """Whether there is a plan."""
        return self.status == PlanStatus.SOLVED

    def __repr__(self) -> str:
        """What it says in a line; `actions` holds the plan."""
        cost = "" if self.cost is None else f" cost {self.cost},"
        return (
            f"PlanResult({self.status.name}, {counted(len(self.actions), 'step')},{cost}"
            f" {counted(self.expansions, 'expansion')})"
        )

    def _repr_html_(self) -> str:
        """The plan as a numbered list, for notebooks."""
        from html import escape  # only here: commands that plan start without it

        title = repr(self) if self.is_solved else f"{self!r}: {self.status.meaning}"
        shown = self.actions[:_MOST_SHOWN]
        steps = "".join(f"<li><code>{escape(action)}</code></li>" for action in shown)
        left = len(self.actions) - len(shown)
        more = f"<p>and {left} more in <code>actions</code></p>" if left else ""
        return f"<div><div><code>{escape(title)}</code></div><ol>{steps}</ol>{more}</div>"
