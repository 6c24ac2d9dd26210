"""PDDL as others write it: what is odd but means something is read, what goes beyond STRIPS is
refused by name and line.

`odd_inputs/pddl` holds the files; damaged and random text must end in a task or one `PddlError`.
"""

import json
import os
import pathlib
import random

import numpy as np
import pytest

import sign_model
from sign_model.clock import Clock, OutOfTime
from sign_model.forward_search.relaxation import make_heuristic
from sign_model.map_algorithm.regression import regression_space
from sign_model.map_batch.ladder import plan_batch
from sign_model.pddl import grounding, syntax
from sign_model.pddl.grounding import ground, load
from sign_model.pddl.planning_task import task_from_arrays
from sign_model.pddl.reader import parse
from sign_model.pddl.syntax import PddlError, read_form
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.result import PlanStatus
from sign_model.signs.from_tasks import world_model_of
from srt_jax.cli import run
from tests.helpers.odd import damaged

ODD = pathlib.Path(__file__).resolve().parents[2] / "odd_inputs" / "pddl"
PLANNERS = ("map", "astar", "wastar", "gbfs")

MOVE = """(define (domain d) (:predicates (p ?x) (q ?x))
 (:action a :parameters (?x) :precondition (p ?x) :effect (and (q ?x) (not (p ?x)))))"""


def problem(init="(p o)", goal="(q o)", objects="o", rest=""):
    return (
        f"(define (problem t) (:domain d)\n(:objects {objects})\n(:init {init})\n(:goal"
        f" {goal})\n{rest})"
    )


def domain(precondition="()", effect="(q ?x)", parameters="?x", rest=""):
    return (
        f"(define (domain d)\n(:predicates (p ?x) (q ?x) (r))\n{rest}\n"
        f"(:action a :parameters ({parameters})\n:precondition {precondition}\n:effect {effect}))"
    )


# Files of tests/odd_inputs/pddl ------------------------------------------------------------------

PLANS = (
    ("roads", "cost_5e9", ["(go x y)", "(go y z)"]),
    ("roads", "bom", ["(go x y)", "(go y z)"]),
    ("roads_warm", "unused_function", ["(go x y)", "(go y z)"]),
    ("nothing_to_do_domain", "nothing_to_do", []),
    ("glued_domain", "glued_problem", ["(fuel a1)"]),
)


@pytest.mark.parametrize(("domain_file", "problem_file", "actions"), PLANS)
def test_odd_files_are_planned(domain_file, problem_file, actions, capsys):
    files = [str(ODD / f"{name}.pddl") for name in (domain_file, problem_file)]
    assert run(["plan", *files, "--planner", "astar", "--json"]) == 0
    out = json.loads(capsys.readouterr().out)
    assert (out["status"], out["actions"]) == ("SOLVED", actions)


REFUSED = (
    (
        "roads",
        "metric_maximize",
        "metric_maximize.pddl:3",
        "only (:metric minimize (total-cost)) is understood",
    ),
    (
        "roads",
        "metric_other",
        "metric_other.pddl:3",
        "'fuel' is not declared in (:functions ...), and only",
    ),
    (
        "oneof_domain",
        "oneof_problem",
        "oneof_domain.pddl:5",
        "'oneof' goes beyond STRIPS (non-deterministic effects)",
    ),
    (
        "numeric_domain",
        "numeric_problem",
        "numeric_domain.pddl:6",
        "'>=' goes beyond STRIPS (numeric conditions)",
    ),
    (
        "notand_domain",
        "notand_problem",
        "notand_domain.pddl:5",
        "'not' over 'and' goes beyond STRIPS",
    ),
    (
        "tool_domain",
        "tool_problem",
        "tool_domain.pddl:5",
        "'spade' is an object of the problem: declare it in the domain's",
    ),
)


