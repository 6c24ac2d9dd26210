"""What small problems teach of a domain: fewer expansions on larger ones, no plan lost, and a
record that survives its file.
"""

import dataclasses
import json

import pytest

from experiments.campaigns.inputs.chore_tasks import garden, paint, rails
from experiments.campaigns.inputs.craft_tasks import boards, probes, shunting, tools
from experiments.campaigns.inputs.errand_tasks import ferry, keys, lifts, pictures, yards
from experiments.campaigns.inputs.vehicle_tasks import rooms
from experiments.data.pddl_domains import VISITING, visiting
from sign_model import Memory, PlanningRule, load, load_memory, plan, save_memory, validate
from sign_model.blocks import random_blocks_tasks
from sign_model.experience import practice
from sign_model.experience.skill import BOTH, SHARE, Skill, attempt
from sign_model.map_algorithm.heuristics import DEFAULTS, RELAXED_PLAN
from sign_model.map_algorithm.map_planner import Rungs
from sign_model.strategies.improve import Patience
from sign_model.strategies.rule import UNLEARNED
from sign_model.strategies.turns import NEAR, outcome_of


def hands(balls):
    return load(*rooms(balls, 2, balls, 1))


@pytest.fixture(scope="module")
def memory():
    lines = []
    memory = Memory().practised([hands(n) for n in (2, 3, 4, 6)], log=lines.append)
    assert len(lines) == 1 and lines[0].startswith("4 problems: ")
    return memory


def test_larger_problems_with_other_objects_need_fewer_expansions(memory):
    task = hands(12)
    without, with_it = plan(task), plan(task, memory=memory)
    assert validate(task, with_it.actions) == []
    assert with_it.expansions <= without.expansions / 2
    assert len(with_it.actions) <= len(without.actions)


def test_practice_is_deterministic_and_survives_its_file(memory, tmp_path):
    assert Memory().practised([hands(n) for n in (2, 3, 4, 6)]).skills == memory.skills
    save_memory(memory, tmp_path / "memory.json")
    assert load_memory(tmp_path / "memory.json") == memory


def test_a_domain_without_practice_is_planned_without_it(memory):
    task = random_blocks_tasks(4, 1)[0]
    assert memory.skill(task) is None
    assert plan(task, memory=memory).actions == plan(task).actions


def test_new_practice_of_a_domain_replaces_the_old_one_and_keeps_the_precedents(memory):
    task = hands(2)
    with_plan = memory.learned(task, plan(task).actions)
    again = with_plan.practised([hands(2)])
    assert len(again.skills) == 1 and again.precedents == with_plan.precedents
    assert with_plan.skills == memory.skills


def test_what_experience_cannot_do_is_planned_without_it():
    task = hands(6)
    useless = PlanningRule("useless", {"goal by goal": 1}, trust=(9.0, 0.0))
    distrusted = PlanningRule("distrusted", {"boldly": 1000}, effort=0, trust=(0.0, 0.0))
    domain = Memory().practised([hands(2)]).skills[0].domain
    for rule in (useless, distrusted):
        for per_step in (None, 1.0):
            memory = Memory(skills=(Skill(domain, rule, DEFAULTS, per_step),))
            assert memory.skill(task).rule is rule
            assert len(plan(task, memory=memory).actions) <= len(plan(task).actions)


def test_experience_that_is_distrusted_pays_for_planning_without_it():
    task = hands(6)
    domain = Memory().practised([hands(2)]).skills[0].domain
    rule = PlanningRule("distrusted", {"boldly": 1000}, improvement=0, trust=(0.0, 0.0))
    known = Skill(domain, rule, DEFAULTS, 1.0)
    _, alone = attempt(known, task, max_expansions=10_000)
    both = plan(task, memory=Memory(skills=(known,)))
    without = plan(task)
    assert both.expansions >= alone.expansions + without.expansions
    assert len(both.actions) <= len(without.actions)


def test_where_the_regression_finds_no_plan_the_other_ways_find_one():
    # a beam of one that may take a single step
    task = load(*yards(1, 2, 1, 3, 4))
    domain = Memory().practised([load(*yards(0, 2, 1, 3, 2))]).skills[0].domain
    rule = PlanningRule("hopeless", {"boldly": 1}, improvement=0, trust=(9.0, 9.0))
    found = Skill(domain, rule, DEFAULTS, 1.0, 5, 0.5).plan(task, max_expansions=20_000)
    names = task.action_names
    assert validate(task, [names[action] for action in found.plan]) == []
    assert len(found.plan) <= len(plan(task).actions)


def alone(sign, beam=24, trust=(9.0, 9.0)):
    rule = PlanningRule("alone", {"backwards": 1 << 30}, improvement=0, beam=beam, trust=trust)
    return Skill("", rule, (sign,), 80.0, 10, 1.0)


