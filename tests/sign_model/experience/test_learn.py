"""Weights learned from small tasks: better than the unlearned ones on other tasks, deterministic,
and unchanged by saving and loading. Also random blocks tasks and the rule of the paper's authors.
"""

import dataclasses

import numpy as np
import pytest

from sign_model.blocks import optimal_length, random_blocks_tasks, random_state, state_of
from sign_model.experience.learn import learn
from sign_model.map_algorithm.authors_rule import plan_by_authors_rule
from sign_model.map_algorithm.heuristics import load_signs, save_signs
from sign_model.map_algorithm.shorten import states_along
from sign_model.map_batch.ladder import plan_batch
from sign_model.pddl.grounding import load
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan


@pytest.fixture(scope="module")
def learned():
    lines = []
    sign = learn(
        random_blocks_tasks(4, 64, seed=1),
        generations=6,
        population=12,
        lanes=32,
        beam=2,
        log=lines.append,
    )
    assert lines and "mean length" in lines[-1]
    return sign


def test_learned_weights_give_short_plans_on_larger_tasks(learned):
    tasks = random_blocks_tasks(6, 30, seed=2)
    lengths = np.array(
        [len(result.actions) for result in (plan(task, heuristic=learned) for task in tasks)]
    )
    optima = np.array(
        [optimal_length(state_of(t.problem.start, 6), state_of(t.problem.goal, 6)) for t in tasks]
    )
    assert (lengths >= optima).all() and lengths.sum() <= 1.05 * optima.sum()


def test_learned_weights_can_be_saved_loaded_and_used_in_a_batch(learned, tmp_path):
    save_signs(tmp_path / "signs.json", [learned])
    (again,) = load_signs(tmp_path / "signs.json")
    tasks = random_blocks_tasks(4, 8, seed=3)
    assert all(
        not validate(t, r.actions) for t, r in zip(tasks, plan_batch(tasks, heuristic=again))
    )


def test_the_same_seed_gives_the_same_weights(learned):
    again = learn(
        random_blocks_tasks(4, 64, seed=1), generations=6, population=12, lanes=32, beam=2
    )
    assert again == learned


def test_the_number_of_tasks_in_a_batch_need_not_be_a_power_of_two():
    tasks = random_blocks_tasks(3, 10, seed=1)
    signs = [
        learn(tasks, generations=1, population=2, lanes=lanes, beam=2, name="n")
        for lanes in (10, 16)
    ]
    assert signs[0] == signs[1]  # padding counts nothing


def test_no_tasks_and_tasks_of_different_domains_are_refused():
    with pytest.raises(ValueError, match="at least one task"):
        learn([])
    from experiments.campaigns.inputs.vehicle_tasks import rooms

    with pytest.raises(ValueError, match="of 2 domains"):
        learn([random_blocks_tasks(3, 1)[0], load(*rooms(0, 2, 2, 1))])


def test_tasks_with_different_objects_teach_weights_for_larger_ones():
    small = [random_blocks_tasks(n, 1, seed=n)[0] for n in (3, 4, 4, 5)]
    sign = learn(small, generations=2, population=4, beam=2)
    assert sign == learn(small, generations=2, population=4, beam=2)
    task = random_blocks_tasks(8, 1, seed=5)[0]
    result = plan(task, heuristic=sign)
    assert result.is_solved and validate(task, result.actions) == []


def test_random_states_are_towers_and_equally_likely():
    rng = np.random.default_rng(0)
    sampled = [tuple(random_state(3, rng).tolist()) for _ in range(3000)]
    counts = {state: sampled.count(state) for state in set(sampled)}
    assert len(counts) == 13 and min(counts.values()) > 150 and max(counts.values()) < 320
    for state in counts:
        resting = [place for place in state if place != -1]
        assert len(resting) == len(set(resting))


def test_the_optimal_length_of_blocks_tasks_equals_that_of_astar():
    for task in random_blocks_tasks(4, 40, seed=4):
        found = plan(task, planner="astar", heuristic="hmax").actions
        assert len(found) == optimal_length(
            state_of(task.problem.start, 4), state_of(task.problem.goal, 4)
        )


def test_fewer_than_two_blocks_are_refused():
    with pytest.raises(ValueError, match="at least 2 blocks"):
        random_blocks_tasks(1, 1)


def test_the_authors_rule_solves_figure_2_with_their_lengths(shared_data):
    folder = shared_data / "pddl" / "blocks"
    for name, length in (("4-0", 6), ("4-1", 10), ("4-2", 6), ("5-1", 14), ("6-1", 10)):
        task = load(folder / "domain.pddl", folder / f"probBLOCKS-{name}.pddl")
        number_of = {action: i for i, action in enumerate(task.action_names)}
        end = states_along(task, [number_of[action] for action in plan(task).actions])[-1]
        complete = dataclasses.replace(task, goal=end)  # their program required complete goals
        result = plan_by_authors_rule(complete)
        assert len(result.actions) == length and validate(task, result.actions) == []


def test_the_authors_rule_may_fail_where_map_finds_a_plan():
    task = random_blocks_tasks(7, 1, seed=12)[0]
    assert not plan_by_authors_rule(task, max_iterations=1).is_solved
    assert plan(task).is_solved