@pytest.mark.parametrize(("domain_file", "problem_file", "place", "message"), REFUSED)
def test_files_beyond_strips_are_refused_in_one_line(
    domain_file, problem_file, place, message, capsys
):
    assert run(["plan", *(str(ODD / f"{name}.pddl") for name in (domain_file, problem_file))]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and place in err and message in err


# Refusals: file, line, feature -------------------------------------------------------------------

COSTS = "(:functions (total-cost) (f ?x) (g ?x) - number)"
COST = "(and (q ?x) (increase (total-cost) {}))"
METRIC = "(:metric minimize (total-cost))"

BEYOND = {
    "when": (
        domain(effect="(when (p ?x) (q ?x))"),
        problem(),
        "<domain>:6: 'when' goes beyond STRIPS (conditional effects)",
    ),
    "forall": (
        domain("(forall (?y) (p ?y))"),
        problem(),
        "<domain>:5: 'forall' goes beyond STRIPS (quantified",
    ),
    "exists": (
        domain("(and (r) (exists (?y) (p ?y)))"),
        problem(),
        "<domain>:5: 'exists' goes beyond STRIPS",
    ),
    "imply": (
        domain("(imply (r) (p ?x))"),
        problem(),
        "<domain>:5: 'imply' goes beyond STRIPS (implications)",
    ),
    "or": (
        domain("(or (r) (p ?x))"),
        problem(),
        "<domain>:5: 'or' goes beyond STRIPS (disjunctions)",
    ),
    "preference": (
        domain("(preference n (r))"),
        problem(),
        "<domain>:5: 'preference' goes beyond STRIPS (preferences)",
    ),
    "less": (
        domain("(< (f ?x) 3)"),
        problem(),
        "<domain>:5: '<' goes beyond STRIPS (numeric conditions)",
    ),
    "equal numbers": (
        domain("(= (f ?x) 3)"),
        problem(),
        "<domain>:5: '=' goes beyond STRIPS (numeric conditions)",
    ),
    "assign": (
        domain(effect="(assign (f ?x) 3)"),
        problem(),
        "<domain>:6: 'assign' goes beyond STRIPS (numeric effects)",
    ),
    "other fluent": (
        domain(effect="(increase (f ?x) 3)"),
        problem(),
        "<domain>:6: only (increase (total-cost)",
    ),
    "probabilistic": (
        domain(effect="(probabilistic 0.5 (r))"),
        problem(),
        "<domain>:6: 'probabilistic' goes beyond STRIPS",
    ),
    "not over or": (
        domain("(not (or (r) (p ?x)))"),
        problem(),
        "<domain>:5: 'or' goes beyond STRIPS",
    ),
    "not over not": (
        domain("(not (not (r)))"),
        problem(),
        "<domain>:5: 'not' over 'not' goes beyond STRIPS",
    ),
    "not of nothing": (domain("(not)"), problem(), "<domain>:5: 'not' takes exactly one atom"),
    "not of a word": (domain("(not r)"), problem(), "<domain>:5: 'r' is where a form"),
    "durative action": (
        domain(rest="(:durative-action b)"),
        problem(),
        "<domain>:3: ':durative-action' goes beyond STRIPS",
    ),
    "derived predicate": (
        domain(rest="(:derived (r) (q))"),
        problem(),
        "<domain>:3: ':derived' goes beyond STRIPS",
    ),
    "domain constraints": (
        domain(rest="(:constraints (r))"),
        problem(),
        "<domain>:3: ':constraints' goes beyond STRIPS",
    ),
    "problem constraints": (
        domain(),
        problem(rest="(:constraints (r))"),
        "<problem>:5: ':constraints' goes beyond STRIPS",
    ),
    "process": (
        domain(rest="(:process b)"),
        problem(),
        "<domain>:3: ':process' goes beyond STRIPS",
    ),
    "requirement": (
        domain(rest="(:requirements :stirps)"),
        problem(),
        "<domain>:3: requirement ':stirps' is not known",
    ),
    "timed literal": (
        domain(),
        problem("(p o)\n(at 5 (r))"),
        "<problem>:4: 'at' goes beyond STRIPS (timed initial literals)",
    ),
    "oneof in init": (
        domain(),
        problem("(oneof (r) (p o))"),
        "<problem>:3: 'oneof' goes beyond STRIPS",
    ),
    "and in init": (
        domain(),
        problem("(and (r) (p o))"),
        "<problem>:3: 'and' has no place in :init",
    ),
    "goal equality": (domain(), problem(goal="(= o o)"), "<problem>:4: '=' has no place in a goal"),
    "effect equality": (
        domain(effect="(= ?x ?x)"),
        problem(),
        "<domain>:6: '=' has no place in an effect",
    ),
    "goal exists": (
        domain(),
        problem(goal="(exists (?y) (q ?y))"),
        "<problem>:4: 'exists' goes beyond STRIPS",
    ),
    "word of PDDL": (
        domain().replace("(r)", "(or)"),
        problem(),
        "<domain>:2: 'or' is a word of PDDL",
    ),
    "empty declaration": (
        domain().replace("(r)", "()"),
        problem(),
        "<domain>:2: () is in (:predicates ...)",
    ),
    "empty either": (
        domain(parameters="?x - (either)"),
        problem(),
        "<domain>:4: a type is a name, or (either",
    ),
    "nested either": (
        domain(parameters="?x - (either (a))"),
        problem(),
        "<domain>:4: a form in parentheses",
    ),
    "variable as object": (
        domain(),
        problem(objects="?o o"),
        "<problem>:2: '?o' is no name of an object",
    ),
    "variable as constant": (
        domain(rest="(:constants ?c)"),
        problem(),
        "<domain>:3: '?c' is no name of an object",
    ),
    "two metrics": (
        domain(rest=COSTS),
        problem(rest=METRIC + "\n" + METRIC),
        "<problem>:6: a problem has at most one",
    ),
    "metric of time": (
        domain(rest=COSTS),
        problem(rest="(:metric minimize (total-time))"),
        "<problem>:5: only (:metric min",
    ),
    "metric sum": (
        domain(rest=COSTS),
        problem(rest="(:metric minimize (+ (f o) 1))"),
        "<problem>:5: only (:metric minimize",
    ),
    "metric alone": (
        domain(rest=COSTS),
        problem(rest="(:metric)"),
        "<problem>:5: only (:metric minimize (total-cost))",
    ),
    "metric of a function": (
        domain(rest=COSTS),
        problem(rest="(:metric minimize (f o))"),
        "<problem>:5: only (:metric",
    ),
    "a product": (
        domain(effect=COST.format("(* 2 (f ?x))"), rest=COSTS),
        problem(),
        "<domain>:6: '*' is not understood",
    ),
    "cost of itself": (
        domain(effect=COST.format("(total-cost)"), rest=COSTS),
        problem(),
        "<domain>:6: (total-cost) cannot",
    ),
    "undeclared cost": (
        domain(effect=COST.format("(h ?x)"), rest=COSTS),
        problem(),
        "<domain>:6: 'h' is not declared",
    ),
    "a fraction": (
        domain(effect=COST.format("2.5"), rest=COSTS),
        problem(),
        "<domain>:6: '2.5' is a fraction",
    ),
    "below 0": (
        domain(effect=COST.format("-2"), rest=COSTS),
        problem(),
        "<domain>:6: '-2' is below 0",
    ),
    "inf": (
        domain(effect=COST.format("inf"), rest=COSTS),
        problem(),
        "<domain>:6: 'inf' is no cost",
    ),
    "nan": (
        domain(effect=COST.format("nan"), rest=COSTS),
        problem(),
        "<domain>:6: 'nan' is no cost",
    ),
    "underscores": (
        domain(effect=COST.format("1_000"), rest=COSTS),
        problem(),
        "<domain>:6: '1_000' is no cost",
    ),
    "too large": (
        domain(effect=COST.format("1e13"), rest=COSTS),
        problem(),
        "<domain>:6: '1e13' is too large",
    ),
    "400 digits": (
        domain(effect=COST.format("9" * 400), rest=COSTS),
        problem(),
        "' is too large: the greatest cost is 1,000,",
    ),
    "an object as number": (
        domain(rest=COSTS),
        problem("(= (f o) o)"),
        "<problem>:3: 'o' is no number",
    ),
    "two numbers": (
        domain(effect=COST.format("(f ?x)"), rest=COSTS),
        problem("(= (f o) 1) (= (f o) 2)", rest=METRIC),
        "<problem>:3: (f o) is given two numbers",
    ),
    "no number": (
        domain(effect=COST.format("(f ?x)"), rest=COSTS),
        problem("(= (g o) 1)", rest=METRIC),
        "<problem>:3: (f o) has no number, and (a o) needs it as its cost",
    ),
    "a sum too large": (
        domain(effect=COST.format("(+ (f ?x) 1000000000000)"), rest=COSTS),
        problem("(= (f o) 1)", rest=METRIC),
        "<problem>:3: (a o) costs 1,000,000,000,001, more than",
    ),
    "a control character": (
        domain(rest="(:constants a\x1bb)"),
        problem(),
        "<domain>:3: not a text file in UTF-8: the sign U+",
    ),
}


@pytest.mark.parametrize("kind", BEYOND)
def test_what_is_not_understood_is_named_with_file_and_line(kind):
    domain_text, problem_text, expected = BEYOND[kind]
    with pytest.raises(PddlError) as caught:
        load(domain_text, problem_text)
    message = str(caught.value)
    assert (
        expected in message and "\n" not in message and len(message) < 300 and message.isprintable()
    ), message


# Costs -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cost", "values", "total"),
    [
        ("(f ?x)", "(= (f o) 3)", 3),
        ("(f ?x)", "(= (f o) 3.0) (= (total-cost) 0)", 3),
        ("(f ?x)", "(= (f o) 5000000000)", 5_000_000_000),
        ("(+ (f ?x) 2 (+ (g ?x)))", "(= (f o) 3) (= (g o) 1e2)", 105),
        ("0", "(= (f o) -3.5) (= (g o) nan)", 0),
        ("1000000000000", "", 10**12),
    ],
)
def test_costs_are_whole_numbers_and_sums_of_functions(cost, values, total):
    task = load(domain(effect=COST.format(cost), rest=COSTS), problem(values, rest=METRIC))
    assert task.costs.dtype == np.int64 and task.costs.tolist() == [total]


