"""The planners as engines of unified-planning (UP), an interface of many planners: a UP problem in,
a plan over its own actions and objects out.

    sign-model       MAP, which counts steps
    sign-model-opt   A*, which proves that no plan is shorter, or cheaper where actions have costs

Importing this module registers both with UP's global environment; `register` does it for another
one. A problem goes to `sign_model.load` as PDDL written by UP, so both read what that reads: typed
STRIPS with constants, equality, negative conditions and action costs. UP's compilers bring many
other problems into this form. Writing and reading back takes longer than planning a small task, so
batches are better planned by `plan_batch`.
"""

import time
import warnings
from collections.abc import Callable
from typing import IO, Any

from sign_model.clock import OutOfTime
from sign_model.foundation.extras import install_command
from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.syntax import PddlError
from sign_model.plan_task import plan
from sign_model.result import PlanResult, PlanStatus

try:
    from unified_planning.engines import Credits, Engine
    from unified_planning.engines import PlanGenerationResultStatus as Status
    from unified_planning.engines.mixins import OneshotPlannerMixin
    from unified_planning.engines.mixins.oneshot_planner import OptimalityGuarantee
    from unified_planning.engines.results import LogLevel, LogMessage, PlanGenerationResult
    from unified_planning.environment import Environment, get_environment
    from unified_planning.exceptions import UPException, UPUsageError
    from unified_planning.io import PDDLWriter
    from unified_planning.model import Problem, ProblemKind
    from unified_planning.plans import ActionInstance, SequentialPlan
except ImportError as error:
    raise ImportError(
        "the engines need unified-planning: " + install_command("up", "unified-planning")
    ) from error

_BOTH = (
    "ACTION_BASED",
    "FLAT_TYPING",
    "HIERARCHICAL_TYPING",
    "NEGATIVE_CONDITIONS",
    "EQUALITIES",
    "PLAN_LENGTH",
)
_COSTS = ("ACTIONS_COST", "INT_NUMBERS_IN_ACTIONS_COST", "STATIC_FLUENTS_IN_ACTIONS_COST")
_COST_FLUENTS = ("INT_FLUENTS", "REAL_FLUENTS", "BOUNDED_TYPES")
"""Of the numbers that costs are read from; a number that changes or is compared is another
feature."""


class SignModelEngine(OneshotPlannerMixin, Engine):
    """MAP as an engine of UP: `OneshotPlanner(name="sign-model")`.

    Args:
      max_expansions: the most situations expanded; beyond it the answer is
        UNSOLVABLE_INCOMPLETELY.
    """

    _planner, _name = "map", "sign-model"

    def __init__(self, *, max_expansions: int = 10_000_000, **options: Any) -> None:
        OneshotPlannerMixin.__init__(self)
        Engine.__init__(self, **options)
        self.max_expansions = max_expansions

    @property
    def name(self) -> str:
        """The name that UP knows the engine by."""
        return self._name

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Returns the features of problems that the engine plans."""
        return ProblemKind(_BOTH)

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Returns whether the engine plans problems of a kind."""
        return problem_kind <= SignModelEngine.supported_kind()

    @staticmethod
    def get_credits(**options: Any) -> Credits:
        """Returns what UP prints when it takes the engine."""
        return _credits(
            "sign-model",
            "MAP, planning on a world model of signs.",
            "MAP of Panov and Yakovlev (2016): goal regression and forward search on boolean"
            " matrices, as signs.",
        )

    def solve(self, problem: Problem, *arguments: Any, **options: Any) -> PlanGenerationResult:
        """Returns UP's result for a problem.

        Raises:
          UPUsageError: the problem has features beyond those supported; the message names them.
        """
        skips_checks = self.skip_checks
        if not skips_checks and (missing := self._missing(problem.kind)):
            message = (
                f"{self.name} cannot plan the problem '{problem.name}': it has {missing}; a"
                " compiler of unified-planning may remove that, or take another engine"
            )
            if self.error_on_failed_checks:
                raise UPUsageError(message)
            warnings.warn(message, stacklevel=2)
        self.skip_checks = True  # UP's own check does not say which features
        try:
            return super().solve(problem, *arguments, **options)
        finally:
            self.skip_checks = skips_checks

    def _missing(self, kind: ProblemKind) -> str:
        return ", ".join(sorted(kind.features - self.supported_kind().features))

    def _solve(
        self,
        problem: Problem,
        heuristic: Callable[[Any], float | None] | None = None,
        timeout: float | None = None,
        output_stream: IO[str] | None = None,
    ) -> PlanGenerationResult:
        if heuristic is not None:
            warnings.warn(f"{self.name} ignores the heuristic: it has its own", stacklevel=3)
        began = time.perf_counter()
        writer = PDDLWriter(problem)
        try:
            task = load(writer.get_domain(), writer.get_problem(), max_seconds=timeout)
            left = None if timeout is None else max(0.0, timeout + began - time.perf_counter())
            found = plan(
                task,
                planner=self._planner,
                max_expansions=self.max_expansions,
                max_seconds=left,
            )
        except OutOfTime:
            return PlanGenerationResult(Status.TIMEOUT, None, self.name)
        except (PddlError, UPException, NotImplementedError, ValueError) as error:
            return PlanGenerationResult(
                Status.UNSUPPORTED_PROBLEM,
                None,
                self.name,
                log_messages=[LogMessage(LogLevel.ERROR, str(error))],
            )
        is_late = timeout is not None and time.perf_counter() - began >= timeout
        if output_stream is not None:
            output_stream.write(f"{self.name}: {found!r}\n")
        steps = None
        if found.is_solved:
            steps = SequentialPlan(_steps(problem, writer, task, found), problem.environment)
        spent = time.perf_counter() - began
        return PlanGenerationResult(
            self._status(problem, found.status, is_late),
            steps,
            self.name,
            metrics={
                "engine_internal_time": str(spent),
                "expansions": str(found.expansions),
            },
        )

    def _status(self, problem: Problem, status: PlanStatus, is_late: bool) -> Status:
        if status == PlanStatus.SOLVED:
            return self._solved(problem)
        if status == PlanStatus.UNSOLVABLE:
            return Status.UNSOLVABLE_PROVEN
        return Status.TIMEOUT if is_late else Status.UNSOLVABLE_INCOMPLETELY

    def _solved(self, problem: Problem) -> Status:
        return Status.SOLVED_SATISFICING


