"""The symbolic half of a solution: MAP's plan, where its steps end on the route, and the proof
where there is none.
"""

import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax import (
    Status,
    check,
    make_task,
    scene_model,
    scene_pddl,
    scene_problem,
    solve,
    solve_many,
)
from srt_jax.symbols.acts import left_behind
from srt_jax.symbols.planning import first_act
from srt_jax.types import Act
from tests.helpers.labelled import random_tasks
from tests.helpers.pictures import task_from

TWO_WALLS = """
    S.aa.b.G
    ..aa.b..
    ..@@.b..
"""


def steps_of(solution, names):
    plan, ends = np.asarray(solution.plan), np.asarray(solution.plan_at)
    return [
        (Act(act).name, "" if obstacle < 0 else names[obstacle], end)
        for (act, obstacle), end in zip(plan.tolist(), ends.tolist())
        if act >= 0
    ]


def test_the_plan_goes_from_area_to_area_through_what_must_go():
    task, names = task_from(TWO_WALLS)
    assert steps_of(solve(task), names) == [
        ("APPROACH", "a", 1),
        ("DESTROY", "a", 1),
        ("PASS", "a", 4),
        ("APPROACH", "b", 4),
        ("DESTROY", "b", 4),
        ("PASS", "b", 7),
    ]


def test_a_scene_is_a_problem_of_unified_planning_that_the_plan_carried_out_solves():
    shortcuts = pytest.importorskip("unified_planning.shortcuts")
    from unified_planning.io import PDDLReader

    task, _ = task_from(TWO_WALLS)
    solution = solve(task)
    problem = scene_problem(task, solution)
    lines = "\n".join(scene_pddl(task, solution)[2])
    plan = PDDLReader().parse_plan_string(problem, lines)
    with shortcuts.PlanValidator(name="sequential_plan_validator") as validator:
        assert validator.validate(problem, plan).status.name == "VALID"
    assert len(plan.actions) == 6


def test_a_scene_is_a_world_model_whose_places_lead_down_to_measurements():
    task, _ = task_from(TWO_WALLS)
    solution = solve(task)
    model = scene_model(task, solution, heading=0)
    for name in ("situation goal", "action destroy", "i", "obstacle-0", "area-2"):
        assert name in model.names
    (seen,) = model.sign("obstacle-0").image
    assert seen.features == {"ahead", "close"}
    (direction,) = model.sign("ahead").image
    assert all(model.sign(name).image == () for name in direction.features)


@pytest.mark.slow
def test_the_papers_loop_plans_again_at_each_blockage_and_passes_last():
    task, names = task_from(TWO_WALLS)
    names_of_steps = [step[:2] for step in steps_of(solve(task, mode="paper"), names)]
    assert names_of_steps == [
        ("APPROACH", "a"),
        ("DESTROY", "a"),
        ("APPROACH", "b"),
        ("DESTROY", "b"),
        ("PASS", "b"),
    ]


def test_before_anything_blocks_the_plan_is_to_walk():
    assert first_act() is Act.RELOCATE
    task, names = task_from("S..G")
    for mode in ("least", "paper", "literal"):
        assert steps_of(solve(task, mode=mode), names) == [("RELOCATE", "", 3)]


@pytest.mark.parametrize("mode", ["least", "paper"])
def test_who_is_there_need_not_act(mode):
    solution = solve(make_task(np.ones((1, 2), bool), (0, 0), (0, 0)), mode=mode)
    assert (
        Status(int(solution.status)) is Status.PATH_EXISTS
        and (np.asarray(solution.plan) == -1).all()
    )


def test_read_literally_the_loop_stops_at_something_indestructible_ahead():
    task, names = task_from("""
        S.a..
        ..@.G
        ..@..
    """)
    assert Status(int(solve(task, mode="literal").status)) is Status.STOPPED_SHORT
    assert [step[1] for step in steps_of(solve(task, mode="paper"), names)] == ["a", "a", "a"]
    ahead, names = task_from("""
        S.@..
        ..a.G
        ..@..
    """)
    assert [step[1] for step in steps_of(solve(ahead, mode="literal"), names)] == ["a", "a", "a"]


def test_read_literally_what_cannot_be_solved_at_all_is_still_proven():
    task, _ = task_from("S.@.G")
    solution = solve(task, mode="literal")
    assert Status(int(solution.status)) is Status.UNSOLVABLE and not check(task, solution)


def test_the_proof_names_the_indestructible_obstacles_that_separate_and_no_others():
    labels = np.full((7, 9), -1, np.int32)
    labels[:4, 4], labels[4:, 4] = 0, 1  # a wall of two indestructible parts
    labels[2, 5:7] = 2  # destroyable, touches it
    labels[0, 0], labels[6, 8] = 3, 4  # indestructible, apart
    task = make_task(labels, (3, 0), (3, 8), destroyable=[False, False, True, False, False])
    solution = solve(task)
    assert Status(int(solution.status)) is Status.UNSOLVABLE and not check(task, solution)
    assert np.asarray(solution.separating).tolist() == [0, 1, -1, -1, -1]


def test_a_goal_inside_something_indestructible_has_that_as_its_proof():
    solution = solve(
        make_task(np.array([[-1, -1, 0, 1]], np.int32), (0, 0), (0, 3), destroyable=[True, False])
    )
    assert np.asarray(solution.separating).tolist() == [1, -1]


@pytest.mark.slow
def test_symbolic_plan_and_route_tell_the_same_story_read_literally():
    """The other modes are judged likewise in `test_solver`."""
    tasks = random_tasks(5, 120, overlap=True, max_side=14, can_destroy=0.5)
    solutions = solve_many(tasks, mode="literal")
    assert [check(task, solution) for task, solution in zip(tasks, solutions)] == [[]] * len(tasks)
    assert {Status.SOLVED, Status.UNSOLVABLE, Status.STOPPED_SHORT} <= {
        int(solution.status) for solution in solutions
    }


def test_an_obstacle_is_left_behind_at_the_first_cell_it_did_not_cover():
    labels = jnp.array([[[[-1, 0, 0, -1, 1, -1]]]], jnp.int32)
    cells = jnp.stack([jnp.zeros(6, jnp.int32), jnp.arange(6, dtype=jnp.int32)], axis=1)[None]
    ids, at = jnp.array([[0, 1, -1]], jnp.int32), jnp.array([[0, 3, -1]], jnp.int32)
    assert left_behind(labels, cells, jnp.array([6], jnp.int32), ids, at).tolist() == [[3, 5, -1]]
    together = jnp.array([[0, 0, -1]], jnp.int32)
    assert left_behind(labels, cells, jnp.array([6], jnp.int32), ids, together).tolist() == [
        [0, 1, -1]
    ]