def test_of_two_signs_the_one_whose_plans_are_clearly_shorter_comes_first(monkeypatch):
    series = [load(*rooms(50 + i, 3 + i // 3, 3 + i, 1)) for i in range(4)]
    outcomes = [outcome_of(task, DEFAULTS, UNLEARNED, max_expansions=20_000) for task in series]
    taught = [practice._Taught(*one) for one in zip(series, outcomes)]
    # by one step of 54 on all problems together
    assert practice._signs_in_order(taught, None) == [RELAXED_PLAN, BOTH]
    monkeypatch.setattr(practice, "_CLEARLY", 0.0)
    assert practice._signs_in_order(taught, None) == [BOTH, RELAXED_PLAN]


def test_where_the_regression_goes_astray_another_sign_is_tried():
    task = random_blocks_tasks(11, 1, seed=1007)[0]
    outcome, found = attempt(alone(RELAXED_PLAN), task, max_expansions=20_000)
    before = outcome.regression
    assert outcome.lengths["backwards"] > 1.1 * len(before.plan)
    assert len(found.plan) <= len(plan(task).actions) < len(before.plan)
    assert found.expansions > before.expansions


def test_other_ways_have_what_is_left_of_the_share():
    task = load(VISITING, visiting(7))
    skill = alone(RELAXED_PLAN)
    outcome, found = attempt(skill, task, max_expansions=20_000)
    before, length = outcome.regression, len(outcome.regression.plan)
    assert len(found.plan) < length
    share = SHARE * skill.expected(outcome, length, before.expansions)
    assert before.expansions < found.expansions < share * 1.1
    names = task.action_names
    assert validate(task, [names[action] for action in found.plan]) == []
    # nothing is left where the regression took it all
    _, nothing = attempt(alone(RELAXED_PLAN, beam=48), task, max_expansions=20_000)
    rungs = Rungs(task, (RELAXED_PLAN,)).tried(48, 20_000)
    assert nothing.expansions == rungs.expansions


def test_a_regression_far_beyond_trust_is_compared_with_planning_without_experience():
    task = hands(6)
    _, known = attempt(alone(RELAXED_PLAN), task, max_expansions=20_000)
    found = alone(RELAXED_PLAN, trust=(0.0, 0.0)).plan(task, max_expansions=20_000)
    without = plan(task, max_expansions=20_000)
    assert found.expansions >= known.expansions + without.expansions
    assert len(found.plan) <= len(without.actions)


def test_what_planning_without_experience_takes_is_estimated_by_how_it_plans():
    task = hands(6)
    skill = Skill("", UNLEARNED, DEFAULTS, 80.0, 10, 1.0)
    backwards = PlanningRule("backwards", {"backwards": 1 << 30}, improvement=0, trust=(9.0, 9.0))
    quick = outcome_of(task, DEFAULTS, backwards, max_expansions=20_000)
    near, far = int(NEAR * quick.estimate), 2 * int(NEAR * quick.estimate)
    assert skill.expected(quick, near, 0) / near < skill.expected(quick, far, 0) / far
    bold = PlanningRule("boldly", {"boldly": 1000}, improvement=0, trust=(9.0, 9.0))
    stalled = outcome_of(task, DEFAULTS, bold, max_expansions=20_000)
    assert stalled.finder == "boldly"
    assert skill.expected(stalled, 20, 0) == 20 * 80 * 2  # twice the length, twice for a step
    assert skill.expected(stalled, 20, 10_000) > 10_000


def test_a_plan_is_improved_while_that_brings_something():
    patience = Patience(least=100, begun=40, spent=99, gained=40)
    assert not patience.is_over  # too soon
    patience.spent = 100
    assert patience.is_over  # all 60 were in vain
    patience.gained = 70
    assert not patience.is_over  # half of them
    patience.spent = 130
    assert patience.is_over  # two thirds: 60 of 90


def test_errands_of_every_kind_get_plans():
    for texts in (
        ferry(0, 3, 2),
        lifts(0, 3, 2),
        pictures(0, 1, 2, 3, 2),
        yards(0, 2, 1, 3, 2),
        keys(1, 6, 2, 1, 2),
        garden(1, 5, 2, 3),
        paint(1, 3, 1, 2),
        rails(1, 5, 3),
        probes(1, 6, 2, 3),
        shunting(1, 4, 3),
        tools(1, 5, 2, 3),
        boards(1, 3, 2, 1),
    ):
        task = load(*texts)
        result = plan(task, max_seconds=10)
        assert result.actions and validate(task, result.actions) == []


def test_problems_that_are_not_solved_teach_nothing():
    skill = Memory().practised([hands(6)], max_expansions=1).skills[0]
    assert skill.rule == UNLEARNED


def test_no_problems_several_domains_and_tasks_from_arrays_are_refused():
    task = hands(2)
    with pytest.raises(ValueError, match="of no domains"):
        Memory().practised([])
    with pytest.raises(ValueError, match="of 2 domains"):
        Memory().practised([task, random_blocks_tasks(3, 1)[0]])
    with pytest.raises(ValueError, match="load it from PDDL"):
        Memory().practised([dataclasses.replace(task, domain=None)])


def test_a_file_with_a_broken_skill_is_refused_by_name(memory, tmp_path):
    path = tmp_path / "memory.json"
    save_memory(memory, path)
    record = json.loads(path.read_text())
    for wrong in ({"length": "long"}, {"growth": "fast"}, {"per_step": "few"}):
        path.write_text(json.dumps(record | {"skills": [record["skills"][0] | wrong]}))
        with pytest.raises(ValueError, match=r"memory\.json: skill 1: not a skill"):
            load_memory(path)
    record["skills"][0]["rule"]["turns"] = [["sideways", 1]]
    path.write_text(json.dumps(record))
    with pytest.raises(ValueError, match=r"memory\.json: skill 1: not a skill"):
        load_memory(path)
