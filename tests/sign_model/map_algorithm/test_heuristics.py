"""The tables of the A-step against slow twins on sets; mutexes against the reachable states;
heuristic signs in files.
"""

import itertools

import numpy as np
import pytest

from sign_model.bits import pack, popcount, unpack
from sign_model.blocks import random_blocks_tasks
from sign_model.map_algorithm.a_step import kind_of, make_rating
from sign_model.map_algorithm.heuristics import (
    DEFAULTS,
    LANDMARKS,
    HeuristicSign,
    load_signs,
    save_signs,
    weight_of,
)
from sign_model.map_algorithm.landmarks import landmark_table, relaxed_plan_table
from sign_model.map_algorithm.mutex import mutex_groups, mutexes
from sign_model.map_algorithm.regression import RegressionSpace, regression_space
from tests.helpers.strips import random_task, reachable_states


def spaces(count: int):
    """Yields (space, start, goal) of random tasks and of three blocks tasks."""
    for seed in range(count):
        task = random_task(seed)
        space = regression_space(task)
        yield space, space.situations(task.start), space.situations(task.goal)
    for task in random_blocks_tasks(4, 3, seed=1):
        space = regression_space(task)
        yield space, space.situations(task.start), space.situations(task.goal)


def relaxed_reachable(
    space: RegressionSpace, start: np.ndarray, without: int | None = None
) -> set[int]:
    """Returns the features reached if nothing is deleted and no action that adds `without` is
    executed.
    """
    reached = set(np.flatnonzero(start))
    while True:
        new = set(reached)
        for needs, gives in zip(space.conditions, space.adds):
            if set(np.flatnonzero(needs)) <= reached and not (
                without is not None and gives[without]
            ):
                new |= set(np.flatnonzero(gives))
        if new == reached:
            return reached
        reached = new


def test_no_feature_is_reached_without_its_landmarks():
    for space, start, _ in spaces(60):
        size = len(space.features)
        table = unpack(landmark_table(space, start), size)
        assert not table[start].any()
        reached = relaxed_reachable(space, start)
        for feature, landmark in itertools.product(sorted(reached), range(size)):
            if table[feature, landmark] and landmark != feature:
                assert feature not in relaxed_reachable(space, start, landmark) or _comes_along(
                    space, feature, landmark
                )


def _comes_along(space: RegressionSpace, feature: int, landmark: int) -> bool:
    """Returns whether every achiever of a feature adds the landmark too."""
    return bool(space.adds[space.adds[:, feature], landmark].all())


def test_the_landmark_table_is_the_greatest_fixpoint_of_its_equation():
    for space, start, _ in spaces(40):
        size = len(space.features)
        table = [set() if start[f] else set(range(size)) for f in range(size)]
        along = [set(np.flatnonzero(gives & ~start)) for gives in space.adds]
        while True:
            needs = [
                a.union(*(table[p] for p in np.flatnonzero(c)))
                for a, c in zip(along, space.conditions)
            ]
            new = []
            for f in range(size):
                achievers = [needs[a] for a in np.flatnonzero(space.adds[:, f])]
                shared = set.intersection(*achievers) if achievers else set(range(size))
                new.append(set() if start[f] else shared | {f})
            if new == table:
                break
            table = new
        fast = unpack(landmark_table(space, start), size)
        assert [set(np.flatnonzero(row)) for row in fast] == table


def test_a_relaxed_plan_reaches_its_feature_and_is_empty_at_the_start():
    for space, start, _ in spaces(60):
        table = unpack(relaxed_plan_table(space, start), len(space.kept_actions))
        for feature in relaxed_reachable(space, start):
            chosen = np.flatnonzero(table[feature])
            state = start.copy()
            for _ in range(len(chosen) + 1):
                for action in chosen:
                    if not (space.conditions[action] & ~state).any():
                        state |= space.adds[action]
            assert state[feature]
            assert not (start[feature] and len(chosen))