class SignModelOptimalEngine(SignModelEngine):
    """A* as an engine of UP: `OneshotPlanner(name="sign-model-opt")`.

    Args:
      max_expansions: as of `SignModelEngine`.
    """

    _planner, _name = "astar", "sign-model-opt"

    @staticmethod
    def get_credits(**options: Any) -> Credits:
        """Returns what UP prints when it takes the engine."""
        return _credits(
            "sign-model-opt",
            "A* with h_max, for shortest or cheapest plans.",
            "Forward A* on boolean matrices with the admissible heuristic h_max (Bonet and Geffner"
            " 2001), of the same package as sign-model.",
        )

    @staticmethod
    def satisfies(optimality_guarantee: OptimalityGuarantee) -> bool:
        """Returns that plans are optimal: the cheapest, or without costs the shortest."""
        return True

    @staticmethod
    def supported_kind() -> ProblemKind:
        """Returns the features of problems that the engine plans."""
        return ProblemKind((*_BOTH, *_COSTS, *_COST_FLUENTS))

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        """Returns whether the engine plans problems of a kind."""
        return problem_kind <= SignModelOptimalEngine.supported_kind()

    def _solved(self, problem: Problem) -> Status:
        return Status.SOLVED_OPTIMALLY if problem.quality_metrics else Status.SOLVED_SATISFICING


def _credits(name: str, short: str, long: str) -> Credits:
    return Credits(
        name=name,
        author="The srt-jax developers",
        contact="",
        website="https://arxiv.org/abs/1607.08181",
        license="MIT",
        short_description=short,
        long_description=long,
    )


def _steps(
    problem: Problem, writer: PDDLWriter, task: PlanningTask, found: PlanResult
) -> list[ActionInstance]:
    """Returns a plan over the actions and objects of the problem, whatever UP called them in
    PDDL.
    """
    express = problem.environment.expression_manager.ObjectExp
    steps = []
    for line in found.actions:
        action, *objects = line.strip("()").split()
        arguments = tuple(express(writer.get_item_named(name)) for name in objects)  # type: ignore
        steps.append(ActionInstance(writer.get_item_named(action), arguments))  # type: ignore
    return steps


def register(environment: Environment | None = None) -> None:
    """Makes both engines known to an environment of UP, its global one where None.

    Examples:
      >>> from sign_model import up_engine
      >>> from unified_planning.shortcuts import Environment
      >>> environment = Environment()
      >>> up_engine.register(environment)
      >>> environment.factory.engine("sign-model-opt").__name__
      'SignModelOptimalEngine'
    """
    factory = (environment or get_environment()).factory
    for engine in (SignModelEngine, SignModelOptimalEngine):
        factory.add_engine(engine._name, __name__, engine.__name__)


register()
