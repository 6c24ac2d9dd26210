"""The commands as a person types them: what they print, what they leave behind, how they refuse."""

import json

import numpy as np
import pytest

from srt_jax.cli import run
from srt_jax.formats.batch import read_batch
from srt_jax.formats.movingai import write_map

WALLED = """type octile
height 4
width 6
map
..@...
..@.@.
..@...
..@...
"""

WORLD = {
    "format": "srt-jax world",
    "version": 1,
    "bounds": [0, 0, 10, 10],
    "agent": {"position": [1.5, 1.5], "radius": 0.4},
    "goal": {"centre": [8.5, 8.5], "side": 1.0},
    "obstacles": [
        {"name": "wall", "destroyable": True, "polygon": [[[4, 0], [5, 0], [5, 10], [4, 10]]]}
    ],
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walled.map").write_text(WALLED)
    return tmp_path


def printed(capsys, *arguments):
    code = run([*arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_solving_a_map_prints_one_json_document(here, capsys):
    code, out, err = printed(
        capsys, "solve", "walled.map", "--start", "0,0", "--goal", "3,5", "--json"
    )
    (task,) = json.loads(out)["tasks"]
    assert (code, err, task["status"], task["destroyed"], task["blocking"]) == (
        0,
        "",
        "SOLVED",
        [0],
        [0],
    )
    assert task["cells"][0] == [0, 0] and task["cells"][-1] == [3, 5]
    assert task["seed"] == [3, 1] and len(task["contour"]) == 4


def test_indestructible_obstacles_make_the_exit_code_one(here, capsys):
    code, out, _ = printed(
        capsys, "solve", "walled.map", "--start=0,0", "--goal=3,5", "--destroyable", "1", "--json"
    )
    assert code == 1 and json.loads(out)["tasks"][0]["status"] == "UNSOLVABLE"
    assert json.loads(out)["tasks"][0]["removal_bound"] is None


def test_a_single_task_is_explained_and_drawn(here, capsys):
    code, out, _ = printed(
        capsys, "solve", "walled.map", "--start", "0,0", "--goal", "3,5", "--out", "answers"
    )
    assert code == 0 and "Destroyed obstacle 0 from" in " ".join(out.split())
    assert sorted(path.name for path in (here / "answers").iterdir()) == [
        "results.json",
        "walled.png",
    ]
    assert (here / "answers" / "walled.png").read_bytes().startswith(b"\x89PNG")


def test_generated_tasks_are_solved_at_their_proven_optimum(here, capsys):
    assert (
        printed(
            capsys,
            "generate",
            "mixed",
            "--count",
            "12",
            "--size",
            "24-32",
            "--seed",
            "3",
            "--out",
            "b.npz",
        )[0]
        == 0
    )
    code, out, _ = printed(capsys, "solve", "b.npz", "--json")
    batch, records = read_batch("b.npz"), json.loads(out)["tasks"]
    assert [record["name"] for record in records] == list(batch.names)
    assert code == int(any(record["status"] not in ("SOLVED", "PATH_EXISTS") for record in records))
    for optimum, record in zip(batch.optimum.tolist(), records):
        if np.isfinite(optimum) and record["status"] != "BUDGET_SPENT":
            assert record["removal_bound"] <= optimum <= record["removal_cost"]
        elif np.isinf(optimum):
            assert record["removal_bound"] is None


def test_a_world_in_metres_and_a_map_are_solved_in_one_call(here, capsys):
    (here / "world.json").write_text(json.dumps(WORLD))
    code, out, _ = printed(capsys, "solve", "world.json", "--json")
    assert code == 0 and json.loads(out)["tasks"][0]["destroyed"] == [0]


def test_a_scenario_is_recomputed_row_by_row(here, capsys):
    rows = [
        "version 1",
        *(
            "\t".join(map(str, row))
            for row in (
                (0, "walled.map", 6, 4, 3, 0, 5, 3, 4.41421356),
                (0, "walled.map", 6, 4, 0, 0, 1, 1, 1.41421356),
            )
        ),
    ]
    (here / "walled.map.scen").write_text("\n".join(rows))
    code, out, _ = printed(capsys, "scen", "walled.map.scen", "--map", "walled.map", "--json")
    answer = json.loads(out)
    assert (code, answer["rows"], answer["matches"]) == (0, 2, 2) and answer[
        "max_relative_error"
    ] < 1e-6
    (here / "walled.map.scen").write_text("\n".join(rows).replace("4.41421356", "4.2"))
    assert printed(capsys, "scen", "walled.map.scen")[0] == 1
    assert printed(capsys, "scen", "walled.map.scen", "--limit", "0")[0] == 2


def scenario(start="0\t0", size="6\t4"):
    return f"version 1\n0\twalled.map\t{size}\t{start}\t1\t1\t1.0\n"


def world_with(**changes):
    return json.dumps(WORLD | changes)


BAD = {
    "a missing file": ("nowhere.map", None, "no such file"),
    "an unknown ending": ("map.txt", "", "ending"),
    "a map cut short": ("bad.map", WALLED.rsplit("\n", 2)[0], "bad.map"),
    "a header that lies": ("bad.map", WALLED.replace("width 6", "width 7"), "7 columns"),
    "a header that is none": ("bad.map", "octile\n", "bad.map:1"),
    "a character that is no cell": ("bad.map", WALLED.replace("..@.@.", "..x.@."), "'x'"),
    "a batch that is none": ("bad.npz", "PK", "npz"),
    "a world that is no JSON": ("bad.json", "{", "bad.json"),
    "a polygon with two points": (
        "bad.json",
        world_with(obstacles=[{"polygon": [[[0, 0], [1, 1]]]}]),
        "at least three",
    ),
    "a polygon that crosses itself": (
        "bad.json",
        world_with(obstacles=[{"polygon": [[[0, 0], [2, 2], [2, 0], [0, 2]]]}]),
        "meets itself",
    ),
    "cells too narrow for the agent": (
        "bad.json",
        world_with(goal={"centre": [8.5, 8.5], "side": 0.8}),
        "2 R",
    ),
    "a coordinate that is no number": (
        "bad.json",
        world_with(bounds=[0, 0, 10, float("nan")]),
        "NaN",
    ),
    "a goal outside the world": (
        "bad.json",
        world_with(goal={"centre": [18.5, 8.5], "side": 1.0}),
        "outside",
    ),
    "an agent inside a wall": (
        "bad.json",
        world_with(agent={"position": [4.5, 1.5], "radius": 0.4}),
        "covered",
    ),
    "a scenario row off the map": ("bad.scen", scenario(start="0\t9"), "outside"),
    "a scenario row on a wall": ("bad.scen", scenario(start="2\t0"), "wall"),
    "a scenario for another map": ("bad.scen", scenario(size="7\t4"), "7 wide"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_in_one_line_with_exit_code_two(here, capsys, case):
    name, content, message = BAD[case]
    if content is not None:
        (here / name).write_text(content)
    before = sorted(here.iterdir())
    ends = ("--start", "0,0", "--goal", "3,5") if name.endswith(".map") else ()
    code, out, err = printed(capsys, "solve", name, *ends, "--out", "answers")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and err.startswith("srt-jax: error: ") and message in err
    assert sorted(here.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["solve", "walled.map"], "--start"),
        (["solve", "walled.map", "--start", "0,2", "--goal", "3,5"], "wall"),
        (["solve", "walled.map", "--start", "0,0", "--goal", "1,4"], "wall"),
        (["solve", "walled.map", "--start", "0,0", "--goal", "9,5"], "outside"),
        (["solve", "walled.map", "--start", "0;0", "--goal", "3,5"], "row,column"),
        (
            ["solve", "walled.map", "--start", "0,0", "--goal", "3,5", "--destroyable", "7"],
            "obstacle 7",
        ),
        (
            ["solve", "walled.map", "--start", "0,0", "--goal", "3,5", "--destroyable", "some"],
            "all, none",
        ),
        (["solve", "walled.map", "--start", "0,0", "--goal", "3,5", "--mode", "best"], "mode"),
        (["solve"], "INPUT"),
        (["fly"], "fly"),
        (["bench", "moons"], "moons"),
        (["generate", "moons", "--out", "b.npz"], "moons"),
        (["generate", "rooms", "--out", "b.map"], ".npz"),
        (["generate", "rooms", "--size", "big", "--out", "b.npz"], "--size"),
        (["generate", "rooms", "--out", "nowhere/b.npz"], "nowhere"),
    ],
)
def test_a_slip_in_the_arguments_is_one_line_with_exit_code_two(here, capsys, arguments, message):
    code, out, err = printed(capsys, *arguments)
    assert (code, out) == (2, "") and err.count("\n") == 1 and message in err
    assert [path.name for path in here.iterdir()] == ["walled.map"]


def test_an_empty_scenario_is_an_empty_batch(here, capsys):
    (here / "none.scen").write_text("version 1\n")
    code, _, err = printed(capsys, "solve", "none.scen")
    assert code == 2 and err.count("\n") == 1


SWITCH = """(define (domain switch) (:requirements :strips) (:predicates (on) (off))
  (:action turn-on :parameters () :precondition (off) :effect (and (on) (not (off)))))"""


def problem_of_switch(init, goal):
    return f"(define (problem p) (:domain switch) (:init {init}) (:goal {goal}))"


@pytest.mark.parametrize("planner", ["map", "astar", "wastar", "gbfs"])
def test_a_pddl_task_is_planned_or_proven_to_have_no_plan(here, capsys, planner):
    (here / "domain.pddl").write_text(SWITCH)
    (here / "p.pddl").write_text(problem_of_switch("(off)", "(on)"))
    code, out, _ = printed(capsys, "plan", "domain.pddl", "p.pddl", "--planner", planner)
    assert (code, out) == (0, "(turn-on)\n")
    (here / "p.pddl").write_text(problem_of_switch("(off)", "(and (on) (off))"))
    code, out, _ = printed(capsys, "plan", "domain.pddl", "p.pddl", "--planner", planner, "--json")
    assert (
        code == 1 and json.loads(out)["status"] == "UNSOLVABLE" and json.loads(out)["actions"] == []
    )


def test_a_slip_in_pddl_is_refused_with_file_and_line(here, capsys):
    (here / "domain.pddl").write_text(SWITCH)
    (here / "p.pddl").write_text(problem_of_switch("(off)", "(warm)").replace("(:goal", "\n(:goal"))
    code, out, err = printed(capsys, "plan", "domain.pddl", "p.pddl")
    assert (code, out) == (2, "") and err.count("\n") == 1 and "p.pddl:2" in err and "warm" in err


@pytest.mark.parametrize(
    "command", [[], ["solve"], ["scen"], ["demo"], ["plan"], ["generate"], ["bench"], ["draw"]]
)
def test_every_command_explains_itself_with_an_example(capsys, command):
    code, out, _ = printed(capsys, *command, "--help")
    assert code == 0 and "Usage" in out
    assert not command or "Example" in out


def test_every_row_of_a_street_scenario_matches(shared_data, capsys):
    street = shared_data / "street"
    code, out, _ = printed(
        capsys,
        "scen",
        str(street / "Berlin_0_256.map.scen"),
        "--map",
        str(street / "Berlin_0_256.map"),
        "--json",
    )
    assert code == 0 and json.loads(out)["rows"] > 500


def test_a_map_written_by_us_is_solved(here, capsys):
    write_map(here / "own.map", np.ones((3, 3), bool))
    code, out, _ = printed(capsys, "solve", "own.map", "--start", "0,0", "--goal", "2,2", "--json")
    assert code == 0 and json.loads(out)["tasks"][0]["status"] == "PATH_EXISTS"


def test_a_crossing_polygon_is_repaired_when_asked(here, capsys):
    pytest.importorskip("shapely")
    (here / "world.json").write_text(
        world_with(obstacles=[{"polygon": [[[3, 3], [5, 5], [5, 3], [3, 5]]]}])
    )
    assert "--repair" in printed(capsys, "solve", "world.json")[2]
    code, out, _ = printed(capsys, "solve", "world.json", "--repair", "--json")
    assert code == 0 and json.loads(out)["tasks"][0]["status"] == "PATH_EXISTS"
