"""Units made by one process, by workers and by several runs at once: each once, whoever dies."""

import collections
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

from srt_jax.scale import Part, run, standing
from srt_jax.scale.crews.pool import Pool
from srt_jax.scale.manifest import settle
from tests.helpers.units import Lines


def contents(folder):
    """All that is in a folder, hidden files too."""
    return {path.name: path.read_text() for path in folder.rglob("*") if path.is_file()}


def whole(count):
    return {f"line-{unit:04d}.txt": f"unit {unit}\n" for unit in range(count)}


def made(log):
    return collections.Counter(int(line.split()[0]) for line in log.read_text().splitlines())


@pytest.fixture
def place(tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / "out", tmp_path / "log"


@pytest.mark.parametrize("workers", [None, 1, 3])
def test_what_is_missing_is_made_once(place, workers):
    out, log = place
    (out / "line-0002.txt").write_text("unit 2\n")
    (out / ".line-0003.txt.77-0.part").write_text("half")
    seen = []
    result = run(Lines(out, 12, log=log), workers=workers, progress=seen.append)
    assert contents(out) == whole(12) and sum(seen) == 120
    assert (len(result.outcomes), result.num_there) == (11, 1)
    assert made(log) == {unit: 1 for unit in range(12) if unit != 2}
    assert not run(Lines(out, 12, log=log), workers=workers).outcomes


def test_parts_make_their_own_units_only(place):
    out, _ = place
    run(Lines(out, 7), part=Part(1, 3))
    assert sorted(contents(out)) == ["line-0001.txt", "line-0004.txt"]


def test_two_runs_at_once_share_the_units(place):
    out, log = place
    job = Lines(out, 16, seconds=0.02, log=log)
    runs = [threading.Thread(target=run, args=(job,), kwargs={"workers": 2}) for _ in range(2)]
    # as threads they share the claims of this process, which makes nothing itself
    for one in runs:
        one.start()
    for one in runs:
        one.join()
    assert contents(out) == whole(16) and set(made(log).values()) == {1}


def test_a_worker_that_is_killed_while_it_waits_for_work_is_missed_by_nobody(place):
    out, _ = place
    with Pool(Lines(out, 3, seconds=0.2), 2) as pool:
        for unit in (0, 1):
            pool.submit(unit)
        assert {pool.next().unit, pool.next().unit} == {0, 1}
        waiting = pool._workers[1]
        waiting.process.kill()
        waiting.process.wait()
        pool.submit(2)  # the first worker's
        assert pool.next().unit == 2
    lines = {name: text for name, text in contents(out).items() if name.endswith(".txt")}
    assert lines == whole(3)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_is_killed_is_replaced_and_nothing_is_made_twice(place, monkeypatch, workers):
    out, log = place
    crews, rng = [], random.Random(workers)
    begin = Pool.__enter__
    monkeypatch.setattr(Pool, "__enter__", lambda self: crews.append(self) or begin(self))
    running = threading.Thread(
        target=run, args=(Lines(out, 30, seconds=0.05, log=log),), kwargs={"workers": workers}
    )
    running.start()
    for _ in range(5):
        time.sleep(0.5)
        if crews and crews[0].pids:
            os.kill(rng.choice(crews[0].pids), signal.SIGKILL)
    running.join(60)
    assert not running.is_alive()
    assert contents(out) == whole(30)
    # killed after the file was there, before the line was written: then there is none
    assert set(made(log).values()) == {1} and len(made(log)) >= 25


def test_a_unit_that_ends_every_worker_is_named(place):
    out, _ = place
    with pytest.raises(RuntimeError, match=r"5 workers ended with code -9 at line-0003.txt"):
        run(Lines(out, 6, deadly=(3,)), workers=2)
    assert not list(out.glob(".*"))
    run(Lines(out, 6))
    assert contents(out) == whole(6)


@pytest.mark.parametrize("workers", [None, 2])
def test_a_unit_that_fails_does_not_stop_the_others(place, workers):
    out, _ = place
    with pytest.raises(ValueError, match=r"unit 4 is bad \(1 more unit failed\)"):
        run(Lines(out, 9, bad=(4, 7)), workers=workers)
    assert contents(out).keys() == whole(9).keys() - {"line-0004.txt", "line-0007.txt"}


def test_where_every_unit_fails_few_are_tried(place):
    with pytest.raises(ValueError, match=r"unit 0 is bad \(2 more units failed\)"):
        run(Lines(place[0], 1000, bad=range(1000)))


@pytest.mark.parametrize("how", ["parent killed", "stopped"])
def test_workers_whose_parent_is_gone_end_and_leave_no_draft(place, how):
    out, _ = place
    code = (
        "import sys; from srt_jax.scale import run; from tests.helpers.units import Lines;"
        f" run(Lines({str(out)!r}, 6, seconds=5), workers=2)"
    )
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, "-c", code], env=env)
    deadline = time.monotonic() + 30
    while len(list(out.glob(".line-*.part"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    parent.send_signal(signal.SIGKILL if how == "parent killed" else signal.SIGINT)
    parent.wait(30)
    while list(out.glob(".line-*.part")) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not list(out.glob(".line-*.part"))
    assert not list(out.glob(".claims/*.claim"))


def test_the_standing_tells_what_is_done_and_who_is_at_work(place):
    out, _ = place
    job = Lines(out, 8, seconds=0.6)
    running = threading.Thread(target=run, args=(job,), kwargs={"workers": 2})
    running.start()
    seen = []
    while running.is_alive():
        seen.append(standing(job))
        time.sleep(0.02)
    running.join()
    busiest = max(seen, key=lambda one: len(one.claimed))
    assert len(busiest.claimed) == 2 and not busiest.abandoned
    assert busiest.done + busiest.missing + 2 == 8
    assert any(one.rate and one.left is not None for one in seen)
    last = standing(job)
    assert (last.done, last.missing, last.claimed, last.rate) == (8, 0, {}, None)
    assert last.as_json()["tasks_done"] == 80


def test_another_description_is_refused(place):
    out, _ = place
    settle(out, "job.json", {"seed": 5, "size": (1, 2)}, "thing")
    settle(out, "job.json", {"seed": 5, "size": (1, 2)}, "thing")
    (out / ".job.json.123.part").write_text("half")
    with pytest.raises(ValueError, match="holds a thing of seed 5, not 6: name another folder"):
        settle(out, "job.json", {"seed": 6, "size": (1, 2)}, "thing")
    assert list(contents(out)) == ["job.json"]
