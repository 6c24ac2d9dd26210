"""The judge accepts right solutions, written down by hand, and notices when any field of one is
spoilt.
"""

import jax
import numpy as np
import pytest
from scipy import ndimage

from srt_jax.check import check
from srt_jax.reference.astar import astar
from srt_jax.reference.brute_force import brute_force_removal
from srt_jax.reference.wall_following import follow_wall
from srt_jax.types import Act, Solution, Status, Task
from tests.helpers.answers import (
    CASES,
    INF,
    ROOT,
    destroyed_from,
    fixed_wall,
    open_path,
    solution_of,
    two_walls,
)
from tests.helpers.cut_off_maps import seed_of

all_cases = pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)


@all_cases
def test_right_solutions_pass(case):
    assert check(*case()) == []


@all_cases
def test_right_solutions_pass_as_device_arrays_too(case):
    assert check(*jax.tree.map(jax.numpy.asarray, case())) == []


def spoilt(solution: Solution):
    """Every solution that differs in one entry of one field, with what was changed; a bound that is
    still true is left.
    """
    for name, array in solution.items():
        for index in np.ndindex(np.shape(array)):
            old = np.asarray(array)[index]
            values = (
                {not old}
                if array.dtype == bool
                else {old + 1, old - 1, 99, -3, *([np.nan, 0] if array.dtype == "float32" else [])}
            )
            for value in values - {old}:
                if name == "removal_bound" and 0 <= value <= solution.removal_cost < INF:
                    continue
                if value == old or (np.isinf(old) and np.isinf(value)):
                    continue
                changed = np.array(array)
                changed[index] = value
                yield (
                    f"{name}{list(index)} = {value}",
                    solution.replace(**{name: changed if changed.ndim else changed[()]}),
                )


@all_cases
def test_any_spoilt_entry_is_noticed(case):
    task, solution = case()
    missed = [what for what, wrong in spoilt(solution) if not check(task, wrong)]
    assert missed == []


@all_cases
def test_any_other_status_is_noticed(case):
    task, solution = case()
    for status in set(Status) - {Status(int(solution.status))}:
        if (
            solution.status == Status.UNSOLVABLE
            and status == Status.BUDGET_SPENT
            and not (solution.separating >= 0).any()
        ):
            continue  # a limit may be met before the proof
        assert check(task, solution.replace(status=np.int32(status))), status


@all_cases
def test_padding_and_company_change_nothing(case):
    task, solution = case()
    (padded, padded_solution), (other, its) = wide(task, solution), wide(*two_walls())
    stack = lambda *arrays: np.stack(arrays)  # noqa: E731
    tasks, solutions = (
        jax.tree.map(stack, other, padded, other),
        jax.tree.map(stack, its, padded_solution, its),
    )
    assert check(tasks, solutions) == []
    wrong = solutions.contour.copy()
    wrong[1, -1, -1] = True
    assert [m[:8] for m in check(tasks, solutions.replace(contour=wrong))] == ["task 1: "]


def wide(task: Task, solution: Solution):
    """Both padded to two layers of 6 x 9 cells and 6 obstacles."""
    layers, height, width = task.labels.shape
    room = ((0, 6 - height), (0, 9 - width))
    labels = np.full((2, 6, 9), -1, np.int32)
    labels[0] = -2
    labels[:layers, :height, :width] = task.labels
    more = 6 - len(task.destroyable)
    return (
        task.replace(
            labels=labels,
            destroyable=np.pad(task.destroyable, (0, more)),
            removal_cost=np.pad(task.removal_cost, (0, more), constant_values=1),
        ),
        solution.replace(
            contour=np.pad(solution.contour, room),
            blocking=np.pad(solution.blocking, (0, more), constant_values=-1),
            separating=np.pad(solution.separating, (0, more), constant_values=-1),
        ),
    )


def assert_message(task, solution, *parts: str):
    """Asserts that one message contains each part."""
    messages = check(task, solution)
    assert any(all(part in message for part in parts) for message in messages), messages


def test_a_cut_corner_is_named():
    task, solution = open_path()
    cells = solution.cells.copy()
    cells[:7] = [(0, 0), (1, 0), (2, 0), (3, 1), (3, 2), (2, 2), (-1, -1)]
    assert_message(
        task,
        solution.replace(cells=cells, num_cells=np.int32(6), cost=np.float32(4 + ROOT)),
        "move 2",
        "cuts a blocked corner",
    )


def test_a_move_through_an_obstacle_not_yet_destroyed_is_named():
    task, solution = two_walls()
    late = solution.replace(destroyed_at=np.array([2, 4, -1, -1], np.int32))
    assert_message(task, late, "move 1", "enters (0, 2), which is blocked")


