"""Many tasks in one jitted search: the same answers as one by one, and the jitted tables against
those of the host.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.campaigns.inputs.vehicle_tasks import airlines, roads, rooms
from sign_model import Memory
from sign_model.blocks import optimal_length, random_blocks_tasks, state_of
from sign_model.foundation.words import pack_rows
from sign_model.map_algorithm.heuristics import LANDMARKS, OVERLAP, RELAXED_PLAN, HeuristicSign
from sign_model.map_algorithm.landmarks import landmark_table as host_landmarks
from sign_model.map_algorithm.landmarks import relaxed_plan_table as host_plans
from sign_model.map_algorithm.regression import regression_space
from sign_model.map_batch import ladder as ladder_module
from sign_model.map_batch.detours import have_detours
from sign_model.map_batch.grouping import groups_of
from sign_model.map_batch.iteration import _regress, regress
from sign_model.map_batch.ladder import TOGETHER, Rung, plan_batch
from sign_model.map_batch.packed_tasks import pack_batch
from sign_model.map_batch.start_tables import landmark_table, relaxed_plan_table
from sign_model.map_batch.tables import make_tables
from sign_model.pddl.grounding import load
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.result import PlanStatus
from tests.helpers.strips import random_task, shortest_length

LADDER = (Rung(beam=4, branch=8, steps=32, lanes=16), Rung(beam=32, branch=8, steps=48, lanes=8))


def test_every_plan_of_a_batch_is_valid_and_near_the_optimum():
    tasks = random_blocks_tasks(6, 50, seed=3)
    results = plan_batch(tasks, heuristic=LANDMARKS, ladder=LADDER)
    assert all(
        r.status == PlanStatus.SOLVED and validate(t, r.actions) == []
        for t, r in zip(tasks, results)
    )
    lengths = np.array([len(r.actions) for r in results])
    optima = np.array(
        [optimal_length(state_of(t.problem.start, 6), state_of(t.problem.goal, 6)) for t in tasks]
    )
    assert (lengths >= optima).all() and lengths.sum() <= 1.1 * optima.sum()


def test_a_plan_does_not_depend_on_the_tasks_beside_it():
    # more tasks than batch slots: slots are refilled
    tasks = random_blocks_tasks(4, 40, seed=7)
    on_table = dataclasses.replace(
        tasks[0],
        goal=tasks[0].situation([("ontable", "b1"), ("on", "b0", "b2")]),
        costs=np.arange(tasks[0].num_actions),
        problem=None,
    )
    together = plan_batch(tasks, heuristic=LANDMARKS, ladder=LADDER[:1])
    backwards = plan_batch(
        [on_table, *tasks[::-1]], heuristic=LANDMARKS, ladder=LADDER[:1], num_threads=1
    )
    names = on_table.action_names
    assert backwards[0].cost == sum(map(names.index, backwards[0].actions))
    backwards = backwards[:0:-1]
    assert {r.cost for r in backwards} == {None}
    assert [r.actions for r in together] == [r.actions for r in backwards]
    for number in (0, 1, 17, 39):
        assert (
            plan_batch([tasks[number]], heuristic=LANDMARKS, ladder=LADDER[:1])[0].actions
            == together[number].actions
        )
    few = plan_batch([*tasks[5:8], on_table], heuristic=LANDMARKS, ladder=LADDER[:1])
    assert [r.actions for r in few[:3]] == [r.actions for r in together[5:8]]
    assert (
        plan_batch([on_table], heuristic=LANDMARKS, ladder=LADDER[:1])[0].actions == few[3].actions
    )


def test_new_tasks_and_new_weights_compile_nothing():
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, seconds, **_: compiled.append(event) if "backend_compile" in event else None
    )
    signs = [
        HeuristicSign("one", landmarks={"clear": weight, "holding": 8}, unmet={"on": 4})
        for weight in (5, 9)
    ]
    plan_batch(random_blocks_tasks(4, 10, seed=1), heuristic=signs[0], ladder=LADDER[:1])
    compiled.clear()
    plan_batch(random_blocks_tasks(4, 13, seed=2), heuristic=signs[1], ladder=LADDER[:1])
    assert not compiled


def test_the_marks_change_nothing_but_the_speed(monkeypatch):
    tasks = random_blocks_tasks(3, 6, seed=1)
    batch = pack_batch(tasks, (LANDMARKS,))
    given = (batch.tables, batch.weights[0], *batch.queue(np.arange(6), 16))
    options = {"beam": 2, "branch": 4, "steps": 12, "lanes": 4}
    whole = regress(*given, **options)
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    plain = jax.jit(lambda *args: _regress(*args, **options))(*given)
    for one, other in zip(whole, plain):
        np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_a_detour_is_detected_and_removed():
    task = random_blocks_tasks(4, 1, seed=6)[0]
    good = [task.action_names.index(name) for name in plan(task).actions]
    first = next(
        i
        for i, name in enumerate(task.action_names)
        if name.startswith("(pick-up") and not _lacks(task, i)
    )
    back = task.action_names.index(task.action_names[first].replace("pick-up", "put-down"))
    batch = pack_batch([task, task], (LANDMARKS,))
    of_space = {action: i for i, action in enumerate(batch.space.kept_actions.tolist())}
    plans = [[of_space[a] for a in steps] for steps in (good, [first, back, *good])]
    padded = np.array(
        [np.pad(steps, (0, 24 - len(steps)), constant_values=-1) for steps in plans], np.int32
    )
    t, (start, goal, _) = batch.tables, batch.queue(np.arange(2), 2)
    found = jax.jit(lambda *args: have_detours(*args, lanes=2))(
        t.keeps, t.needs, t.deletes, start, goal, padded
    )
    assert found.tolist() == [False, True]
    batch.record(np.arange(2), np.array([len(steps) for steps in plans]), padded, np.asarray(found))
    assert batch.lengths.tolist() == [len(good), len(good)]
    assert all(result.is_solved for result in batch.results(1000))


def _lacks(task, action):
    return (task.conditions[action] & ~task.start).any()


def test_tasks_are_grouped_if_their_searches_are_the_same_together_and_alone():
    tasks = random_blocks_tasks(4, 3, seed=1)
    other_goal = dataclasses.replace(tasks[0], goal=tasks[0].situation([("ontable", "b1")]))
    other_effects = dataclasses.replace(tasks[0], adds=tasks[0].adds & ~tasks[0].adds[0])
    assert groups_of([tasks[0], other_goal, tasks[1], other_effects, tasks[2]]) == [
        [0, 2, 4],
        [1],
        [3],
    ]
    assert groups_of([]) == []


def test_tasks_of_several_domains_are_answered_in_order(shared_data):
    blocks = random_blocks_tasks(4, 3, seed=1)
    folder = shared_data / "pddl"
    hanoi = load(folder / "hanoi" / "domain.pddl", folder / "hanoi" / "pfile3.pddl")
    miner = load(folder / "goldminer" / "domain.pddl", folder / "goldminer" / "gm-rows2-cols3.pddl")
    tasks = [blocks[0], hanoi, blocks[1], miner, blocks[2]]
    results = plan_batch(tasks, ladder=LADDER)
    assert all(validate(t, r.actions) == [] for t, r in zip(tasks, results))
    assert 7 <= len(results[1].actions) <= 9


def test_tasks_the_ladder_leaves_unsolved_go_to_the_exact_search():
    tasks = random_blocks_tasks(4, 4, seed=2)
    rung = (Rung(beam=1, branch=1, steps=2, lanes=8),)
    assert all(r.is_solved for r in plan_batch(tasks, heuristic=OVERLAP, ladder=rung))
    base = tasks[0]
    impossible = base.situation([("on", "b0", "b1"), ("on", "b1", "b2"), ("on", "b2", "b0")])
    results = plan_batch(
        [base, dataclasses.replace(base, goal=impossible, problem=None, domain=None)], ladder=LADDER
    )
    assert [r.status for r in results] == [PlanStatus.SOLVED, PlanStatus.UNSOLVABLE]


def test_random_tasks_are_answered_as_breadth_first_search_answers_them():
    tasks = [random_task(seed) for seed in range(40)]
    for task, result in zip(tasks, plan_batch(tasks, heuristic=OVERLAP, ladder=LADDER)):
        assert result.is_solved == (shortest_length(task) is not None)
        assert not result.is_solved or validate(task, result.actions) == []


def test_the_jitted_tables_equal_those_of_the_host():
    tasks = random_blocks_tasks(4, 8, seed=4)
    starts, goals = np.array([t.start for t in tasks]), np.array([t.goal for t in tasks])
    space = regression_space(tasks[0], starts, goals)
    size = len(space.features)
    tables = make_tables(space, np.arange(size))
    start = np.zeros((32 * tables.needs.shape[0], len(tasks)), bool)
    start[:size] = space.situations(starts).T
    landmarks, plans = (
        jax.jit(table)(tables, jnp.asarray(start)) for table in (landmark_table, relaxed_plan_table)
    )
    for number, task in enumerate(tasks):
        holds = space.situations(task.start)
        ours = host_landmarks(space, holds).view("<u4")[:, : landmarks.shape[1]]
        np.testing.assert_array_equal(np.asarray(landmarks)[:size, :, number], ours)
        ours = host_plans(space, holds).view("<u4")[:, : plans.shape[1]]
        np.testing.assert_array_equal(np.asarray(plans)[:size, :, number], ours)


@pytest.mark.parametrize("sign", [LANDMARKS, RELAXED_PLAN, OVERLAP], ids=lambda sign: sign.name)
def test_a_batch_is_solved_with_each_heuristic_sign(sign):
    tasks = random_blocks_tasks(4, 8, seed=11)
    assert all(r.is_solved for r in plan_batch(tasks, heuristic=sign, ladder=LADDER))


def test_a_few_tasks_of_any_sizes_are_planned_as_they_would_be_alone():
    domain_of = [roads(1, 6, 1, 3), roads(2, 8, 2, 4), rooms(0, 2, 4, 1), roads(3, 5, 1, 2)]
    tasks = [load(*texts) for texts in domain_of] + random_blocks_tasks(6, 3, seed=1)
    lines = []
    results = plan_batch(tasks, log=lines.append)
    assert [r.actions for r in results] == [plan(task).actions for task in tasks]
    assert all("one by one" in line for line in lines[:-1])
    assert len(lines) == 6 and f"{len(tasks)} tasks in 5 groups: {len(tasks)} solved" in lines[-1]
    memory = Memory().learned(tasks[0], results[0].actions)
    assert plan_batch(tasks[:1], memory=memory)[0].expansions == 1


def test_many_tasks_of_one_size_are_searched_side_by_side_and_the_cost_is_told():
    tasks, lines = [*random_blocks_tasks(4, TOGETHER, seed=4)], []
    assert all(r.is_solved for r in plan_batch(tasks, heuristic=LANDMARKS, log=lines.append))
    assert len(lines) == 1 and lines[0].startswith(f"{TOGETHER} tasks of ")
    assert "side by side" in lines[0] and lines[0].endswith("ms each")
    alone = plan_batch(tasks, log=lines.append, together=TOGETHER + 1)
    assert "one by one" in lines[1]
    assert [r.actions for r in alone[:9]] == [plan(task).actions for task in tasks[:9]]


def _of_several_domains():
    """Tasks of several domains and sizes: groups from 1 to more than 64 tasks."""
    texts = [
        *(airlines(seed, 2, 2, 2, 1) for seed in range(12)),
        *(rooms(seed, 2, 2, 1) for seed in range(8)),
        *(roads(seed, 4 + seed, 1, 2) for seed in range(3)),
    ]
    blocks = (
        task
        for n, count in ((5, 70), (4, 3), (6, 12))
        for task in random_blocks_tasks(n, count, seed=n)
    )
    return [*(load(*text) for text in texts), *blocks]


@pytest.mark.parametrize("probed", [0, 8])
def test_no_plan_of_a_batch_is_longer_than_alone(monkeypatch, probed):
    # without a probe even groups whose plans can't be proven shortest are searched side by side
    monkeypatch.setattr(ladder_module, "_COMPARED", 8)
    monkeypatch.setattr(ladder_module, "_PROBED", probed)
    tasks, lines = _of_several_domains(), []
    order = np.random.default_rng(probed).permutation(len(tasks)).tolist()
    results = plan_batch([tasks[i] for i in order], log=lines.append)
    assert any("side by side, then one by one" in line for line in lines)
    for i, result in zip(order, results):
        assert result.is_solved and validate(tasks[i], result.actions) == []
        assert len(result.actions) <= len(plan(tasks[i]).actions)


def test_a_longer_plan_of_the_search_gives_way_to_that_of_planning_alone():
    # a beam of two finds plans longer than the least
    tasks = random_blocks_tasks(6, 24, seed=9)
    batch, rung = pack_batch(tasks, (LANDMARKS,)), Rung(beam=2, branch=8, steps=64, lanes=8)
    start, goal, count = batch.queue(np.arange(24), 24)
    options = dataclasses.asdict(rung)
    found = regress(batch.tables, batch.weights[0], start, goal, count, **options)
    batch.record(np.arange(24), *(np.array(part) for part in found))
    alone = [plan(task) for task in tasks]
    kept = batch.results(plan, {0: alone[0]})
    lengths = np.array([len(result.actions) for result in alone])
    assert (batch.lengths > lengths).any()
    assert all(batch.least_length(i) <= n for i, n in enumerate(lengths))
    assert [len(result.actions) <= n for result, n in zip(kept, lengths)] == [True] * 24


def test_a_batch_may_hold_one_task_or_none():
    task = random_blocks_tasks(4, 1, seed=5)[0]
    assert len(plan_batch([task], ladder=LADDER)[0].actions) >= len(plan(task).actions)
    assert plan_batch([]) == []


def test_a_goal_that_holds_at_the_start_needs_no_action():
    task = random_blocks_tasks(4, 1)[0]
    done = dataclasses.replace(task, goal=task.start & task.goal, domain=None, problem=None)
    assert plan_batch([done], ladder=LADDER)[0].actions == ()


@pytest.mark.parametrize(
    "wrong",
    [{"beam": 0}, {"beam": 257}, {"branch": 300}, {"steps": 0}, {"lanes": 0}, {"lanes": 24}],
)
def test_a_rung_with_a_number_out_of_range_is_refused(wrong):
    with pytest.raises(ValueError, match=f"a rung's {next(iter(wrong))} must"):
        Rung(**{"beam": 4, "branch": 4, "steps": 4, "lanes": 8, **wrong})


def test_packed_words_hold_their_bits_lowest_first():
    bits = np.zeros((1, 40), bool)
    bits[0, [0, 33]] = True
    assert pack_rows(bits, 2).tolist() == [[1, 2]]
