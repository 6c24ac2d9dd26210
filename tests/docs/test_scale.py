"""The commands and examples of docs/scale.md are what runs here."""

import os
import pathlib
import re
import shlex
import subprocess
import sys

import jax
import pytest

from srt_jax import dataset
from srt_jax.cli import run

ROOT = pathlib.Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "scale.md").read_text()
COMMANDS, SBATCH = re.findall(r"```sh\n(.*?)```", TEXT, flags=re.DOTALL)
(DEVICES,) = (
    block for block in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "shard_map" in block
)


def lines():
    return [shlex.split(line)[1:] for line in COMMANDS.splitlines()]


def test_every_command_is_one_of_ours():
    assert len(lines()) == 7
    assert all(line.startswith("srt-jax ") for line in COMMANDS.splitlines())


@pytest.mark.slow
def test_the_commands_run_in_their_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for words in lines():
        assert run(words) == 0, words
    assert "4 of 4 shards done" in capsys.readouterr().out
    assert len(next(dataset.load("labelled"))["index"]) == 64


@pytest.mark.slow
def test_the_job_array_makes_the_whole(tmp_path):
    """As SLURM runs it: the script once for each number, with its variables."""
    shim = tmp_path / "bin" / "srt-jax"
    shim.parent.mkdir()
    shim.write_text(f'#!/bin/sh\nexec {sys.executable} -m srt_jax "$@"\n')
    shim.chmod(0o755)
    (tmp_path / "job.sh").write_text(SBATCH)
    first, last = map(int, re.search(r"--array=(\d+)-(\d+)", SBATCH).groups())
    for number in range(first, 4):  # there are no more shards: the others end at once
        env = os.environ | {
            "PATH": f"{shim.parent}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "SLURM_ARRAY_TASK_ID": str(number),
            "SLURM_ARRAY_TASK_MIN": str(first),
            "SLURM_ARRAY_TASK_MAX": str(last),
            "SLURM_ARRAY_TASK_COUNT": str(last - first + 1),
        }
        done = subprocess.run(["bash", "job.sh"], cwd=tmp_path, env=env, capture_output=True)
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
