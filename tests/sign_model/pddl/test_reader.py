"""PDDL in: what is read, and the message of each kind of error."""

import pytest

from sign_model.pddl.grounding import load
from sign_model.pddl.reader import parse
from sign_model.pddl.syntax import PddlError

DOMAIN = """(define (domain lamps)
  (:requirements :strips :typing :negative-preconditions :equality :action-costs)
  (:types lamp switch - device room)
  (:constants hall - room)
  (:predicates (in ?d - device ?r - room) (on ?l - lamp) (wired ?s - switch ?l - lamp) (dark))
  (:functions (total-cost) - number (effort ?r - room) - number)
  (:action press
    :parameters (?s - switch ?l - lamp ?r - room)
    :precondition (and (in ?s ?r) (wired ?s ?l) (not (on ?l)) (not (= ?r hall)))
    :effect (and (on ?l) (not (dark)) (increase (total-cost) (effort ?r)))))
"""
PROBLEM = """(define (problem one)
  (:domain lamps)
  (:objects kitchen - room a b - lamp s - switch)
  (:init (in s kitchen) (wired s a) (dark) (= (effort kitchen) 3) (= (effort hall) 1))
  (:goal (and (on a) (not (dark))))
  (:metric minimize (total-cost)))
"""


def test_every_file_of_the_outside_data_is_read(shared_data):
    for folder in ("blocks", "hanoi", "ferry", "goldminer"):
        files = [
            path
            for path in sorted((shared_data / "pddl" / folder).glob("*.pddl"))
            if path.name != "domain.pddl"
        ]
        assert files
        for path in files:
            parse(shared_data / "pddl" / folder / "domain.pddl", path)


def test_types_constants_costs_and_negation_are_read():
    domain, problem = parse(DOMAIN, PROBLEM)
    (press,) = domain.schemas
    assert press.roles == (("?s", ("switch",)), ("?l", ("lamp",)), ("?r", ("room",)))
    assert press.negative_conditions == (("on", "?l"),)
    assert press.equalities == (("?r", "hall", False),)
    assert press.costs == (("effort", "?r"),)
    assert problem.objects["hall"] == ("room",)
    assert problem.values[("effort", "kitchen")] == 3
    assert problem.negative_goal == (("dark",),)


def test_upper_and_lower_case_are_the_same():
    assert parse(DOMAIN.upper(), PROBLEM) == parse(DOMAIN, PROBLEM.upper())


def test_an_object_of_either_type_fills_roles_of_both():
    domain = DOMAIN.replace("?d - device ?r", "?d - (either lamp switch) ?r")
    assert load(domain, PROBLEM).num_actions == 1


def test_types_that_an_untyped_domain_does_not_know_are_taken_for_object():
    domain = "(define (domain d) (:predicates (p ?x)) (:action a :parameters (?x) :effect (p ?x)))"
    problem = "(define (problem q) (:domain d) (:objects b - block) (:init) (:goal (p b)))"
    assert load(domain, problem).action_names == ("(a b)",)


