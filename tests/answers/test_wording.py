"""Explanations: in words, as data, what if it were otherwise, and the plan as a tree."""

import importlib.util
import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest

from sign_model.map_algorithm.plan_specification import IS_ABSTRACT, REALISE, metacognition
from sign_model.pddl.grounding import load
from sign_model.pddl.validate import validate
from sign_model.plan_task import plan
from sign_model.result import PlanStatus
from sign_model.signs.matrix import Component
from sign_model.signs.sign import sequence
from srt_jax import explain, explanation, make_task, scene_pddl, solve, stack, story, why, why_not
from srt_jax.answers.what_if import if_gone
from srt_jax.geometry.frame import Frame
from srt_jax.symbols.scene_of_task import scene_of
from tests.helpers.pictures import task_from


def explained(labels, start, goal, **options):
    task = make_task(np.array(labels, np.int32), start, goal, **options)
    return explain(task, solve(task))


def two_gates(mode="least"):
    """An indestructible wall with a gate a, then a wall of two parts, b and c, of which either
    would do; b is nearer.
    """
    task, _ = task_from("""
        S@....c.
        ..a..b.G
        .@...b..
        .@...b..
    """)
    return task, solve(task, mode=mode)


def test_an_open_way_is_explained_with_its_length():
    assert (
        explained([[-1, -1, -1]], (0, 0), (0, 2))
        == "The goal (0, 2) lies to the east of (0, 0), close, rightward: 2 cells, 90 degrees to"
        " the right, looking north. A path exists, 2 cells long; nothing has to be destroyed."
    )


def test_what_blocks_what_was_destroyed_and_how_good_that_is():
    text = explained([[-1, -1, 0, -1], [-1, -1, 1, -1]], (0, 0), (1, 3), destroyable=[True, False])
    assert (
        "0 (destroyable, 2 cells of contour, close, rightward: 1 cell, 90 degrees to the right), 1"
        " (indestructible, 2 cells of contour, close, rightward: 1 cell, 90 degrees to the right)"
        in text
    )
    assert "Destroyed obstacle 0 from (0, 1); removal cost 1, proven least." in text


@pytest.mark.parametrize("obstacle", [[0], 0.0, True, "0"])
def test_one_obstacle_is_asked_for_by_its_number(obstacle):
    task, solution = two_gates()
    for ask in (why, why_not):
        with pytest.raises(TypeError, match=r"obstacle must be the id of one obstacle, such as 3"):
            ask(task, solution, obstacle)


@pytest.mark.parametrize(
    ("start", "goal", "destroyable", "expected"),
    [
        (
            (0, 2),
            (0, 0),
            True,
            "The start (0, 2) lies in 0 (destroyable), so the agent cannot move.",
        ),
        (
            (0, 0),
            (0, 3),
            False,
            "Unsolvable: nothing can be destroyed: 0 alone keeps start and goal apart.",
        ),
        ((0, 0), (0, 2), False, "Unsolvable: the goal lies in 0 (indestructible)."),
        ((0, 0), (0, 0), True, "The goal (0, 0) is the start."),
    ],
)
def test_each_way_to_fail_has_its_sentence(start, goal, destroyable, expected):
    assert expected in explained([[-1, -1, 0, -1]], start, goal, destroyable=destroyable)


def test_a_batch_is_explained_line_by_line():
    tasks = stack([make_task(np.ones((1, n), bool), (0, 0), (0, n - 1)) for n in (2, 3)])
    solutions = solve(tasks)
    assert [line.split(":")[0] for line in explain(tasks, solutions).splitlines()] == [
        "task 0",
        "task 1",
    ]
    assert [data["goal"]["cell"] for data in explanation(tasks, solutions)] == [[0, 1], [0, 2]]
    with pytest.raises(ValueError, match="batch dimensions"):
        explain(tasks, solve(make_task(np.ones((1, 2), bool), (0, 0), (0, 1))))
    for one in (story, scene_pddl):
        with pytest.raises(ValueError, match="takes one task"):
            one(tasks, solutions)


