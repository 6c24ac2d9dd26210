import numpy as np
import pytest

from srt_jax import Status, check, make_task, solve, solve_many
from srt_jax.reference.brute_force import brute_force_removal
from srt_jax.reference.dijkstra import dijkstra
from tests.helpers.labelled import random_tasks
from tests.helpers.pictures import task_from
from tests.helpers.slowly import slow


def brute_force(task):
    return brute_force_removal(
        task.labels,
        task.destroyable,
        task.removal_cost,
        tuple(task.start.tolist()),
        tuple(task.goal.tolist()),
    )


def cells_of(solution):
    return [tuple(cell) for cell in np.asarray(solution.cells)[: int(solution.num_cells)].tolist()]


def destroyed_by(solution, names):
    return [names[i] for i in np.asarray(solution.destroyed)[: int(solution.num_destroyed)]]


def test_an_open_way_is_walked_and_nothing_is_destroyed():
    task, _ = task_from("""
        S.@.
        ..@.
        ...G
    """)
    solution = solve(task)
    assert Status(int(solution.status)) is Status.PATH_EXISTS
    assert cells_of(solution) == [(0, 0), (1, 1), (2, 1), (2, 2), (2, 3)]
    assert float(solution.removal_bound) == 0
    assert not check(task, solution)


def test_the_one_obstacle_that_lets_through_is_destroyed_from_beside_it():
    task, names = task_from("""
        S.@...
        ..a..G
        ..@...
    """)
    solution = solve(task)
    assert Status(int(solution.status)) is Status.SOLVED
    assert destroyed_by(solution, names) == ["a"]
    assert cells_of(solution)[int(solution.destroyed_at[0])] == (1, 1)
    assert np.asarray(solution.seed).tolist() == [1, 1]
    assert np.asarray(solution.blocking).tolist() == [0, 1]
    assert not check(task, solution)


def test_fewer_obstacles_win_over_a_shorter_route():
    task, names = task_from("""
        S.a.b.G
        ..@.@..
        ..@c@..
        ..@@@..
        .......
        .......
    """)
    assert destroyed_by(solve(task), names) == []
    walled, names = task_from("""
        S.a.b.G
        ..@.@..
        ..@c@..
        ..@@@..
        ..@@@..
        ...d...
    """)
    assert destroyed_by(solve(walled), names) == ["d"]


def test_the_cheapest_total_wins_not_the_fewest():
    task, names = task_from(
        """
        S.a.b.G
        ..@@@..
        ...c...
    """,
        removal_cost=[1.0, 1.5, 3.0, 1.0],
    )
    solution = solve(task)
    assert destroyed_by(solution, names) == ["a", "b"]
    assert float(solution.removal_cost) == float(solution.removal_bound) == 2.5


def test_a_goal_inside_a_destroyable_obstacle_is_reached_by_destroying_it():
    labels = np.full((3, 5), -1, np.int32)
    labels[:, 3:] = 0
    task = make_task(labels, (1, 0), (1, 4))
    solution = solve(task)
    assert Status(int(solution.status)) is Status.SOLVED and not check(task, solution)
    assert (
        Status(int(solve(make_task(labels, (1, 0), (1, 4), destroyable=False)).status))
        is Status.GOAL_BLOCKED
    )


def test_a_start_inside_an_obstacle_is_reported():
    task = make_task(np.array([[False, True]]), (0, 0), (0, 1))
    solution = solve(task)
    assert Status(int(solution.status)) is Status.START_BLOCKED and not check(task, solution)


def test_an_indestructible_ring_is_unsolvable_and_its_contour_is_reported():
    free = np.ones((20, 20), bool)
    free[5:15, 5:15] = False
    free[6:14, 6:14] = True
    task = make_task(free, (0, 0), (10, 10), destroyable=False)
    solution = solve(task)
    assert Status(int(solution.status)) is Status.UNSOLVABLE and not check(task, solution)
    assert int(np.sum(solution.contour)) == 44
    assert np.isinf(solution.cost) and np.isinf(solution.removal_bound)