def test_a_cost_without_a_number_matters_only_where_an_action_can_need_it():
    text = domain("(p ?x)", effect=COST.format("(f ?x)"), rest=COSTS)
    assert load(text, problem("(p o) (= (f o) 7)", objects="o n", rest=METRIC)).costs.tolist() == [
        7
    ]
    # no metric: steps are counted
    assert load(text, problem("(p o)", objects="o n")).costs.tolist() == [1]


def test_large_costs_are_summed_exactly():
    needs, adds = np.zeros((3, 4), bool), np.zeros((3, 4), bool)
    adds[0, 1] = needs[1, 1] = adds[1, 2] = adds[2, 2] = True
    start, goal = np.eye(4, dtype=bool)[0], np.eye(4, dtype=bool)[2]
    big = 1 << 24
    task = task_from_arrays(
        needs, adds, np.zeros((3, 4), bool), start, goal, np.array([big, 1, big + 2])
    )
    assert make_heuristic("hmax", task)(start[None]).tolist() == [big + 1]
    assert plan(task, planner="astar").actions == ("(a0)", "(a1)")
    for wrong in (np.array([1, -1, 1]), np.array([1.0, np.nan, 1.0]), np.array([1, 1])):
        with pytest.raises(ValueError, match="costs must be whole numbers"):
            task_from_arrays(needs, adds, adds & ~adds, start, goal, wrong)