MALFORMED = {
    "an open parenthesis": (DOMAIN[:-3], PROBLEM, "<domain>", "never closed"),
    "a parenthesis too many": (DOMAIN + ")", PROBLEM, "<domain>:11", "one ')' too many"),
    "an empty text": (DOMAIN, "()", "<problem>", "begin with (define"),
    "words before the first parenthesis": (
        "lamps " + DOMAIN,
        PROBLEM,
        "<domain>:1",
        "before the first",
    ),
    "no domain name": (
        DOMAIN.replace("(domain lamps)", "(domain)"),
        PROBLEM,
        "<domain>:1",
        "(domain NAME)",
    ),
    "a problem where the domain belongs": (PROBLEM, PROBLEM, "<domain>:1", "(domain NAME)"),
    "another domain": (
        DOMAIN,
        PROBLEM.replace("lamps", "doors"),
        "<problem>:2",
        "given is 'lamps': give the domain",
    ),
    "an unknown section": (
        DOMAIN.replace(":constants", ":things"),
        PROBLEM,
        "<domain>:4",
        "':things' is not known",
    ),
    "an undeclared predicate": (
        DOMAIN.replace("(not (dark))", "(not (bright))"),
        PROBLEM,
        "<domain>:10",
        "'bright' is not declared",
    ),
    "a wrong arity": (
        DOMAIN,
        PROBLEM.replace("(wired s a)", "(wired s)"),
        "<problem>:4",
        "1 argument(s), declared with 2",
    ),
    "an unknown variable": (
        DOMAIN.replace("(on ?l) (not (dark))", "(on ?k) (not (dark))"),
        PROBLEM,
        "<domain>:10",
        "'?k' is not known",
    ),
    "an unknown object": (
        DOMAIN,
        PROBLEM.replace("(on a)", "(on z)"),
        "<problem>:5",
        "'z' is not known",
    ),
    "an unknown type": (
        DOMAIN.replace("hall - room", "hall - floor"),
        PROBLEM,
        "<domain>:4",
        "type 'floor' is not declared",
    ),
    "a wrong type": (
        DOMAIN,
        PROBLEM.replace("(wired s a)", "(wired a s)"),
        "<problem>:4",
        "'a' is a lamp, 'wired' needs a switch",
    ),
    "types in a circle": (
        DOMAIN.replace("room)", "room lamp - lamp)", 1),
        PROBLEM,
        "<domain>:3",
        "its own ancestor",
    ),
    "a dangling dash": (
        DOMAIN,
        PROBLEM.replace("s - switch", "s -"),
        "<problem>:3",
        "'-' must come between",
    ),
    "a parameter twice": (
        DOMAIN.replace("?l - lamp ?r - room)\n", "?s - lamp ?r - room)\n"),
        PROBLEM,
        "<domain>:8",
        "given twice",
    ),
    "a parameter without '?'": (
        DOMAIN.replace("(?s - switch", "(s - switch"),
        PROBLEM,
        "<domain>:8",
        "begin with '?'",
    ),
    "an action twice": (
        DOMAIN[:-2] + "(:action press :effect (dark)))",
        PROBLEM,
        "<domain>:10",
        "defined twice",
    ),
    "an action without effect": (
        DOMAIN.replace(":effect", ":affect"),
        PROBLEM,
        "<domain>:10",
        "':affect' is not known",
    ),
    "a disjunction": (
        DOMAIN.replace("(and (in", "(or (in"),
        PROBLEM,
        "<domain>:9",
        "'or' goes beyond STRIPS",
    ),
    "a conditional effect": (
        DOMAIN.replace("(and (on ?l)", "(and (when (dark) (on ?l))"),
        PROBLEM,
        "<domain>:10",
        "'when' goes",
    ),
    "a derived predicate": (
        DOMAIN[:-2] + "(:derived (p) (dark)))",
        PROBLEM,
        "<domain>:10",
        "':derived' goes beyond",
    ),
    "no goal": (
        DOMAIN,
        PROBLEM.replace("(:goal (and (on a) (not (dark))))", ""),
        "<problem>:1",
        "exactly one (:goal ...)",
    ),
    "a negative cost": (
        DOMAIN,
        PROBLEM.replace("kitchen) 3", "kitchen) -3"),
        "<problem>:4",
        "costs are whole numbers",
    ),
    "an object of two types": (
        DOMAIN,
        PROBLEM.replace("s - switch", "s - switch a - room"),
        "<problem>:3",
        "declared twice",
    ),
    "a predicate twice": (
        DOMAIN.replace("(dark))\n", "(dark) (dark))\n"),
        PROBLEM,
        "<domain>:5",
        "'dark' is declared twice",
    ),
}


@pytest.mark.parametrize("kind", MALFORMED)
def test_an_error_is_one_line_with_file_line_and_rule(kind):
    domain, problem, place, expected = MALFORMED[kind]
    with pytest.raises(PddlError) as caught:
        load(domain, problem)
    message = str(caught.value)
    assert message.startswith(place) and expected in message and "\n" not in message, message


def test_a_missing_file_is_an_error_that_names_it(tmp_path):
    with pytest.raises(PddlError, match=r"nowhere\.pddl: no such file"):
        load(tmp_path / "nowhere.pddl", PROBLEM)


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "picture.pddl").write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(PddlError, match="not a text file"):
        load(tmp_path / "picture.pddl", PROBLEM)


def test_an_empty_file_is_refused_by_name(tmp_path):
    (tmp_path / "empty.pddl").write_text("; nothing\n")
    with pytest.raises(PddlError, match="the file is empty"):
        load(tmp_path / "empty.pddl", PROBLEM)
