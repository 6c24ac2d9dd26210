"""Roles filled, negation compiled away, only the reachable kept."""

import itertools

import numpy as np
import pytest

from sign_model.pddl.grounding import ground, load
from sign_model.pddl.lifted import Domain, Problem, Schema
from sign_model.plan_task import plan
from sign_model.result import PlanStatus

SWITCHES = """(define (domain switches) (:predicates (on ?l) (wired ?s ?l) (same ?l ?m))
  (:action press :parameters (?s ?l)
    :precondition (and (wired ?s ?l) (not (on ?l))) :effect (on ?l))
  (:action release :parameters (?s ?l)
    :precondition (and (wired ?s ?l) (on ?l)) :effect (not (on ?l))))"""


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
  (:action finish :parameters (?a ?b)
    :precondition (and (go) (between ?a ?b ?a)) :effect (done ?b)))"""


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


def test_costs_count_only_where_the_problem_has_a_metric():
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


def random_lifted(seed):
    """A random domain and problem: up to three schemas with shared, repeated and constant
    arguments, types and equalities.
    """
    rng = np.random.default_rng(seed)
    types = {"u": ("object",), "v": ("u",)}
    kinds = (("object",), ("u",), ("v",), ("u", "v"))
    names = [f"o{i}" for i in range(int(rng.integers(1, 5)))]
    objects = {name: kinds[rng.integers(4)] for name in names}
    predicates = {f"p{i}": (("object",),) * int(rng.integers(0, 3)) for i in range(5)}
    changeable = ["p0", "p1", "p2"]

    def atoms(most, terms, among):
        chosen = [among[rng.integers(len(among))] for _ in range(rng.integers(0, most + 1))]
        return tuple((p, *(terms[rng.integers(len(terms))] for _ in predicates[p])) for p in chosen)

    schemas = []
    for number in range(int(rng.integers(1, 4))):
        roles = tuple((f"?r{i}", kinds[rng.integers(4)]) for i in range(rng.integers(0, 4)))
        terms = [role for role, _ in roles] + names[:1]
        equalities = tuple(
            (
                terms[rng.integers(len(terms))],
                terms[rng.integers(len(terms))],
                bool(rng.integers(2)),
            )
            for _ in range(rng.integers(0, 2))
        )
        schemas.append(
            Schema(
                f"a{number}",
                roles,
                atoms(3, terms, list(predicates)),
                atoms(1, terms, list(predicates)),
                equalities,
                atoms(2, terms, changeable),
                atoms(2, terms, changeable),
            )
        )
    domain = Domain("d", types, {names[0]: objects[names[0]]}, predicates, {}, tuple(schemas))
    start = frozenset(atoms(8, names, list(predicates)))
    return domain, Problem(
        "t", objects, start, atoms(2, names, changeable), atoms(1, names, changeable)
    )


def reachable_slowly(domain, problem):
    """{action: (conditions, must not hold, adds, deletes)} of what can go if nothing is deleted:
    every combination is tried.
    """
    every = {}
    for schema in domain.schemas:
        roles = [role for role, _ in schema.roles]
        for chosen in itertools.product(problem.objects, repeat=len(roles)):
            env = dict(zip(roles, chosen))
            if not all(
                domain.is_a(problem.objects[name], kinds)
                for name, (_, kinds) in zip(chosen, schema.roles)
            ):
                continue
            if any(
                (env.get(x, x) == env.get(y, y)) != wanted for x, y, wanted in schema.equalities
            ):
                continue
            parts = (schema.conditions, schema.negative_conditions, schema.adds, schema.deletes)
            needs, never, adds, deletes = (
                {(a[0], *(env.get(x, x) for x in a[1:])) for a in part} for part in parts
            )
            every[(schema.name, *chosen)] = needs, never, adds, deletes - adds
    held, gone, found = set(problem.start), set(), {}
    while True:
        ready = [
            action
            for action, (needs, never, _, _) in every.items()
            if action not in found and needs <= held and not (never & problem.start) - gone
        ]
        if not ready:
            return found, held
        for action in ready:
            found[action] = every[action]
            held |= every[action][2]
            gone |= every[action][3]


def test_grounding_by_joins_finds_what_trying_every_combination_finds():
    num_actions = num_negative = 0
    for seed in range(500):
        domain, problem = random_lifted(seed)
        task = ground(domain, problem)
        found, held = reachable_slowly(domain, problem)
        assert set(task.actions) == set(found) and len(task.actions) == len(found), seed
        fluents = {atom[0] for schema in domain.schemas for atom in schema.adds + schema.deletes}
        features = set(task.features)
        assert {f for f in features if f[0] != "not"} == {f for f in held if f[0] in fluents} | {
            f for f in problem.goal if f[0] in fluents or f not in problem.start
        }, seed
        for row, action in enumerate(task.actions):
            needs, never, adds, deletes = found[action]
            messages = [
                {task.features[f] for f in np.flatnonzero(m[row])}
                for m in (task.conditions, task.adds, task.deletes)
            ]
            assert messages[0] == {f for f in needs if f[0] in fluents} | {
                ("not", *f) for f in never if f[0] in fluents
            }, seed
            assert {f for f in messages[1] if f[0] != "not"} == adds, seed
            assert {f for f in messages[2] if f[0] != "not"} == deletes & features, seed
            assert {f for f in messages[1] if f[0] == "not"} == {
                ("not", *f) for f in deletes
            } & features, seed
            assert {f for f in messages[2] if f[0] == "not"} == {
                ("not", *f) for f in adds
            } & features, seed
        num_actions += len(found)
        num_negative += sum(f[0] == "not" for f in features)
    assert num_actions > 1000 and num_negative > 100
