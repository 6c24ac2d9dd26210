"""Tasks of coalitions in files, on the command line and in pictures."""

import json
import os

import jax
import numpy as np
import pytest

from srt_jax.cli import run
from srt_jax.coalition import (
    helpers,
    make_coalition,
    read_coalitions,
    stack_coalitions,
    task_files,
    write_coalitions,
)
from srt_jax.coalition.task_files import holds_coalitions
from srt_jax.commands import coalitions
from srt_jax.draw.coalition import animate_coalition, draw_coalition

TASK = {
    "map": ["...@...", "...@...", "...@..."],
    "agents": [{"start": [0, 0], "goal": [0, 6], "able": []}, {"start": [2, 6], "able": [0]}],
    "removal_cost": 2.5,
}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "doors.json"
    path.write_text(json.dumps(TASK))
    return path


def test_a_json_task_reads_as_what_it_says(file):
    ((name, task),) = read_coalitions(file)
    assert name == "doors" and task.able.tolist() == [[False], [True]]
    assert task.goal.tolist() == [[0, 6], [-1, -1]] and task.removal_cost.tolist() == [2.5]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"agents": []}, "at least one agent"),
        ({"map": ["..", "."]}, "texts of one length"),
        ({"map": ["..x.", "...."]}, "'x' at \\(0, 2\\)"),
        ({"labels": [[-1, 0]]}, "either map"),
        ({"agents": [{"start": [0, 99]}]}, "agent 0: .* outside the map"),
        ({"agents": [{"start": [0]}]}, "must be a cell"),
        ({"agents": [{"start": [0, 0], "able": "all"}]}, "able must be true"),
        ({"agents": [{"start": [0, 0], "team": 1}]}, "unknown member 'team'"),
    ],
)
def test_a_json_task_that_breaks_a_rule_is_refused_by_name(tmp_path, change, message):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(TASK | change))
    with pytest.raises(ValueError, match=f"bad.json.*{message}"):
        read_coalitions(path)


@pytest.mark.parametrize(
    ("content", "is_one"),
    [
        (json.dumps(TASK), True),
        (json.dumps(TASK).replace("agents", "\\u0061gents"), True),
        (json.dumps(TASK).encode("utf-16-le"), True),
        (json.dumps({"format": "srt-jax world", "name": "secret agents"}), False),
        (json.dumps({"format": "srt-jax world"}), False),
        ("agents", False),
    ],
)
def test_a_document_of_a_coalition_is_recognised_by_its_members(tmp_path, content, is_one):
    path = tmp_path / "task.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert holds_coalitions(path) is is_one


def test_a_document_that_cannot_be_one_is_not_parsed(tmp_path, monkeypatch):
    path = tmp_path / "world.json"
    path.write_text(json.dumps({"format": "srt-jax world"}))
    monkeypatch.setattr(task_files, "read_json", lambda *_: pytest.fail("parsed"))
    assert not holds_coalitions(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
@pytest.mark.parametrize("name", ["pipe.npz", "pipe.json"])
def test_a_pipe_is_not_waited_for(tmp_path, name):
    os.mkfifo(tmp_path / name)
    assert not holds_coalitions(tmp_path / name)


def test_a_batch_is_written_and_read_back_equal(tmp_path):
    names, tasks, optima = zip(*helpers(count=3, size=16, seed=0, rooms=2))
    path = tmp_path / "batch.npz"
    write_coalitions(path, stack_coalitions(tasks), names=names, optimum=optima)
    assert holds_coalitions(path)
    for (name, task), known, wanted in zip(read_coalitions(path), names, tasks):
        assert name == known
        jax.tree.map(np.testing.assert_array_equal, task, wanted)


def test_a_batch_that_breaks_a_rule_is_refused_by_name(tmp_path):
    batch = stack_coalitions([make_coalition(np.ones((4, 4), bool), [(0, 0)], (3, 3))])
    for change, message in (
        ({"start": batch.start + 9}, "start must lie inside"),
        ({"removal_cost": -batch.removal_cost}, "positive and finite"),
        ({"able": batch.able.astype(np.int32)}, "able must be bool"),
        ({"goal": batch.goal[:, :0]}, "goal must have shape"),
    ):
        with pytest.raises(ValueError, match=message):
            write_coalitions(tmp_path / "x.npz", batch.replace(**change))
    assert not (tmp_path / "x.npz").exists()


def test_the_command_prints_who_helps_whom(file, capsys, monkeypatch, chain):
    # the answers come from the one program that is compiled here
    monkeypatch.setattr(coalitions, "read_coalitions", lambda _: [("chain", chain.tasks[0])])
    monkeypatch.setattr(coalitions, "solved", lambda *_: [chain.answers[0]])
    assert run(["solve", str(file), "--json", "--out", str(file.parent / "out")]) == 0
    (record,) = json.loads(capsys.readouterr().out)["coalitions"]
    assert record["helps"][1] == {"helper": 1, "agent": 0, "obstacle": 1}
    assert [step["obstacle"] for step in record["destroyed"]] == [0, 1]
    assert (file.parent / "out" / "chain.png").exists()
    assert run(["solve", str(file)]) == 0
    assert "1>0" in capsys.readouterr().out


def test_the_command_refuses_what_is_for_other_tasks(file, capsys):
    (file.parent / "a.map").write_text("type octile\nheight 1\nwidth 2\nmap\n..\n")
    assert run(["solve", str(file), str(file.parent / "a.map")]) == 2
    assert "one after the other" in capsys.readouterr().err
    assert run(["solve", str(file), "--report", str(file.parent / "r.html")]) == 2
    assert "use --out or --json" in capsys.readouterr().err


def test_helpers_are_generated_into_a_file_that_solve_reads(tmp_path, capsys):
    path = str(tmp_path / "h.npz")
    assert run(["generate", "helpers", "--count", "2", "--size", "16", "--out", path]) == 0
    assert "known for 2" in capsys.readouterr().out
    assert [task.able.shape for _, task in read_coalitions(path)] == [(3, 13)] * 2


def test_pictures_and_animations_show_agents(tmp_path, chain):
    for task, answer in zip(*chain):
        draw_coalition(task, answer, tmp_path / "one.svg", title="a chain")
    animate_coalition(chain.tasks[0], chain.answers[0], tmp_path / "one.gif")
    assert (tmp_path / "one.gif").stat().st_size > 1000
    with pytest.raises(ValueError, match="no routes to animate"):
        animate_coalition(chain.tasks[1], chain.answers[1], tmp_path / "two.gif")
    with pytest.raises(ValueError, match="a GIF"):
        animate_coalition(chain.tasks[0], chain.answers[0], tmp_path / "one.png")
