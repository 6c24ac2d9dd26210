"""The commands and examples of docs/scale.md are what runs here."""

import os
import pathlib
import re
import shlex
import socket
import subprocess
import sys
import tempfile

import jax
import pytest

from experiments import scale
from srt_jax import dataset
from srt_jax.cli import run

ROOT = pathlib.Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "scale.md").read_text()
COMMANDS, SBATCH, ENGINES, DASK, RAY = re.findall(r"```sh\n(.*?)```", TEXT, flags=re.DOTALL)
(DEVICES,) = (
    block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "shard_map" in block
)


def lines(block=COMMANDS):
    return [shlex.split(line)[1:] for line in block.splitlines()]


@pytest.fixture
def env(tmp_path):
    """The environment of a shell that has `srt-jax` and the commands of the engines."""
    shim = tmp_path / "bin" / "srt-jax"
    shim.parent.mkdir()
    shim.write_text(f'#!/bin/sh\nexec {sys.executable} -m srt_jax "$@"\n')
    shim.chmod(0o755)
    places = [str(shim.parent), str(pathlib.Path(sys.executable).parent), os.environ["PATH"]]
    return os.environ | {"PATH": ":".join(places), "PYTHONPATH": str(ROOT)}


def test_every_command_is_one_of_ours():
    assert len(lines()) == 7 and len(lines(ENGINES)) == 2
    assert all(line.startswith("srt-jax ") for line in (COMMANDS + ENGINES).splitlines())


@pytest.mark.slow
def test_the_commands_run_in_their_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for words in lines():
        assert run(words) == 0, words
    assert "4 of 4 shards done" in capsys.readouterr().out
    assert len(next(dataset.load("labelled"))["index"]) == 64
    assert scale.main(["--replay-only", "labelled", "--replay", "16"]) == {"replayed": 4}


@pytest.mark.slow
@pytest.mark.parametrize(("number", "package"), [(0, "distributed"), (1, "ray")])
def test_an_engine_makes_the_whole(number, package, tmp_path, monkeypatch):
    pytest.importorskip(package)
    monkeypatch.chdir(tmp_path)
    words = lines(ENGINES)[number]
    assert run(words) == 0
    assert len(next(dataset.load(words[words.index("--out") + 1]))["index"]) == 64


@pytest.mark.slow
@pytest.mark.parametrize(
    ("block", "package", "port"), [(DASK, "distributed", "8786"), (RAY, "ray", "6379")]
)
def test_a_cluster_makes_the_whole(block, package, port, tmp_path, env):
    """As the page says, on this machine and by a port that is free."""
    pytest.importorskip(package)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        own = str(free.getsockname()[1])
    text = block.replace(f"head:{port}", f"127.0.0.1:{own}").replace(f"port {port}", f"port {own}")
    (tmp_path / "job.sh").write_text(f"set -e\ntrap 'kill $(jobs -p); wait' EXIT\n{text}")
    # Ray notes there which cluster runs on a machine; its sockets need a short path
    place = tempfile.TemporaryDirectory(prefix="ray", ignore_cleanup_errors=True)
    with place as short, open(tmp_path / "log", "w") as log:
        env["RAY_TMPDIR"] = short
        words = ["timeout", "200", "bash", "job.sh"]
        done = subprocess.run(words, cwd=tmp_path, env=env, stdout=log, stderr=log)
    assert done.returncode == 0, (tmp_path / "log").read_text()[-3000:]
    assert len(next(dataset.load(tmp_path / "labelled"))["index"]) == 64


@pytest.mark.slow
def test_the_job_array_makes_the_whole(tmp_path, env):
    """As SLURM runs it: the script once for each number, with its variables."""
    (tmp_path / "job.sh").write_text(SBATCH)
    first, last = map(int, re.search(r"--array=(\d+)-(\d+)", SBATCH).groups())
    for number in range(first, 4):  # there are no more shards: the others end at once
        of_slurm = {
            "SLURM_ARRAY_TASK_ID": str(number),
            "SLURM_ARRAY_TASK_MIN": str(first),
            "SLURM_ARRAY_TASK_MAX": str(last),
            "SLURM_ARRAY_TASK_COUNT": str(last - first + 1),
        }
        done = subprocess.run(
            ["bash", "job.sh"], cwd=tmp_path, env=env | of_slurm, capture_output=True
        )
        assert done.returncode == 0, done.stderr
    assert len(next(dataset.load(tmp_path / "labelled"))["index"]) == 64


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 8])
@pytest.mark.skipif(not hasattr(jax, "shard_map"), reason="this JAX is older than 0.6")
def test_the_example_gives_the_same_bits_on_several_devices(number):
    """In a process of its own, since the number of devices is fixed when JAX starts."""
    env = os.environ | {
        "XLA_FLAGS": f"--xla_force_host_platform_device_count={number}",
        "JAX_PLATFORMS": "cpu",
        "PYTHONPATH": str(ROOT),
    }
    code = DEVICES + f"\nassert len(jax.devices()) == {number}\n"
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
