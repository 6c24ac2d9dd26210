"""The campaign of tolls and the streets in small."""

import sys

import numpy as np
import pytest

from experiments import break_or_go_round
from experiments.campaigns import tolls
from experiments.campaigns.inputs.tolled_maps import KINDS, tolled_tasks


def test_tasks_of_a_seed_are_the_same_and_of_their_kind():
    for kind in KINDS:
        (one, first), (other, second) = (tolled_tasks(3, 5, kind) for _ in range(2))
        assert (first == second).all()
        assert all((a.labels == b.labels).all() for a, b in zip(one, other))
    rectangles, _ = tolled_tasks(3, 5, "rectangles")
    for task in rectangles:
        for i in range(int(task.labels.max()) + 1):
            rows, cols = np.nonzero(task.labels[0] == i)
            assert len(rows) == (np.ptp(rows) + 1) * (np.ptp(cols) + 1)


@pytest.mark.slow
def test_the_campaign_in_small_passes_and_counts(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["tolls", "--count", "16"])
    assert tolls.main() == 0
    assert "16 tasks" in capsys.readouterr().out


def test_without_the_data_the_streets_say_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("SRT_SHARED_DATA", str(tmp_path))
    assert break_or_go_round.main([]) == 0
    assert "no street map" in capsys.readouterr().out


def test_ends_lie_far_apart_in_the_largest_part():
    free = np.ones((30, 30), bool)
    free[:, 27] = False
    for task in break_or_go_round.tasks_on(free, 5, np.random.default_rng(0)):
        assert abs(task.start - task.goal).max() > 24