def test_the_data_is_json_and_says_where_all_is_seen():
    task, solution = two_gates()
    data = json.loads(json.dumps(explanation(task, solution, what_if=True)))
    assert data["status"] == "SOLVED" and data["goal"]["seen_as"] == ["close", "rightward"]
    assert [one["id"] for one in data["destroyed"]] == [0, 1] and data["is_proven_least"]
    assert {one["id"]: one["contour_cells"] for one in data["blockage"]["obstacles"]} == {
        0: 1,
        3: 5,
    }
    assert [step["act"] for step in data["plan"]] == ["APPROACH", "DESTROY", "PASS"] * 2
    assert (
        data["plan"][-1]["to"] == [1, 7]
        and data["route"]["relocation"]["name"] == "moving closer in a straight line"
    )
    assert data["if_firm"] == [
        {"id": 0, "status": "UNSOLVABLE", "destroyed": [], "removal_cost": None},
        {"id": 1, "status": "SOLVED", "destroyed": [0, 2], "removal_cost": 2.0},
    ]
    assert data["alternatives"] == [
        {"status": "SOLVED", "destroyed": [0, 2], "removal_cost": 2.0, "is_as_cheap": True}
    ]


def test_words_follow_the_heading_and_the_size_of_a_cell():
    task, solution = two_gates()
    assert explanation(task, solution, heading=0.0)["goal"]["seen_as"] == ["close", "ahead"]
    large = explanation(task, solution, cell_side=40.0)
    assert large["goal"]["seen_as"] == ["afar", "rightward"] and large["goal"][
        "distance"
    ] == pytest.approx(40 * 50**0.5)
    (x, y), side = large["goal"]["square"]  # holds the sector, hence the goal's own square
    assert abs(x - 7 * 40) <= (side - 40) / 2 + 1e-6 and abs(y + 40) <= (side - 40) / 2 + 1e-6


def test_places_are_in_metres_where_the_map_has_a_frame():
    task, solution = two_gates()
    frame = Frame.over((-1.0, -1.0), 0.25, height=4, width=8)
    text = explain(task, solution, frame=frame)
    assert text.startswith("The goal (0.88 m, -0.38 m) lies to the east of (-0.88 m, -0.12 m),")
    assert "Destroyed obstacle 0 from (" in text and " m); removal cost 2" in text
    assert explain(task, solution, frame=Frame.of_cells(4, 8)) == explain(task, solution)
    blocked = task.replace(destroyable=np.zeros(4, bool))
    near = explain(blocked, solve(blocked), frame=frame)
    assert "As near as one gets: (-0.62 m, -0.38 m), 1.50 m from the goal" in near


def test_what_follows_if_it_were_otherwise_is_explained():
    task, solution = two_gates()
    text = explain(task, solution, what_if=True)
    assert text.endswith(
        "Instead 0 + 2 could go, at the same cost 2. If 0 were indestructible: unsolvable."
    )
    dearer = task.replace(removal_cost=np.array([1, 1, 1.5, 1], np.float32))
    text = explain(dearer, solve(dearer), what_if=True)
    assert "Instead 0 + 2 could go, at cost 2.5." in text
    assert why(task, solution, 0).endswith(
        "it is the first in the way. If 0 were indestructible: unsolvable."
    )
    assert (
        "behind 0, which had to go first. If 1 were indestructible: 0 + 2 would have to go, at"
        " cost 2." in why(task, solution, 1)
    )
    assert "the same as the 2 of what was chosen" in why_not(task, solution, 2)
    assert "behind-right: 0.57 m, 135" in why(task, solution, 0, cell_side=0.4)
    assert "it cannot be. If it could:" in why_not(task, solution, 3)
    assert "is part of what blocks first and is indestructible" in why(task, solution, 3)
    assert why(task, solution, 2).endswith("has no part in it.") and why_not(
        task, solution, 0
    ).endswith("was destroyed.")
    with pytest.raises(ValueError, match="ids are 0 to 3"):
        why(task, solution, 4)


@pytest.mark.parametrize(
    ("costs", "compared"),
    [
        ((1e8, 1, 3, 1), "more than the 1e+08"),  # the two sums are one and the same float32
        ((1e8, 2, 2, 1), "the same as the 1e+08"),
        ((0.1, 0.2, 0.2, 1), "the same as the 0.3"),
    ],
)
def test_what_other_sets_cost_is_compared_without_rounding(costs, compared):
    task = two_gates()[0].replace(removal_cost=np.array(costs, np.float32))
    solution = solve(task)
    assert solution.destroyed[:3].tolist() == [0, 1, -1]
    assert f"{compared} of what was chosen" in why_not(task, solution, 2)
    other = if_gone(task, solution, 2)
    assert set(other.destroyed) == {0, 2}
    swapped = solve(task.replace(destroyable=np.array([True, False, True, False])))
    assert other.removal_cost == float(swapped.removal_cost)


