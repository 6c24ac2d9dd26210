"""The ways of planning forwards: each against breadth-first search, and objects alike."""

import numpy as np
import pytest

from experiments.campaigns.inputs.vehicle_tasks import roads, rooms
from experiments.campaigns.inputs.workshop_tasks import bar, orders, snacks
from sign_model import PlanningRule, PlanStatus, load, plan, validate
from sign_model.bits import pack
from sign_model.strategies import alike, curiously, forwards
from sign_model.strategies.alike import Alike
from sign_model.strategies.curiously import Curiously
from sign_model.strategies.forwards import Forwards, Scripts
from sign_model.strategies.goal_by_goal import GoalByGoal
from sign_model.strategies.landmarks_left import LandmarksLeft
from sign_model.strategies.rule import WAYS
from tests.helpers.strips import random_task, shortest_length


def names_of(task, actions):
    return [task.action_names[a] for a in actions]


def searches(task, **options):
    scripts = Scripts(task.conditions, task.adds, task.deletes)
    landmarks = LandmarksLeft(task, task.start, task.goal)
    for given in (
        {"is_bold": True},
        {"landmarks": landmarks},
        {"landmarks": landmarks, "is_deferred": True},
        {"landmarks": landmarks, "is_deferred": True, "at_once": 3},
    ):
        yield Forwards(scripts, task.start, task.goal, **given, **options)
    yield Curiously(scripts, task.start, task.goal)


def test_every_search_forwards_decides_random_tasks_like_breadth_first_search():
    for seed in range(150):
        task = random_task(seed)
        length = shortest_length(task)
        for search in searches(task):
            search.advance(100_000)
            if length is None:
                assert search.plan is None and search.is_exhausted, seed
            else:
                assert search.plan is not None and len(search.plan) >= length, seed
                assert validate(task, names_of(task, search.plan)) == [], seed


def test_a_search_continued_in_small_parts_finds_the_same_plan():
    task = load(*roads(3, 8, 2, 4))
    for whole, parts in zip(searches(task), searches(task)):
        whole.advance(10_000)
        for most in range(1, 2_000, 29):
            parts.advance(most)
        parts.advance(10_000)
        assert whole.plan is not None and parts.plan is not None
        assert validate(task, names_of(task, parts.plan)) == []


def test_curiosity_expands_little_where_goals_must_be_given_up_for_others():
    task = load(*bar(2, 3, 3, 1))
    search = Curiously(Scripts(task.conditions, task.adds, task.deletes), task.start, task.goal)
    search.advance(20_000)
    assert search.plan is not None and validate(task, names_of(task, search.plan)) == []
    assert search.expansions < 3000


def test_curiosity_that_may_remember_no_pairs_decides_all_the_same(monkeypatch):
    monkeypatch.setattr(curiously, "_MAX_WORDS", 0)
    for seed in range(60):
        task = random_task(seed)
        search = Curiously(Scripts(task.conditions, task.adds, task.deletes), task.start, task.goal)
        search.advance(100_000)
        assert (search.plan is not None) == (shortest_length(task) is not None), seed
        assert search.plan is not None or search.is_exhausted


def test_goal_by_goal_solves_what_goals_hardly_disturb():
    task = load(*bar(1, 3, 3, 1))
    scripts = Scripts(task.conditions, task.adds, task.deletes)
    search = GoalByGoal(scripts, task.adds, task.deletes, task.start, task.goal, patience=500)
    search.advance(20_000)
    assert search.plan is not None and validate(task, names_of(task, search.plan)) == []


def test_objects_alike_are_those_that_neither_actions_nor_goals_distinguish():
    task = load(*rooms(1, 2, 5, 1))
    assert set(Alike(task).classes) == {("b0", "b1", "b2", "b3", "b4"), ("h0", "h1")}
    one = load(*snacks(0, 4, 2, 1))
    assert any(set(c) == {"t0", "t1"} for c in Alike(one).classes)


