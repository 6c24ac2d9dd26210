"""Plans improved part by part stay valid, and become shorter where two trips can be one."""

import numpy as np

from experiments.campaigns.inputs.vehicle_tasks import roads, rooms
from sign_model import load, validate
from sign_model.map_algorithm.mutex import mutexes
from sign_model.strategies.forwards import Forwards, Scripts
from sign_model.strategies.improve import improve
from sign_model.strategies.windows import Rearranging


def mutex_of(task):
    return mutexes(task.features, task.conditions, task.adds, task.deletes, task.start[None])[0]


def found(task, **options):
    search = Forwards(Scripts(task.conditions, task.adds, task.deletes), task.start, task.goal)
    search.advance(10_000)
    assert search.plan is not None
    return search.plan


def names_of(task, actions):
    return [task.action_names[a] for a in actions]


def one_by_one(task, balls):
    """A plan that carries each ball alone."""
    number_of = {name: i for i, name in enumerate(task.action_names)}
    plan = []
    for i in range(balls):
        plan += [f"(grab b{i} r0 k0 h0)", "(step k0 r0 r1)", f"(drop b{i} r1 k0 h0)"]
        plan += ["(step k0 r1 r0)"] if i + 1 < balls else []
    return [number_of[name] for name in plan]


def test_single_trips_become_trips_with_both_hands():
    task = load(*rooms(0, 2, 6, 1))
    plan = one_by_one(task, 6)
    assert validate(task, names_of(task, plan)) == [] and len(plan) == 23
    better, expansions = improve(task, mutex_of(task), plan, effort=10_000_000)
    assert validate(task, names_of(task, better)) == [] and len(better) == 17
    again = improve(task, mutex_of(task), plan, effort=10_000_000)
    assert again == (better, expansions) and expansions > 0
    assert improve(task, mutex_of(task), plan, effort=0) == (plan, 0)


def test_gathered_steps_keep_a_plan_valid():
    task = load(*roads(4, 9, 2, 4))
    plan, rearranging = found(task), Rearranging(task, mutex_of(task))
    rng = np.random.default_rng(0)
    for _ in range(60):
        count = int(rng.integers(1, len(plan)))
        chosen = sorted(rng.choice(len(plan), count, replace=False).tolist())
        before, part, after = rearranging.gathered(plan, chosen)
        assert sorted(before + part + after) == sorted(plan)
        assert validate(task, names_of(task, before + part + after)) == []
        held = list(part)
        for place in chosen:
            held.remove(plan[place])


def test_a_window_is_solved_by_its_own_part():
    task = load(*roads(4, 9, 2, 4))
    plan, rearranging = found(task), Rearranging(task, mutex_of(task))
    for at in range(0, len(plan) - 4, 3):
        parts = plan[:at], plan[at : at + 5], plan[at + 5 :]
        for is_wide in (False, True):
            window = rearranging.window(*parts, is_wide=is_wide)
            number_of = {int(a): i for i, a in enumerate(window.space.kept_actions)}
            state = window.start
            for action in parts[1]:
                row = number_of[action]
                assert state[window.space.conditions[row]].all()
                state = (state & ~window.space.deletes[row]) | window.space.adds[row]
            assert state[window.goal].all()
