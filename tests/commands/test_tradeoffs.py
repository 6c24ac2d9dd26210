"""`srt-jax solve --mode shortest` and `srt-jax tradeoffs`."""

import json

import numpy as np
import pytest

from srt_jax import make_task, stack
from srt_jax.cli import run
from srt_jax.formats.batch import write_batch


@pytest.fixture
def wall(tmp_path):
    free = np.ones((12, 12), bool)
    free[:11, 6] = False
    path = tmp_path / "wall.npz"
    write_batch(path, stack([make_task(free, (0, 4), (0, 8))]), names=["wall"])
    return str(path)


def test_solve_breaks_or_goes_round_by_the_toll(wall, capsys):
    for toll, status, total in (("3", "BROKE_THROUGH", 7), ("30", "PATH_EXISTS", None)):
        assert run(["solve", wall, "--mode", "shortest", "--toll", toll, "--json"]) == 0
        (record,) = json.loads(capsys.readouterr().out)["tasks"]
        assert record["status"] == status and record["total"] == record["total_bound"]
        assert total is None or record["total"] == total


def test_a_toll_without_its_mode_is_refused(wall, capsys):
    assert run(["solve", wall, "--toll", "3"]) == 2
    assert "--mode shortest" in capsys.readouterr().err
    assert run(["solve", wall, "--mode", "shortest", "--toll", "-3"]) == 2
    assert "toll is -3" in capsys.readouterr().err


def test_tradeoffs_prints_the_front_and_draws_it(wall, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "front.png"
    assert run(["tradeoffs", wall, "--tolls", "3,30", "--out", str(picture)]) == 0
    out = capsys.readouterr().out
    assert "nothing" in out and picture.stat().st_size > 5000
    assert run(["tradeoffs", wall, "--tolls", "3,30", "--json"]) == 0
    front = json.loads(capsys.readouterr().out)["front"]
    assert [point["destroyed"] for point in front] == [[0], []]
    assert run(["tradeoffs", wall, "--tolls", "3,30", "--cell-side", "0.5"]) == 0
    assert "2.00 m" in capsys.readouterr().out  # four cells of half a metre


def test_tolls_that_are_no_numbers_are_refused(wall, capsys):
    assert run(["tradeoffs", wall, "--tolls", "3,x"]) == 2
    assert "--tolls must be numbers" in capsys.readouterr().err
