"""MAP on one task: small cases that earlier planners get wrong, random tasks against breadth-first
search, and known optimal lengths.
"""

import csv
import dataclasses

import numpy as np
import pytest

from sign_model.bits import pack
from sign_model.blocks import optimal_length, random_blocks_tasks, state_of
from sign_model.clock import NO_LIMIT
from sign_model.map_algorithm import map_planner
from sign_model.map_algorithm.a_step import make_rating
from sign_model.map_algorithm.heuristics import LANDMARKS, OVERLAP, RELAXED_PLAN
from sign_model.map_algorithm.map_planner import regress
from sign_model.map_algorithm.regression import regression_space
from sign_model.map_algorithm.shorten import shorten
from sign_model.pddl.grounding import load
from sign_model.pddl.planning_task import task_from_arrays
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.result import PlanStatus
from tests.helpers.strips import random_task, shortest_length


def small(conditions: str, adds: str, deletes: str, start: str, goal: str):
    """Returns a task with the features p, q, r and one action."""

    def bits(names: str) -> np.ndarray:
        return np.array([name in names for name in "pqr"])

    return task_from_arrays(
        bits(conditions)[None], bits(adds)[None], bits(deletes)[None], bits(start), bits(goal)
    )


def test_an_action_that_deletes_a_feature_of_the_goal_is_no_plan():
    assert plan(small("pq", "r", "pq", "pq", "qr")).status == PlanStatus.UNSOLVABLE


def test_an_action_may_delete_a_feature_that_the_goal_does_not_require():
    assert plan(small("p", "r", "pq", "pq", "r")).actions == ("(a0)",)


def test_a_partial_goal_needs_no_completion(shared_data):
    folder = shared_data / "pddl" / "blocks"
    text = (folder / "probBLOCKS-4-0.pddl").read_text()
    goal = text.lower().index("(:goal")
    assert len(plan(load(folder / "domain.pddl", text[:goal] + "(:goal (on a b)))")).actions) == 2


def test_a_goal_that_holds_at_the_start_gives_an_empty_plan():
    result = plan(small("p", "r", "", "pq", "pq"))
    assert result.status == PlanStatus.SOLVED and result.actions == () and result.expansions == 0


@pytest.mark.parametrize("sign", [OVERLAP, LANDMARKS, RELAXED_PLAN], ids=lambda sign: sign.name)
@pytest.mark.parametrize("name,length", [("4-0", 6), ("4-1", 10)])
def test_the_two_tasks_of_figure_2_take_6_and_10_steps(shared_data, sign, name, length):
    folder = shared_data / "pddl" / "blocks"
    task = load(folder / "domain.pddl", folder / f"probBLOCKS-{name}.pddl")
    assert len(plan(task, heuristic=sign).actions) == length


def test_random_tasks_are_decided_like_by_breadth_first_search():
    solvable = 0
    for seed in range(2000):
        task = random_task(seed)
        length, result = shortest_length(task), plan(task)
        assert result.status == (PlanStatus.UNSOLVABLE if length is None else PlanStatus.SOLVED), (
            seed
        )
        if length is not None:
            solvable += 1
            assert validate(task, result.actions) == [] and len(result.actions) >= length, seed
    assert 500 < solvable < 1700


def test_a_narrow_beam_proves_no_solvable_task_unsolvable():
    for seed in range(300):
        task = random_task(seed)
        space = regression_space(task)
        start, goal = space.situations(task.start), space.situations(task.goal)
        rating = make_rating(OVERLAP, space, start, goal, ["a"] * len(space.kept_actions))
        found = regress(space, start, goal, rating, beam=1, max_expansions=1000)
        assert not (found.is_proof and shortest_length(task) is not None), seed


def test_an_unlimited_beam_finds_a_shortest_plan():
    for seed in range(300):
        task = random_task(seed)
        space = regression_space(task)
        start, goal = space.situations(task.start), space.situations(task.goal)
        if space.is_consistent(goal[None])[0]:
            rating = make_rating(OVERLAP, space, start, goal, ["a"] * len(space.kept_actions))
            found = regress(space, start, goal, rating, beam=1 << 30, max_expansions=10**6)
            assert (None if found.plan is None else len(found.plan)) == shortest_length(task), seed