# Text --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-32", "utf-8"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_every_encoding_and_line_end_is_read(encoding, end, tmp_path):
    text = "; a comment\n" + MOVE.replace("(p ?x)", "(p\t?x)\f").replace("(q ?x)", "(Q\u00a0?X)")
    (tmp_path / "d.pddl").write_bytes(text.replace("\n", end).encode(encoding))
    (tmp_path / "p.pddl").write_bytes(problem().replace("\n", end).encode(encoding))
    assert plan(load(tmp_path / "d.pddl", tmp_path / "p.pddl")).actions == ("(a o)",)
    (tmp_path / "p.pddl").write_bytes(
        problem(goal="(nosuch o)").replace("\n", end).encode(encoding)
    )
    with pytest.raises(PddlError, match=r"p\.pddl:4: 'nosuch' is not declared"):
        load(tmp_path / "d.pddl", tmp_path / "p.pddl")


def test_bytes_of_another_encoding_are_skipped_in_comments_and_refused_elsewhere(tmp_path):
    path = tmp_path / "d.pddl"
    path.write_bytes(b"; stra\xdfe\n" + MOVE.encode())
    assert plan(load(path, problem())).actions == ("(a o)",)
    path.write_bytes(MOVE.replace("(q ?x))", "(q ?x) (stra\u00dfe))", 1).encode("latin-1"))
    with pytest.raises(PddlError, match=r"d\.pddl:1: not a text file in UTF-8: the byte 0xDF"):
        load(path, problem())
    path.write_bytes(MOVE.encode("utf-16-le"))
    with pytest.raises(PddlError, match=r"d\.pddl:1: not a text file in UTF-8: the sign U\+0000"):
        load(path, problem())


