"""What is no task, no solution or another one's is refused by each function that takes one."""

import jax
import numpy as np
import pytest

import srt_jax
from srt_jax import draw, envs
from srt_jax.formats.batch import write_batch

FREE = np.ones((5, 7), bool)
FREE[:, 3] = False
TASK = srt_jax.make_task(FREE, (2, 0), (2, 6))
OTHER = srt_jax.make_task(np.ones((3, 4), bool), (0, 0), (2, 3))


@pytest.fixture(scope="module")
def solution():
    return srt_jax.solve(TASK)


@pytest.mark.parametrize(
    "call",
    [srt_jax.solve, srt_jax.approach, srt_jax.least_removal, lambda t: srt_jax.solve_many(t)],
)
def test_an_array_in_place_of_a_task_is_told_of_make_task(call):
    with pytest.raises(TypeError, match=r"an array: write srt_jax.make_task"):
        call(FREE)


@pytest.mark.parametrize("tasks", [[TASK], (TASK,), iter([TASK])])
def test_a_list_in_place_of_a_task_is_told_of_solve_many(tasks):
    with pytest.raises(TypeError, match=r"solve_many solves a list, srt_jax.stack makes one batch"):
        srt_jax.solve(tasks)


@pytest.mark.parametrize("call", [srt_jax.stack, srt_jax.solve_many])
def test_a_batch_in_place_of_a_list_is_told_of_solve_and_unstack(call):
    for given in (TASK, srt_jax.stack([TASK])):
        with pytest.raises(TypeError, match=r"solve takes either.*unstack"):
            call(given)
    with pytest.raises(ValueError, match=r"task 1 has labels of shape .* call unstack"):
        call([TASK, srt_jax.stack([TASK])])
    with pytest.raises(TypeError, match=r"task 1 is an array: write srt_jax.make_task"):
        call([TASK, FREE])


def test_a_list_in_place_of_a_batch_is_told_of_stack(tmp_path):
    for call in (srt_jax.unstack, lambda tasks: write_batch(tmp_path / "a.npz", tasks)):
        with pytest.raises(TypeError, match=r"got a list: srt_jax.stack makes one batch"):
            call([TASK])


def test_entries_of_a_stream_are_looked_at_too():
    with pytest.raises(TypeError, match="solve_many takes single tasks, but task 0 is an array"):
        next(srt_jax.solve_many(iter([FREE])))  # type: ignore[arg-type]


PAIRS = [
    srt_jax.explain,
    srt_jax.explanation,
    srt_jax.story,
    srt_jax.scene_pddl,
    lambda task, solution: srt_jax.why(task, solution, 0),
    lambda task, solution: srt_jax.why_not(task, solution, 0),
    draw.draw,
    draw.animate,
]


@pytest.mark.parametrize("call", PAIRS)
def test_a_task_takes_its_own_solution(call, solution):
    with pytest.raises(ValueError, match=r"3 x 4 cells .* of 5 x 7 cells .* the task's own"):
        call(OTHER, solution)
    with pytest.raises(TypeError, match="got a Solution: the task comes first"):
        call(solution, TASK)
    with pytest.raises(TypeError, match="got a list: call it for each"):
        call([TASK], solution)
    with pytest.raises(TypeError, match="got a Task as the solution"):
        call(TASK, TASK)


def test_the_judge_says_what_is_missing_in_one_sentence(solution):
    assert srt_jax.check([TASK], solution) == [  # type: ignore[arg-type]
        "a Task must be given, or a batch of them (srt_jax.stack), got list"
    ]
    assert len(srt_jax.check(TASK, TASK)) == 1  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "remedy"),
    [
        (lambda cell: srt_jax.make_task(FREE, cell, (2, 6)).start, "task.replace"),
        (lambda cell: srt_jax.solve_many([TASK.replace(start=cell)])[0].cost, "call solve inside"),
        (lambda cell: srt_jax.stack([TASK.replace(start=cell)]).start, "jax.vmap"),
        (lambda cell: srt_jax.inflate(TASK.replace(start=cell), 1.0).labels, "call it outside"),
    ],
)
def test_what_runs_on_the_host_says_so_inside_jit(call, remedy):
    with pytest.raises(TypeError, match=f"runs on the host.*{remedy}"):
        jax.jit(call)(np.array([2, 0], np.int32))


def test_a_single_solution_has_the_actions_of_its_batch_of_one(solution):
    (row,) = envs.oracle_actions(jax.tree.map(lambda array: array[None], solution))
    np.testing.assert_array_equal(envs.oracle_actions(solution), row)
    with pytest.raises(TypeError, match="a Task as the solution"):
        envs.oracle_actions(TASK)  # type: ignore[arg-type]
