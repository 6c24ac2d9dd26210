"""Planning tasks become signs, from which the same matrices are read back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import task_from_arrays
from sign_model.signs import matrix as tables
from sign_model.signs.from_tasks import GOAL, START, act_name, task_matrices, world_model_of
from sign_model.signs.matrix import Component
from sign_model.signs.network import is_procedural, network
from sign_model.signs.sign import causal, sequence

DOMAIN = """(define (domain yard) (:requirements :strips :typing :negative-preconditions :equality)
  (:types rock place - object boulder - rock)
  (:constants home - place)
  (:predicates (at ?p - place) (lies ?r - rock ?p - place) (twin ?p ?q - place) (done))
  (:action act :parameters (?r - rock ?p - place)
    :precondition (and (at ?p) (lies ?r ?p) (not (done)))
    :effect (and (not (lies ?r ?p)) (done)))
  (:action go :parameters (?p ?q - place) :precondition (and (at ?p) (not (= ?p ?q)))
    :effect (and (not (at ?p)) (at ?q) (twin ?q ?q)))
)"""
PROBLEM = """(define (problem p) (:domain yard) (:objects big - boulder far - place)
  (:init (at home) (lies big far)) (:goal (and (done) (twin far far))))"""


def assert_same_matrices(task):
    model = world_model_of(task)
    assert tables.faults(model.matrices) == []
    again = task_matrices(model)
    assert again.features == task.features and again.actions == task.actions
    for name in ("conditions", "adds", "deletes", "start", "goal"):
        given, found = getattr(task, name), getattr(again, name)
        assert found.dtype == bool and np.array_equal(given, found), name
    return model


@pytest.mark.parametrize(
    "name",
    ["blocks/probBLOCKS-4-0", "blocks/probBLOCKS-8-1", "ferry/p-10locs-5cars", "hanoi/pfile1"],
)
def test_the_matrices_of_a_published_task_are_read_back_bit_for_bit(shared_data, name):
    path = shared_data / "pddl" / f"{name}.pddl"
    if not path.exists():
        pytest.skip(f"{name} is not in the data")
    assert_same_matrices(load(path.parent / "domain.pddl", path))


# few sizes: each is compiled
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([(1, 0), (2, 5), (6, 3)]))
def test_the_matrices_of_any_task_are_read_back_bit_for_bit(seed, size):
    num_features, num_actions = size
    rng = np.random.default_rng(seed)
    parts = [rng.random((num_actions, num_features)) < 0.3 for _ in range(3)]
    assert_same_matrices(
        task_from_arrays(*parts, rng.random(num_features) < 0.5, rng.random(num_features) < 0.5)
    )


def test_types_constants_negation_and_repeated_objects_become_signs():
    model = assert_same_matrices(load(DOMAIN, PROBLEM))
    assert model.sign("(twin far far)").image == (sequence("predicate twin", "far", "far"),)
    assert model.sign("(not done)").image == (sequence("predicate not", "predicate done"),)
    assert model.sign("act (act big far)").image == (sequence("action act", "big", "far"),)
    assert model.sign("type rock").significance == (sequence("type boulder"),)
    assert model.sign("type boulder").significance == (sequence("big"),)
    assert model.sign("predicate lies").significance == (sequence("type rock", "type place"),)


def test_a_schema_is_a_script_with_roles_and_its_ground_actions_are_personal_meanings():
    model = world_model_of(load(DOMAIN, PROBLEM))
    schema = model.sign("action go")
    (script,) = schema.significance
    assert [sorted(column.features) for column in script.columns] == [
        ["role go ?p"],
        ["role go ?q"],
        ["script go (at ?p)", "script go (not = ?p ?q)"],
        ["script go (at ?q)", "script go (twin ?q ?q)"],
        ["script go (at ?p)"],
    ]
    assert is_procedural(model.matrices, model.index("action go"), Component.SIGNIFICANCE)
    assert schema.meaning == (sequence("act (go home far)"), sequence("act (go far home)"))
    assert model.sign(act_name(("go", "home", "far"))).meaning == (
        causal("(at home)", ["(at far)", "(twin far far)"], "(at home)"),
    )


def test_start_and_goal_are_situations_on_the_network_of_personal_meanings():
    model = world_model_of(load(DOMAIN, PROBLEM))
    links = np.asarray(network(model.matrices, Component.MEANING))
    assert set(model.named(links[model.index(START)])) == {
        "(at home)",
        "(lies big far)",
        "(not done)",
    }
    assert set(model.named(links[model.index(GOAL)])) == {"(done)", "(twin far far)"}
