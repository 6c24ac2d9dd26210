"""`srt-jax compare`: two files, two modes, and what is wrong with them."""

import json

import numpy as np
import pytest

from srt_jax import make_task, stack
from srt_jax.cli import run
from srt_jax.formats.batch import write_batch


@pytest.fixture
def tasks(tmp_path):
    free = np.ones((12, 12), bool)
    free[:11, 6] = False
    walls = [make_task(free, (0, 4), (0, 8)), make_task(free, (11, 4), (11, 8))]
    path = tmp_path / "walls.npz"
    write_batch(path, stack(walls), names=["far", "near"])
    return str(path)


def test_two_modes_on_the_same_tasks(tasks, capsys):
    assert run(["compare", tasks, "--modes", "least,shortest"]) == 1
    out = capsys.readouterr().out
    assert "PATH_EXISTS | BROKE_THROUGH" in out and "1 of 2 tasks differ" in out
    assert "near" not in out
    assert run(["compare", tasks, "--modes", "least,shortest", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [row["differs"] for row in document["tasks"]][1] == []
    assert document["sums"]["shorter"] == [0, 1] and document["left"] == "least"


def test_two_files_of_results(tasks, tmp_path, capsys):
    first, second = str(tmp_path / "a.json"), str(tmp_path / "b.parquet")
    pytest.importorskip("pyarrow")
    for path in (first, second):
        assert run(["solve", tasks, "--results", path]) == 0
    capsys.readouterr()
    assert run(["compare", first, second, "--all"]) == 0
    out = capsys.readouterr().out
    assert "0 of 2 tasks differ" in out and "near" in out


def test_what_cannot_be_compared_is_named(tasks, tmp_path, capsys):
    odd = tmp_path / "odd.json"
    odd.write_text('{"tasks": [{"name": "a"}]}')
    for arguments, says in (
        ([tasks], "two files of results, got 1"),
        ([tasks, tasks], "results are written as .json or .parquet"),
        ([str(odd), str(odd)], "odd.json: an answer has no 'status'"),
        ([tasks, "--modes", "least"], "--modes must be two of"),
        ([str(tmp_path / "no.json")] * 2, "no.json: no such file"),
    ):
        assert run(["compare", *arguments]) == 2
        assert says in capsys.readouterr().err
