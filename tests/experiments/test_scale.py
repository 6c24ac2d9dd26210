"""The measurement behind docs/scale.md in small: what it counts, not how long it takes."""

import pytest

from experiments import scale


@pytest.mark.slow
def test_it_measures_and_replays(capsys):
    small = ["--kind", "rooms", "--size", "16", "--shard-size", "8", "--shards", "2"]
    constants = scale.main([*small, "--replay", "5"])
    assert constants["bytes a task"] > 100 and constants["peak MB a worker"] > 50
    assert "tasks solved again and replayed" in capsys.readouterr().out


def test_the_arithmetic_is_that_of_the_page():
    rows = scale.arithmetic({"CPU ms a task": 3.6, "bytes a task": 15e3}, 4096)
    assert rows[2] == "| 10^6 | 1 | 0.0156 h | 15 GB | 245 |"
    assert rows[4].endswith("| 244,140,625 |")