def test_another_set_may_cost_less_than_what_a_greedy_walk_chose():
    task = two_gates()[0].replace(removal_cost=np.array([1, 2, 3, 1], np.float32))
    solution = solve(task, mode="paper")
    assert solution.destroyed[:3].tolist() == [0, 2, -1]
    assert "less than the 4 of what was chosen" in why_not(task, solution, 1)


def test_what_separates_is_explained_too():
    task, _ = task_from("S.@.G")
    solution = solve(task)
    assert why(task, solution, 0).endswith(
        "keeps start and goal apart. If 0 could be destroyed: 0 would have to go, at cost 1."
    )


def test_the_story_is_a_tree_with_cells_under_each_step():
    task, solution = two_gates()
    lines = story(task, solution).splitlines()
    assert lines[0] == "reach the goal area at (1, 7) (specified: 6 steps)"
    assert lines[1:4] == [
        "  approach obstacle 0",
        (
            "    moving closer in a straight line: (0, 0) to (1, 1), cells 0 to 2, 0.7 off the"
            " straight link"
        ),
        "  destroy obstacle 0 from (1, 1)",
    ]
    assert "0.4 m off the straight link" in story(task, solution, cell_side=0.5).splitlines()[2]
    assert lines[-2:] == [
        "  pass obstacle 1",
        (
            "    moving closer in a straight line: (1, 4) to (1, 7), cells 5 to 8, 0.0 off the"
            " straight link"
        ),
    ]


def test_realise_or_specify_is_decided_by_a_sign():
    task, solution = two_gates()
    bolder = metacognition().grown(REALISE, Component.IMAGE, sequence(IS_ABSTRACT))
    assert (
        story(task, solution, rule=bolder)
        .splitlines()[0]
        .endswith("(realised: path planning alone)")
    )
    open_task, _ = task_from("S..G")
    assert "realised" in story(open_task, solve(open_task))
    closed, _ = task_from("S.@.G")
    assert "no plan" in story(closed, solve(closed))
    here = make_task(np.ones((1, 2), bool), (0, 0), (0, 0))
    assert "nothing to do" in story(here, solve(here))


@pytest.mark.parametrize("mode", ["least", "paper"])
def test_the_plan_carried_out_is_valid_in_the_scene_and_map_finds_it_too(mode):
    task, solution = two_gates(mode)
    domain, problem, lines = scene_pddl(task, solution)
    scene = load(domain, problem)
    assert validate(scene, lines) == []
    assert scene_of(task, solution).obstacles == tuple(
        f"obstacle-{i}" for i in np.asarray(solution.destroyed)[:2]
    )
    if mode == "least":
        assert plan(scene).actions == tuple(lines)


def test_the_scene_of_an_unsolvable_task_has_no_plan():
    task, _ = task_from("S.@.G")
    domain, problem, lines = scene_pddl(task, solve(task))
    assert lines == [] and plan(load(domain, problem)).status is PlanStatus.UNSOLVABLE


def test_another_planner_finds_a_plan_as_short(tmp_path):
    pytest.importorskip("pyperplan")
    domain, problem, lines = scene_pddl(*two_gates())
    (tmp_path / "domain.pddl").write_text(domain)
    (tmp_path / "problem.pddl").write_text(problem)
    command = [sys.executable, "-m", "pyperplan", "-s", "bfs", "domain.pddl", "problem.pddl"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "problem.pddl.soln").read_text().split("\n")[:-1] == lines


def test_the_planner_of_competitions_finds_a_plan_as_short(tmp_path):
    found = importlib.util.find_spec("up_fast_downward")
    if found is None or found.origin is None:
        pytest.skip("Fast Downward (up_fast_downward) is not installed")
    driver = pathlib.Path(found.origin).parent / "downward" / "fast-downward.py"
    domain, problem, lines = scene_pddl(*two_gates())
    (tmp_path / "domain.pddl").write_text(domain)
    (tmp_path / "problem.pddl").write_text(problem)
    command = [
        sys.executable,
        str(driver),
        "--plan-file",
        "plan",
        "domain.pddl",
        "problem.pddl",
        "--search",
        "astar(blind())",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    if done.returncode != 0 and "not find" in done.stdout + done.stderr:
        pytest.skip("Fast Downward is not built here")
    assert done.returncode == 0, done.stdout + done.stderr
    assert [
        line for line in (tmp_path / "plan").read_text().splitlines() if not line.startswith(";")
    ] == lines
