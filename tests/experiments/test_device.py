"""The comparison of an accelerator with the CPU, rehearsed: rows, differences, calls that fail."""

import json
import time

import numpy as np

from experiments.device.__main__ import Side, kind_of, line_of, main
from experiments.device.jobs import jobs


def test_small_functions_are_equal_in_both_forms(tmp_path, capsys):
    out = tmp_path / "rows.json"
    names = ["octile", "seed_cell"]
    arguments = ["--batches", "2", "--side", "16", "--only", *names, "--out", str(out)]
    assert main(arguments) == 0
    rows = json.loads(out.read_text())["rows"]
    assert {row["job"] for row in rows} == {"octile_distance", "seed_cell, contour"}
    assert all(kind_of(row) == "equal" for row in rows)
    assert "2 equal" in capsys.readouterr().out.splitlines()[-1]


def test_a_row_tells_what_differs_and_what_failed():
    times = {"seconds": 0.001, "first": 1.0}
    row = {"job": "reach", "batch": 2, "device": times, "cpu": times}
    assert kind_of(row | {"differences": ["result: 1 of 9 entries"]}) == "different"
    assert "1 of 9" in line_of(row | {"differences": ["result: 1 of 9 entries"]})
    full = {"error": "RESOURCE_EXHAUSTED: 9 GiB", "is_memory": True}
    assert kind_of(row | {"device": full}) == "too large"
    assert kind_of(row | {"cpu": {"error": "TypeError: no"}}) == "failed"


def test_differences_are_counted_entry_by_entry(tmp_path):
    from experiments.device.__main__ import _differences

    row = {}
    for which, entries in (("device", [1.0, 2.0, np.nan]), ("cpu", [1.0, 3.0, np.nan])):
        (tmp_path / which).mkdir()
        np.save(tmp_path / which / "0.npy", np.array(entries, np.float32))
        row[which] = {"digests": {"": which}, "files": {"": "0.npy"}}
    assert _differences(row, tmp_path) == ["result: 1 of 3 entries"]


def test_a_call_that_does_not_end_is_given_up_and_the_next_one_runs():
    side = Side({"JAX_PLATFORMS": "cpu"})
    order = {"do": "first", "job": "octile_distance", "batch": 1, "side": 16}
    try:
        side.give({**order, "job": "no such function", "folder": ""})
        assert "KeyError" in side.answer(time.monotonic() + 60)["error"]
        # no time at all: the process is ended, and started again for the next order
        side.give({"do": "again", "least": 3600})
        side.stop()
        side.give({**order, "folder": "/nowhere"})
        assert "FileNotFoundError" in side.answer(time.monotonic() + 60)["error"]
    finally:
        side.stop()


def test_every_name_stands_once():
    names = [job.name for job in jobs(16)]
    assert len(set(names)) == len(names)