def test_a_question_mark_begins_a_word():
    assert read_form("(at?x ?y?z)", "f") == ["at", "?x", "?y", "?z"]


def test_a_path_may_hold_a_parenthesis(tmp_path):
    path = tmp_path / "domain (2).pddl"
    path.write_text(MOVE)
    assert load(str(path), problem()).action_names == ("(a o)",)


def test_only_regular_files_of_bounded_size_are_read(tmp_path, monkeypatch):
    with pytest.raises(PddlError, match="it is a folder"):
        load(tmp_path, problem())
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(PddlError, match="it is a pipe"):
            load(tmp_path / "pipe", problem())
    (tmp_path / "d.pddl").write_text(MOVE)
    monkeypatch.setattr(syntax, "MAX_BYTES", 20)
    with pytest.raises(PddlError, match="at most 20 are read"):
        load(tmp_path / "d.pddl", problem())


def test_names_ignore_case_and_long_words_are_shortened_in_messages():
    assert plan(load(MOVE.upper(), problem(objects="O", init="(P o)"))).actions == ("(a o)",)
    with pytest.raises(PddlError) as caught:
        load(MOVE, problem(goal=f"({'x' * 5000})"))
    assert len(str(caught.value)) < 200


def test_a_predicate_may_be_called_like_a_feature():
    text = MOVE.replace("(p ?x)", "(within ?x)")
    assert plan(load(text, problem("(within o)"))).actions == ("(a o)",)


@pytest.mark.parametrize("depth", [5_000, 20_000])
def test_forms_of_any_depth_are_read(depth):
    def nested(atom):
        return "(and " * depth + atom + ")" * depth

    text = MOVE.replace(":precondition (p ?x)", f":precondition {nested('(p ?x)')}")
    assert plan(load(text, problem(goal=nested("(q o)")))).actions == ("(a o)",)
    with pytest.raises(PddlError, match="never closed"):
        load("(" * depth, problem())
    with pytest.raises(PddlError, match="'not' over 'not'"):
        load(MOVE, problem(goal="(not " * depth + "(q o)" + ")" * depth))


def test_damaged_files_end_in_a_task_or_one_error(tmp_path):
    path = tmp_path / "d.pddl"
    refused = 0
    for name in ("roads", "two_hands_domain"):
        other = {"roads": "cost_5e9", "two_hands_domain": "two_hands_6"}[name]
        contents = {part: (ODD / f"{part}.pddl").read_bytes() for part in (name, other)}
        for part in (name, other):
            for broken in damaged(contents[part], seed=7, count=60):
                path.write_bytes(broken)
                files = [path if one == part else ODD / f"{one}.pddl" for one in (name, other)]
                try:
                    load(*files)
                except PddlError as error:
                    refused += 1
                    assert "\n" not in str(error) and ".pddl" in str(error)
    assert 100 < refused < 240