@pytest.mark.parametrize("pairs_at_once", [1 << 4, 1 << 16])
@pytest.mark.parametrize("size", [5, 64, 150])
def test_the_steps_on_words_do_what_their_sentences_say(size, pairs_at_once, monkeypatch):
    monkeypatch.setattr(map_planner, "_PAIRS_AT_ONCE", pairs_at_once)
    rng = np.random.default_rng(size)
    situations, adds, bad = (rng.random((n, size)) < 0.1 for n in (23, 40, 40))
    number, action = map_planner._m_step(situations, pack(adds), pack(bad), NO_LIMIT)
    assert list(zip(number.tolist(), action.tolist())) == [
        (i, a)
        for i, situation in enumerate(situations)
        for a in range(len(adds))
        if (situation & adds[a]).any() and not (situation & bad[a]).any()
    ]

    # Some contain another, some are equal to one, most are neither.
    known = np.concatenate([situations[:9], rng.random((200, size)) < 0.02])
    larger = np.concatenate([situations, known[:20] | (rng.random((20, size)) < 0.05)])
    assert map_planner._contains_another(pack(larger), pack(known)).tolist() == [
        any(not (other & ~one).any() and (other != one).any() for other in known) for one in larger
    ]


def test_an_exhausted_budget_is_a_status():
    task = random_blocks_tasks(8, 1, seed=3)[0]
    assert plan(task, max_expansions=2).status == PlanStatus.BUDGET_SPENT
    assert plan(task, max_seconds=0.0).status == PlanStatus.BUDGET_SPENT


def test_equal_tasks_give_equal_plans():
    for task in random_blocks_tasks(7, 5, seed=9):
        assert plan(task).actions == plan(task).actions


def test_the_order_of_the_features_does_not_change_the_length_of_a_plan():
    task = random_blocks_tasks(6, 1, seed=4)[0]
    order = np.random.default_rng(0).permutation(task.num_features)
    permuted = dataclasses.replace(
        task_from_arrays(
            *(m[:, order] for m in (task.conditions, task.adds, task.deletes)),
            task.start[order],
            task.goal[order],
        ),
        features=tuple(task.features[i] for i in order),
    )
    assert len(plan(permuted).actions) == len(plan(task).actions)


def test_unlearned_plans_of_blocks_are_nearly_optimal():
    tasks = random_blocks_tasks(7, 60, seed=2)
    lengths = np.array([len(plan(task).actions) for task in tasks])
    optima = np.array(
        [optimal_length(state_of(t.problem.start, 7), state_of(t.problem.goal, 7)) for t in tasks]
    )
    assert (lengths >= optima).all() and lengths.sum() <= 1.05 * optima.sum()


@pytest.mark.parametrize("folder", ["blocks", "hanoi", "ferry", "goldminer"])
def test_plans_are_at_most_15_percent_longer_than_known_optima(shared_data, folder):
    with open(shared_data / "pddl" / "fd_optimal.csv") as file:
        optima = {
            row["file"]: int(row["optimal_steps_if_unit_cost"]) for row in csv.DictReader(file)
        }
    for name, optimum in optima.items():
        if name.startswith(folder) and optimum <= 63:
            task = load(shared_data / "pddl" / folder / "domain.pddl", shared_data / "pddl" / name)
            assert optimum <= len(plan(task).actions) <= 1.15 * optimum, name


class _Experience:
    """A memory with fixed answers."""

    def __init__(self, recalled=None, suggested=None):
        self.recalled, self.suggested = recalled, suggested

    def recall(self, task):
        return self.recalled

    def suggest(self, task):
        return self.suggested


def test_a_precedent_needs_one_expansion_and_a_wrong_one_does_no_harm():
    task = random_blocks_tasks(6, 1, seed=8)[0]
    fresh = plan(task)
    repeated = plan(task, memory=_Experience(fresh.actions))
    assert repeated.actions == fresh.actions and repeated.expansions == 1
    for wrong in (("(fly b1)",), fresh.actions[:-1]):
        assert plan(task, memory=_Experience(wrong, wrong)).actions == fresh.actions


def test_a_suggestion_is_returned_if_the_budget_is_exhausted():
    task = random_blocks_tasks(8, 1, seed=3)[0]
    known = plan(task).actions
    assert plan(task, max_expansions=1, memory=_Experience(None, known)).actions == known


def test_shorten_removes_a_detour():
    task = random_blocks_tasks(5, 1, seed=1)[0]
    number_of = {name: i for i, name in enumerate(task.action_names)}
    best = [number_of[name] for name in plan(task).actions]
    first = task.actions[best[0]]
    back = {"pick-up": "(put-down {0})", "unstack": "(stack {0} {1})"}[first[0]].format(*first[1:])
    assert len(shorten(task, [best[0], number_of[back], *best])) == len(best)


@pytest.mark.parametrize(
    "options,message",
    [
        ({"planner": "magic"}, "planner 'magic' is not known"),
        ({"heuristic": "magic"}, "heuristic sign 'magic' is not known"),
        ({"planner": "astar", "heuristic": "magic"}, "heuristic 'magic' is not known"),
        ({"planner": "astar", "heuristic": OVERLAP}, "takes the name of a heuristic"),
        ({"heuristic": ()}, "at least one heuristic sign"),
        ({"max_expansions": 0}, "max_expansions must be at least 1"),
    ],
)
def test_wrong_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        plan(small("p", "r", "", "pq", "r"), **options)
