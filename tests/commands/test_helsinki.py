import json

import numpy as np
import pytest

from srt_jax.cli import run
from srt_jax.commands import helsinki
from srt_jax.formats.batch import read_batch


def test_the_demo_solves_the_five_blockages_on_a_real_city_and_leaves_the_evidence(
    tmp_path, capsys
):
    assert run(["demo", "--out", str(tmp_path / "out"), "--pairs", "1"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "OpenStreetMap contributors" in shown and "5 SOLVED" in shown
    pictures = {f"{kind}-0.png" for kind in helsinki.BLOCKAGES}
    pictures |= {"contact-sheet.png"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == pictures | {
        "results.json",
        "table.md",
        "tasks.npz",
    }
    records = json.loads((tmp_path / "out" / "results.json").read_text())["tasks"]
    assert all(record["removal_cost"] == record["removal_bound"] == 1 for record in records)
    assert [record["name"] for record in records] == list(
        read_batch(tmp_path / "out" / "tasks.npz").names
    )


def test_starts_and_goals_are_far_apart_and_follow_from_the_seed():
    place = helsinki.city()
    tasks = helsinki.tasks_in(place, pairs=3, seed=1)
    assert len(tasks) == 15
    for named in tasks:
        assert np.abs(named.task.start - named.task.goal).max() >= helsinki.APART
    again, other = (
        helsinki.tasks_in(place, pairs=3, seed=1),
        helsinki.tasks_in(place, pairs=3, seed=2),
    )
    assert all((a.task.start == b.task.start).all() for a, b in zip(tasks, again))
    assert any((a.task.start != b.task.start).any() for a, b in zip(tasks, other))


@pytest.mark.parametrize(
    ("kind", "share"),
    [
        ("half", 0.5),
        ("quarter", 0.75),
        ("bagel-100", 0.96),
        ("bagel-50", 0.99),
        ("bagel-10", 0.999),
    ],
)
def test_the_explored_shares_are_those_of_the_paper(kind, share, solved_demo):
    (row,) = (row for row in solved_demo if row["blockage"] == kind)
    assert row["explored"] == pytest.approx(share, abs=0.06)
    assert row["route"] >= row["open route"] - 1e-3


@pytest.fixture(scope="module")
def solved_demo():
    from srt_jax import solve_many

    place = helsinki.city()
    tasks = helsinki.tasks_in(place, pairs=1, seed=0)
    return helsinki.summary(place, tasks, solve_many([named.task for named in tasks]))
