"""`srt-jax compare`: two files, two modes, and what is wrong with them."""

import json

import numpy as np
import pytest

from srt_jax import make_task, stack
from srt_jax.answers import shards
from srt_jax.cli import run
from srt_jax.formats.batch import write_batch
from srt_jax.formats.reading import Reading


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


def test_more_modes_are_each_held_against_the_first(tasks, capsys):
    assert run(["compare", tasks, "--modes", "least,shortest,least", "--json"]) == 1
    documents = json.loads(capsys.readouterr().out)["comparisons"]
    assert [(one["left"], one["right"]) for one in documents] == [
        ("least", "shortest"),
        ("least", "least"),
    ]
    assert [one["sums"]["differing"] for one in documents] == [1, 0]


@pytest.mark.parametrize("format", ["parquet", "jsonl"])
def test_folders_of_shards_are_read_and_those_of_pictures_too(tasks, tmp_path, capsys, format):
    if format == "parquet":
        pytest.importorskip("pyarrow")
    whole, parts = tmp_path / "a.json", tmp_path / "parts"
    assert run(["solve", tasks, "--results", str(whole)]) == 0
    request = shards.Request(
        inputs=(tasks,), counts=(2,), reading=Reading(), shard_size=1, format=format
    )
    parts.mkdir()
    job = shards.settled_job(parts, request)
    job.make(1)
    assert run(["compare", str(whole), str(parts)]) == 2
    err = capsys.readouterr().err
    assert "1 of 2 shards missing, the first is answers-000000" in err
    job.make(0)
    assert run(["compare", str(whole), str(parts)]) == 0
    whole.rename(tmp_path / "results.json")
    assert run(["compare", str(tmp_path), str(parts)]) == 0
    (tmp_path / "results.json").rename(whole)
    assert run(["compare", str(tmp_path), str(parts)]) == 2
    assert "holds neither _solve.json nor results.json" in capsys.readouterr().err


def test_what_cannot_be_compared_is_named(tasks, tmp_path, capsys):
    odd = tmp_path / "odd.json"
    odd.write_text('{"tasks": [{"name": "a"}]}')
    for arguments, says in (
        ([tasks], "two files of results, got 1"),
        ([tasks, tasks], "results are written as .json or .parquet"),
        ([str(odd), str(odd)], "odd.json: an answer has no 'status'"),
        ([tasks, "--modes", "least"], "--modes must be two or more of"),
        ([str(tmp_path / "no.json")] * 2, "no.json: no such file"),
    ):
        assert run(["compare", *arguments]) == 2
        assert says in capsys.readouterr().err


def test_tasks_are_read_as_solve_reads_them(tasks, tmp_path, capsys):
    assert run(["compare", tasks, "--modes", "least,shortest", "--rows", "1:2"]) == 0
    assert "0 of 1 tasks differ" in capsys.readouterr().out
    none = ["--destroyable", "none"]
    assert run(["compare", tasks, "--modes", "least,shortest", *none, "--all"]) == 0
    assert "BROKE_THROUGH" not in capsys.readouterr().out
    first = str(tmp_path / "a.json")
    assert run(["solve", tasks, "--results", first]) == 0
    assert f"Wrote {first}: the answers." in capsys.readouterr().out.replace("\n", " ")
    assert run(["compare", first, first, "--limit", "1"]) == 2
    assert "how tasks are read or solved goes with --modes" in capsys.readouterr().err
    assert run(["compare", tasks, "--modes", "least,least", "--toll", "3"]) == 2
    assert "--toll is for the mode shortest, which --modes does not name" in capsys.readouterr().err
