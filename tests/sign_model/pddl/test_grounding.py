"""Roles filled, negation compiled away, only the reachable kept."""

import numpy as np
import pytest

from sign_model.pddl.grounding import load
from sign_model.plan_task import plan
from sign_model.result import PlanStatus

SWITCHES = """(define (domain switches) (:predicates (on ?l) (wired ?s ?l) (same ?l ?m))
  (:action press :parameters (?s ?l) :precondition (and (wired ?s ?l) (not (on ?l))) :effect (on ?l))
  (:action release :parameters (?s ?l) :precondition (and (wired ?s ?l) (on ?l)) :effect (not (on ?l))))"""


def switches(goal: str) -> str:
    return (
        "(define (problem p) (:domain switches) (:objects s t a b) (:init (wired s a) (wired t b)"
        f" (on b)) (:goal {goal}))"
    )


def test_static_conditions_bind_roles_before_any_combination_is_tried():
    task = load(SWITCHES, switches("(on a)"))
    assert task.action_names == ("(press s a)", "(press t b)", "(release s a)", "(release t b)")


def test_negative_conditions_become_complements_kept_in_step():
    task = load(SWITCHES, switches("(and (on a) (not (on b)))"))
    assert ("not", "on", "a") in task.features and ("not", "on", "b") in task.features
    on, off = task.features.index(("on", "a")), task.features.index(("not", "on", "a"))
    assert (task.adds[:, on] == task.deletes[:, off]).all() and (
        task.deletes[:, on] == task.adds[:, off]
    ).all()
    assert plan(task).actions in (
        ("(press s a)", "(release t b)"),
        ("(release t b)", "(press s a)"),
    )


def test_an_unreachable_goal_makes_the_task_unsolvable_not_wrong():
    for goal in ("(same a b)", "(and (on a) (wired s b))", "(not (wired s a))"):
        assert plan(load(SWITCHES, switches(goal))).status == PlanStatus.UNSOLVABLE


def test_a_static_goal_that_holds_costs_nothing():
    assert plan(load(SWITCHES, switches("(wired s a)"))).actions == ()
    assert plan(load(SWITCHES, switches("(and)"))).actions == ()


def test_parameters_named_differently_than_in_the_declaration_give_the_same_actions():
    renamed = (
        SWITCHES.replace("?s ?l", "?x ?y")
        .replace("?l", "?y")
        .replace("(on ?y) (wired ?x ?y)", "(on ?p) (wired ?q ?r)")
    )
    assert renamed != SWITCHES
    one, other = load(SWITCHES, switches("(on a)")), load(renamed, switches("(on a)"))
    assert one.action_names == other.action_names
    np.testing.assert_array_equal(one.conditions, other.conditions)


ARITIES = """(define (domain arities) (:predicates (go) (between ?a ?b ?c) (done ?a))
  (:action start :precondition () :effect (go))
  (:action finish :parameters (?a ?b) :precondition (and (go) (between ?a ?b ?a)) :effect (done ?b)))"""


def test_predicates_of_arity_0_1_and_3_and_repeated_objects_are_grounded():
    problem = """(define (problem p) (:domain arities) (:objects a b)
      (:init (between a a a) (between b a b) (between a b b)) (:goal (done a)))"""
    task = load(ARITIES, problem)
    assert task.action_names == ("(start)", "(finish a a)", "(finish b a)")
    assert plan(task).actions == ("(start)", "(finish a a)")


def test_a_domain_of_unary_predicates_only_is_solved():
    domain = """(define (domain unary) (:predicates (p ?x) (q ?x))
      (:action a :parameters (?x) :precondition (p ?x) :effect (and (q ?x) (not (p ?x)))))"""
    problem = (
        "(define (problem t) (:domain unary) (:objects x y) (:init (p x) (p y)) (:goal (and (q x)"
        " (q y))))"
    )
    assert plan(load(domain, problem)).actions in (("(a x)", "(a y)"), ("(a y)", "(a x)"))


@pytest.mark.parametrize(
    "test,kept",
    [("(= ?x ?y)", ["(a x x)", "(a y y)"]), ("(not (= ?x ?y))", ["(a x y)", "(a y x)"])],
)
def test_equality_filters_bindings(test, kept):
    domain = f"""(define (domain e) (:predicates (r ?x ?y))
      (:action a :parameters (?x ?y) :precondition {test} :effect (r ?x ?y)))"""
    problem = "(define (problem t) (:domain e) (:objects x y) (:init) (:goal (r x y)))"
    assert list(load(domain, problem).action_names) == kept


def test_costs_count_only_where_the_problem_asks_for_them():
    domain = """(define (domain c) (:predicates (p)) (:functions (total-cost) - number)
      (:action dear :effect (and (p) (increase (total-cost) 7))))"""
    problem = "(define (problem t) (:domain c) (:init) (:goal (p)) (:metric minimize (total-cost)))"
    assert load(domain, problem).costs.tolist() == [7]
    assert load(domain, problem.replace("(:metric minimize (total-cost))", "")).costs.tolist() == [
        1
    ]


def test_an_action_that_deletes_and_adds_a_fact_adds_it():
    domain = "(define (domain d) (:predicates (p)) (:action a :effect (and (not (p)) (p))))"
    task = load(domain, "(define (problem t) (:domain d) (:init) (:goal (p)))")
    assert task.adds.tolist() == [[True]] and task.deletes.tolist() == [[False]]
