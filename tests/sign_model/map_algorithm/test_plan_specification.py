"""Plan specification: acts are refined into sub-plans, by a rule that consists of signs."""

import types

import numpy as np
import pytest

from sign_model.map_algorithm.plan_specification import (
    HAS_FINER_LEVEL,
    IS_ABSTRACT,
    IS_OPERATION,
    REALISE,
    SPECIFY,
    decide,
    metacognition,
    specify_plan,
    sub_tasks,
)
from sign_model.pddl.grounding import load
from sign_model.pddl.validate import validate
from sign_model.signs.matrix import Component
from sign_model.signs.sign import sequence

COARSE = load(
    """(define (domain rooms) (:predicates (in ?r) (next ?r ?s))
      (:action change-room :parameters (?r ?s) :precondition (and (in ?r) (next ?r ?s))
        :effect (and (not (in ?r)) (in ?s))))""",
    """(define (problem p) (:domain rooms) (:objects hall office lab)
      (:init (in hall) (next hall office) (next office lab)) (:goal (in lab)))""",
)
FINE_DOMAIN = """(define (domain doors)
  (:predicates (in ?r) (door ?d ?r ?s) (at ?d) (key ?d) (open ?d))
  (:action approach :parameters (?d ?r ?s) :precondition (and (in ?r) (door ?d ?r ?s))
    :effect (at ?d))
  (:action unlock :parameters (?d) :precondition (and (at ?d) (key ?d))
    :effect (and (open ?d) (not (key ?d))))
  (:action pass :parameters (?d ?r ?s) :precondition (and (at ?d) (open ?d) (in ?r) (door ?d ?r ?s))
    :effect (and (not (in ?r)) (in ?s) (not (at ?d)))))"""
FINE_PROBLEM = """(define (problem p) (:domain doors) (:objects hall office lab one two)
  (:init (in hall) (door one hall office) (door two office lab) KEYS) (:goal (in lab)))"""
PLAN = ("(change-room hall office)", "(change-room office lab)")


def fine_task(keys):
    return load(FINE_DOMAIN, FINE_PROBLEM.replace("KEYS", keys))


def breadth_first(task):
    """Returns a shortest plan, None if there is none: slow and obvious."""
    waiting, visited = [(task.start, ())], {task.start.tobytes()}
    while waiting:
        situation, plan = waiting.pop(0)
        if (task.goal <= situation).all():
            return plan
        for number in range(task.num_actions):
            if (task.conditions[number] <= situation).all():
                after = (situation & ~task.deletes[number]) | task.adds[number]
                if after.tobytes() not in visited:
                    visited.add(after.tobytes())
                    waiting.append((after, (*plan, task.action_names[number])))
    return None


class Planner:
    """Plans batches and records their sizes."""

    def __init__(self):
        self.sizes = []

    def __call__(self, tasks):
        self.sizes.append(len(tasks))
        return [types.SimpleNamespace(actions=breadth_first(task)) for task in tasks]


def test_a_sub_task_leads_from_the_conditions_of_an_act_to_its_effects():
    fine = fine_task("(key one) (key two)")
    first, second = sub_tasks(COARSE, PLAN, fine)
    assert {fine.features[f] for f in np.flatnonzero(first.start)} == {
        ("in", "hall"),
        ("key", "one"),
        ("key", "two"),
    }
    assert {fine.features[f] for f in np.flatnonzero(first.goal)} == {("in", "office")}
    assert {fine.features[f] for f in np.flatnonzero(second.start)} == {
        ("in", "office"),
        ("key", "one"),
        ("key", "two"),
    }
    assert ("in", "hall") not in second.problem.start and ("in", "office") in second.problem.start
    assert (
        second.problem.goal == (("in", "lab"),)
        and ("door", "one", "hall", "office") in second.problem.start
    )


def test_the_goal_of_a_sub_task_has_all_effects_and_what_later_acts_need():
    task = load(
        """(define (domain d) (:predicates (p) (q) (r) (s))
          (:action a :precondition (s) :effect (and (p) (r)))
          (:action b :precondition (and (p) (s)) :effect (q)) (:action c :effect (not (s))))""",
        "(define (problem p) (:domain d) (:init (s)) (:goal (q)))",
    )
    first, second = sub_tasks(task, ("(a)", "(b)"), task)
    assert {task.features[f] for f in np.flatnonzero(first.goal)} == {("p",), ("r",), ("s",)}
    assert {task.features[f] for f in np.flatnonzero(second.start)} == {("p",), ("s",)}


def test_all_acts_are_specified_in_one_batch_and_the_leaves_solve_the_finer_task():
    fine, planner = fine_task("(open one) (key two)"), Planner()
    steps = specify_plan(COARSE, PLAN, [fine], plan_batch=planner)
    assert planner.sizes == [2]
    assert [step.action for step in steps] == list(PLAN) and {step.decision for step in steps} == {
        SPECIFY
    }
    leaves = [leaf.action for step in steps for leaf in step.leaves()]
    assert [len(step.steps) for step in steps] == [2, 3] and validate(fine, leaves) == []
    assert {leaf.decision for step in steps for leaf in step.leaves()} == {REALISE}