def test_an_obstacle_destroyed_from_afar_is_named():
    task, solution = two_walls()
    assert_message(
        task,
        solution.replace(destroyed_at=np.array([0, 4, -1, -1], np.int32)),
        "obstacle 1",
        "not beside",
    )


def test_an_indestructible_obstacle_must_stand():
    task, solution = two_walls()
    assert_message(
        task.replace(destroyable=np.array([False, False, True])),
        solution,
        "obstacle 1 was destroyed, but is not destroyable",
    )


def test_a_false_proof_of_unsolvability_is_named():
    task, solution = fixed_wall()
    assert_message(
        task.replace(destroyable=np.array([True] * 4)),
        solution,
        "status is UNSOLVABLE, but the truth is SOLVED",
    )


def test_an_unsolvable_task_is_no_solved_one():
    task, _ = fixed_wall()
    route = solution_of(task, Status.SOLVED, cells=[(0, 0)])
    assert_message(task, route, "status is SOLVED, but the truth is UNSOLVABLE")


def test_a_route_that_does_not_fit_is_a_spent_budget():
    task, solution = open_path()
    empty = np.full((3, 2), -1, np.int32)
    none = {
        "cells": empty,
        "plan": np.full((13, 2), -1, np.int32),
        "plan_at": np.full(13, -1, np.int32),
    }
    spent = solution.replace(
        status=np.int32(Status.BUDGET_SPENT),
        cost=INF,
        removal_cost=INF,
        removal_bound=np.float32(0),
        **none,
    )
    assert check(task, spent) == []
    assert_message(
        task,
        spent.replace(num_cells=np.int32(0)),
        "status is BUDGET_SPENT, but the truth is PATH_EXISTS",
    )
    assert_message(
        task, spent.replace(status=np.int32(Status.PATH_EXISTS)), "num_cells is 7", "1 to 3"
    )


def test_a_spent_budget_has_no_route():
    task, solution = two_walls()
    assert_message(
        task, solution.replace(status=np.int32(Status.BUDGET_SPENT)), "cells must be empty"
    )


@pytest.mark.parametrize("name", [*Task.__dataclass_fields__, *Solution.__dataclass_fields__])
def test_wrong_form_is_a_message_not_a_crash(name):
    task, solution = two_walls()
    kinds = {"task": task, "solution": solution}
    for what, record in kinds.items():
        if name not in record:
            continue
        array = np.asarray(record[name])
        for wrong in (
            array.astype(np.float64),
            array[None],
            np.zeros((1, 2, 3, 4, 5), array.dtype),
            "?",
            None,
            array.astype("O"),
        ):
            problems = check(**(kinds | {what: record.replace(**{name: wrong})}))
            assert problems and all(isinstance(message, str) for message in problems)


@pytest.mark.parametrize(
    "name", ["labels", "destroyable", "cells", "contour", "blocking", "seed", "destroyed_at"]
)
def test_a_side_of_another_length_is_reported(name):
    task, solution = two_walls()

    def cut(record):
        return record.replace(**{name: record[name][..., 1:]}) if name in record else record

    assert check(cut(task), cut(solution)) or name == "labels"


def test_what_is_no_record_is_reported():
    assert check(3, None)  # type: ignore[arg-type]


def test_a_batch_of_another_length_is_reported():
    task, solution = jax.tree.map(lambda array: np.asarray(array)[None], two_walls())
    two = jax.tree.map(lambda array: np.concatenate([array, array]), solution)
    assert "batch dimensions" in check(task, two)[0]


@pytest.mark.parametrize(
    "change", [{"size": [0, 7]}, {"size": [3, 8]}, {"labels": 3}, {"labels": -3}]
)
def test_a_task_out_of_range_is_reported(change):
    task, solution = two_walls()
    (name, value), labels = *change.items(), task.labels.copy()
    labels[0, 0, 0] = value if name == "labels" else -1
    size = np.array(value, np.int32) if name == "size" else task.size
    assert f"task.{name}" in check(task.replace(labels=labels, size=size), solution)[0]


