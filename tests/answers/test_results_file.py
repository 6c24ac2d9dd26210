"""Answers as files: JSON and Parquet hold the same and are read back equal."""

import json
import sys

import numpy as np
import pytest

from srt_jax import make_task, solve_many
from srt_jax.answers.results_file import as_record, read_results, write_results
from tests.helpers.odd import refusals

TASKS = {
    "open": (np.ones((4, 6), bool), True),
    "walled": (np.arange(24).reshape(4, 6) % 6 != 3, True),
    "indestructible": (np.arange(24).reshape(4, 6) % 6 != 3, False),
}


@pytest.fixture(scope="module")
def records():
    made = {
        name: make_task(free, (0, 0), (3, 5), destroyable=destroyable)
        for name, (free, destroyable) in TASKS.items()
    }
    return [as_record(name, task, solve_many([task])[0]) for name, task in made.items()]


def test_a_record_holds_the_plan_with_where_each_step_ends_and_the_proof(records):
    is_open, walled, fixed = records
    assert (
        is_open["plan"] == [["relocate", None, len(is_open["cells"]) - 1]]
        and is_open["separating"] == []
    )
    at, last = walled["destroyed_at"][0], len(walled["cells"]) - 1
    assert (
        walled["plan"] == [["approach", 0, at], ["destroy", 0, at], ["pass", 0, last]]
        and walled["separating"] == []
    )
    assert fixed["plan"] == [] and fixed["separating"] == fixed["blocking"] == [0]


def test_a_record_of_no_route_holds_the_way_as_near_as_one_gets(records):
    is_open, walled, fixed = records
    assert is_open["approach"] is None and walled["approach"] is None
    near = fixed["approach"]
    assert near["cells"][0] == [0, 0] and near["cells"][-1] == fixed["seed"] == [3, 2]
    assert near["gap"] == 3.0 and near["cost"] == pytest.approx(1 + 2 * 2**0.5)
    assert fixed["cell_side"] is None
    task = make_task(np.ones((2, 3), bool), (0, 0), (0, 2))
    record = as_record("metres", task, solve_many([task])[0], cell_side=0.25)
    assert record["cell_side"] == 0.25 and "0.50 m long" in record["explanation"]


@pytest.mark.parametrize("ending", [".json", ".parquet"])
def test_answers_are_read_back_equal(tmp_path, records, ending):
    if ending == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"answers{ending}"
    write_results(path, records)
    assert read_results(path) == records == json.loads(json.dumps(records))
    write_results(path, [])
    assert read_results(path) == []


def test_a_column_of_parquet_is_a_member_of_the_record(tmp_path, records):
    parquet = pytest.importorskip("pyarrow.parquet")
    write_results(tmp_path / "answers.parquet", records)
    table = parquet.read_table(tmp_path / "answers.parquet")
    assert table.column_names == list(records[0]) and table["status"].to_pylist() == [
        "PATH_EXISTS",
        "SOLVED",
        "UNSOLVABLE",
    ]
    assert table["cost"].to_pylist()[2] is None


def test_broken_answers_are_refused_in_one_line(tmp_path, records):
    pytest.importorskip("pyarrow")
    write_results(tmp_path / "answers.parquet", records)
    assert (
        refusals(
            read_results, tmp_path / "answers.parquet", (tmp_path / "answers.parquet").read_bytes()
        )
        > 10
    )
    (tmp_path / "answers.json").write_text("[]")
    with pytest.raises(ValueError, match="no results"):
        read_results(tmp_path / "answers.json")
    for act in (read_results, lambda path: write_results(path, records)):
        with pytest.raises(ValueError, match=r"written as \.json or \.parquet, not '\.csv'"):
            act(tmp_path / "answers.csv")


def test_without_pyarrow_the_message_names_the_command(tmp_path, monkeypatch, records):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install '?pyarrow"):
        write_results(tmp_path / "answers.parquet", records)