def test_a_budget_too_small_is_reported_with_the_bound_kept():
    task, _ = task_from("S.a.b.c.G")
    solution = solve(task, max_destroyed=2)
    assert Status(int(solution.status)) is Status.BUDGET_SPENT and not check(task, solution)
    assert float(solution.removal_bound) == 3
    short = solve(task, max_cells=5)
    assert Status(int(short.status)) is Status.BUDGET_SPENT and int(short.num_cells) == 9


def test_the_papers_loop_may_destroy_more_than_is_needed():
    task, names = task_from("""
        S.a.b.G
        ..@.@..
        ..@@@..
        ...c...
    """)
    paper, least = solve(task, mode="paper"), solve(task)
    assert destroyed_by(least, names) == ["c"]
    assert destroyed_by(paper, names) == ["a", "b"]
    assert not check(task, paper)


@pytest.mark.parametrize("overlap", [True, *slow(False)])
def test_the_papers_loop_solves_what_can_be_solved(overlap):
    tasks = random_tasks(3, 200, overlap=overlap)
    for task, solution in zip(tasks, solve_many(tasks, mode="paper", max_destroyed=16)):
        best = brute_force(task)
        assert not check(task, solution)
        assert Status(int(solution.status)).is_solved == best.is_solvable
        assert float(solution.removal_bound) <= best.cost


def test_the_route_is_the_shortest_for_what_is_destroyed():
    tasks = random_tasks(4, 250, overlap=True)
    for task, solution in zip(tasks, solve_many(tasks)):
        if Status(int(solution.status)).is_solved:
            gone = np.asarray(solution.destroyed)[: int(solution.num_destroyed)]
            free = ((task.labels == -1) | np.isin(task.labels, gone)).all(axis=0)
            np.testing.assert_allclose(
                solution.cost,
                dijkstra(free, tuple(task.start.tolist()))[tuple(task.goal)],
                rtol=1e-5,
            )


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"labels": np.zeros((3, 3), np.int32)}, ValueError, "labels"),
        ({"labels": np.zeros((1, 3, 3), np.float32)}, TypeError, "labels"),
        ({"start": np.zeros(2, np.float32)}, TypeError, "start"),
        ({"goal": np.zeros(3, np.int32)}, ValueError, "goal"),
        ({"removal_cost": np.ones(3, np.float32)}, ValueError, "removal_cost"),
        ({"destroyable": np.zeros((2, 1), bool)}, ValueError, "destroyable"),
    ],
)
def test_a_task_whose_arrays_do_not_fit_is_refused_by_name(change, error, message):
    task = make_task(np.ones((3, 3), bool), (0, 0), (2, 2))
    with pytest.raises(error, match=message) as caught:
        solve(task.replace(**change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "options", [{"mode": "best"}, {"max_destroyed": 0}, {"max_cells": 0}, {"max_branches": 0}]
)
def test_an_option_out_of_range_is_refused_by_name(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        solve(make_task(np.ones((3, 3), bool), (0, 0), (2, 2)), **options)


def test_the_route_is_the_same_among_few_obstacles_and_among_many():
    """Padding to many brings another search of the route into the program."""
    rng = np.random.default_rng(8)
    free = rng.random((60, 60)) > 0.25
    free[0, 0] = free[-1, -1] = True
    labels = np.where(free, -1, 0).astype(np.int32)
    labels[:, 30] = 1
    few = make_task(labels, (0, 0), (59, 59))
    room = 300 - len(few.destroyable)
    more = {"destroyable": np.zeros(room, bool), "removal_cost": np.ones(room, np.float32)}
    many = few.replace(
        **{name: np.concatenate([getattr(few, name), new]) for name, new in more.items()}
    )
    expected, found = solve(few), solve(many)
    assert int(found.status) == Status.SOLVED
    for name in ("cells", "num_cells", "cost", "destroyed", "destroyed_at", "removal_bound"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
