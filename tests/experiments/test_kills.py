"""The campaign of kills in small: it runs, and finds nothing."""

import pytest

from experiments.campaigns import kills

SMALL = ["--count", "96", "--size", "16", "--shard-size", "8", "--workers", "2"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "job", "number"),
    [("kill", "dataset", 3), ("kill", "solve", 1), ("term", "dataset", 1), ("int", "dataset", 1)],
)
def test_whoever_is_killed_the_bytes_are_the_same(how, job, number, capsys):
    assert kills.main([*SMALL, "--how", how, "--job", job, "--kills", str(number)]) == 0
    row = capsys.readouterr().out.splitlines()[-1].split(" | ")
    assert row[:2] == [f"| {how}", job] and int(row[5]) >= number


def test_a_file_made_again_and_a_draft_that_is_left_are_noticed(tmp_path):
    watch = kills.Watch(tmp_path)
    (tmp_path / "shard-0.npz").write_bytes(b"one")
    watch.look()
    (tmp_path / ".shard-1.npz.part").write_bytes(b"half")
    (tmp_path / "other").write_bytes(b"one")
    (tmp_path / "other").replace(tmp_path / "shard-0.npz")
    watch.look()
    assert (watch.made_again, watch.left()) == (1, 1)
    assert not kills.Tally(left=1).is_clean and kills.Tally(kills=9).is_clean
    one = kills.digest(tmp_path)
    (tmp_path / "shard-0.npz").write_bytes(b"two")
    assert kills.digest(tmp_path) != one