def test_an_operation_is_realised_and_not_specified():
    planner = Planner()
    steps = specify_plan(
        COARSE, PLAN, [fine_task("(open one)")], plan_batch=planner, operations={"change-room"}
    )
    assert (
        planner.sizes == []
        and [step.decision for step in steps] == [REALISE, REALISE]
        and all(step.steps is None for step in steps)
    )


def test_without_a_finer_level_acts_are_realised():
    assert [step.decision for step in specify_plan(COARSE, PLAN, [], plan_batch=Planner())] == [
        REALISE,
        REALISE,
    ]


def test_a_plan_without_acts_has_no_steps():
    done = load(
        "(define (domain d) (:predicates (p)) (:action a :effect (p)))",
        "(define (problem p) (:domain d) (:init (p)) (:goal (p)))",
    )
    assert specify_plan(done, (), [done], plan_batch=Planner()) == ()


def test_an_act_whose_effects_hold_already_has_an_empty_sub_plan():
    task = load(
        """(define (domain d) (:predicates (p) (q)) (:action a :effect (p))
          (:action b :precondition (p) :effect (q))
          (:action keep :precondition (p) :effect (p)))""",
        "(define (problem p) (:domain d) (:init) (:goal (q)))",
    )
    steps = specify_plan(task, ("(a)", "(keep)", "(b)"), [task], plan_batch=Planner())
    assert [[leaf.action for leaf in step.leaves()] for step in steps] == [["(a)"], [], ["(b)"]]


def test_an_operation_among_abstract_acts_is_an_action_of_the_finer_level():
    domain = """(define (domain d) (:predicates (p) (q) (r)) (:action a :effect (p))
      (:action b :precondition (p) :effect (q)) (:action step :effect (r))
      (:action b-fine :precondition (and (r) (p)) :effect (q)))"""
    coarse = load(domain, "(define (problem p) (:domain d) (:init) (:goal (q)))")
    finer = load(
        domain.replace("(:action b :precondition (p) :effect (q))", ""),
        "(define (problem p) (:domain d) (:init) (:goal (q)))",
    )
    steps = specify_plan(
        coarse, ("(a)", "(b)"), [finer], plan_batch=Planner(), operations={"a", "step", "b-fine"}
    )
    assert steps[0].steps is None and steps[0].decision == REALISE
    assert [leaf.action for leaf in steps[1].leaves()] == ["(step)", "(b-fine)"]


def test_an_act_without_a_sub_plan_has_no_steps():
    steps = specify_plan(COARSE, PLAN, [fine_task("(open one)")], plan_batch=Planner())
    assert len(steps[0].steps) == 2 and steps[1].steps is None and steps[1].decision == SPECIFY


ONE_KEY_DOMAIN = """(define (domain lend) (:predicates (in ?r) (next ?r ?s) (coin) (machine ?r))
  (:action ride :parameters (?r ?s) :precondition (and (in ?r) (next ?r ?s) (coin))
    :effect (and (not (in ?r)) (in ?s) (not (coin))))
  (:action earn :parameters (?r) :precondition (in ?r) :effect (coin)))"""


def test_sub_plans_that_invalidate_each_other_are_planned_in_turn():
    fine = load(
        ONE_KEY_DOMAIN,
        """(define (problem p) (:domain lend) (:objects hall office lab)
          (:init (in hall) (coin) (next hall office) (next office lab)) (:goal (in lab)))""",
    )
    planner = Planner()
    steps = specify_plan(COARSE, PLAN, [fine], plan_batch=planner)
    assert planner.sizes == [2, 1, 1]
    leaves = [leaf.action for step in steps for leaf in step.leaves()]
    assert (
        leaves == ["(ride hall office)", "(earn office)", "(ride office lab)"]
        and validate(fine, leaves) == []
    )


def test_specification_continues_through_several_levels():
    planner = Planner()
    steps = specify_plan(
        COARSE, PLAN, [COARSE, fine_task("(open one) (open two)")], plan_batch=planner
    )
    assert planner.sizes == [2, 2]
    assert [step.steps[0].action for step in steps] == list(PLAN)
    assert [len(list(step.leaves())) for step in steps] == [2, 2]


def test_the_rule_consists_of_signs_that_an_experience_can_change():
    rule = metacognition()
    acts = [{IS_ABSTRACT, HAS_FINER_LEVEL}, {IS_ABSTRACT}, {IS_OPERATION, HAS_FINER_LEVEL}, set()]
    assert decide(rule, acts) == (SPECIFY, REALISE, REALISE, REALISE)
    bolder = rule.grown(REALISE, Component.IMAGE, sequence(IS_ABSTRACT))
    assert decide(bolder, acts) == (REALISE,) * 4
    assert decide(rule, []) == ()


def test_an_invalid_plan_is_refused():
    with pytest.raises(ValueError, match="only a valid plan can be specified"):
        sub_tasks(COARSE, PLAN[1:], fine_task("(open one)"))


def test_an_error_names_the_feature_that_the_finer_level_lacks():
    finer = load(
        "(define (domain d) (:predicates (p) (q)) (:action a :precondition (q) :effect (p)))",
        "(define (problem p) (:domain d) (:init (q)) (:goal (p)))",
    )
    with pytest.raises(ValueError, match="is no feature of this task"):
        sub_tasks(COARSE, PLAN, finer)
