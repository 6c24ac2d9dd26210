"""The same bits whatever the batch around a task, and whatever transformation the call is in."""

import chex
import jax
import numpy as np
import pytest

from srt_jax import make_task, solve, solve_many, stack
from srt_jax.engine.reuse import only_own_shapes
from tests.helpers.labelled import random_tasks


@pytest.mark.parametrize(
    "mode",
    ["least", *(pytest.param(mode, marks=pytest.mark.slow) for mode in ("paper", "literal"))],
)
def test_an_answer_does_not_depend_on_the_batch_around_it(mode):
    tasks = random_tasks(5, 8, overlap=True, max_side=14)
    batch = solve(stack(tasks), mode=mode)
    backwards = solve(stack(tasks[::-1]), mode=mode)
    chex.assert_trees_all_equal(batch, jax.tree.map(lambda x: x[::-1], backwards))
    for index, task in enumerate(tasks):
        with only_own_shapes():
            alone, (H, W) = solve(task, mode=mode), task.labels.shape[1:]
        among = jax.tree.map(lambda x, i=index: x[i], batch)
        among = among.replace(
            contour=among.contour[:H, :W],
            blocking=among.blocking[: len(task.destroyable)],
            separating=among.separating[: len(task.destroyable)],
            cells=among.cells[: alone.cells.shape[0]],
        )
        chex.assert_trees_all_equal(alone, among)


def test_solve_may_be_jitted_vmapped_and_scanned():
    tasks = stack(random_tasks(9, 8, overlap=True, max_side=14))
    pairs = jax.tree.map(lambda x: x.reshape(4, 2, *x.shape[1:]), tasks)

    def step(carry, pair):
        return carry, jax.vmap(solve)(pair)

    # all in one program: it takes seconds to compile
    in_pairs = jax.jit(lambda pairs: jax.lax.scan(step, 0, pairs)[1])(pairs)
    batch = jax.tree.map(lambda x: x.reshape(8, *x.shape[2:]), in_pairs)
    chex.assert_trees_all_equal(solve(tasks), batch)


def test_any_number_of_batch_dimensions_is_kept():
    batch = stack(random_tasks(6, 6, overlap=False, max_side=10))
    flat = solve(batch)
    square = solve(jax.tree.map(lambda x: x.reshape(2, 3, *x.shape[1:]), batch))
    chex.assert_trees_all_equal(flat, jax.tree.map(lambda x: x.reshape(6, *x.shape[2:]), square))


def test_many_tasks_of_unequal_size_come_back_in_order_and_cut_to_size():
    tasks = [
        *random_tasks(7, 5, overlap=False, max_side=12),
        *random_tasks(8, 5, overlap=True, max_side=28),
    ]
    done = []
    solutions = solve_many(tasks, progress=done.append)
    assert sum(done) == 10
    for task, solution in zip(tasks, solutions):
        assert solution.contour.shape == task.labels.shape[1:]
        alone = jax.tree.map(np.asarray, solve(task))
        room = min(len(alone.cells), len(solution.cells))
        chex.assert_trees_all_equal(
            alone.replace(cells=alone.cells[:room]), solution.replace(cells=solution.cells[:room])
        )
    assert solve_many([]) == []


def test_many_tasks_find_room_for_a_route_that_winds():
    free = np.zeros((41, 41), bool)
    free[::2] = True
    free[1::4, -1] = free[3::4, 0] = True
    (solution,) = solve_many([make_task(free, (0, 0), (40, 40))])
    assert int(solution.num_cells) == 21 * 41 + 20


def test_room_for_all_obstacles_or_more_gives_one_answer_in_the_shape_asked_for():
    tasks = random_tasks(11, 1, overlap=False, max_side=12)
    task, num = tasks[0], len(tasks[0].destroyable)
    whole = solve(task, max_destroyed=8)
    for room in (num, num + 1, 3 * num):
        answer = solve(task, max_destroyed=room)
        assert answer.destroyed.shape == answer.destroyed_at.shape == (room,)
        assert answer.plan.shape == (3 * room + 1, 2) and answer.plan_at.shape == (3 * room + 1,)
        some = min(room, 8)
        assert answer.destroyed[:some].tolist() == whole.destroyed[:some].tolist()
        assert answer.plan[: 3 * some + 1].tolist() == whole.plan[: 3 * some + 1].tolist()
