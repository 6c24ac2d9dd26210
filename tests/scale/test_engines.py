"""The engines: the same bytes as plain workers, a worker killed or not, an error told as ours."""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

import pytest

from experiments.campaigns.kills import workers_of
from srt_jax import dataset
from srt_jax.scale import run
from tests.helpers.units import Lines

PLAN = {"kind": "rooms", "count": 24, "size": 16, "seed": 5, "shard_size": 8}
ENGINES = [
    pytest.param("dask", marks=pytest.mark.slow),
    pytest.param("ray", marks=pytest.mark.slow),
]


def importorskip(engine):
    pytest.importorskip({"dask": "distributed"}.get(engine, engine))


def contents(folder):
    """All files in a folder, hidden ones too."""
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_data_set_has_the_bytes_of_one_process(engine, tmp_path):
    importorskip(engine)
    dataset.write_dataset(tmp_path / "one", **PLAN)
    dataset.write_dataset(tmp_path / "other", **PLAN, engine=engine, workers=2)
    assert contents(tmp_path / "other") == contents(tmp_path / "one")


@pytest.mark.parametrize("engine", ENGINES)
def test_a_killed_worker_costs_its_unit_only(engine, tmp_path):
    importorskip(engine)
    out, log = tmp_path / "out", tmp_path / "log"
    out.mkdir()
    job = Lines(out, 24, seconds=0.3, log=log)
    running = threading.Thread(target=run, args=(job,), kwargs={"engine": engine, "workers": 2})
    running.start()
    while not log.exists() or len(log.read_text().splitlines()) < 4:
        time.sleep(0.05)
    os.kill(workers_of(os.getpid(), engine)[0], signal.SIGKILL)
    running.join(120)
    assert not running.is_alive()
    assert contents(out) == {job.name(unit): f"unit {unit}\n".encode() for unit in range(24)}
    units = [line.split()[0] for line in log.read_text().splitlines()]
    assert len(units) == len(set(units)) >= 23


@pytest.mark.parametrize("engine", ENGINES)
def test_a_worker_killed_while_it_starts_is_replaced(engine, tmp_path):
    importorskip(engine)
    job = Lines(tmp_path, 6)
    running = threading.Thread(target=run, args=(job,), kwargs={"engine": engine, "workers": 2})
    running.start()
    while not (workers := workers_of(os.getpid(), engine)):
        time.sleep(0.01)
    os.kill(workers[0], signal.SIGKILL)
    running.join(180)
    assert not running.is_alive()
    assert len(contents(tmp_path)) == 6


@pytest.mark.parametrize("engine", ENGINES)
def test_what_is_wrong_with_a_unit_is_told_as_by_plain_workers(engine, tmp_path):
    importorskip(engine)
    with pytest.raises(ValueError, match=r"^unit 3 is bad$"):
        run(Lines(tmp_path, 6, bad=(3,)), engine=engine, workers=2)
    with pytest.raises(RuntimeError, match=r"workers died at line-0003.txt"):
        run(Lines(tmp_path, 6, deadly=(3,)), engine=engine, workers=2)
    assert len(contents(tmp_path)) == 5


@pytest.mark.slow
def test_a_cluster_of_dask_that_is_there_is_used(tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", host="127.0.0.1"
    ) as cluster:
        run(Lines(tmp_path, 12), engine="dask", address=cluster.scheduler_address)
        assert len(contents(tmp_path)) == 12 and len(cluster.workers) == 2


@pytest.mark.slow
def test_a_cluster_that_somebody_has_started_on_this_machine_is_left_alone(tmp_path):
    """Ray notes it in a file and joins it by default, whether it still runs or not."""
    pytest.importorskip("ray")
    code = (
        "from srt_jax.scale import run; from tests.helpers.units import Lines;"
        f" run(Lines({str(tmp_path)!r}, 2), engine='ray', workers=1)"
    )
    with tempfile.TemporaryDirectory(prefix="ray", ignore_cleanup_errors=True) as short:
        (pathlib.Path(short) / "ray").mkdir()
        (pathlib.Path(short) / "ray" / "ray_current_cluster").write_text("127.0.0.1:9")
        env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "RAY_TMPDIR": short}
        done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    assert len(contents(tmp_path)) == 2


@pytest.mark.slow
def test_where_no_scheduler_answers_it_is_said(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("srt_jax.scale.crews.dask_cluster._PATIENCE", 1)
    with pytest.raises(ValueError, match=r"--address tcp://127.0.0.1:9: no scheduler of Dask"):
        run(Lines(tmp_path, 2), engine="dask", address="tcp://127.0.0.1:9")


@pytest.mark.parametrize(("engine", "package"), [("dask", "distributed"), ("ray", "ray")])
def test_without_the_package_the_install_command_is_given(engine, package, tmp_path):
    code = (
        f"import sys; sys.modules[{package!r}] = None; from srt_jax.scale import run;"
        " from tests.helpers.units import Lines\n"
        f"try: run(Lines({str(tmp_path)!r}, 2), engine={engine!r})\n"
        "except ImportError as error: print(error)"
    )
    env = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    assert f"--engine {engine} needs {package}: pip install " in done.stdout
    assert package in done.stdout.partition("pip install ")[2]
