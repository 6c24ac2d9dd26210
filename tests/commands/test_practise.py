"""`srt-jax practise` and `plan --experience`: what small problems teach, kept in a file."""

import json

import pytest

import sign_model
from sign_model import load_memory
from srt_jax.cli import run

DOMAIN = """(define (domain ferry)
 (:predicates (at ?c ?p) (boat ?p) (on ?c) (free) (port ?p) (car ?c))
 (:action sail :parameters (?a ?b) :precondition (and (port ?a) (port ?b) (boat ?a))
  :effect (and (boat ?b) (not (boat ?a))))
 (:action board :parameters (?c ?p) :precondition (and (car ?c) (at ?c ?p) (boat ?p) (free))
  :effect (and (on ?c) (not (at ?c ?p)) (not (free))))
 (:action leave :parameters (?c ?p) :precondition (and (port ?p) (on ?c) (boat ?p))
  :effect (and (at ?c ?p) (free) (not (on ?c)))))"""


def problem(cars, domain="ferry"):
    names = [f"c{i}" for i in range(cars)]
    start = " ".join(f"(car {name}) (at {name} here)" for name in names)
    goal = " ".join(f"(at {name} there)" for name in names)
    return (
        f"(define (problem p{cars}) (:domain {domain}) (:objects {' '.join(names)} here there)"
        f" (:init (port here) (port there) (boat here) (free) {start}) (:goal (and {goal})))"
    )


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "domain.pddl").write_text(DOMAIN)
    for cars in (1, 2, 3, 6):
        (tmp_path / f"p{cars}.pddl").write_text(problem(cars))
    return tmp_path


def practised(*options):
    return run(["practise", "domain.pddl", "p1.pddl", "p2.pddl", "p3.pddl", *options])


def expansions(capsys, *options):
    capsys.readouterr()
    assert run(["plan", "domain.pddl", "p6.pddl", "--json", *options]) == 0
    document = json.loads(capsys.readouterr().out)
    return len(document["actions"]), document["expansions"]


def test_what_small_problems_teach_serves_a_larger_one(here, capsys):
    assert practised("--out", "known.json") == 0
    out, err = capsys.readouterr()
    assert out.startswith("3 problems: ") and "Wrote known.json." in err
    (skill,) = load_memory("known.json").skills
    assert skill.domain.startswith("ferry")
    length, without = expansions(capsys)
    learned_length, with_it = expansions(capsys, "--experience", "known.json")
    assert learned_length <= length and with_it < without


def test_a_second_domain_joins_the_first(here, capsys):
    (here / "other.pddl").write_text(DOMAIN.replace("ferry", "barge").replace("board", "load"))
    (here / "q2.pddl").write_text(problem(2, "barge"))
    assert practised("--out", "known.json") == 0
    assert run(["practise", "other.pddl", "q2.pddl", "--out", "known.json"]) == 0
    assert len(load_memory("known.json").skills) == 2


def test_a_plan_that_is_remembered_is_recalled(here, capsys):
    first, _ = expansions(capsys, "--experience", "plans.json", "--remember")
    assert expansions(capsys, "--experience", "plans.json") == (first, 1)
    assert len(load_memory("plans.json").precedents) == 1


def test_signs_and_a_rule_of_ones_own_are_taken_up(here, capsys):
    overlap = sign_model.HeuristicSign("overlap", unmet={"*": 1})
    sign_model.save_signs("signs.json", [overlap])
    sign_model.save_rule("rule.json", sign_model.PlanningRule("mine", {"curiously": 500}))
    task = sign_model.load(here / "domain.pddl", here / "p6.pddl")
    for options, given in (
        (["--signs", "signs.json"], {"heuristic": overlap}),
        (["--rule", "rule.json"], {"rule": sign_model.load_rule("rule.json")}),
    ):
        expected = sign_model.plan(task, **given)
        assert expansions(capsys, *options) == (len(expected.actions), expected.expansions)
        assert expected.expansions != sign_model.plan(task).expansions


def test_what_is_wrong_is_said_in_a_line(here, capsys):
    for options, words in (
        (["plan", "domain.pddl", "p1.pddl", "--remember"], "--remember needs --experience FILE"),
        (["plan", "domain.pddl", "p1.pddl", "--experience", "lost.json"], "no such file"),
        (["plan", "domain.pddl", "p1.pddl", "--signs", "lost.json"], "no such file"),
        (["plan", "domain.pddl", "p1.pddl", "--rule", "domain.pddl"], "not a planning rule"),
        (["plan", "domain.pddl", "p1.pddl", "--planner", "gbfs", "--rule", "r"], "--signs and"),
        (["practise", "domain.pddl", "domain.pddl", "--out", "x.json"], "this is a domain"),
        (["practise", "domain.pddl", "p1.pddl"], "--out"),
    ):
        assert run(options) == 2
        err = capsys.readouterr().err
        assert words in err and "Traceback" not in err
    (here / "no.json").write_text("{}")
    assert practised("--out", "no.json") == 2
    assert "not a memory" in capsys.readouterr().err
    assert (here / "no.json").read_text() == "{}" and not (here / "x.json").exists()