def test_a_canonical_situation_is_the_same_for_all_exchanges_and_reachable_by_one():
    task = load(*rooms(1, 2, 4, 1))
    known, number_of = Alike(task), {atom: i for i, atom in enumerate(task.features)}
    rng = np.random.default_rng(0)
    balls, hands = [f"b{i}" for i in range(4)], ["h0", "h1"]
    for _ in range(50):
        swap = dict(zip(balls, rng.permutation(balls))) | dict(zip(hands, rng.permutation(hands)))
        state = rng.random(task.num_features) < 0.3
        image = np.zeros_like(state)
        for f in np.flatnonzero(state):
            atom = task.features[f]
            image[number_of[(atom[0], *[str(swap.get(x, x)) for x in atom[1:]])]] = True
        both = known.canonical(np.stack([state, image]))
        kinds = [sorted(task.features[f][0] for f in np.flatnonzero(row)) for row in both]
        assert kinds[0] == kinds[1] == sorted(task.features[f][0] for f in np.flatnonzero(state))
        only_balls = {h: h for h in hands}
        image = np.zeros_like(state)
        for f in np.flatnonzero(state):
            atom = task.features[f]
            moved = (atom[0], *[str((swap | only_balls).get(x, x)) for x in atom[1:]])
            image[number_of[moved]] = True
        table = known.tables[[len(c) for c in known.classes].index(4)]
        rows = [np.sort(np.packbits(s[table], axis=1), axis=0) for s in (state, image)]
        assert (rows[0] == rows[1]).all()


@pytest.mark.parametrize("size", [1, 5, 64, 70])
def test_members_are_ordered_by_their_words(size):
    rows = np.random.default_rng(size).random((30, 4, size)) < 0.5
    rows[:10] = np.sort(rows[:10], axis=1)
    rows[5:20, 2] = rows[5:20, 1]
    for row, ordered in zip(rows, alike._sorted(rows.copy())):
        expected = sorted(row, key=lambda member: pack(member).tolist())
        assert np.array_equal(ordered, expected)


def test_what_is_prepared_or_known_before_changes_no_deferred_search(monkeypatch):
    task = load(*snacks(1, 3, 2, 2))
    found = []
    for prepared, known in ((1, 0), (7, 1 << 18)):
        monkeypatch.setattr(forwards, "_PREPARED", prepared)
        monkeypatch.setattr(forwards, "_MOST_KEYS", known)
        options = {"canonical": Alike(task).canonical}
        for search in searches(task, **options):
            if not isinstance(search, Forwards):
                continue
            search.advance(300)
            found.append((search.plan, search.expansions, search.words))
    half = len(found) // 2
    for one, other in zip(found[:half], found[half:]):
        assert one[:2] == other[:2] and np.array_equal(one[2], other[2])


def test_fewer_situations_rated_together_lead_to_a_plan_sooner():
    task = load(*rooms(0, 3, 6, 1))
    lengths, expansions = [], []
    for at_once in (8, 32):
        rule = PlanningRule("one", {"deferred": 4000}, improvement=0, at_once=at_once)
        result = plan(task, rule=rule)
        assert validate(task, result.actions) == []
        lengths.append(len(result.actions))
        expansions.append(result.expansions)
    assert lengths[0] >= lengths[1] and 2 * expansions[0] < expansions[1]


@pytest.mark.parametrize("way", WAYS)
def test_each_way_alone_solves_a_small_delivery(way):
    task = load(*roads(0, 5, 2, 2))
    result = plan(task, rule=PlanningRule("one", {way: 1000}))
    assert result.is_solved and validate(task, result.actions) == []


@pytest.mark.parametrize(
    "texts,most",
    [
        (rooms(0, 2, 8, 1), 23),
        (roads(2, 9, 2, 4), 30),
        (snacks(3, 6, 2, 2), 30),
        (orders(1, 6, 6, 0.3), 24),
        (bar(2, 3, 2, 1), 26),
    ],
    ids=["rooms", "roads", "snacks", "orders", "bar"],
)
def test_domains_where_the_regression_stalls_are_solved_with_short_plans(texts, most):
    task = load(*texts)
    result = plan(task)
    assert result.is_solved and validate(task, result.actions) == []
    assert len(result.actions) <= most


def test_a_rule_changes_no_verdict():
    rules = [
        PlanningRule("forwards", {"forwards": 5, "backwards": 5}, growth=2),
        PlanningRule("bold", {"boldly": 1, "goal by goal": 1, "backwards": 1}, improvement=0),
    ]
    for seed in range(150):
        task = random_task(seed)
        has_plan = shortest_length(task) is not None
        for rule in rules:
            status = plan(task, rule=rule).status
            assert status == (PlanStatus.SOLVED if has_plan else PlanStatus.UNSOLVABLE), seed


def test_steps_that_cut_nothing_off_are_no_stall(shared_data):
    folder = shared_data / "pddl" / "hanoi"
    task = load(folder / "domain.pddl", folder / "pfile8.pddl")
    result = plan(task, rule=PlanningRule("one", {"backwards": 8000}, improvement=0))
    assert len(result.actions) == 255 and result.expansions < 12_000
