"""MAP over working memory, jitted: the same answers as MAP on the host, whatever the batch."""

import functools

import jax
import numpy as np
import pytest

from sign_model.map_algorithm.heuristics import OVERLAP
from sign_model.map_algorithm.map_planner import plan_map
from sign_model.pddl.validate import validate
from sign_model.relocation.domain import AGENT
from sign_model.relocation.map_in_jit import plan_situations
from sign_model.relocation.working_memory import (
    BREAKABLE,
    INDESTRUCTIBLE,
    area,
    chain_memory,
    contour_memory,
    slot,
)
from sign_model.signs.matrix import Component
from sign_model.signs.sign import sequence


def facts(between, kind_of):
    """Returns the facts known of obstacles: {slot: (area, area)} and {slot: kind}."""
    atoms = [("at", AGENT, area(0))]
    for number, (one, other) in between.items():
        atoms += [
            ("blocked-by", area(one), area(other), slot(number)),
            ("blocked-by", area(other), area(one), slot(number)),
        ]
        atoms += [("borders", slot(number), area(one)), ("borders", slot(number), area(other))]
        atoms.append(("of-kind", slot(number), kind_of[number]))
    return atoms


def random_scenes(form, count, rng):
    """Yields starts and goals over the working memory: some slots are empty, some obstacles are
    indestructible, and the goal is any area.
    """
    num_areas = len({atom[-1] for atom in form.space.features if atom[0] == "at"})
    pairs = {
        number: (0, 1) if num_areas == 2 else (number, number + 1)
        for number in range(form.num_slots)
    }
    for _ in range(count):
        present = {number: pair for number, pair in pairs.items() if rng.random() < 0.8}
        kinds = {number: INDESTRUCTIBLE if rng.random() < 0.5 else BREAKABLE for number in present}
        yield facts(present, kinds), [("at", AGENT, area(int(rng.integers(num_areas))))]


@functools.cache
def planner(form, max_steps):
    return jax.jit(functools.partial(plan_situations, form, max_steps=max_steps))


def plan_all(form, scenes, *, max_steps=13):
    start, goal = (
        np.stack([form.situation(*side) for side in sides], axis=1) for sides in zip(*scenes)
    )
    return jax.tree.map(np.asarray, planner(form, max_steps)(start | form.abilities[:, None], goal))


@pytest.mark.parametrize("form", [contour_memory(3), chain_memory(4)], ids=["contour", "chain"])
def test_plans_and_proofs_are_those_of_map_on_the_host(form):
    scenes = list(random_scenes(form, 96, np.random.default_rng(0)))
    found = plan_all(form, scenes)
    assert found.is_solved.any() and found.is_proof.any()
    for number, (start, goal) in enumerate(scenes):
        task = form.task_of(start, goal)
        truth = plan_map(task, [OVERLAP], max_expansions=10_000)
        assert (
            found.is_solved[number] == (truth.plan is not None)
            and found.is_proof[number] == truth.is_proof
        )
        if truth.plan is not None:
            actions = found.actions[:, number]
            names = [f"({' '.join(form.actions[action])})" for action in actions if action >= 0]
            assert (
                len(names) == found.num_actions[number] == len(truth.plan)
                and validate(task, names) == []
            )
            assert (actions[len(names) :] == -1).all()


def test_a_plan_does_not_depend_on_the_batch_around_it():
    form = chain_memory(4)
    scenes = list(random_scenes(form, 96, np.random.default_rng(1)))
    whole, backwards = plan_all(form, scenes), plan_all(form, scenes[::-1])
    for one, other in zip(whole, backwards):
        assert np.array_equal(one, other[..., ::-1])


def test_among_equal_obstacles_the_first_slot_is_chosen():
    form = contour_memory(3)
    found = plan_all(
        form,
        [(facts({1: (0, 1), 2: (0, 1)}, {1: BREAKABLE, 2: BREAKABLE}), [("at", AGENT, area(1))])]
        * 96,
    )
    acts = [form.actions[action][:3] for action in found.actions[:, 0] if action >= 0]
    assert acts == [
        ("approach", AGENT, slot(1)),
        ("destroy", AGENT, slot(1)),
        ("pass", AGENT, area(0)),
    ]


def test_a_search_cut_short_is_neither_plan_nor_proof():
    form = contour_memory(3)
    found = plan_all(
        form, [(facts({0: (0, 1)}, {0: BREAKABLE}), [("at", AGENT, area(1))])], max_steps=2
    )
    assert not found.is_solved[0] and not found.is_proof[0] and (found.actions == -1).all()


def test_an_experience_adds_an_ability_to_the_personal_meanings_of_i():
    weak, strong = contour_memory(1), contour_memory(1, (BREAKABLE, INDESTRUCTIBLE))
    assert weak.model.sign(AGENT).meaning == (sequence({"action destroy", BREAKABLE}),)
    grown = weak.model.grown(AGENT, Component.MEANING, sequence({"action destroy", INDESTRUCTIBLE}))
    assert grown.sign(AGENT) == strong.model.sign(AGENT)
    scene = (facts({0: (0, 1)}, {0: INDESTRUCTIBLE}), [("at", AGENT, area(1))])
    assert plan_all(weak, [scene]).is_proof[0] and plan_all(strong, [scene]).num_actions[0] == 3


def test_the_matrices_are_the_personal_meanings_of_the_acts():
    form = contour_memory(2)
    (meaning,) = form.model.sign(f"act (pass i {area(0)} {area(1)} {slot(1)})").meaning
    number = form.actions.index(("pass", AGENT, area(0), area(1), slot(1)))
    needed = {form.space.features[i] for i in np.flatnonzero(form.space.conditions[number])}
    assert needed == {
        ("at", AGENT, area(0)),
        ("blocked-by", area(0), area(1), slot(1)),
        ("destroyed", slot(1)),
    }
    assert {f"({' '.join(atom)})" for atom in needed} < meaning.features
