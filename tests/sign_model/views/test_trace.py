"""MAP's iterations as people read them are those that MAP carries out."""

import re
import xml.etree.ElementTree as ElementTree

import pytest

from sign_model import animate_trace, load, trace, validate
from sign_model.blocks import random_blocks_tasks
from sign_model.map_algorithm.heuristics import DEFAULTS, OVERLAP

DOMAIN = """(define (domain door) (:predicates (closed) (open) (through))
 (:action push :precondition (closed) :effect (and (open) (not (closed))))
 (:action walk :precondition (open) :effect (through)))"""


def door(goal):
    return load(
        DOMAIN, f"(define (problem out) (:domain door) (:init (closed)) (:goal (and {goal})))"
    )


@pytest.mark.parametrize("sign", [*DEFAULTS, OVERLAP], ids=lambda sign: sign.name)
def test_the_iterations_lead_from_the_goal_to_the_start_along_the_plan(sign):
    for task in random_blocks_tasks(4, 4, seed=3):
        found = trace(task, heuristic=sign)
        assert validate(task, found.plan) == []
        assert len(found.iterations) == len(found.plan)
        goal = {task.features[f] for f in range(task.num_features) if task.goal[f]}
        situation = {f"({' '.join(atom)})" for atom in goal}
        for iteration, action in zip(found.iterations, reversed(found.plan)):
            assert set(iteration.situation) == situation
            assert iteration.candidates[iteration.taken].action == action
            ratings = [candidate.rating for candidate in iteration.candidates]
            assert ratings == sorted(ratings)
            for candidate in iteration.candidates:
                assert sum(candidate.parts.values()) == candidate.rating
            situation = set(iteration.before)
        assert situation <= set(found.start)


def test_a_goal_that_holds_needs_no_iteration_and_one_out_of_reach_has_none():
    done, never = trace(door("(closed)")), trace(door("(open) (closed)"))
    assert done.iterations == () and done.plan == ()
    assert never.plan is None and str(never) == "MAP found no plan by this sign."
    with pytest.raises(ValueError, match="no plan to show"):
        animate_trace(never)


def test_the_text_names_every_step_with_its_reason():
    text = str(trace(random_blocks_tasks(3, 1, seed=2)[0]))
    for step in "MAP":
        assert re.search(rf"^ +{step}: ", text, flags=re.MULTILINE)
    assert re.search(r"rated \d+ = \d+ landmarks.*; taken", text)


def test_every_frame_of_the_animation_has_its_turn():
    found = trace(random_blocks_tasks(3, 1, seed=2)[0])
    root = ElementTree.fromstring(animate_trace(found, seconds=0.5))
    turns = root.findall(".//{http://www.w3.org/2000/svg}animate")
    assert len(turns) == len(found.iterations) + 1
    shown = [0.0] * 101
    for turn in turns:
        times = [float(time) for time in turn.get("keyTimes").split(";")] + [1.0]
        for value, begin, end in zip(turn.get("values").split(";"), times, times[1:]):
            for i in range(100):
                shown[i] += value == "visible" and begin <= i / 100 + 0.003 < end
    assert set(shown[:100]) == {1}
    for action in found.plan:
        assert action in "".join(root.itertext())
    with pytest.raises(ValueError, match="more than 0 s"):
        animate_trace(found, seconds=0.0)
