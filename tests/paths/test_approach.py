"""As near as one gets: the cells that the slow twin finds, in every form; and `check` notices what
is wrong.
"""

import jax
import numpy as np
import pytest

import srt_jax
from srt_jax import approach, check, make_task, solve, stack
from srt_jax.reference.approach import approach as slow_approach
from tests.helpers.labelled import random_tasks
from tests.helpers.pictures import drawn


def tasks_of(seed, count=48):
    """Tasks of all kinds, padded to one batch; some ends blocked, some outside the map."""
    tasks = random_tasks(seed, count // 2, overlap=False, can_destroy=0.2)
    tasks += random_tasks(seed + 1, count - count // 2, overlap=True, can_destroy=0.2)
    batch = stack(tasks)
    rng = np.random.default_rng(seed)
    anywhere = rng.integers(-3, 19, (count, 2, 2)).astype(np.int32)
    is_moved = (np.arange(count) % 3 == 0)[:, None]
    return batch.replace(
        start=np.where(is_moved, anywhere[:, 0], batch.start),
        goal=np.where(is_moved, anywhere[:, 1], batch.goal),
    )


def of(record, index):
    return jax.tree.map(lambda array: np.asarray(array)[index], record)


def test_the_cells_are_those_of_the_slow_twin_and_check_walks_them():
    batch = tasks_of(1)
    near, solutions = approach(batch), solve(batch)
    assert check(batch, solutions, approach=near) == []
    num_moved = num_empty = 0
    for index in range(len(batch.start)):
        task, found = of(batch, index), of(near, index)
        free = (task.labels == srt_jax.types.FREE).all(axis=0)
        start, goal = tuple(task.start.tolist()), tuple(task.goal.tolist())
        cells = slow_approach(free, start, goal)
        assert [tuple(cell) for cell in found.cells[: found.num_cells].tolist()] == cells
        num_moved += bool(cells) and cells[0] != start
        num_empty += not cells
    assert num_moved > 5
    assert {int(status) for status in solutions.status} >= {0, 1, 2, 3}


def test_a_solution_without_a_route_carries_it():
    batch = tasks_of(5, 24)
    near, solutions = approach(batch), solve(batch)
    is_solved = np.array([srt_jax.Status(int(s)).is_solved for s in solutions.status])
    assert 0 < is_solved.sum() < 24
    cells = np.where(is_solved[:, None, None], -1, np.asarray(near.cells))
    np.testing.assert_array_equal(solutions.approach, cells)
    np.testing.assert_array_equal(solutions.num_approach, np.where(is_solved, 0, near.num_cells))
    for one, own in zip(srt_jax.solve_many(srt_jax.unstack(batch)), solutions.approach):
        count = int(one.num_approach)
        np.testing.assert_array_equal(one.approach[:count], own[:count])
        assert count == (own[:, 0] >= 0).sum()
    # what came out of jit does not know its task
    jitted = jax.jit(lambda solution: solution)(of(solutions, int(np.flatnonzero(~is_solved)[0])))
    with pytest.raises(AttributeError, match=r"call srt_jax.approach\(task\)"):
        _ = jitted.approach


def test_alone_jitted_vmapped_and_in_a_batch_the_bits_are_the_same():
    batch = tasks_of(2, 16)
    near = jax.tree.map(np.asarray, approach(batch, max_cells=200))
    mapped = jax.jit(jax.vmap(lambda task: approach(task, max_cells=200)))(batch)
    jax.tree.map(np.testing.assert_array_equal, near, jax.tree.map(np.asarray, mapped))
    for index in range(3):
        alone = approach(of(batch, index), max_cells=200)
        jax.tree.map(
            np.testing.assert_array_equal, of(near, index), jax.tree.map(np.asarray, alone)
        )


def test_a_blocked_start_begins_beside_it_and_a_blocked_goal_ends_beside_it():
    free, places = drawn("""
        ..@.@....
        .S@.@....
        ..@.@..G.
        ..@@@....
    """)
    task = make_task(free, places["S"], places["G"], destroyable=False)
    near = approach(task)
    assert near.end.tolist() == [2, 1] and near.gap == 6.0 and near.num_cells == 2
    inside = approach(task.replace(start=np.array([1, 2], np.int32)))
    # (1, 1) and (1, 3) are as near: the lower column; and from there the goal stays out of reach
    assert inside.begin.tolist() == [1, 1] and inside.end.tolist() == [2, 1]
    beside = approach(
        task.replace(start=np.array([0, 6], np.int32), goal=np.array([1, 4], np.int32))
    )
    assert beside.end.tolist() == [1, 5] and beside.gap == 1.0


def test_without_a_free_cell_there_is_none_and_a_path_leads_to_the_goal():
    none = approach(make_task(np.zeros((3, 4), bool), (0, 0), (2, 3)))
    assert none.num_cells == 0 and np.isinf(none.gap) and np.isinf(none.cost)
    assert none.begin.tolist() == none.end.tolist() == [-1, -1] and (none.cells == -1).all()
    whole = approach(make_task(np.ones((3, 4), bool), (0, 0), (2, 3)))
    assert whole.gap == 0 and whole.end.tolist() == [2, 3]


def test_a_route_longer_than_the_room_tells_its_number_of_cells():
    free, places = drawn("""
        S........
        @@@@@@@@.
        .........
        .@@@@@@@@
        G@.......
    """)
    task = make_task(free, places["S"], places["G"])
    short = approach(task, max_cells=4)
    assert short.num_cells > 4 and (np.asarray(short.cells) == -1).all()
    assert short.end.tolist() == list(places["G"])
    assert check(task, solve(task), approach=short) == []
    with pytest.raises(ValueError, match="max_cells must be at least 1"):
        approach(task, max_cells=0)
    with pytest.raises(TypeError, match=r"task\.start must be an array of int32"):
        approach(task.replace(start=np.zeros(2)))


def test_check_notices_each_field_made_wrong():
    batch = tasks_of(5, 16)
    solutions, near = jax.tree.map(np.asarray, (solve(batch), approach(batch)))
    index = int(np.argmax(near.num_cells * (near.gap > 0)))
    task, solution, right = (of(record, index) for record in (batch, solutions, near))
    num = int(right.num_cells)
    assert num > 4 and check(task, solution, approach=right) == []
    # two diagonal steps back and forth would be a longer route between the same ends
    detour = right.cells.copy()
    detour[1] = detour[0]
    wrong = {
        "begin": right.replace(begin=right.begin + 1),
        "end": right.replace(end=right.begin),
        "gap": right.replace(gap=right.gap + np.float32(1)),
        "long, not": right.replace(cost=right.cost + np.float32(1)),
        "no step to a neighbour": right.replace(cells=detour),
        "empty": right.replace(num_cells=np.int32(0)),
        "and -1 after them": right.replace(num_cells=np.int32(num - 1 + 2)),
        "does not fit": right.replace(num_cells=np.int32(len(right.cells) + 1)),
        "must be int32": right.replace(cells=right.cells.astype(np.int64)),
    }
    for sentence, changed in wrong.items():
        found = check(task, solution, approach=changed)
        assert any(sentence in problem for problem in found), (sentence, found)