def answer_of_the_twins(task: Task) -> Solution:
    """The least removal by brute force, the route by A*, the contour by wall following: nothing in
    common with the judge.
    """
    labels, start, goal = task.labels, tuple(task.start.tolist()), tuple(task.goal.tolist())
    free, least = (
        (labels == -1).all(axis=0),
        brute_force_removal(labels, task.destroyable, task.removal_cost, start, goal),
    )
    first, blockage = astar(free, start, goal), {}
    if free[start] and first.cost == np.inf:
        seed = seed_of(first.closed, goal)
        contour = follow_wall(free, seed, goal)
        blobs, _ = ndimage.label(~free, structure=np.ones((3, 3)))
        step = seed[0] + np.sign(goal[0] - seed[0]), seed[1] + np.sign(goal[1] - seed[1])
        blob = blobs == (blobs[step] or blobs[seed[0], step[1]])
        beside = [
            cell
            for cell in np.argwhere(blob).tolist()
            if min(max(abs(np.subtract(cell, c))) for c in contour) == 1
        ]
        ids = {int(i) for row, col in beside for i in labels[:, row, col]} - {-1}
        blockage = {"seed": seed, "contour": sorted(set(contour)), "blocking": sorted(ids)}
    if not least.is_solvable:
        ends = free[start], all(i == -1 or task.destroyable[i] for i in labels[:, *goal])
        status = (
            Status.START_BLOCKED
            if not ends[0]
            else Status.UNSOLVABLE
            if ends[1]
            else Status.GOAL_BLOCKED
        )
        covering = {int(i) for i in labels[:, *goal]} - {-1}
        proof = {"START_BLOCKED": set(), "GOAL_BLOCKED": covering}.get(
            status.name, range(len(task.destroyable))
        )
        separating = [i for i in sorted(proof) if not task.destroyable[i]]
        return solution_of(task, status, room=80, separating=separating, **blockage)
    # an index of -1, free, finds the last
    gone = np.append(np.isin(np.arange(len(task.destroyable)), least.obstacles), True)
    route = astar(gone[labels].all(axis=0), start, goal)
    destroyed, destroyed_at = [], []
    for i, ((a, b), (c, d)) in enumerate(zip(route.path[:-1], route.path[1:], strict=True)):
        new = sorted(
            {int(i) for cell in ((c, d), (a, d), (c, b)) for i in labels[:, *cell]}
            - {-1, *destroyed}
        )
        destroyed, destroyed_at = destroyed + new, destroyed_at + [i] * len(new)
    fields = {
        "destroyed": destroyed,
        "destroyed_at": destroyed_at,
        "removal_cost": least.cost,
        "removal_bound": least.cost,
    }
    status, last = Status.SOLVED if destroyed else Status.PATH_EXISTS, len(route.path) - 1
    plan = [] if destroyed or not last else [(Act.RELOCATE, -1, last)]
    for obstacle, at in zip(destroyed, destroyed_at):
        plan += destroyed_from(obstacle, at)
    # as the paper's loop would tell it
    fields["plan"] = [*plan, (Act.PASS, destroyed[-1], last)] if destroyed else plan
    return solution_of(
        task, status, room=80, cells=route.path, cost=route.cost, **fields, **blockage
    )


def random_task(rng: np.random.Generator) -> Task:
    height, width, num_obstacles, layers = (
        *rng.integers(2, 10, 2),
        rng.integers(1, 5),
        rng.integers(1, 3),
    )
    labels = rng.integers(0, num_obstacles, (layers, height, width)).astype(np.int32)
    labels[rng.random(labels.shape) < rng.choice([0.6, 0.75, 0.9])] = -1
    return Task(
        labels=labels,
        destroyable=rng.random(num_obstacles) < 0.7,
        removal_cost=rng.integers(1, 4, num_obstacles).astype(np.float32),
        start=rng.integers(0, (height, width)).astype(np.int32),
        goal=rng.integers(0, (height, width)).astype(np.int32),
        size=np.array([height, width], np.int32),
    )


def test_answers_of_the_slow_twins_pass():
    rng, seen = np.random.default_rng(0), set()
    for _ in range(600):
        task = random_task(rng)
        solution = answer_of_the_twins(task)
        assert check(task, solution) == []
        seen.add(Status(int(solution.status)))
    others = {Status.BUDGET_SPENT, Status.STOPPED_SHORT, Status.BROKE_THROUGH}
    assert seen == set(Status) - others


def test_spoilt_answers_of_the_slow_twins_are_noticed():
    """Another cell to destroy from, another route as long, or more indestructible obstacles may be
    as good; all else must be noticed.
    """
    rng = np.random.default_rng(1)
    for _ in range(12):  # the campaign of checks spoils thousands
        task = random_task(rng)
        solution = answer_of_the_twins(task)
        missed = [what for what, wrong in spoilt(solution) if not check(task, wrong)]
        assert all(what.startswith(("destroyed_at", "cells")) for what in missed), (task, missed)
