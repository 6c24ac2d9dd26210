"""The independent replay: what it lets pass and what it says of the rest."""

import numpy as np
import pytest

from sign_model.blocks import DOMAIN, random_blocks_tasks
from sign_model.pddl.grounding import load
from sign_model.pddl.validate import replay_batch, validate
from sign_model.plan_task import plan

PROBLEM = """(define (problem p) (:domain blocks) (:objects a b)
  (:init (ontable a) (ontable b) (clear a) (clear b) (handempty)) (:goal (on a b)))"""


def test_a_right_plan_passes_in_any_case():
    assert validate(load(DOMAIN, PROBLEM), ["(PICK-UP A)", "(stack a b)"]) == []


@pytest.mark.parametrize(
    "actions,message",
    [
        ([], "the goal (on a b) is not reached"),
        (["(stack a b)"], "step 1 (stack a b): (holding a) does not hold"),
        (["(pick-up a)", "(fly a)"], "step 2 (fly a): there is no such action"),
        (["(pick-up c)"], "step 1 (pick-up c): there is no object 'c'"),
        (["(pick-up a b)"], "step 1 (pick-up a b): 2 argument(s), the action takes 1"),
    ],
)
def test_a_wrong_plan_is_refused_in_a_sentence(actions, message):
    assert validate(load(DOMAIN, PROBLEM), actions) == [message]


def test_types_equalities_and_negative_conditions_are_checked():
    domain = """(define (domain d) (:types s t) (:predicates (p ?x - s) (q ?x - s ?y - s))
      (:action a :parameters (?x ?y - s)
        :precondition (and (not (= ?x ?y)) (not (p ?x))) :effect (q ?x ?y)))"""
    problem = (
        "(define (problem r) (:domain d) (:objects u v w - s z - t) (:init (p v)) (:goal (and (q u"
        " v) (not (q u w)))))"
    )
    task = load(domain, problem)
    assert validate(task, ["(a u v)"]) == []
    assert validate(task, ["(a u u)"]) == ["step 1 (a u u): ?x and ?y must not be equal"]
    assert validate(task, ["(a v u)"]) == ["step 1 (a v u): (p v) holds but must not"]
    assert validate(task, ["(a u z)"]) == ["step 1 (a u z): 'z' is no s"]
    assert validate(task, ["(a u v)", "(a u w)"]) == ["the goal (not (q u w)) is not reached"]


def test_many_plans_are_replayed_side_by_side():
    tasks = random_blocks_tasks(4, 6, seed=5)
    number_of = {name: i for i, name in enumerate(tasks[0].action_names)}
    plans = [np.array([number_of[name] for name in plan(task).actions], int) for task in tasks]
    starts, goals = (
        np.array([task.start for task in tasks]),
        np.array([task.goal for task in tasks]),
    )
    longest = max(map(len, plans))

    def padded(*plans):
        return np.array(
            [np.pad(plan, (0, longest - len(plan)), constant_values=-1) for plan in plans]
        )

    replay_batch(tasks[0], starts, goals, padded(*plans))
    with pytest.raises(AssertionError, match="plan 2"):
        replay_batch(tasks[0], starts, goals, padded(*plans[:2], plans[2][:-1], *plans[3:]))
    with pytest.raises(AssertionError, match="cannot go"):
        replay_batch(tasks[0], starts, goals, padded(plans[0][1:], *plans[1:]))
