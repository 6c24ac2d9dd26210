"""What the README says is what runs."""

import pathlib
import re

import pytest

from srt_jax.cli import app

README = (pathlib.Path(__file__).resolve().parents[2] / "README.md").read_text()


@pytest.mark.parametrize("example", re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL))
def test_the_examples_run_as_written(example, capsys):
    exec(example, {})


def test_the_commands_it_lists_are_the_commands_there_are():
    there = {command.name or command.callback.__name__ for command in app.registered_commands}
    listed = set(re.findall(r"^\| `srt-jax (\w+)", README, flags=re.MULTILINE))
    assert listed == there


@pytest.mark.parametrize("place", re.findall(r"`((?:srt_jax|sign_model)/[\w/.]+|\w+\.py)`", README))
def test_the_places_of_its_table_exist(place):
    root = pathlib.Path(__file__).resolve().parents[2]
    assert (root / place).exists() or list(root.glob(f"s*/**/{place}"))
