"""The engines of unified-planning, judged by its own examples, validator and report."""

import io
import sys

import pytest

up = pytest.importorskip("unified_planning.shortcuts")

from unified_planning.engines import PlanGenerationResultStatus as Status  # noqa: E402
from unified_planning.exceptions import UPUsageError  # noqa: E402
from unified_planning.test.examples import get_example_problems  # noqa: E402

from sign_model import up_engine  # noqa: E402

EXAMPLES = get_example_problems()
ENGINES = {
    "sign-model": up_engine.SignModelEngine,
    "sign-model-opt": up_engine.SignModelOptimalEngine,
}
REMOVERS = {
    up.CompilationKind.USERTYPE_FLUENTS_REMOVING: ("OBJECT_FLUENTS",),
    up.CompilationKind.QUANTIFIERS_REMOVING: (
        "EXISTENTIAL_CONDITIONS",
        "UNIVERSAL_CONDITIONS",
        "FORALL_EFFECTS",
    ),
    up.CompilationKind.CONDITIONAL_EFFECTS_REMOVING: ("CONDITIONAL_EFFECTS",),
    up.CompilationKind.DISJUNCTIVE_CONDITIONS_REMOVING: ("DISJUNCTIVE_CONDITIONS",),
}
up.get_environment().credits_stream = None


def solved(engine, problem, **options):
    with up.OneshotPlanner(name=engine) as planner:
        return planner.solve(problem, **options)


def verdict(problem, plan):
    with up.PlanValidator(problem_kind=problem.kind, plan_kind=plan.kind) as validator:
        return validator.validate(problem, plan).status.name


@pytest.mark.parametrize(("engine", "least"), [("sign-model", 11), ("sign-model-opt", 12)], ids=str)
def test_every_example_of_the_supported_kind_gets_a_valid_plan(engine, least):
    problems = [
        example.problem
        for example in EXAMPLES.values()
        if ENGINES[engine].supports(example.problem.kind)
    ]
    assert len(problems) >= least
    for problem in problems:
        result = solved(engine, problem, timeout=60)
        is_best = engine.endswith("opt") and problem.quality_metrics
        assert result.status is (Status.SOLVED_OPTIMALLY if is_best else Status.SOLVED_SATISFICING)
        assert verdict(problem, result.plan) == "VALID", problem.name


@pytest.mark.parametrize(
    "name",
    ["basic_conditional", "basic_exists", "robot_fluent_of_user_type", "charge_discharge"],
)
def test_compilers_bring_other_problems_into_reach(name):
    original = problem = EXAMPLES[name].problem
    assert not up_engine.SignModelEngine.supports(problem.kind)
    done = []
    for compilation, features in REMOVERS.items():
        if set(features) & problem.kind.features:
            with up.Compiler(problem_kind=problem.kind, compilation_kind=compilation) as compiler:
                done.append(compiler.compile(problem, compilation))
                problem = done[-1].problem
    plan = solved("sign-model", problem).plan
    for compiled in reversed(done):
        plan = plan.replace_action_instances(compiled.map_back_action_instance)
    assert verdict(original, plan) == "VALID"


@pytest.mark.parametrize("engine", ENGINES)
def test_the_report_of_unified_planning_finds_nothing_wrong(engine, monkeypatch):
    utilities = pytest.importorskip("up_test_cases.utils")
    monkeypatch.setitem(sys.modules, "utils", utilities)  # a script: it imports its neighbour so
    from up_test_cases import report
    from up_test_cases.builtin.classical import basic_problems, metric_problems

    tried = 0
    for cases in (basic_problems.get_test_cases(), metric_problems.get_test_cases()):
        for case in cases.values():
            with up.OneshotPlanner(name=engine) as planner:
                if planner.supports(case.problem.kind):
                    outcome, values = report.check_result(
                        case, planner.solve(case.problem, timeout=60), planner
                    )
                    assert outcome.ok(), str(outcome)
                    if engine.endswith("opt") and case.optimum is not None and values:
                        assert [*values.values()] == [case.optimum]
                    tried += 1
    assert tried >= 3


def test_costs_are_counted_and_mixed_case_names_come_back():
    at, cost = (
        up.Fluent("At", up.BoolType(), x=up.UserType("Place")),
        up.Fluent("Toll", up.IntType()),
    )
    place = up.UserType("Place")
    go = up.InstantaneousAction("Go To", x=place, y=place)
    go.add_precondition(at(go.x))
    go.add_precondition(up.Not(up.Equals(go.x, go.y)))
    go.add_effect(at(go.x), False)
    go.add_effect(at(go.y), True)
    leap = up.InstantaneousAction("Leap")
    home, shop = up.Object("Home", place), up.Object("Shop 1", place)
    leap.add_precondition(up.Not(at(shop)))
    leap.add_effect(at(shop), True)
    problem = up.Problem("Errand")
    problem.add_fluents([at, cost])
    problem.add_actions([leap, go])
    problem.add_objects([home, shop])
    for x, holds in ((home, True), (shop, False)):
        problem.set_initial_value(at(x), holds)
    problem.set_initial_value(cost, 7)
    problem.add_goal(at(shop))
    problem.add_quality_metric(up.MinimizeActionCosts({leap: cost + 1, go: up.Int(3)}))
    result = solved("sign-model-opt", problem)
    assert result.status is Status.SOLVED_OPTIMALLY
    assert [step.action for step in result.plan.actions] == [go]
    assert result.plan.actions[0].actual_parameters[1].object() == shop


def test_a_problem_without_a_plan_is_proven_to_have_none():
    problem = EXAMPLES["basic"].problem.clone()
    problem.clear_actions()
    assert solved("sign-model", problem).status is Status.UNSOLVABLE_PROVEN


def test_a_spent_budget_is_no_proof():
    problem = EXAMPLES["robot_loader_adv"].problem
    assert solved("sign-model", problem, timeout=0).status is Status.TIMEOUT
    with up.OneshotPlanner(name="sign-model-opt", params={"max_expansions": 1}) as planner:
        assert planner.solve(problem).status is Status.UNSOLVABLE_INCOMPLETELY


def test_a_refusal_names_the_features():
    problem = EXAMPLES["basic_conditional"].problem
    with up.OneshotPlanner(name="sign-model") as planner:
        planner.error_on_failed_checks = True
        with pytest.raises(UPUsageError, match=r"sign-model cannot .* has CONDITIONAL_EFFECTS"):
            planner.solve(problem)
        planner.error_on_failed_checks = False
        with pytest.warns(UserWarning, match="CONDITIONAL_EFFECTS"):
            result = planner.solve(problem)
    assert result.status is Status.UNSUPPORTED_PROBLEM
    assert "conditional effects" in result.log_messages[0].message


@pytest.mark.parametrize(("name", "words"), [("sign-model", "MAP"), ("sign-model-opt", "A*")])
def test_each_engine_is_credited_for_what_it_does(name, words):
    credits = ENGINES[name].get_credits()
    assert credits.name == name and words in credits.short_description


def test_the_output_says_what_was_found():
    output = io.StringIO()
    solved("sign-model", EXAMPLES["basic"].problem, output_stream=output)
    assert output.getvalue().startswith("sign-model: PlanResult(SOLVED, 1 step,")
