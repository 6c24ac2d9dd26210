"""Answers in shards: those of one call, whoever made them and however often they were stopped."""

import json
import shutil

import numpy as np
import pytest

from srt_jax.answers import shards
from srt_jax.answers.results_file import read_results
from srt_jax.cli import run
from srt_jax.formats.batch import write_batch
from srt_jax.formats.movingai import ScenRow, write_map, write_scen
from srt_jax.instances.generate import generate
from srt_jax.task import stack


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A scenario of 10 rows, a batch of 7 tasks, and one map."""
    folder = tmp_path_factory.mktemp("inputs")
    free = np.ones((24, 24), bool)
    free[4:9, 6:12] = False
    write_map(folder / "open.map", free)
    ends = [((2, number), (21, 23 - number)) for number in range(9)] + [((2, 2), (3, 3))]
    rows = [ScenRow(0, "open.map", 24, 24, start, goal, 1.0) for start, goal in ends]
    write_scen(folder / "open.map.scen", rows)
    made = generate("mixed", count=7, size=24, seed=3)
    write_batch(folder / "b.npz", stack([task for _, task, _ in made]), names=[m[0] for m in made])
    return [str(folder / name) for name in ("open.map.scen", "b.npz")]


def call(capsys, *arguments):
    code = run(["solve", *map(str, arguments)])
    out, err = capsys.readouterr()
    return code, out, err


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def whole(inputs, tmp_path_factory):
    out = tmp_path_factory.mktemp("whole") / "answers"
    assert run(["solve", *inputs, "--out", str(out), "--shard-size", "6", "--json"]) in (0, 1)
    return out


def records(folder):
    return [one for path in sorted(folder.glob("*.parquet")) for one in read_results(path)]


def test_the_answers_are_those_of_one_call_without_shards(inputs, whole, capsys):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert sorted(contents(whole)) == [
        "_solve.json",
        *(f"answers-{number:06d}.parquet" for number in range(3)),
    ]
    # readers of tables take the folder: a name that begins with _ is none of the data
    assert parquet.read_table(whole).num_rows == 17
    code, out, _ = call(capsys, *inputs, "--json")
    assert json.loads(json.dumps(records(whole))) == json.loads(out)["tasks"]
    code, out, _ = call(capsys, *inputs, "--out", whole, "--shard-size", 6, "--json")
    told = json.loads(out)
    assert (told["tasks"], told["shards"], told["made"]) == (17, 3, 0)
    assert sum(told["statuses"].values()) == 17 and code == 1


def test_answers_with_long_routes_are_not_held_until_there_are_many(
    inputs, whole, tmp_path, capsys, monkeypatch
):
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(shards, "_CELLS_AT_ONCE", 30)
    call(capsys, *inputs, "--out", tmp_path, "--shard-size", 6, "--json")
    assert records(tmp_path) == records(whole)
    name = "answers-000000.parquet"
    assert parquet.ParquetFile(tmp_path / name).num_row_groups >= 3
    assert parquet.ParquetFile(whole / name).num_row_groups == 1


def test_stopped_anywhere_it_goes_on_to_the_same_bytes(inputs, whole, tmp_path, capsys):
    out = tmp_path / "answers"
    shutil.copytree(whole, out)
    (out / "answers-000001.parquet").unlink()
    (out / ".answers-000001.parquet.77-0.part").write_bytes(b"half")
    _, text, _ = call(capsys, *inputs, "--out", out, "--shard-size", 6, "--json")
    assert json.loads(text)["made"] == 1 and contents(out) == contents(whole)


def test_parts_make_the_whole(inputs, whole, tmp_path, capsys):
    out = tmp_path / "answers"
    for part in ("1/2", "0/2"):
        call(capsys, *inputs, "--out", out, "--shard-size", 6, "--part", part)
    assert contents(out) == contents(whole)


@pytest.mark.slow
def test_workers_write_the_same_bytes(inputs, whole, tmp_path, capsys):
    out = tmp_path / "answers"
    call(capsys, *inputs, "--out", out, "--shard-size", 6, "--workers", 2)
    assert contents(out) == contents(whole)


def test_another_command_in_the_same_folder_is_refused(inputs, whole, capsys):
    for more, what in (
        (["--shard-size", 5], "of shard_size 6, not 5"),
        (["--shard-size", 6, "--mode", "paper"], "of mode 'least', not 'paper'"),
        (["--rows", "2:4"], "of counts "),
    ):
        code, _, err = call(capsys, *inputs, "--out", whole, *more)
        assert code == 2 and what in err and err.count("\n") == 1


def test_a_changed_input_is_refused(inputs, tmp_path, capsys):
    free = np.ones((24, 24), bool)
    for name in ("open.map", "open.map.scen"):
        shutil.copy(inputs[0].replace("open.map.scen", name), tmp_path / name)
    given = [tmp_path / "open.map.scen", "--out", tmp_path / "answers", "--shard-size", 5]
    assert call(capsys, *given, "--part", "0/2")[0] == 0
    write_map(tmp_path / "open.map", free)  # which the scenario names
    code, _, err = call(capsys, *given)
    assert code == 2 and "content_of_inputs" in err


def test_rows_that_no_blocker_fits_are_left_out(inputs, tmp_path, capsys):
    given = [inputs[0], "--block", "half", "--out", tmp_path / "answers", "--shard-size", 4]
    code, out, err = call(capsys, *given)
    assert code == 0 and "tasks left out: --block half does not fit: 1" in err
    assert "9 answers in 3 shards" in out
    names = [one["name"] for one in records(tmp_path / "answers")]
    assert names == [f"open.map-{number}" for number in range(9)]
    assert all(one["status"] == "SOLVED" for one in records(tmp_path / "answers"))


def test_without_pyarrow_shards_are_lines_of_json(inputs, whole, tmp_path, capsys, monkeypatch):
    def missing(module, **_):
        raise ImportError(module)

    monkeypatch.setattr(shards, "require_module", missing)
    out = tmp_path / "answers"
    assert call(capsys, *inputs, "--out", out, "--shard-size", 6)[0] == 1
    lines = [line for path in sorted(out.glob("*.jsonl")) for line in path.read_text().splitlines()]
    assert [json.loads(line) for line in lines] == json.loads(json.dumps(records(whole)))


def test_what_does_not_go_together_is_refused(inputs, tmp_path, capsys):
    for more, what in (
        (["--workers", 2], "add --out DIR"),
        (["--out", tmp_path, "--workers", 2, "--results", "x.json"], "--results is for tasks"),
        (["--out", tmp_path / "x", "--part", "2/2"], "the last of 2 is 1/2"),
        (["--out", tmp_path / "x", "--address", "tcp://x:1"], "--engine dask or ray"),
        (["--out", tmp_path / "x", "--engine", "spark"], "one of dask, ray"),
    ):
        code, _, err = call(capsys, *inputs, *more)
        assert code == 2 and what in err and err.count("\n") == 1


def test_the_status_of_a_folder(inputs, whole, tmp_path, capsys):
    out = tmp_path / "answers"
    shutil.copytree(whole, out)
    assert run(["status", str(out)]) == 0
    assert "3 of 3 shards done, 0 claimed, 0 missing; 17 of 17 tasks." in capsys.readouterr().out
    (out / "answers-000000.parquet").unlink()
    assert run(["status", str(out), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["done"], told["missing"], told["tasks_done"]) == (2, 1, 11)
    assert run(["status", str(tmp_path)]) == 2
    assert "holds neither dataset.json nor _solve.json" in capsys.readouterr().err
    for path, what in ((tmp_path / "none", "no such folder"), (out / shards.MANIFEST, "no folder")):
        assert run(["status", str(path)]) == 2
        assert f"{path}: " in (err := capsys.readouterr().err) and what in err


def test_many_tasks_go_to_shards_unasked(inputs, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(shards, "SHARD_SIZE", 6)
    call(capsys, *inputs, "--out", tmp_path / "a")
    assert sorted(path.name for path in (tmp_path / "a").iterdir())[0] == "_solve.json"
    call(capsys, inputs[0], "--limit", 3, "--pictures", 0, "--out", tmp_path / "b")
    assert [path.name for path in (tmp_path / "b").iterdir()] == ["results.json"]
