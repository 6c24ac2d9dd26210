"""The smart relocation task as PDDL and as signs."""

import itertools

import numpy as np
import pytest

from sign_model.plan_task import plan
from sign_model.relocation.domain import (
    DOMAIN,
    Scene,
    abilities_of,
    problem_text,
    scene_signs,
    scene_task,
)
from sign_model.result import PlanStatus
from sign_model.signs.from_tasks import task_matrices
from sign_model.signs.matrix import Component
from sign_model.signs.network import network
from sign_model.signs.sign import sequence
from sign_model.space.fuzzy_table import DEFAULT_TABLE
from sign_model.space.spatial_signs import spatial_signs

RINGS = Scene(
    start="yard",
    goal="vault",
    ways=(("yard", "street"),),
    blocked=(
        ("street", "garden", "hedge"),
        ("street", "garden", "wall"),
        ("garden", "vault", "door"),
    ),
    kinds={"hedge": "plant", "wall": "stone", "door": "wood"},
    abilities=("plant", "wood"),
    seen_as={"vault": ("afar", "ahead-left"), "wall": ("close", "ahead")},
)


def test_the_plan_relocates_approaches_destroys_and_passes_up_to_the_goal():
    found = plan(scene_task(RINGS))
    assert found.actions == (
        "(relocate i yard street)",
        "(approach i hedge street)",
        "(destroy i hedge street plant)",
        "(pass i street garden hedge)",
        "(approach i door garden)",
        "(destroy i door garden wood)",
        "(pass i garden vault door)",
    )


def test_an_obstacle_that_the_agent_cannot_destroy_makes_the_task_unsolvable():
    weak = Scene(start="a", goal="b", blocked=(("a", "b", "rock"),), kinds={"rock": "stone"})
    assert plan(scene_task(weak)).status == PlanStatus.UNSOLVABLE


def test_a_start_in_the_goal_area_needs_no_action():
    assert plan(scene_task(Scene(start="a", goal="a"))).actions == ()


def test_plans_on_random_scenes_destroy_the_least_number_of_obstacles():
    rng = np.random.default_rng(0)
    for _ in range(12):
        areas = [f"area{i}" for i in range(5)]
        pairs = [pair for pair in itertools.combinations(range(5), 2) if rng.random() < 0.5]
        blocked = tuple((areas[i], areas[j], f"thing{i}{j}") for i, j in pairs)
        solid = {name for *_, name in blocked if rng.random() < 0.3}
        kinds = {name: "iron" if name in solid else "wood" for *_, name in blocked}
        scene = Scene(
            start=areas[0], goal=areas[4], blocked=blocked, kinds=kinds, abilities=("wood",)
        )
        # The least number by breadth: one more area deep with each obstacle destroyed.
        level, reached = 0, {areas[0]}
        while areas[4] not in reached and level < 6:
            level += 1
            reached |= {
                x for p, q, name in blocked if name not in solid for x in (p, q) if {p, q} & reached
            }
        found = plan(scene_task(scene), planner="astar")
        assert found.is_solved == (areas[4] in reached)
        if found.is_solved:
            assert sum(action.startswith("(destroy") for action in found.actions) == level


def test_abilities_are_personal_meanings_of_the_sign_i():
    model = scene_signs(RINGS)
    assert model.sign("i").meaning == (
        sequence({"action destroy", "plant"}),
        sequence({"action destroy", "wood"}),
    )
    assert abilities_of(model) == {"plant", "wood"}
    stronger = model.grown("i", Component.MEANING, sequence({"action destroy", "stone"}))
    assert abilities_of(stronger) == {"plant", "wood", "stone"}


def test_images_of_areas_lead_through_spatial_signs_to_degrees_and_metres():
    model = scene_signs(RINGS)
    grounded = model.with_signs(())
    known = {sign.name: sign for sign in spatial_signs(DEFAULT_TABLE)}
    for name in ("afar", "ahead-left"):
        for below in known[name].image[0].features:
            grounded = grounded.with_signs([known[below]]).grown(
                name, Component.IMAGE, known[name].image[0]
            )
    links = np.asarray(network(grounded.matrices, Component.IMAGE))
    two_steps = links.astype(int) @ links.astype(int) > 0
    assert {"phi 22.5..67.5 deg", "r 200..1000 m"} <= set(
        grounded.named(two_steps[grounded.index("vault")])
    )


def test_the_matrices_of_a_task_are_read_back_from_its_signs():
    task, found = scene_task(RINGS), task_matrices(scene_signs(RINGS))
    assert found.features == task.features and np.array_equal(found.conditions, task.conditions)
    assert np.array_equal(found.adds, task.adds) and np.array_equal(found.goal, task.goal)


def test_the_problem_text_is_plain_pddl():
    text = problem_text(
        Scene(start="a", goal="b", blocked=(("a", "b", "rock"),), kinds={"rock": "stone"}),
        name="tiny",
    )
    assert text.splitlines() == [
        "(define (problem tiny)",
        "  (:domain smart-relocation)",
        "  (:objects a b - area rock - obstacle stone - kind)",
        "  (:init",
        "    (at i a)",
        "    (blocked-by a b rock)",
        "    (blocked-by b a rock)",
        "    (borders rock a)",
        "    (borders rock b)",
        "    (of-kind rock stone))",
        "  (:goal (at i b)))",
    ]
    assert DOMAIN.count("(") == DOMAIN.count(")")


def test_another_reader_of_pddl_understands_domain_and_problem(tmp_path):
    parser = pytest.importorskip("plado.parser")
    (tmp_path / "domain.pddl").write_text(DOMAIN)
    (tmp_path / "problem.pddl").write_text(problem_text(RINGS))
    domain, problem = parser.parse(str(tmp_path / "domain.pddl"), str(tmp_path / "problem.pddl"))
    assert len(domain.actions) == 4 and len(problem.objects) == 10


@pytest.mark.parametrize(
    "scene, message",
    [
        (Scene(start="a", goal="b", blocked=(("a", "b", "rock"),)), "obstacle 'rock' has no kind"),
        (
            Scene(start="a", goal="b", blocked=(("a", "b", "a"),), kinds={"a": "k"}),
            "'a' names two things",
        ),
        (Scene(start="a b", goal="c"), "'a b' is no PDDL name"),
        (Scene(start="a", goal="B"), "'B' is no PDDL name"),
        (
            Scene(start="a", goal="b", seen_as={"c": ("afar",)}),
            "'c' is seen but is no area or obstacle",
        ),
    ],
)
def test_a_scene_that_breaks_a_rule_is_refused_in_one_sentence(scene, message):
    with pytest.raises(ValueError, match=message):
        problem_text(scene)
