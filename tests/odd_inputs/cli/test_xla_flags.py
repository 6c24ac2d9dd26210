"""Flags that XLA does not know end its process with code 1, which is not what 1 means here."""

import os
import subprocess
import sys

import pytest

from srt_jax.commands.shared import xla_flags


@pytest.mark.parametrize(
    ("flags", "reason"),
    [
        ("--no_such_flag=1", "--no_such_flag=1"),
        ("--xla_cpu_multi_thread_eigen=banana", "banana for flag xla_cpu_multi_thread_eigen"),
    ],
)
def test_flags_that_xla_refuses_are_one_line_and_code_2(flags, reason, tmp_path):
    (tmp_path / "a.map").write_text("type octile\nheight 1\nwidth 3\nmap\n.@.\n")
    done = subprocess.run(
        [sys.executable, "-m", "srt_jax", "solve", "a.map", "--start", "0,0", "--goal", "0,2"],
        cwd=tmp_path,
        env=os.environ | {"XLA_FLAGS": flags},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert "XLA_FLAGS" in done.stderr and reason in done.stderr and "unset it" in done.stderr


@pytest.mark.parametrize("flags", ["", " ", "--xla_cpu_multi_thread_eigen=false"])
def test_flags_that_xla_takes_are_passed(flags):
    assert xla_flags.what_is_wrong(os.environ | {"XLA_FLAGS": flags}) is None
