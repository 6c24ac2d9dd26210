"""The measurements of `srt-jax bench plan` on a small scale, and its table."""

import numpy as np

from sign_model.blocks import random_blocks_tasks
from sign_model.map_algorithm.heuristics import LANDMARKS
from srt_jax.bench import plan


def test_a_row_of_random_tasks_counts_what_it_says(monkeypatch):
    monkeypatch.setattr(plan, "_SECONDS_A_ROW", 0.0)
    lines = []
    row = plan._throughput(4, 12, LANDMARKS, lines.append)
    assert (
        row["solved"] == 1
        and 1 <= row["ratio"] < 1.2
        and row["tasks_a_second"] > 0
        and len(lines) == 1
    )


def test_known_optima_are_read_with_their_tasks(shared_data, monkeypatch):
    lines = []
    rows = list(plan._known_optima(shared_data / "pddl", LANDMARKS, True, lines.append))
    assert [(row["domain"], row["sign"]) for row in rows[:2]] == [
        ("blocks", "unlearned"),
        ("blocks", "learned"),
    ]
    assert all(row["solved"] == row["tasks"] > 0 and row["ratio"] <= 1.15 for row in rows)


def test_a_peer_that_finds_nothing_counts_as_unsolved(tmp_path):
    task = random_blocks_tasks(3, 1, seed=1)[0]
    assert plan._peer_length(["true"], task) is None


def test_the_table_has_a_line_for_every_measurement():
    row = {
        "blocks": 8,
        "sign": "learned",
        "tasks_a_second": 5e4,
        "tasks_a_cpu_second": 4e4,
        "solved": 1.0,
        "ratio": 1.0,
    }
    known = {
        "domain": "hanoi",
        "sign": "unlearned",
        "tasks": 8,
        "solved": 8,
        "ratio": 1.0,
        "worst": 1.0,
        "optimal": 1.0,
    }
    spent = {"quartiles": [0.9, 1.1]}
    text = plan.table(
        {
            "machine": {"jax": "1", "numpy": "2", "python": "3", "cores": 2},
            "learning": {"tasks": 10, "blocks": 6, "seconds": 1.0},
            "random_blocks": [
                row | {"quartiles": [4e4, 6e4], "optimal": 1.0, "compile_seconds": 2.0}
            ],
            "known_optima": [known | {"slowest_seconds": 0.1}],
            "cold_start": {"seconds": 0.4, "cpu_seconds": 0.2},
            "peers": [
                {
                    "name": "peer",
                    "blocks": 8,
                    "tasks": 3,
                    "solved": 0,
                    "ratio": np.nan,
                    "seconds": 1.0,
                }
                | spent
            ],
            "missing": ["pyperplan"],
        }
    )
    assert (
        "50,000 tasks/s (40,000-60,000)," in text
        and "pyperplan is not installed" in text
        and "hanoi" in text
        and "solved 0 of 3" in text
    )