def test_random_words_end_in_a_task_or_one_error():
    odd = "( ) (and (or (not (= - ?x :goal 3 nan (either (increase ;"
    words = [*MOVE.split(), *problem(rest=METRIC).split(), *odd.split()]
    rng = random.Random(3)
    for _ in range(400):
        text = problem().split(" ")
        for _ in range(rng.randrange(1, 4)):
            text[rng.randrange(len(text))] = rng.choice(words)
        try:
            load(MOVE, " ".join(text))
        except PddlError as error:
            assert "\n" not in str(error)


# Nothing to do, too much to do, no time to do it --------------------------------------------------


def test_a_goal_that_holds_where_nothing_can_be_done_takes_no_step():
    task = load(ODD / "nothing_to_do_domain.pddl", ODD / "nothing_to_do.pddl")
    assert (task.num_features, task.num_actions) == (0, 0)
    for planner in PLANNERS:
        result = plan(task, planner=planner)
        assert (result.status, result.actions) == (PlanStatus.SOLVED, ())
    assert plan_batch([task, task])[1].status == PlanStatus.SOLVED
    assert sign_model.describe(world_model_of(task)).startswith("World model")
    assert plan(load(domain("(r)"), problem())).status == PlanStatus.UNSOLVABLE


WIDE = """(define (domain d) (:predicates (p ?x) (q) (r ?x ?y ?z))
 (:action a :parameters (?a ?b ?c ?d ?e ?f ?g ?h) :precondition ({}) :effect (q)))"""


def test_too_many_ground_actions_are_refused_with_the_limit_and_what_to_do(monkeypatch):
    monkeypatch.setattr(grounding, "MAX_ACTIONS", 1000)
    many = problem(
        " ".join(f"(p o{i})" for i in range(100)), "(q)", " ".join(f"o{i}" for i in range(100))
    )
    for condition in ("", "and (p ?a) (p ?b) (p ?c) (p ?d) (p ?e) (p ?f) (p ?g) (p ?h)"):
        with pytest.raises(
            PddlError,
            match=r"<problem>: more than 1,000 ground actions, most of them of 'a': name fewer",
        ):
            load(WIDE.format(condition), many)
    few = many.replace("(:init ", "(:init (r o1 o2 o3) (r o3 o4 o5) (r o6 o7 o8) ")
    bound = load(WIDE.format("and (p ?a) (r ?a ?b ?c) (r ?c ?d ?e) (r ?f ?g ?h)"), few)
    assert bound.action_names == (
        "(a o1 o2 o3 o4 o5 o1 o2 o3)",
        "(a o1 o2 o3 o4 o5 o3 o4 o5)",
        "(a o1 o2 o3 o4 o5 o6 o7 o8)",
    )


def test_where_matrices_would_be_too_large_only_what_the_goal_needs_is_kept(monkeypatch):
    objects = " ".join(f"o{i}" for i in range(100))
    start = " ".join(f"(p o{i})" for i in range(100))
    monkeypatch.setattr(grounding, "MAX_CELLS", 1000)
    task = load(MOVE, problem(start, "(and (q o3) (q o70))", objects))
    assert task.action_names == ("(a o3)", "(a o70)") and task.num_features == 4
    assert (
        sorted(plan(task).actions) == ["(a o3)", "(a o70)"]
        and validate(task, plan(task).actions) == []
    )
    with pytest.raises(
        PddlError, match=r"100 ground actions with 200 features, more than 1,000 cells"
    ):
        load(
            MOVE, problem(start, "(and " + " ".join(f"(q o{i})" for i in range(100)) + ")", objects)
        )


