"""Claims: one holder at a time, whoever dies, on one machine and on two."""

import concurrent.futures
import json
import os
import subprocess
import sys
import time

import pytest

from srt_jax.scale import claims as module
from srt_jax.scale.claims import Claims


@pytest.fixture
def two(tmp_path):
    made = [Claims(tmp_path, stale=0.3, beat=0.05) for _ in range(2)]
    yield made
    for one in made:
        one.close()


def left_by_a_process_that_ended(folder, **changes):
    """Claims unit "u" as a process does that ends at once, and changes what the claim says."""
    code = (
        "import os, sys; from srt_jax.scale.claims import Claims; c = Claims(sys.argv[1]);"
        " assert c.take('u'); os._exit(1)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(folder)]).returncode == 1
    (claim,) = (folder / ".claims").glob("*.claim")
    claim.write_text(json.dumps(json.loads(claim.read_text()) | changes))
    return claim


def test_one_of_two_holds_a_unit_until_it_gives_it_back(two):
    first, second = two
    assert first.take("u") and not second.take("u") and not first.take("u")
    assert second.take("v")
    first.release("u")
    assert second.take("u") and not first.take("u")


def test_of_many_that_try_at_once_one_holds_it(tmp_path):
    crowd = [Claims(tmp_path) for _ in range(8)]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        for number in range(20):
            took = list(pool.map(lambda one, name=f"u{number}": one.take(name), crowd))
            assert sum(took) <= 1  # none, where two met: they try again
    for one in crowd:
        one.close()
    assert not (tmp_path / ".claims").exists()


def test_of_many_that_find_a_dead_claim_one_takes_it_over(tmp_path):
    for _ in range(5):
        left_by_a_process_that_ended(tmp_path)
        crowd = [Claims(tmp_path) for _ in range(8)]
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            took = [one for one, won in zip(crowd, pool.map(lambda c: c.take("u"), crowd)) if won]
        assert len(took) <= 1
        for one in crowd:
            one.close(is_all_done=True)


def test_on_the_same_machine_a_dead_process_is_known_at_once(tmp_path, two):
    left_by_a_process_that_ended(tmp_path)
    assert two[0].take("u") and not two[1].take("u")
    assert [path.name for path in (tmp_path / ".claims").glob("*.claim")] == ["u.1.claim"]


def test_a_process_that_only_has_the_number_of_a_dead_one_holds_nothing(tmp_path, two):
    left_by_a_process_that_ended(tmp_path, pid=os.getpid(), began="1")
    assert two[0].take("u")


def test_on_another_machine_a_claim_dies_when_it_is_no_longer_touched(tmp_path, two):
    claim = left_by_a_process_that_ended(tmp_path, host="elsewhere", pid=os.getpid())
    os.utime(claim)
    assert not two[0].take("u")
    time.sleep(0.4)
    assert two[0].take("u") and not two[1].take("u")


def test_a_process_that_lives_elsewhere_keeps_its_claim_alive(tmp_path, two, monkeypatch):
    monkeypatch.setattr(module.socket, "gethostname", lambda: "elsewhere")
    other = Claims(tmp_path, stale=0.3, beat=0.05)
    assert other.take("u")
    time.sleep(0.5)
    assert not two[0].take("u")
    other.close()
    assert two[0].take("u")


def test_the_age_goes_by_the_folders_clock(tmp_path, two, monkeypatch):
    """A machine whose clock is wrong by a day takes nothing over."""
    left_by_a_process_that_ended(tmp_path, host="elsewhere")
    monkeypatch.setattr(module, "time", None, raising=False)
    assert not two[0].take("u")
    assert abs(two[0].now() - time.time()) < 5


def test_without_hard_links_claims_are_files_of_their_own(tmp_path, two, monkeypatch):
    def refuse(*_):
        raise OSError(module.errno.EPERM, "no links here")

    monkeypatch.setattr(module.os, "link", refuse)
    assert two[0].take("u") and not two[1].take("u")
    two[0].release("u")
    assert two[1].take("u")


def test_who_leaves_takes_all_that_is_left_along(tmp_path):
    left_by_a_process_that_ended(tmp_path)
    one = Claims(tmp_path)
    assert one.take("u")
    one.close()
    assert not (tmp_path / ".claims").exists()