def test_mutexes_exclude_no_reachable_state():
    for seed in range(150):
        task = random_task(seed)
        states = reachable_states(task)
        together = (states[:, :, None] & states[:, None, :]).any(axis=0)
        mutex, usable = mutexes(
            task.features, task.conditions, task.adds, task.deletes, task.start[None]
        )
        assert not (mutex & together).any()
        is_executed = np.array(
            [bool((~(needs & ~states)).all(axis=1).any()) for needs in task.conditions], bool
        )
        assert not (is_executed & ~usable).any()
        for group in mutex_groups(
            task.features, task.conditions, task.adds, task.deletes, task.start[None]
        ):
            assert (states & group).sum(axis=1).max() <= 1


def test_the_mutex_groups_of_blocks_are_found():
    task = random_blocks_tasks(5, 1)[0]
    groups = mutex_groups(task.features, task.conditions, task.adds, task.deletes, task.start[None])
    kinds = sorted(
        {tuple(sorted({task.features[f][0] for f in np.flatnonzero(group)})) for group in groups}
    )
    assert kinds == [
        ("clear", "holding", "on"),
        ("handempty", "holding"),
        ("holding", "on", "ontable"),
    ]
    assert len(groups) == 11


def test_a_rating_is_the_weighted_count_of_its_sign():
    sign = HeuristicSign(
        "mixed",
        landmarks={"on": 3, "*": 1},
        plan={"stack": 2},
        held={"clear": 5},
        unmet={"@goal": 7, "*": 1},
    )
    rng = np.random.default_rng(0)
    for space, start, goal in spaces(10):
        schemas = [["stack", "other"][a % 2] for a in space.kept_actions]
        rate = make_rating(sign, space, start, goal, schemas)
        kinds = [kind_of(atom) for atom in space.features]
        goals = {kinds[f] for f in np.flatnonzero(goal)}
        landmarks = unpack(landmark_table(space, start), len(kinds))
        plans = unpack(relaxed_plan_table(space, start), len(schemas))
        situations = rng.random((200, len(kinds))) < 0.3
        for situation, rating in zip(situations, rate(situations)):
            expected = sum(
                weight_of(sign.landmarks, kinds[c], goals)
                for c in np.flatnonzero(landmarks[situation].any(axis=0))
            )
            expected += sum(
                weight_of(sign.plan, schemas[a])
                for a in np.flatnonzero(plans[situation].any(axis=0))
            )
            expected += sum(
                weight_of(sign.held, kinds[f], goals) for f in np.flatnonzero(situation & start)
            )
            expected += sum(
                weight_of(sign.unmet, kinds[f], goals) for f in np.flatnonzero(situation & ~start)
            )
            assert rating == expected


def test_packed_rows_are_unpacked_without_loss_and_counted():
    rng = np.random.default_rng(1)
    for size in (0, 1, 63, 64, 65, 200):
        rows = rng.random((7, size)) < 0.4
        np.testing.assert_array_equal(unpack(pack(rows), size), rows)
        np.testing.assert_array_equal(popcount(pack(rows)), rows.sum(axis=1))


def test_heuristic_signs_are_saved_and_loaded_without_loss(tmp_path):
    signs = (*DEFAULTS, HeuristicSign("learned", landmarks={"clear": 5}, held={"on": 2}))
    save_signs(tmp_path / "signs.json", signs)
    assert load_signs(tmp_path / "signs.json") == signs
    assert [path.name for path in tmp_path.iterdir()] == ["signs.json"]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        '{"heuristic_signs": [{"name": "x", "magic": {}}]}',
        '{"heuristic_signs": [{"name": "x", "held": {"p": -1}}]}',
        '{"heuristic_signs": [{}]}',
    ],
)
def test_a_file_without_heuristic_signs_is_refused(tmp_path, text):
    (tmp_path / "signs.json").write_text(text)
    with pytest.raises(ValueError, match="not a file of heuristic signs"):
        load_signs(tmp_path / "signs.json")


def test_a_name_takes_precedence_over_the_goal_and_the_goal_over_the_rest():
    weights = {"on": 3, "@goal": 2, "*": 1}
    assert [weight_of(weights, name, {"on", "in"}) for name in ("on", "in", "clear")] == [3, 2, 1]
    assert weight_of(LANDMARKS.plan, "stack") == 0