def test_a_regression_leaves_out_features_that_no_goal_needs(monkeypatch):
    task = load(MOVE, problem("(p o) (p n) (p m)", "(q n)", "o n m"))
    whole = regression_space(task)
    monkeypatch.setattr("sign_model.map_algorithm.regression.MAX_FEATURES", 2)
    small = regression_space(task)
    for name in (
        "features",
        "kept_features",
        "kept_actions",
        "conditions",
        "adds",
        "deletes",
        "bad",
        "mutex",
    ):
        np.testing.assert_array_equal(getattr(small, name), getattr(whole, name))
    monkeypatch.setattr("sign_model.map_algorithm.regression.MAX_FEATURES", 1)
    with pytest.raises(ValueError, match="the goal can depend on 2 features, more than the 1"):
        plan(task)
    assert plan(task, planner="gbfs").is_solved


class Ending(Clock):
    """A clock whose time is over after it was asked a number of times."""

    def __init__(self, times):
        super().__init__()
        self.times = times

    def is_over(self):
        self.times -= 1
        return self.times < 0


def test_the_time_limit_is_asked_while_reading_and_grounding():
    many = problem(
        " ".join(f"(p o{i})" for i in range(3000)), "(q o1)", " ".join(f"o{i}" for i in range(3000))
    )
    with pytest.raises(OutOfTime):
        parse(MOVE, many, clock=Ending(0))
    lifted = parse(MOVE, many)
    asked = Ending(10**9)
    ground(*lifted, clock=asked)
    assert 10**9 - asked.times >= 5
    for times in range(10**9 - asked.times):
        with pytest.raises(OutOfTime):
            ground(*lifted, clock=Ending(times))
    with pytest.raises(OutOfTime) as caught:
        load(MOVE, many, max_seconds=0)
    assert set(caught.value.seconds) == {"parse", "build"}


@pytest.mark.parametrize("planner", PLANNERS)
def test_wherever_the_time_ends_the_budget_is_spent_or_the_plan_is_the_same(planner, monkeypatch):
    task = load(ODD / "two_hands_domain.pddl", ODD / "two_hands_6.pddl")
    whole = plan(task, planner=planner)
    seen = set()
    for times in (0, 1, 2, 3, 5, 8, 13, 21, 50, 100, 10**9):
        monkeypatch.setattr("sign_model.plan_task.Clock", lambda _, times=times: Ending(times))
        result = plan(task, planner=planner)
        seen.add(result.status)
        if result.is_solved:
            assert validate(task, result.actions) == []
        else:
            assert (
                result.status == PlanStatus.BUDGET_SPENT and result.expansions <= whole.expansions
            )
    assert result == whole or (result.actions, result.expansions) == (
        whole.actions,
        whole.expansions,
    )
    assert seen == {PlanStatus.SOLVED, PlanStatus.BUDGET_SPENT}


def test_a_limit_of_time_is_a_number_from_0_up():
    task = load(MOVE, problem())
    for wrong in (-1.0, float("nan")):
        with pytest.raises(ValueError, match="max_seconds must be 0 or more"):
            plan(task, max_seconds=wrong)


def test_a_spent_budget_hints_at_what_else_to_try(capsys):
    files = [str(ODD / name) for name in ("two_hands_domain.pddl", "two_hands_6.pddl")]
    for arguments, answer in (
        (
            ["--max-expansions", "1"],
            "; try another planner, --planner gbfs, or raise --max-expansions",
        ),
        (["--max-expansions", "1", "--planner", "gbfs"], "; try another planner, --planner map"),
        (["--max-seconds", "0"], "; the time ended before the search began: raise --max-seconds"),
    ):
        assert run(["plan", *files, *arguments]) == 3
        out, err = capsys.readouterr()
        assert (
            out == ""
            and err.startswith("; BUDGET_SPENT")
            and err.splitlines()[1].startswith(answer)
        )
    assert run(["plan", *files, "--max-seconds", "0", "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "BUDGET_SPENT" and set(answer["seconds"]) == {
        "parse",
        "build",
        "search",
        "validate",
    }
